"""A closed-form model that stands in for the simulation of stalks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.integrate import cumulative_trapezoid

import ramiefenics as rf
from ramiefenics.model.laws.free_form import CRUSHED, LOSSES, PRESSED, PULLED, STRAINS
from ramiefenics.runs import Done
from ramiefenics.runs.curve import CurveTask, Mapper

AT_MM = np.linspace(0.0, 16.0, 161)
PARTS_N = {
    ("xylem", "E_Z_MPa"): 20.0 * np.tanh(AT_MM / 3.0),
    ("xylem", "E_X_MPa"): 2.0 * AT_MM,
    ("phloem", "E_Z_MPa"): 40.0 * np.tanh(AT_MM / 8.0),
    ("phloem", "E_X_MPa"): 25.0 * AT_MM / (AT_MM + 4.0),
}
"""Contribution of each modulus to the force, for a stalk like the published ones, N."""

MESH_ERROR, ORDER = 0.08, 2.0
"""Relative error of the force at 14 mm with eight cells around half the circumference, as in
`screening`; order of convergence."""


class Formula(Mapper):
    """Stand-in for `Runs` that evaluates the formula."""

    asked = 0

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        return [Done(self._curve(task)) for task in tasks]

    def _curve(self, task: CurveTask) -> pd.DataFrame:
        force = force_N(task.test)
        slopes = {f.name: (force_N(f.apply(task.test, 0.01)) - force) / 0.01 for f in task.factors}
        curve = pd.DataFrame({"displacement_mm": AT_MM, "force_N": force, **slopes})
        if not task.test.protocol.then:
            return curve
        turn = task.test.protocol.travel_mm
        at = np.append(AT_MM[turn > AT_MM], turn)
        there = force_N(replace(task.test, protocol=replace(task.test.protocol, then=())))
        back = np.append(np.interp(at[:-1], AT_MM, force), np.interp(turn, AT_MM, there))
        return pd.DataFrame({"displacement_mm": at, "force_N": back})


STRAIN = 0.1 * AT_MM / 14.0
"""Largest tensile strain of the fibres along the travel; the compressive one is as large."""

LOSS = 0.4 * (AT_MM / 14.0) ** 0.5
"""Loss of the section's area along the travel; most of the crushing happens early."""

FIBRE_N, SECTION_N = 1000.0, 200.0
"""Force of fibres whose stress is k, and of a section whose stress is 2 mu + lambda."""


def learned_N(test: rf.BendingTest) -> np.ndarray:
    """Return the force added by the law `free_form`, whose tangents are linear between knots."""
    own = test.stalk.layers[-1].material.law_constants
    sides = ((PULLED, STRAINS, STRAIN), (PRESSED, STRAINS, STRAIN), (CRUSHED, LOSSES, LOSS))
    sizes = (FIBRE_N, FIBRE_N / 2.0, SECTION_N)
    force = np.zeros_like(AT_MM)
    for size, (names, knots, at) in zip(sizes, sides, strict=True):
        tangent = np.interp(at, (0.0, *knots), (0.0, *(own.get(name, 0.0) for name in names)))
        force += size * cumulative_trapezoid(tangent, at, initial=0.0)
    return force


HYSTERESIS = 0.1
"""Share of the force that friction takes away during unloading."""


def lost(test: rf.BendingTest) -> np.ndarray:
    """Return the share of the force lost to damage; lasting damage does not heal in unloading."""
    damage = test.stalk.layers[-1].material.large_strain.fibre_damage
    lasts = bool(test.protocol.then) and test.law == "inelastic"
    worst = np.maximum(AT_MM, test.protocol.travel_mm) if lasts else AT_MM
    return 0.3 * damage * (worst / 14.0) ** 2


def force_N(test: rf.BendingTest) -> np.ndarray:
    """Return the force; bending scales with span^-3, crushing with span^-1 and radius^0.3."""
    usual, own = (
        {layer.name: layer.material.elastic for layer in stalk.layers}
        for stalk in (rf.ramie(14.4, 7.4, 0.67).stalk, test.stalk)
    )
    shares = {k: getattr(own[k[0]], k[1]) / getattr(usual[k[0]], k[1]) for k in PARTS_N}
    shorter = 100.0 / test.fixture.span_mm
    blunter = test.fixture.indenter_radius_mm / 5.0
    by_kind = {"E_Z_MPa": shorter**3, "E_X_MPa": shorter * blunter**0.3}
    force = sum(share * by_kind[key[1]] * PARTS_N[key] for key, share in shares.items())
    force = force + learned_N(test) * shorter
    force = force * (1.0 - lost(test)) * (1.0 - HYSTERESIS * bool(test.protocol.then))
    size = (8.0 / test.numerics.mesh.angular_elements) ** ORDER
    return test.stalk.stiffness_factor * (1.0 + MESH_ERROR * size * AT_MM / 14.0) * force
