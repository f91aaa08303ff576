"""What a larger void or a thicker rind does to the force, all along the curve, from one run."""

import matplotlib.pyplot as plt

import ramiefenics as rf


def by(key):
    return rf.Parameter(lambda test, mm: rf.override(test, [f"{key}={SIZE[key] + mm}"]))


SIZE = {"stalk.void_diameter_mm": 7.28, "stalk.layers.phloem.outer_diameter_mm": 14.23}
found = rf.sensitivities("table3", {key.split(".")[-1]: by(key) for key in SIZE})
figure, axes = plt.subplots(layout="constrained")
found.curve.plot("displacement_mm", ax=axes, y=["void_diameter_mm", "outer_diameter_mm"])
axes.set(xlabel="Indenter displacement (mm)", ylabel="Derivative of the force (N/mm)")
