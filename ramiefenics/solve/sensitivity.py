"""Derivatives of the force curve by anything in the specification, from one run.

Differentiating the equations ``R(u, a) = 0`` along the path gives ``K u' = - dR/da``: one more
solve per step with the tangent K of the converged state. What a parameter changes in the residual
(constants, coordinates of the mesh, the fixture, all that contact remembers of the step before) is
found without stating any of it: twins of the problem, made from specifications on either side, are
carried along the path in the state ``u + a u'``, and the difference of their residuals is ``dR/da``
at first and the error of u' afterwards, which the factorised tangent corrects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from mpi4py import MPI
from petsc4py import PETSc

from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.observables import Observer
from ramiefenics.solve.quasistatic import QuasiStatic
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import BendingTest, SpecificationError

TWIN_SHARE, DIFFERENCE_SHARE = 1e-4, 0.1
"""Distance of the twins, and of whole simulations where twins do not serve, over the typical size:
the former makes residuals linear, the latter is far above the error of a simulated force."""

ACCURACY = 1e-6
"""Residual of the differentiated equations over their right-hand side, or, where rounding is all
that is left of it, its change by a typical amount over the force."""

MAX_CORRECTIONS = 12
"""Where to give up: the force is not smooth in this parameter."""


@dataclass(frozen=True)
class Parameter:
    """Something that a specification depends on.

    Attributes
    ----------
    change
        From a specification and an amount to the changed specification; none at zero. If it
        refuses negative amounts, derivatives are one-sided.
    typical
        An amount that matters, in the parameter's unit: the scale of finite differences.
    """

    change: Callable[[BendingTest, float], BendingTest]
    typical: float = 1.0


@dataclass(frozen=True)
class Sensitivities:
    """A force curve and its derivatives.

    Attributes
    ----------
    curve
        ``displacement_mm``, ``force_N`` and one column per parameter: N per unit of it, at the
        given displacement.
    by_differences
        Parameters for which whole simulations were subtracted.
    """

    curve: pd.DataFrame
    by_differences: tuple[str, ...]


def sensitivities(
    test: BendingTest, parameters: Mapping[str, Parameter], comm: MPI.Comm | None = None
) -> Sensitivities:
    """Simulate, and differentiate the force curve by parameters.

    Where a parameter changes the mesh's topology or, on several ranks, its distribution, where the
    stalk jumps, and where the differentiated equations do not converge, simulations on either side
    are subtracted instead.

    Parameters
    ----------
    test
        The specification.
    parameters
        By name.
    comm
        MPI communicator, all of whose ranks call; the world by default.

    Raises
    ------
    SpecificationError
        If the path has more than a loading.
    """
    comm = MPI.COMM_WORLD if comm is None else comm
    test.protocol.check_loading_only("sensitivities")
    problem = BendingProblem(test, comm)
    stepper = QuasiStatic(problem, Observer(problem).observe, test.protocol, test.numerics.stepping)
    pairs = {name: _Pair.make(problem, parameter) for name, parameter in parameters.items()}
    smooth = {name: pair for name, pair in pairs.items() if pair is not None}
    rows: list[dict[str, float]] = []
    before = 0.0
    for step in stepper.steps():
        row = {"displacement_mm": step.travel_mm, "force_N": step.observables.force_N}
        if step.jump is not None:
            smooth.clear()
        if smooth and step.travel_mm > 0.0:
            stepper.newton.tangent.factorise()
        for name, pair in list(smooth.items()):
            slope = pair.follow(
                step.travel_mm - before, row["force_N"], stepper.newton.tangent.apply_factors
            )
            if slope is None:
                del smooth[name]
            else:
                row[name] = slope
        before = step.travel_mm
        rows.append(row)
    curve = pd.DataFrame(rows)
    others = tuple(name for name in parameters if name not in smooth)
    for name in others:
        curve[name] = _differences(test, parameters[name], curve["displacement_mm"], comm)
    return Sensitivities(curve[["displacement_mm", "force_N", *parameters]], others)


class _Pair:
    """Two twins of a problem, on either side of it along a parameter."""

    def __init__(
        self, base: BendingProblem, twins: dict[float, BendingProblem], typical: float
    ) -> None:
        self._base, self._twins, self._typical = base, twins, typical
        self._span = max(twins) - min(twins)
        u = base.displacement.x.petsc_vec
        self._rate, self._residual, self._one, self._correction = (u.duplicate() for _ in range(4))
        self._rate.set(0.0)
        self._started = False

    @classmethod
    def make(cls, base: BendingProblem, parameter: Parameter) -> _Pair | None:
        """Return the twins, or None if they have another mesh topology."""
        comm = base.tube.mesh.comm
        amounts = _either_side(base.test, parameter, TWIN_SHARE)
        twins = {a: BendingProblem(parameter.change(base.test, a), comm) for a in amounts}
        same = all(_same_topology(base, twin) for twin in twins.values())
        return cls(base, twins, parameter.typical) if comm.allreduce(same, op=MPI.LAND) else None

    def follow(
        self, length: float, force_N: float, solve: Callable[[PETSc.Vec, PETSc.Vec], None]
    ) -> float | None:
        """Go on with the base, which has converged; return the force's derivative, N per unit."""
        if length == 0.0:
            return 0.0
        for twin in self._twins.values():
            if self._started:
                twin.accept()
            twin.place(length, length / twin.test.protocol.speed_mm_per_s)
        self._started = True
        sizes = [self._difference()]
        for _ in range(MAX_CORRECTIONS):
            solve(self._residual, self._correction)
            self._rate.axpy(-1.0, self._correction)
            sizes.append(self._difference())
            rounding = sizes[-1] > 0.5 * sizes[-2]
            if sizes[-1] <= ACCURACY * sizes[0] or rounding:
                break
        enough = ACCURACY * max(sizes[0], abs(force_N) / self._typical)
        return self._force() if sizes[-1] <= enough else None

    def _difference(self) -> float:
        """Put the twins in place; evaluate the residual's derivative and return its norm."""
        self._residual.set(0.0)
        for amount, twin in self._twins.items():
            u = twin.displacement.x
            u.petsc_vec.waxpy(amount, self._rate, self._base.displacement.x.petsc_vec)
            u.scatter_forward()
            twin.equations.residual(self._one)
            self._residual.axpy(self._sign(amount) / self._span, self._one)
        return float(self._residual.norm())

    def _force(self) -> float:
        return (
            sum(
                self._sign(amount) * twin.forces(twin.contact.sums())[0]
                for amount, twin in self._twins.items()
            )
            / self._span
        )

    def _sign(self, amount: float) -> float:
        return 1.0 if amount == max(self._twins) else -1.0


def _either_side(test: BendingTest, parameter: Parameter, share: float) -> tuple[float, float]:
    """Return two amounts around zero, or zero and one above if none below is allowed."""
    amount = share * parameter.typical
    try:
        parameter.change(test, -amount)
    except SpecificationError:
        return 0.0, amount
    return -amount, amount


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
    test: BendingTest, parameter: Parameter, at_mm: pd.Series[float], comm: MPI.Comm
) -> np.ndarray:
    low, high = _either_side(test, parameter, DIFFERENCE_SHARE)
    forces = []
    for amount in (low, high):
        curve = simulate(parameter.change(test, amount), comm).curve
        travel, force = curve["displacement_mm"], curve["force_N"]
        forces.append(np.interp(at_mm, travel, force, right=np.nan))
    return (forces[1] - forces[0]) / (high - low)
