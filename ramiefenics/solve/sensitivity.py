"""Derivatives of the force curve with respect to anything in the specification, from one run.

Differentiating the equations ``R(u, a) = 0`` with respect to a parameter a along the path gives
``dR/du du/da = -dR/da``, one more system of linear equations per step, with the tangent dR/du of
the converged state. A parameter may change the residual through constants, coordinates of the mesh,
the fixture and all that contact remembers of the step before. None of these changes has to be
stated. Instead, a twin of the problem, made from a specification that differs by a small delta_a,
is carried along the path in the state ``u + delta_a du/da``. The difference of the residuals over
delta_a is ``dR/da + dR/du du/da``, which vanishes at the solution. Until it does, the factorised
tangent corrects du/da.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from mpi4py import MPI
from petsc4py import PETSc

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.equations import Array
from ramiefenics.model.observables import Observer
from ramiefenics.solve.quasistatic import QuasiStatic
from ramiefenics.solve.rest import come_to_rest
from ramiefenics.solve.simulate import simulate
from ramiefenics.solve.tangent import Tangent
from ramiefenics.specification import BendingTest, SpecificationError
from ramiefenics.specification.sources import Source, as_test

TWIN_SHARE, DIFFERENCE_SHARE = 1e-4, 0.1
"""Change of the parameter in a twin, and in whole simulations where a twin cannot be used, relative
to the parameter's typical size. The former is small enough for residuals to be linear; the latter
changes the force by far more than the error of a simulation."""

ACCURACY = 1e-6
"""Tolerance on the residual of the differentiated equations, relative to their right-hand side. If
that is only rounding error, the residual times the typical size is compared with the force."""

MAX_CORRECTIONS = 12
"""Number of corrections after which the force counts as not smooth in a parameter."""

ENOUGH = 0.5
"""Least share of the parameters in which the force must be smooth if jumps are refused."""


@dataclass(frozen=True)
class Parameter:
    """Parameter of a specification.

    Attributes
    ----------
    change
        Function of a specification and an amount that returns the changed specification; zero
        changes nothing. If it refuses amounts of one sign, derivatives are one-sided.
    typical
        Typical amount, in the parameter's unit, by which finite differences are scaled.
    """

    change: Callable[[BendingTest, float], BendingTest]
    typical: float = 1.0


@dataclass(frozen=True)
class Sensitivities:
    """A force curve and its derivatives.

    Attributes
    ----------
    curve
        ``displacement_mm``, ``force_N`` and one column per parameter: the derivative of the force
        at the given displacement, N per unit of the parameter.
    by_differences
        Parameters whose derivatives are differences between whole simulations.
    """

    curve: pd.DataFrame
    by_differences: tuple[str, ...]


def sensitivities(
    test: Source,
    parameters: Mapping[str, Parameter],
    comm: MPI.Comm | None = None,
    jumps: bool = True,
    **changes: Any,
) -> Sensitivities:
    """Simulate a test, and differentiate its force curve with respect to parameters.

    The derivative is the difference between whole simulations on either side if a parameter changes
    the domain, the mesh's topology or, on several ranks, its distribution, if the stalk jumps, or
    if the differentiated equations do not converge.

    Parameters
    ----------
    test
        The specification, its TOML file, or the name of a published one.
    parameters
        Parameters by name.
    comm
        MPI communicator, all of whose ranks call; the world by default.
    jumps
        Whether the stalk may jump, come to rest by motion, or have a force that is not smooth in
        most parameters. Each derivative affected then takes two more simulations.
    changes
        Changes to the specification, see `as_test`.

    Raises
    ------
    SpecificationError
        If the path is more than a single loading, if the stalk does what `jumps` excludes, or if
        neither of two simulations for a difference goes as far as that of the test.
    """
    comm = MPI.COMM_WORLD if comm is None else comm
    test = as_test(test, **changes).alone
    test.protocol.check_loading_only("sensitivities")
    problem = BendingProblem(test, comm)
    come_to_rest(problem)
    observe = Observer(problem).observe
    stepper = QuasiStatic(problem, observe, test.protocol, test.numerics.stepping, jumps)
    twins = {name: _Twin.make(problem, parameter) for name, parameter in parameters.items()}
    smooth = {name: twin for name, twin in twins.items() if twin is not None}
    differentiable = len(smooth)
    residual = problem.displacement.x.petsc_vec.duplicate()
    rows: list[dict[str, float]] = []
    before = 0.0
    for step in stepper.steps():
        row = {"displacement_mm": step.travel_mm, "force_N": step.observables.force_N}
        if step.jump is not None:
            smooth.clear()
        if smooth and step.travel_mm > 0.0:
            stepper.newton.tangent.factorise()
            problem.equations.residual(residual)
        length, tangent = step.travel_mm - before, stepper.newton.tangent
        slopes = _follow(smooth, length, row["force_N"], residual, tangent)
        smooth = {name: smooth[name] for name in slopes}
        row |= slopes
        if not jumps and len(smooth) < ENOUGH * differentiable:
            raise _not_smooth(step.travel_mm)
        before = step.travel_mm
        rows.append(row)
    if not jumps and stepper.ending is not None and stepper.ending.kind == "not converged":
        raise _not_smooth(before)
    curve = pd.DataFrame(rows)
    others = tuple(name for name in parameters if name not in smooth)
    for name in others:
        curve[name] = _differences(test, parameters[name], curve, comm)
    return Sensitivities(curve[["displacement_mm", "force_N", *parameters]], others)


def _not_smooth(travel_mm: float) -> SpecificationError:
    allowed = "must be passed without a jump if derivatives are requested"
    return SpecificationError("displacement_mm", travel_mm, allowed)


class _Twin:
    """Problem with a slightly different parameter that follows the base problem."""

    def __init__(
        self, base: BendingProblem, twin: BendingProblem, typical: float, amount: float
    ) -> None:
        self._base, self._twin = base, twin
        self._typical, self._amount = typical, amount
        u = base.displacement.x.petsc_vec
        self._rate, self._residual = u.duplicate(), u.duplicate()
        self._rate.set(0.0)
        self._started = False
        self._sizes: list[float] = []

    @classmethod
    def make(cls, base: BendingProblem, parameter: Parameter) -> _Twin | None:
        """Return the twin, or None if it has another domain or mesh topology."""
        comm = base.tube.mesh.comm
        low, high = _either_side(base.test, parameter, TWIN_SHARE)
        amount = high or low
        test = parameter.change(base.test, amount)
        if test.numerics.domain != base.test.numerics.domain:
            return None
        twin = BendingProblem(test, comm, base.tube if _same_mesh(base.test, test) else None)
        come_to_rest(twin)
        same = comm.allreduce(_same_topology(base, twin), op=MPI.LAND)
        return cls(base, twin, parameter.typical, amount) if same else None

    def go_on(self, length: float, residual: PETSc.Vec) -> None:
        """Follow a step of the base, which has converged with the given residual."""
        if self._started:
            self._twin.accept()
        self._twin.place(length, length / self._twin.test.protocol.speed_mm_per_s)
        self._started = True
        self._sizes = [self._difference(residual)]

    @property
    def error(self) -> Array:
        """Residual of the differentiated equations, this rank's part of it, shape (n,)."""
        return np.asarray(self._residual.array_r)

    @property
    def converged(self) -> bool:
        """Whether no further correction is needed, or none would help."""
        *_, before, now = self._sizes
        return now <= ACCURACY * self._sizes[0] or now > 0.5 * before

    def correct(self, correction: Array, residual: PETSc.Vec) -> None:
        """Subtract a correction from the derivative of the displacement."""
        self._rate.array -= correction
        self._sizes.append(self._difference(residual))

    def is_smooth(self, force_N: float) -> bool:
        """Return whether the derivative is accurate, given the force of the base."""
        return self._sizes[-1] <= ACCURACY * max(self._sizes[0], abs(force_N) / self._typical)

    def slope(self, force_N: float) -> float:
        """Return the derivative of the base's force, N per unit."""
        return (self._twin.forces(self._twin.contact.sums())[0] - force_N) / self._amount

    def _difference(self, residual: PETSc.Vec) -> float:
        """Update the twin's state, evaluate the residual's derivative and return its norm."""
        u = self._twin.displacement.x
        u.petsc_vec.waxpy(self._amount, self._rate, self._base.displacement.x.petsc_vec)
        u.scatter_forward()
        self._twin.equations.residual(self._residual)
        self._residual.axpy(-1.0, residual)
        self._residual.scale(1.0 / self._amount)
        return float(self._residual.norm())


def _follow(
    twins: Mapping[str, _Twin], length: float, force_N: float, residual: PETSc.Vec, tangent: Tangent
) -> dict[str, float]:
    """Follow a step of the base, which has converged, with the twins.

    Parameters
    ----------
    twins
        Twins by name of the parameter.
    length
        Length of the step, mm.
    force_N, residual, tangent
        Force, residual and factorised tangent of the base.

    Returns
    -------
    dict
        Derivatives of the force, N per unit, for the parameters in which it is smooth.
    """
    if length == 0.0:
        return dict.fromkeys(twins, 0.0)
    for twin in twins.values():
        twin.go_on(length, residual)
    left = list(twins.values())
    for _ in range(MAX_CORRECTIONS):
        if not left:
            break
        corrections = tangent.apply_factors(np.array([twin.error for twin in left]))
        for twin, correction in zip(left, corrections, strict=True):
            twin.correct(correction, residual)
        left = [twin for twin in left if not twin.converged]
    return {name: twin.slope(force_N) for name, twin in twins.items() if twin.is_smooth(force_N)}


def _same_mesh(one: BendingTest, other: BendingTest) -> bool:
    """Return whether specifications differ in materials, law and friction at most."""
    if len(one.stalk.layers) != len(other.stalk.layers):
        return False
    pairs = zip(other.stalk.layers, one.stalk.layers, strict=True)
    layers = tuple(replace(layer, material=like.material) for layer, like in pairs)
    stalk = replace(other.stalk, layers=layers)
    fixture = replace(other.fixture, friction=one.fixture.friction)
    return replace(other, stalk=stalk, fixture=fixture, law=one.law) == one


def _either_side(test: BendingTest, parameter: Parameter, share: float) -> tuple[float, float]:
    """Return an amount on either side of zero, with zero in place of one that is refused."""
    amount = share * parameter.typical
    sides = []
    for side in (-amount, amount):
        try:
            parameter.change(test, side)
        except SpecificationError as error:
            refused = error
        else:
            sides.append(side)
    if not sides:
        raise refused
    return min(sides[0], 0.0), max(sides[-1], 0.0)


def _same_topology(one: BendingProblem, other: BendingProblem) -> bool:
    pairs = [
        (one.solid.space.dofmap.list, other.solid.space.dofmap.list),
        (one.tube.cells.values, other.tube.cells.values),
        *(
            (a.facets, b.facets)
            for a, b in zip(one.contact.obstacles, other.contact.obstacles, strict=True)
        ),
    ]
    return all(np.array_equal(a, b) for a, b in pairs)


def _differences(
    test: BendingTest, parameter: Parameter, base: pd.DataFrame, comm: MPI.Comm
) -> np.ndarray:
    """Return the differences between simulations, from the base where one of them ended before."""
    at_mm, amounts, forces = base["displacement_mm"], [], []
    for amount in _either_side(test, parameter, DIFFERENCE_SHARE):
        curve = simulate(parameter.change(test, amount), comm).curve
        reached = at_mm <= curve["displacement_mm"].iloc[-1]
        there = np.interp(at_mm, curve["displacement_mm"], curve["force_N"])
        forces.append(np.where(reached, there, base["force_N"]))
        amounts.append(np.where(reached, amount, 0.0))
    if not np.all(known := amounts[1] > amounts[0]):
        allowed = "must be reached by a simulation with a changed parameter, too, for a derivative"
        raise SpecificationError("displacement_mm", float(at_mm[~known].min()), allowed)
    return (forces[1] - forces[0]) / (amounts[1] - amounts[0])
