"""What a material law is to the rest of the program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import ufl

from ramiefenics.specification import Elastic, Material, SpecificationError
from ramiefenics.specification.checks import checked_number

Expr = Any
"""A UFL expression; UFL's own types are not annotated."""

State = Mapping[str, Expr]
"""Internal variables by name."""


@dataclass(frozen=True)
class Constant:
    """A constant that a law needs of every layer beyond the elastic ones.

    Attributes
    ----------
    name
        Its key in ``material.law_constants`` and among the energy's parameters.
    unit
        ``1`` for a pure number.
    default
        What it is where a layer does not give it; None if every layer has to.
    above, at_least, below, at_most
        Its bounds.
    """

    name: str
    unit: str
    default: float | None = None
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def of(self, material: Material) -> float:
        """Return its value in a material.

        Raises
        ------
        SpecificationError
            If there is none, or it is out of bounds.
        """
        value = material.law_constants.get(self.name, self.default)
        if value is None:
            raise SpecificationError(f"law_constants.{self.name}", None, "is required but missing")
        return checked_number(
            f"law_constants.{self.name}",
            value,
            above=self.above,
            at_least=self.at_least,
            below=self.below,
            at_most=self.at_most,
            unit="" if self.unit == "1" else self.unit,
        )


@dataclass(frozen=True)
class Memory:
    """What a material point remembers, and how that changes.

    Attributes
    ----------
    start
        Internal variables at rest by name: a number, or nested tuples of numbers, in the
        variable's shape.
    update
        From the deformation gradient, the parameters, the internal variables at the end of the
        last step, and the duration of this step, s, to their values at its end. A duration of zero
        is allowed.
    dissipation
        From the deformation gradient, the parameters, the internal variables before and after a
        step, and its duration to the energy dissipated in it per undeformed volume, N/mm2. By
        default the thermodynamic forces at its end times the change of the variables (backward
        Euler), which is exact where the forces are constant.
    units
        Of the internal variables that are no pure numbers, as their fields' names end.
    """

    start: Mapping[str, Any]
    update: Callable[[Expr, Mapping[str, Expr], State, Expr], State]
    dissipation: Callable[[Expr, Mapping[str, Expr], State, State, Expr], Expr] | None = None
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Law:
    """A stored energy, its parameters, and what it remembers; equal to itself only.

    The stress is the derivative of the stored energy by the deformation gradient at fixed internal
    variables (Coleman and Gurtin 1967, Eq. 6.2); the tangent is the derivative of that stress with
    all that follows from a change of the deformation, so that Newton's method converges
    quadratically whatever the update is.

    Attributes
    ----------
    name
        As in the specification.
    parameters
        From a layer's material to the energy's parameters, each a number; the set of names is
        the same for every material, so that they can be data to one compiled form. The law's own
        constants are added to them.
    energy
        From the deformation gradient, UFL shape (3, 3), the parameters, and, if the law remembers,
        the internal variables to the stored energy per undeformed volume, N/mm2. Its second
        derivative by the deformation gradient at rest is `Elastic.stiffness`.
    least_stretch
        Stretch at which the stress of a compressed fibre or layer stops growing; 0 if it never
        does.
    homogeneous
        Whether all stresses double where all moduli do, so that forces are known of stalks that
        are stiffer as a whole.
    constants
        The law's own.
    memory
        None for an elastic law.
    """

    name: str
    parameters: Callable[[Material], dict[str, float]]
    energy: Callable[..., Expr]
    least_stretch: float = 0.0
    homogeneous: bool = False
    constants: tuple[Constant, ...] = ()
    memory: Memory | None = None

    def parameters_of(self, material: Material) -> dict[str, float]:
        """Return the energy's parameters for a material, the law's own constants included.

        Raises
        ------
        SpecificationError
            If the law cannot take the material's constants.
        """
        own = {constant.name: constant.of(material) for constant in self.constants}
        for name, value in material.law_constants.items():
            if name not in own:
                known = f"which has {', '.join(own)}" if own else "which has none"
                allowed = f"is no constant of the law {self.name}, {known}"
                raise SpecificationError(f"law_constants.{name}", value, allowed)
        return own | self.parameters(replace(material, law_constants=own))

    def state(self, F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
        """Return the internal variables at the end of a step; none of an elastic law."""
        return {} if self.memory is None else self.memory.update(F, p, last, duration)

    def stored(self, F: Expr, p: Mapping[str, Expr], state: State) -> Expr:
        """Return the stored energy per undeformed volume, N/mm2."""
        return self.energy(F, p) if self.memory is None else self.energy(F, p, state)

    def stress(self, F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> Expr:
        """Return the first Piola-Kirchhoff stress at the end of a step, MPa, UFL shape (3, 3).

        Parameters
        ----------
        F
            Deformation gradient there, a `ufl.variable`.
        p, last, duration
            As for `Memory.update`.
        """
        if self.memory is None:
            return ufl.diff(self.energy(F, p), F)
        state = self.state(F, p, last, duration)
        at_fixed_state = ufl.variable(F)
        return ufl.diff(self.energy(at_fixed_state, p, state), at_fixed_state)

    def dissipated(
        self, F: Expr, p: Mapping[str, Expr], last: State, state: State, duration: Expr
    ) -> Expr:
        """Return the energy that a step to a state dissipates per undeformed volume, N/mm2."""
        if self.memory is None:
            return ufl.as_ufl(0.0)
        if self.memory.dissipation is not None:
            return self.memory.dissipation(F, p, last, state, duration)
        fixed = {name: ufl.variable(value) for name, value in state.items()}
        energy = self.energy(F, p, fixed)
        return -sum(
            ufl.inner(ufl.diff(energy, fixed[name]), state[name] - last[name]) for name in fixed
        )


def stiffness_entries(elastic: Elastic) -> tuple[float, float, float, float]:
    """Return C11, C12, C13, C33 of a layer that is isotropic in its cross-section, MPa.

    The shear moduli are in `elastic`; what G_XY exceeds (C11 - C12) / 2 by, a law adds.
    """
    stiffness = elastic.stiffness()
    return stiffness[0, 0], stiffness[0, 1], stiffness[0, 2], stiffness[2, 2]
