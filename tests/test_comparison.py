"""Recorded forces and their changes, for a stalk that is a linear spring: all in closed form."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import ramiefenics as rf
from ramiefenics.discovery.comparison import Model, Simulator
from ramiefenics.discovery.factors import factors
from ramiefenics.discovery.meshes import other_meshes

STIFFNESS_N_PER_MM, COMPLIANCE_MM_PER_N, GAP_MM = 10.0, 0.02, 0.3
AT_MM = np.linspace(0.5, 6.0, 12)


class Springs:
    """Simulates springs whose stiffness depends on the mesh only."""

    def __init__(self, stiffness: dict[rf.MeshRecipe, float]) -> None:
        self._stiffness = stiffness

    def curves(self, tasks: list) -> list[pd.DataFrame]:
        u = np.linspace(0.0, 7.0, 71)
        curves = []
        for task in tasks:
            force = self._stiffness[task.test.numerics.mesh] * u
            by_factors = {factor.name: force for factor in task.factors}
            curves.append(pd.DataFrame({"displacement_mm": u, "force_N": force, **by_factors}))
        return curves


@pytest.fixture
def simulator(screening: rf.BendingTest) -> Simulator:
    mesh = screening.numerics.mesh
    finer, other = other_meshes(mesh)
    stiffness = {mesh: 1.0, finer: 0.97, other: 1.08}
    springs = Springs({m: STIFFNESS_N_PER_MM * value for m, value in stiffness.items()})
    stalks = SimpleNamespace(specimens=[SimpleNamespace(test=screening)])
    return Simulator(stalks, AT_MM, springs)


def loose(gap_mm: float) -> rf.Effect:
    """A compliant machine with a gap."""

    def apply(test: rf.BendingTest, compliance: float) -> rf.BendingTest:
        changes = [f"machine.compliance_mm_per_N={compliance}", f"machine.seating_gap_mm={gap_mm}"]
        return rf.override(test, changes)

    return rf.Effect("loose", "A loose machine.", "none", "mm/N", (0.0, 0.05), 1e-4, apply)


@pytest.mark.parametrize("gap_mm", [0.0, GAP_MM])
def test_changes_pass_through_the_machine(
    screening: rf.BendingTest, simulator: Simulator, gap_mm: float
) -> None:
    used = factors(screening, ["xylem.axial"])
    model = Model(used, (0.0,), loose(gap_mm), COMPLIANCE_MM_PER_N)
    found = simulator.linearise(model)
    # F = k u and d = gap + u + c F: F = k (d - gap) / (1 + c k), and its derivatives
    k, c, d = STIFFNESS_N_PER_MM, COMPLIANCE_MM_PER_N, AT_MM - gap_mm
    force, by_log_k = k * d / (1 + c * k), k * d / (1 + c * k) ** 2
    assert np.allclose(found.force[0], force, rtol=1e-9)
    # small differences are taken of a thousandth, and of c by 0.000025 mm/N: errors of that order
    assert np.allclose(found.by_factors[0, 0], by_log_k, rtol=1e-3)
    assert np.allclose(found.by_mesh[0], np.outer([-0.03, 0.08], by_log_k), rtol=1e-3)
    assert found.by_effect is not None
    assert np.allclose(found.by_effect[0], -(k**2) * d / (1 + c * k) ** 2, rtol=1e-3)
