"""Derivatives of the force with respect to two diameters, all along the curve, from one run."""

import matplotlib.pyplot as plt

import ramiefenics as rf


def diameter(key):
    return rf.Parameter(lambda test, mm: rf.override(test, [f"{key}={SIZE[key] + mm}"]))


SIZE = {"stalk.void_diameter_mm": 7.28, "stalk.layers.phloem.outer_diameter_mm": 14.23}
found = rf.sensitivities("table3", {key.split(".")[-1]: diameter(key) for key in SIZE})
with rf.style():
    figure, axes = plt.subplots(layout="constrained")
    for name, label in {"void_diameter_mm": "void", "outer_diameter_mm": "stalk"}.items():
        axes.plot(found.curve.displacement_mm, found.curve[name], label=f"Diameter of the {label}")
    axes.legend()
axes.set(xlabel="Indenter displacement (mm)", ylabel="Derivative of the force (N/mm)")
