"""Effects found in real tests that a model leaves out, each at its typical size."""

import matplotlib.pyplot as plt

import ramiefenics as rf

test = rf.as_test("table3")
with rf.style():
    figure, axes = plt.subplots(layout="constrained")
for name in ("pith_core", "machine_compliance", "seating_gap", "fibre_damage", "span_error"):
    effect = rf.EFFECTS[name]
    curve = rf.simulate(effect.apply(test, effect.typical)).curve
    at, force = curve.recorded_displacement_mm, curve.recorded_force_N
    axes.plot(at, force, label=name.replace("_", " "))
plain = rf.simulate(test).curve
axes.plot(plain.displacement_mm, plain.force_N, "k", label="without")
axes.set(xlabel="Displacement (mm)", ylabel="Force (N)")
axes.legend(frameon=False)
