"""Interface of a material law to the rest of the program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import ufl

from ramiefenics.specification import Elastic, Material, SpecificationError
from ramiefenics.specification.checks import checked_number

Expr = Any
"""A UFL expression; UFL itself has no type annotations."""

State = Mapping[str, Expr]
"""Internal variables by name."""


@dataclass(frozen=True)
class Constant:
    """A constant that a law needs for every layer, in addition to the elastic ones.

    Attributes
    ----------
    name
        Key in ``material.law_constants`` and among the energy's parameters.
    unit
        Unit, ``1`` for a pure number.
    default
        Value for layers that do not state one; None if every layer must.
    above
        Lower bound, itself excluded.
    at_least
        Lower bound, itself allowed.
    below
        Upper bound, itself excluded.
    at_most
        Upper bound, itself allowed.
    """

    name: str
    unit: str
    default: float | None = None
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def of(self, material: Material) -> float:
        """Return the constant's value in a material.

        Raises
        ------
        SpecificationError
            If the value is missing or out of bounds.
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
    """Internal variables of a material point, and how they evolve.

    Attributes
    ----------
    start
        Internal variables at rest by name: a number, or nested tuples of numbers, in the
        variable's shape.
    update
        Function that returns the internal variables at the end of a step. Its arguments are the
        deformation gradient, the parameters, the internal variables at the end of the last step,
        and the duration of this step, s, which may be zero.
    dissipation
        Function that returns the energy dissipated in a step per undeformed volume, N/mm2. Its
        arguments are the deformation gradient, the parameters, the internal variables before and
        after the step, and its duration. By default, the dissipation is the thermodynamic forces
        at the end of the step times the change of the variables (backward Euler), which is exact
        where the forces are constant.
    units
        Units of the internal variables that are not pure numbers, by name, as appended to the
        names of their fields.
    """

    start: Mapping[str, Any]
    update: Callable[[Expr, Mapping[str, Expr], State, Expr], State]
    dissipation: Callable[[Expr, Mapping[str, Expr], State, State, Expr], Expr] | None = None
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Law:
    """A stored energy, its parameters and its internal variables; compared by identity.

    The stress is the derivative of the stored energy with respect to the deformation gradient at
    fixed internal variables (Coleman and Gurtin 1967, Eq. 6.2). The tangent is the derivative of
    that stress, including the change of the internal variables with the deformation, so that
    Newton's method converges quadratically whatever the update is.

    Attributes
    ----------
    name
        Name, as in the specification.
    parameters
        Function that returns the energy's parameters, each a number, for a layer's material. The
        names are the same for every material, so that the parameters can be data of one compiled
        form. The law's own constants are added to them.
    energy
        Function that returns the stored energy per undeformed volume, N/mm2, from the deformation
        gradient, UFL shape (3, 3), the parameters and, unless the law is elastic, the internal
        variables. Its second derivative with respect to the deformation gradient at rest is
        `Elastic.stiffness`.
    least_stretch
        Stretch at which the stress of a compressed fibre or layer stops growing; 0 if it never
        does.
    homogeneous
        Whether all stresses double when all moduli do, so that the forces on a uniformly stiffer
        stalk follow by scaling.
    constants
        The law's own constants, which are given for each layer.
    memory
        Internal variables and their evolution; None for an elastic law.
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
            If the law does not accept the material's constants.
        """
        own = {constant.name: constant.of(material) for constant in self.constants}
        for name, value in material.law_constants.items():
            if name not in own:
                known = f"which has only {', '.join(own)}" if own else "which has none"
                allowed = f"is not a constant of the law {self.name}, {known}"
                raise SpecificationError(f"law_constants.{name}", value, allowed)
        return own | self.parameters(replace(material, law_constants=own))

    def state(self, F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> State:
        """Return the internal variables at the end of a step; empty for an elastic law."""
        return {} if self.memory is None else self.memory.update(F, p, last, duration)

    def stored(self, F: Expr, p: Mapping[str, Expr], state: State) -> Expr:
        """Return the stored energy per undeformed volume, N/mm2."""
        return self.energy(F, p) if self.memory is None else self.energy(F, p, state)

    def stress(self, F: Expr, p: Mapping[str, Expr], last: State, duration: Expr) -> Expr:
        """Return the first Piola-Kirchhoff stress at the end of a step, MPa, UFL shape (3, 3).

        Parameters
        ----------
        F
            Deformation gradient at the end of the step, a `ufl.variable`.
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
        """Return the energy dissipated in a step to `state` per undeformed volume, N/mm2."""
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
    """Return C_11, C_12, C_13, C_33 of a layer that is isotropic in its cross-section, MPa.

    The shear moduli are in `elastic`; each law accounts for a G_XY other than (C_11 - C_12) / 2.
    """
    stiffness = elastic.stiffness()
    return stiffness[0, 0], stiffness[0, 1], stiffness[0, 2], stiffness[2, 2]
