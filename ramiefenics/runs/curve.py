"""Tasks that simulate force curves and their derivatives.

Moduli are normalised, so that one simulation serves all stalks whose moduli are in proportion.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import io
import warnings
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeAlias, TypeVar

import pandas as pd

from ramiefenics.model.laws import law_content, law_named
from ramiefenics.runs.executor import Done
from ramiefenics.runs.store import key_of
from ramiefenics.solve.quasistatic import Ending
from ramiefenics.specification import (
    BendingTest,
    Machine,
    SpecificationError,
    SpecificationWarning,
)
from ramiefenics.specification.files import to_dict

MODULUS_MPA = 1000.0
"""Modulus of the outermost layer along the fibres in normalised simulations."""

FIRST_SHARE, LONGEST_SHARE = 1.0 / 28.0, 1.0 / 14.0
"""Largest first increment, and largest of all increments, as shares of the travel. With those of
a specification, which are meant for long tests, the curve of a short one would have so few points
that forces between them were wrong by more than the noise of measured ones."""

REMEMBERED = 10_000
"""Number of specifications whose normalised form is cached; each is needed dozens of times."""


class Change(Protocol):
    """Change with respect to which a curve can be differentiated; a frozen dataclass.

    Attributes
    ----------
    name
        Name of the column with the derivative.
    TYPICAL
        Typical amount of the change.
    """

    TYPICAL: ClassVar[float]

    @property
    def name(self) -> str: ...  # noqa: D102

    def apply(self, test: BendingTest, amount: float, /) -> BendingTest:
        """Return the changed specification; it is the same if the amount is zero."""


@dataclass(frozen=True)
class CurveTask:
    """Task that simulates a force curve.

    Attributes
    ----------
    test
        Test to simulate. Its machine does not matter. If something follows the loading, the curve
        is that of the first unloading.
    factors
        Changes with respect to which the curve is differentiated.
    smooth
        Whether to refuse a stalk that jumps, as its derivatives take many simulations.
    strict
        Whether to refuse it even among learned curves the others of which tell nothing of it.
    """

    test: BendingTest
    factors: tuple[Change, ...] = ()
    smooth: bool = False
    strict: bool = False

    def keys(self) -> tuple[str, ...]:
        """Return the keys under which the curve is kept, with derivatives and without."""
        test = to_dict(normalised(self.test)[0]) | {"law": law_content(self.test.law)}
        names = []
        own = (self.factors, self.smooth and bool(self.factors))
        # a smooth curve also serves requests that would accept jumps
        for some, smooth in dict.fromkeys([own, (self.factors, False), ((), False)]):
            files = {inspect.getfile(type(factor)): None for factor in some}
            names.append(key_of([test, [to_dict(f) for f in some], smooth], __file__, *files))
        return tuple(names)

    def compute(self) -> str:
        """Simulate; return the curve as CSV, for normalised moduli."""
        from mpi4py import MPI

        from ramiefenics.solve.sensitivity import Parameter, sensitivities
        from ramiefenics.solve.simulate import simulate

        with warnings.catch_warnings(action="ignore", category=SpecificationWarning):
            test = _with_enough_points(normalised(self.test)[0])
            if self.factors:
                parameters = {f.name: Parameter(f.apply, f.TYPICAL) for f in self.factors}
                jumps = not self.smooth
                curve = sensitivities(test, parameters, MPI.COMM_SELF, jumps).curve
            else:
                result = simulate(test, MPI.COMM_SELF)
                if result.ending.kind == "interrupted":
                    raise KeyboardInterrupt
                curve = result.curve[["displacement_mm", "force_N"]]
                if test.protocol.then:
                    curve = _first_unloading(curve, result.ending)
        text = io.StringIO()
        curve.to_csv(text, index=False)
        return text.getvalue()

    def read(self, text: str) -> pd.DataFrame:
        """Return the curve: ``displacement_mm`` of the indenter, ``force_N``, and derivatives.

        For every factor, the column with its name is the derivative of the force with respect to
        the amount of that change, N per unit of the amount.
        """
        curve = pd.read_csv(io.StringIO(text))
        # the stored curve may have derivatives that this task does not ask for
        curve = curve[["displacement_mm", "force_N", *(factor.name for factor in self.factors)]]
        curve[curve.columns[1:]] *= normalised(self.test)[1]
        return curve


def _with_enough_points(test: BendingTest) -> BendingTest:
    """Return the test with increments short enough for forces between points to be read."""
    settings, travel = test.numerics.stepping, test.protocol.travel_mm
    first = min(settings.first_step_mm, FIRST_SHARE * travel)
    settings = dataclasses.replace(
        settings,
        min_step_mm=min(settings.min_step_mm, first),
        first_step_mm=first,
        max_step_mm=min(settings.max_step_mm, LONGEST_SHARE * travel),
    )
    numerics = dataclasses.replace(test.numerics, stepping=settings)
    return dataclasses.replace(test, numerics=numerics)


def _first_unloading(curve: pd.DataFrame, ending: Ending) -> pd.DataFrame:
    """Return the curve of the first unloading from the largest travel, in ascending order.

    Raises
    ------
    SpecificationError
        If the run did not reach the end of its path.
    """
    if ending.kind != "completed":
        raise SpecificationError("protocol.then", ending.reason, "must be followed to its end")
    turn = int(curve["displacement_mm"].to_numpy()[::-1].argmax())
    back = curve.iloc[len(curve) - 1 - turn :]
    falls = back["displacement_mm"].diff().to_numpy()[1:] < 0.0
    end = len(back) if falls.all() else 1 + int(falls.argmin())
    return back.iloc[:end].iloc[::-1]


T = TypeVar("T")

Simulating: TypeAlias = Generator[Sequence[CurveTask], list[Done[pd.DataFrame]], T]
"""Generator that yields tasks, is sent their outcomes, and finally returns a result."""


class Mapper(Protocol):
    """Executes tasks, as `Runs` does.

    Attributes
    ----------
    asked
        Number of tasks so far.
    """

    asked: int

    def map(self, tasks: Sequence[CurveTask]) -> list[Done[pd.DataFrame]]:
        """Return the outcomes of tasks, in their order."""

    def together(self, computations: Sequence[Simulating[T]]) -> list[T]:
        """Carry out computations; return their results, in their order.

        Unless something better is known, the tasks of all are executed before any goes on.
        """
        results: dict[int, T] = {}
        outcomes: dict[int, Any] = dict.fromkeys(range(len(computations)))  # None begins them
        while outcomes:
            tasks = {}
            for i, own in outcomes.items():
                try:
                    tasks[i] = computations[i].send(own)
                except StopIteration as end:
                    results[i] = end.value
            every = [task for some in tasks.values() for task in some]
            done = iter(self.map(every) if every else ())
            outcomes = {i: [next(done) for _ in some] for i, some in tasks.items()}
        return [results[i] for i in range(len(computations))]


def simulated(runs: Mapper, tasks: Sequence[CurveTask]) -> list[pd.DataFrame]:
    """Return the curves of tasks, in their order."""
    return [done.result() for done in runs.map(tasks)]


@functools.lru_cache(maxsize=REMEMBERED)
def normalised(test: BendingTest) -> tuple[BendingTest, float]:
    """Return the simplest specification with proportional forces, and the ratio of the forces.

    The forces of `test` are those of the returned specification times that ratio. Where all
    stresses scale with the moduli (`Law.homogeneous`), so do forces, and one simulation serves all
    stalks that differ by a factor on all moduli.
    """
    test = dataclasses.replace(test.alone, group="")
    stalk, factor = test.stalk.measured_at_midspan(), 1.0
    if law_named(test.law).homogeneous:
        factor = stalk.layers[-1].material.elastic.E_Z_MPa * stalk.stiffness_factor / MODULUS_MPA
    scale = stalk.stiffness_factor / factor
    layers = tuple(
        dataclasses.replace(layer, material=layer.material.scaled(scale)) for layer in stalk.layers
    )
    stalk = dataclasses.replace(
        stalk,
        layers=layers,
        position_mm=0.0,
        stiffness_gradient_per_m=0.0,
        reference_position_mm=0.0,
        place_mm=(),
        place_factor=(),
        moisture=0.0,
        moisture_softening=0.0,
        reference_moisture=0.0,
        bond=stalk.bond.scaled(1.0 / factor),
    )
    mesh = dataclasses.replace(test.numerics.mesh, name="")
    numerics = dataclasses.replace(test.numerics, acoustic_check=False, mesh=mesh)
    round_section = stalk.section_height_mm is None and stalk.void_offset_mm == 0.0
    if stalk.rotation_deg != 0.0 and round_section:  # the same from all sides
        stalk = dataclasses.replace(stalk, rotation_deg=0.0)
        least, _ = dataclasses.replace(test, stalk=stalk).least_domain
        numerics = dataclasses.replace(numerics, domain=least)
    return dataclasses.replace(test, stalk=stalk, machine=Machine(), numerics=numerics), factor


def stiffer(test: BendingTest, factor: float) -> BendingTest:
    """Return the same test with all moduli of the stalk multiplied by a factor."""
    stalk = test.stalk
    layers = tuple(
        dataclasses.replace(layer, material=layer.material.scaled(factor)) for layer in stalk.layers
    )
    stalk = dataclasses.replace(stalk, layers=layers, bond=stalk.bond.scaled(factor))
    return dataclasses.replace(test, stalk=stalk)
