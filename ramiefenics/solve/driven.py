"""What the stepper needs to know of a structure that a prescribed displacement drives."""

from __future__ import annotations

from typing import Protocol

from dolfinx import fem

from ramiefenics.model.equations import Equations


class Driven(Protocol):
    """A structure, or the modelled part of one.

    Attributes
    ----------
    displacement
        The unknown.
    equations
        Residual and derivative; Dirichlet conditions are zero.
    mass
        Compiled form of the consistent mass, bilinear, tonne.
    factor
        From the modelled part to the whole structure.
    """

    equations: Equations
    mass: fem.Form
    factor: float

    @property
    def displacement(self) -> fem.Function: ...  # noqa: D102

    def place(self, travel: float, duration_s: float) -> None:
        """Drive on from the last accepted position by mm in s; may be called again."""

    def first_guess(self, travel: float) -> None:
        """Set the displacement from which the first step is solved."""

    def stored_energy(self) -> float:
        """Return what this rank's cells store, N mm."""

    def remember(self) -> None:
        """Let friction and material remember the current state, on the way to an accepted one."""

    def accept(self) -> None:
        """Make the current state the last accepted one."""


class Observed(Protocol):
    """What is measured of a state of the whole structure; there may be more.

    Attributes
    ----------
    force_N
        The force that drives it.
    stored_energy_Nmm, friction_work_Nmm, dissipated_Nmm
        Energy stored; work done against friction so far; energy dissipated by the material so far.
    misses_contact
        Whether the drive is inside the structure, which a shorter step may prevent.
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
        """Return what is wrong if it is."""

    def physical_end(self) -> str | None:
        """Return why the model says nothing about what follows, if so."""
