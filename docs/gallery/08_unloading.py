"""Fibres that yield: the stalk stays bent, and the indenter leaves it at 1.5 mm on the way back."""

import ramiefenics as rf

yielding = {"stalk.layers.phloem.material.law_constants.tensile_yield_strain": 0.01}
result = rf.simulate(
    rf.override(rf.as_test("table3", law="fibre_plasticity"), yielding),
    travel_mm=8,
    then=[{"to_mm": 1}],
)
figure = result.plot()
