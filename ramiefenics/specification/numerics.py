"""Numerical settings: mesh recipe, contact, stepping, explicit dynamics."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ramiefenics.specification.checks import (
    check_choice,
    check_instance,
    check_integer,
    check_number,
)
from ramiefenics.specification.defaults import Default, put_in_order
from ramiefenics.specification.mesh_recipe import MeshRecipe, mesh_recipe


@dataclass(frozen=True)
class ContactMethod:
    """Nitsche's method for unilateral frictional contact (Chouly, Hild and Renard 2015).

    Attributes
    ----------
    theta
        Variant of the method: 1 symmetric, 0 incomplete (one term less), -1 skew-symmetric.
    stabilisation
        Multiple of (normal stiffness of the cell / thickness of the cell) that penalises
        penetration. The method is consistent for any value, but stable only for large ones: above
        about 5 for theta 0 and -1, above about 50 for theta 1.
    presliding_mm
        Slip over which friction builds up at a point at rest (Dahl 1968): the smaller it is, the
        closer to Coulomb's law, and the more iterations are needed.
    """

    theta: int = 0
    stabilisation: float = 20.0
    presliding_mm: float = 0.02

    def __post_init__(self) -> None:
        """Check choices and signs."""
        check_choice(self, "theta", (-1, 0, 1))
        check_number(self, "stabilisation", above=0.0)
        check_number(self, "presliding_mm", above=0.0, unit="mm")


@dataclass(frozen=True)
class Stepping:
    """Increments of the indenter's travel, and Newton's method within each.

    Attributes
    ----------
    first_step_mm
        First increment. If only one or two of the three increments are stated, the defaults of the
        others move to where they do not contradict them.
    max_step_mm
        Largest increment; at least `first_step_mm`.
    min_step_mm
        Smallest increment; at most `first_step_mm`. A value above a hundredth of the whole path is
        reduced to it. If there is no equilibrium nearby even with this increment, the stalk jumps
        to one that is farther away.
    max_iterations
        Most Newton iterations before the increment is cut.
    relative_tolerance
        Norm of the residual at convergence, relative to the norm of the contact forces.
    force_tolerance
        Allowed error of the curve if it is interpolated linearly between steps, which determines
        their length. During the first loading it is relative to the force extrapolated along the
        secant to the end of the travel, and afterwards to the largest force so far.
    linear_solver
        ``direct`` (MUMPS), ``iterative`` (algebraic multigrid) or ``auto``: direct up to 200,000
        unknowns.
    """

    first_step_mm: float = Default(0.5)
    max_step_mm: float = Default(1.0)
    min_step_mm: float = Default(0.05)
    max_iterations: int = 20
    relative_tolerance: float = 1e-5
    force_tolerance: float = 0.002
    linear_solver: str = "auto"

    def __post_init__(self) -> None:
        """Check signs and the order of the increments."""
        put_in_order(self, ("min_step_mm", "first_step_mm", "max_step_mm"), "mm")
        check_integer(self, "max_iterations", 1)
        check_number(self, "relative_tolerance", above=0.0, below=1.0)
        check_number(self, "force_tolerance", above=0.0, below=1.0)
        check_choice(self, "linear_solver", ("auto", "direct", "iterative"))


@dataclass(frozen=True)
class Explicit:
    """Explicit dynamics by central differences, a check of the quasi-static solution.

    Attributes
    ----------
    duration_s
        Duration of the whole travel. The longer it is, the closer the stalk is to equilibrium, and
        the more steps are needed.
    ramp
        Share of the duration in which the indenter's velocity rises smoothly from zero; afterwards
        it is constant.
    mass_factor
        Factor on all densities (mass scaling). Time steps grow with its square root, and inertia
        acts as in a test that is shorter by the same ratio.
    viscosity
        Damping of the highest frequency, approximately as a share of the critical damping; lower
        frequencies are damped in proportion to the frequency. Without it friction, whose tangent is
        not symmetric, may feed vibrations of crushed cells under the cylinders.
    drag
        Damping, in proportion to the mass, of the difference between the velocity and its mean over
        a twentieth of the duration. In the course of the test such a vibration decays by
        ``exp(-drag / 2)``. Without it the stalk swings between its cylinders, and friction, whose
        direction changes with every swing, holds less.
    step_share
        Ratio of the time step to the longest stable one.
    max_energy_error
        Share of the energy that may appear or vanish; a run that exceeds it after the first tenth
        of the travel is ended.
    """

    duration_s: float = 0.05
    ramp: float = 0.2
    mass_factor: float = 1.0
    viscosity: float = 0.06
    drag: float = 50.0
    step_share: float = 0.9
    max_energy_error: float = 0.05

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_number(self, "duration_s", above=0.0, unit="s")
        check_number(self, "ramp", above=0.0, at_most=1.0)
        check_number(self, "mass_factor", at_least=1.0)
        check_number(self, "viscosity", at_least=0.0, at_most=0.5)
        check_number(self, "drag", at_least=0.0, at_most=1000.0)
        check_number(self, "step_share", above=0.0, at_most=1.0)
        check_number(self, "max_energy_error", above=0.0, below=1.0)


DOMAINS = ("quarter", "half", "full")


@dataclass(frozen=True)
class Numerics:
    """Settings of the numerical solution, which do not change the problem that is solved.

    Attributes
    ----------
    domain
        Modelled part of the stalk: ``quarter`` (X >= 0, Z >= 0), ``half`` (X >= 0) or ``full``.
        Forces are always those of the whole stalk.
    mesh
        Refinement of the mesh: the name of a recipe, or its values.
    contact
        Contact method.
    stepping
        Increments of travel, and Newton's method.
    explicit
        Explicit dynamics, which only `simulate_explicitly` and ``ramiefenics explicit`` use.
    acoustic_check
        Whether to compute the smallest acoustic eigenvalue at every saved step, which detects the
        loss of ellipticity. It costs up to a tenth of a run, and is not needed in sweeps around a
        specification that is known to be sound.
    """

    domain: str = "quarter"
    mesh: MeshRecipe = field(default_factory=lambda: mesh_recipe("standard"))
    contact: ContactMethod = field(default_factory=ContactMethod)
    stepping: Stepping = field(default_factory=Stepping)
    explicit: Explicit = field(default_factory=Explicit)
    acoustic_check: bool = True

    def __post_init__(self) -> None:
        """Check the choices and the parts."""
        check_choice(self, "domain", DOMAINS)
        check_instance(self, "mesh", MeshRecipe)
        check_instance(self, "contact", ContactMethod)
        check_instance(self, "stepping", Stepping)
        check_instance(self, "explicit", Explicit)
        check_choice(self, "acoustic_check", (False, True))

    def whole(self) -> Numerics:
        """Return the same settings with the whole stalk, for tests without a symmetry plane."""
        return replace(self, domain="full")

    def whole_length(self) -> Numerics:
        """Return the same settings with both halves of the stalk's length.

        For tests that are not symmetric about the plane Z = 0.
        """
        return replace(self, domain="half") if self.domain == "quarter" else self
