"""The default law with fibres that yield along their axis and unload elastically.

The strain e of the default law's fibres is the sum of an elastic part and a plastic part e_p (Green
and Naghdi 1965). Their energy, including what hardening stores, is

    Psi = k/2 (e - e_p)^2 + K_k/2 e_p^2 + K_i/2 xi^2,    dxi/dt = |de_p/dt|,

with the length xi of the plastic strain's path. Their stress ``k (e - e_p)`` less the back stress
K_k e_p stays between ``-(s_Y + K_i xi)`` and ``k e_t + K_i xi``. In monotonic compression the
stress is to equal the default law's except for the rounding of its corner. Therefore
``s_Y = s_c k / (k - h)`` and ``K_k + K_i = h k / (k - h)``, so that the tangent beyond yield is h.
The share of K_k in this sum and the strain e_t of yield in tension are constants of this law. The
return to the yield surface is in closed form (Simo and Hughes 1998, box 1.4) and minimises energy
plus dissipation over the step (Ortiz and Stainier 1999). The rate of dissipation is |de_p/dt| times
the initial strength of the side that yields, s_Y or k e_t.
"""

from __future__ import annotations

from collections.abc import Mapping

import ufl

from ramiefenics.model.laws.base import Constant, Expr, Law, Memory, State
from ramiefenics.model.laws.saturating_fibre import (
    SATURATING_FIBRE,
    energy_with_fibres,
    fibre_strain,
)
from ramiefenics.specification import Material, SpecificationError

CONSTANTS = (
    Constant("tensile_yield_strain", "1", default=0.05, above=0.0),
    Constant("kinematic_share", "1", default=1.0, at_least=0.0, at_most=1.0),
)


def _parameters(material: Material) -> dict[str, float]:
    for name in ("fibre_damage", "bimodularity"):
        value = getattr(material.large_strain, name)
        if value != 0.0:
            allowed = "must be 0 for the law fibre_plasticity"
            raise SpecificationError(f"large_strain.{name}", value, allowed)
    p = SATURATING_FIBRE.parameters(material)
    rise = p["k"] / (p["k"] - p["h"])
    return p | {"strength": p["s_c"] * rise, "hardening": p["h"] * rise}


def _energy(F: Expr, p: Mapping[str, Expr], state: State) -> Expr:
    plastic, length = state["plastic_strain"], state["plastic_length"]
    share = p["kinematic_share"]
    hardened = p["hardening"] / 2 * (share * plastic**2 + (1 - share) * length**2)

    def fibre_energy(e: Expr, p: Mapping[str, Expr]) -> Expr:
        return p["k"] / 2 * (e - plastic) ** 2 + hardened

    return energy_with_fibres(F, p, fibre_energy)


def _update(F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
    plastic, length = last["plastic_strain"], last["plastic_length"]
    kinematic = p["kinematic_share"] * p["hardening"]
    hardened = (p["hardening"] - kinematic) * length
    trial = p["k"] * (fibre_strain(F, p) - plastic) - kinematic * plastic
    over = trial - p["k"] * p["tensile_yield_strain"] - hardened
    under = -trial - p["strength"] - hardened
    stiffness = p["k"] + p["hardening"]
    longer = ufl.conditional(ufl.gt(over, 0), over / stiffness, 0.0)
    shorter = ufl.conditional(ufl.gt(under, 0), under / stiffness, 0.0)
    return {
        "plastic_strain": plastic + longer - shorter,
        "plastic_length": length + longer + shorter,
    }


FIBRE_PLASTICITY = Law(
    "fibre_plasticity",
    _parameters,
    _energy,
    homogeneous=True,
    constants=CONSTANTS,
    memory=Memory({"plastic_strain": 0.0, "plastic_length": 0.0}, _update),
)
