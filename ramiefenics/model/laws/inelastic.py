"""The default law with damage, yielding and crushing, each activated by a constant.

The section is crushed as in the law `crushing`. The strain e of the fibres, computed from the
elastic part of the deformation, is the sum of an elastic part x and a plastic part e_p (Green and
Naghdi 1965). With the default law's Psi, the fibres store

    Psi(x) / (1 + c_D m)^2 + [h/2 (e^2 - x^2) if e_p < 0],    m the largest Psi(x) so far.

Damage: under monotonic loading, where m = Psi, the stress is that of the default law's energy
limiter (Volokh 2007); unloading follows the secant (Simo and Ju 1987).

Yield: in tension and in compression, the fibres yield where x leaves the elastic range,
``|x| < e_Y + v``. This is a range of strain (Naghdi and Trapp 1975), because the stress of
compressed fibres reaches its plateau long before they yield. Of the strain beyond the range, the
share phi is permanent, and the rest widens the range:

    |de_p/dt| = phi |de/dt|,    dv/dt = (1 - phi) |de/dt|.

Yielding fibres thus have the tangent ``(1 - phi) k`` in tension. In compression, fibres that have
yielded keep the resistance h e, h times the whole strain, which is the second term of the energy;
with a smaller tangent, sheared fibres would kink. The driving force on e_p is
``Psi'(x) / (1 + c_D m)^2 - h x`` where e_p is negative, and the first term alone otherwise. It has
the sign of de_p/dt unless damage has made the first term smaller than h x in magnitude.
"""

from __future__ import annotations

from collections.abc import Mapping

import ufl

from ramiefenics.model.laws import crushing
from ramiefenics.model.laws.base import Constant, Expr, Law, Memory, State
from ramiefenics.model.laws.saturating_fibre import (
    energy_with_fibres,
    fibre_strain,
    undamaged_energy,
)

CONSTANTS = (
    Constant("yielding_share", "1", default=0.0, at_least=0.0, at_most=1.0),  # phi
    Constant("yield_strain", "1", default=0.01, above=0.0),  # e_Y
    Constant("crushed_share", "1", default=0.0, at_least=0.0, at_most=1.0),
    *(constant for constant in crushing.CONSTANTS if constant.name != "crushed_share"),
)


def _energy(F: Expr, p: Mapping[str, Expr], state: State) -> Expr:
    plastic = state["plastic_strain"]

    def of_fibres(e: Expr, p: Mapping[str, Expr]) -> Expr:
        x = e - plastic
        bearing = p["h"] / 2 * (e**2 - x**2)
        whole = undamaged_energy(x, p) * _intact(state, p)
        return whole + ufl.conditional(ufl.lt(plastic, 0), bearing, 0.0)

    elastic = crushing.elastic_part(F, state["unloading"])
    return energy_with_fibres(elastic, p, of_fibres)


def _intact(state: State, p: Mapping[str, Expr]) -> Expr:
    """Return the share of the fibres' stress that remains after damage."""
    return (1 + p["c"] * state["largest_energy"]) ** -2


def _whole_stress(x: Expr, p: Mapping[str, Expr]) -> Expr:
    x = ufl.variable(x)
    return ufl.diff(undamaged_energy(x, p), x)


def _update(F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
    def stress_of_fibres(elastic: Expr) -> Expr:
        e = fibre_strain(elastic, p)
        now = _fibres(e, p, last)
        plastic = now["plastic_strain"]
        whole = _whole_stress(e - plastic, p) * _intact(now, p)
        return whole + ufl.conditional(ufl.lt(plastic, 0), p["h"] * plastic, 0.0)

    section = crushing.crushed(F, p, last, stress_of_fibres)
    elastic = crushing.elastic_part(F, section["unloading"])
    return section | _fibres(fibre_strain(elastic, p), p, last)


def _fibres(e: Expr, p: Mapping[str, Expr], last: State) -> dict[str, Expr]:
    """Return the internal variables of the fibres at the end of a step to the strain e."""
    trial = e - last["plastic_strain"]
    over = abs(trial) - p["yield_strain"] - last["widening"]
    over = ufl.conditional(ufl.gt(over, 0), over, 0.0)
    side = ufl.conditional(ufl.ge(trial, 0), 1.0, -1.0)
    plastic = last["plastic_strain"] + p["yielding_share"] * side * over
    energy, largest = undamaged_energy(e - plastic, p), last["largest_energy"]
    return {
        "plastic_strain": plastic,
        "widening": last["widening"] + (1 - p["yielding_share"]) * over,
        "largest_energy": ufl.conditional(ufl.gt(energy, largest), energy, largest),
    }


def _dissipation(F: Expr, p: Mapping[str, Expr], last: State, state: State, duration: Expr) -> Expr:
    """Return the energy dissipated by damage, yielding and crushing.

    The first part is exact unless Psi has a maximum within a step, the second where the stress is
    linear in the strain. The third is computed by the backward Euler method.
    """
    failing = _failed(state["largest_energy"], p) - _failed(last["largest_energy"], p)
    flow = state["plastic_strain"] - last["plastic_strain"]
    side = ufl.conditional(ufl.ge(flow, 0), 1.0, -1.0)
    bearing = ufl.conditional(ufl.lt(state["plastic_strain"], 0), p["h"], 0.0)
    forces = []
    for now in (last, state):
        x = side * (p["yield_strain"] + now["widening"])
        forces.append(_whole_stress(x, p) * _intact(now, p) - bearing * x)
    unloading = ufl.variable(state["unloading"])
    energy = _energy(F, p, {**state, "unloading": unloading})
    crushed = -ufl.inner(ufl.diff(energy, unloading), state["unloading"] - last["unloading"])
    return failing + sum(forces) / 2 * flow + crushed


def _failed(largest: Expr, p: Mapping[str, Expr]) -> Expr:
    """Return the integral of ``2 c_D m / (1 + c_D m)^3`` over m, N/mm2."""
    return p["c"] * (largest / (1 + p["c"] * largest)) ** 2


INELASTIC = Law(
    "inelastic",
    crushing.parameters,
    _energy,
    homogeneous=True,
    constants=CONSTANTS,
    memory=Memory(
        crushing.START | {"plastic_strain": 0.0, "widening": 0.0, "largest_energy": 0.0},
        _update,
        _dissipation,
        units={"largest_energy": "Nmm_per_mm3"},
    ),
)
