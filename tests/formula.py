"""A closed formula that stands in for the simulation of stalks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

import ramiefenics as rf
from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask

AT_MM = np.linspace(0.0, 16.0, 161)
PARTS_N = {
    ("xylem", "E_Z_MPa"): 20.0 * np.tanh(AT_MM / 3.0),
    ("xylem", "E_X_MPa"): 2.0 * AT_MM,
    ("phloem", "E_Z_MPa"): 40.0 * np.tanh(AT_MM / 8.0),
    ("phloem", "E_X_MPa"): 25.0 * AT_MM / (AT_MM + 4.0),
}
"""What the moduli of a stalk like the published ones bear."""

MESH_ERROR, ORDER = 0.08, 2.0
"""Of the force at 14 mm where cells are 6 mm long, as in the recipe `screening`; of convergence."""


class Formula:
    """Stands in for `Runs`."""

    asked = 0

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        return [Done(self._curve(task)) for task in tasks]

    def _curve(self, task: CurveTask) -> pd.DataFrame:
        force = force_N(task.test)
        slopes = {f.name: (force_N(f.apply(task.test, 0.01)) - force) / 0.01 for f in task.factors}
        return pd.DataFrame({"displacement_mm": AT_MM, "force_N": force, **slopes})


def force_N(test: rf.BendingTest) -> np.ndarray:
    """Bending goes with the third power of the span, crushing with the first and the radius."""
    usual, own = (
        {layer.name: layer.material.elastic for layer in stalk.layers}
        for stalk in (rf.ramie(14.4, 7.4, 0.67).stalk, test.stalk)
    )
    shares = {k: getattr(own[k[0]], k[1]) / getattr(usual[k[0]], k[1]) for k in PARTS_N}
    shorter = 100.0 / test.fixture.span_mm
    blunter = test.fixture.indenter_radius_mm / 5.0
    by_kind = {"E_Z_MPa": shorter**3, "E_X_MPa": shorter * blunter**0.3}
    force = sum(share * by_kind[key[1]] * PARTS_N[key] for key, share in shares.items())
    cells = (test.numerics.mesh.contact_size / 0.06) ** ORDER
    return test.stalk.stiffness_factor * (1.0 + MESH_ERROR * cells * AT_MM / 14.0) * force
