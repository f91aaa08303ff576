"""Interface between the stepper and a structure with a prescribed displacement."""

from __future__ import annotations

from typing import Protocol

from dolfinx import fem

from ramiefenics.model.equations import Equations


class Driven(Protocol):
    """A structure, or the modelled part of one.

    Attributes
    ----------
    displacement
        Unknown displacement.
    equations
        Residual and its derivative; Dirichlet conditions are homogeneous.
    mass
        Compiled bilinear form of the consistent mass, tonne.
    factor
        Factor from the modelled part to the whole structure.
    """

    equations: Equations
    mass: fem.Form
    factor: float

    @property
    def displacement(self) -> fem.Function: ...  # noqa: D102

    def place(self, travel: float, duration_s: float) -> None:
        """Move the drive on from its last accepted position; may be called again.

        Parameters
        ----------
        travel
            Travel in this step, mm.
        duration_s
            Time that it takes.
        """

    def first_guess(self, travel: float) -> None:
        """Set the displacement from which the first step is solved."""

    def stored_energy(self) -> float:
        """Return the energy stored in this rank's cells, N mm."""

    def remember(self) -> None:
        """Let friction and material store the current state, on the way to an accepted one."""

    def accept(self) -> None:
        """Make the current state the last accepted one."""


class Observed(Protocol):
    """Observables of the whole structure in one state; a class may have more of them.

    Attributes
    ----------
    force_N
        Driving force.
    stored_energy_Nmm, friction_work_Nmm, dissipated_Nmm
        Energy stored; energy dissipated by friction so far; energy dissipated by the material so
        far.
    misses_contact
        Whether the drive has entered the structure, which a shorter step may prevent.
    """

    @property
    def force_N(self) -> float: ...  # noqa: D102

    @property
    def stored_energy_Nmm(self) -> float: ...  # noqa: D102

    @property
    def friction_work_Nmm(self) -> float: ...  # noqa: D102

    @property
    def dissipated_Nmm(self) -> float: ...  # noqa: D102

    @property
    def misses_contact(self) -> bool: ...  # noqa: D102

    def missed_contact(self) -> str:
        """Return what is wrong if contact is missed."""

    def physical_end(self) -> str | None:
        """Return why the model cannot describe what follows; None if it can."""
