"""Places in the model where something unknown may be: free functions of few coefficients.

Each function is zero where, by definition, nothing is missing: without force, at rest, or, over the
height, on average over the specimens. A priori it is a straight line of unknown slope over the
number of the knot, with independent second differences, which bend it (the prior of smoothing
splines: Wahba 1978, Journal of the Royal Statistical Society B 40, 364-372). Its size is the
standard deviation at the last knot.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from ramiefenics.discovery.curves.blocks import Array
from ramiefenics.effects import Effect
from ramiefenics.effects.materials import with_materials
from ramiefenics.model.kernels.points import PointKernel
from ramiefenics.model.laws import law_named
from ramiefenics.model.laws.free_form import (
    CRUSHED,
    FREE_FORM,
    LOSSES,
    PRESSED,
    PULLED,
    STRAINS,
)
from ramiefenics.specification import BendingTest, Material, SpecificationError

DEFLECTION_SHARE = 0.05
"""Prior size of the machine's deflection, relative to the largest displacement."""

TANGENT_SIZE = 0.5
"""Prior size of a missing tangent, relative to the tangent at rest."""

HEIGHT_SIZE = 0.2
"""Prior size of the relative change of the moduli over the height."""

FORCE_KNOTS, HEIGHT_KNOTS = 6, 5

HEIGHT_POINTS = 25
"""Number of places at which the smooth function over the height is stated."""

SMALL = 1e-3
"""Step of a deflection relative to its size; with a large step at small forces, the recorded
displacement would decrease."""

GRID = 61
"""Number of points at which functions are evaluated."""


@dataclass(frozen=True)
class Place:
    """A place in the model where something unknown may be.

    Attributes
    ----------
    name
        Name, one word.
    sentence
        What the function is, in words.
    x_label, y_label
        Labels of its axes, with units.
    at
        Points at which the function is evaluated, shape (g,).
    effects
        One effect for each coefficient, which changes the specification in proportion to it.
    root
        Root of the coefficients' prior covariance, which is ``root @ root.T``, shape (c, q).
    prepared
        Returns an equivalent specification in which each coefficient is a number.
    function
        Returns the whole function of a specification, including the baseline's own, at some points.
    similar
        Names of effects that a test of one loading may take for this function, but that are not
        tried by default.
    """

    name: str
    sentence: str
    x_label: str
    y_label: str
    at: Array
    effects: tuple[Effect, ...]
    root: Array
    prepared: Callable[[BendingTest], BendingTest]
    function: Callable[[BendingTest, Array], Array]
    similar: tuple[str, ...] = ()

    def apply(self, test: BendingTest, coefficients: Array) -> BendingTest:
        """Return the specification with given coefficients, shape (c,)."""
        test = self.prepared(test)
        for effect, amount in zip(self.effects, coefficients, strict=True):
            test = effect.apply(test, float(amount))
        return test

    def basis(self, test: BendingTest) -> Array:
        """Return the contribution of each coefficient to the function, per unit, shape (g, c)."""
        base = self.prepared(test)
        without = self.function(base, self.at)
        columns = [
            (self.function(e.apply(base, e.typical), self.at) - without) / e.typical
            for e in self.effects
        ]
        return np.stack(columns, axis=1)


def places(tests: Sequence[BendingTest], largest_N: float, largest_mm: float) -> dict[str, Place]:
    """Return the places about which a data set can tell something, by name.

    Parameters
    ----------
    tests
        Specifications of all curves.
    largest_N, largest_mm
        Largest measured force and displacement.
    """
    found = [_machine(largest_N, DEFLECTION_SHARE * largest_mm)]
    if tests[0].law in ("saturating_fibre", FREE_FORM.name):
        found += [_fibre(), _section()]
    heights = np.array([test.stalk.position_mm for test in tests])
    if len(np.unique(heights)) > 2:
        found.append(_height(heights))
    return {place.name: place for place in found}


def _from_zero(size: float, knots: int) -> Array:
    """Return the prior root for a function that is zero before the first knot.

    Its columns are a slope, and second differences at all knots but the last. The slope makes half
    of the variance at the last knot, and the second differences together the other half.
    """
    number = np.arange(1, knots + 1)
    bent = np.maximum(number[:, None] - number[:-1], 0)
    columns = [number[:, None] / knots, bent / np.linalg.norm(bent[-1])]
    return np.asarray(size / 2.0**0.5 * np.hstack(columns))


def _from_mean(size: float, knots: int) -> Array:
    """Return the prior root for a function of zero mean: a slope, and second differences."""
    number = np.arange(knots)
    straight = np.column_stack([np.ones(knots), np.linspace(-1.0, 1.0, knots)])
    bent = np.abs(number[:, None] - number[1:-1]) / 2.0
    bent -= straight @ np.linalg.lstsq(straight, bent, rcond=None)[0]
    columns = [straight[:, 1:], bent / np.linalg.norm(bent[-1])]
    return np.asarray(size / 2.0**0.5 * np.hstack(columns))


def _effect(
    name: str, size: float, unit: str, apply: Callable[[BendingTest, float], BendingTest]
) -> Effect:
    limits = (-np.inf, np.inf)
    return Effect(name, "One coefficient of a free function.", "", unit, limits, size, apply)


def _machine(largest_N: float, size_mm: float) -> Place:
    """Return the place of the machine's deflection over force, with more knots at small forces."""
    number = np.arange(1, FORCE_KNOTS + 1)
    knots = tuple(float(force) for force in largest_N * (number / FORCE_KNOTS) ** 2)

    def prepared(test: BendingTest) -> BendingTest:
        if test.machine.table_N == knots:
            return test
        if test.machine.table_N:
            allowed = "must be the forces of the test's own table"
            raise SpecificationError("machine.table_N", list(knots), allowed)
        table = replace(test.machine, table_N=knots, table_mm=(0.0,) * len(knots))
        return replace(test, machine=table)

    def change(index: int, test: BendingTest, amount: float) -> BendingTest:
        table = _added(test.machine.table_mm, index, amount)
        return replace(test, machine=replace(test.machine, table_mm=table))

    return Place(
        "machine",
        "a force-dependent deflection of machine, load cell or fixture",
        "Force (N)",
        "Deflection of the machine (mm)",
        np.linspace(0.0, largest_N, GRID),
        tuple(
            _effect(f"machine_{i + 1}", SMALL * size_mm, "mm", partial(change, i))
            for i in range(len(knots))
        ),
        _from_zero(size_mm, len(knots)),
        prepared,
        lambda test, at: np.asarray(test.machine.deflection_mm(at)),
    )


def _fibre() -> Place:
    """Return the place of the fibres' axial stress over their strain."""
    return Place(
        "fibre",
        "a different stress-strain curve of the fibres",
        "Axial strain",
        "Confined axial stress, outermost layer (MPa)",
        np.linspace(-0.1, 0.1, GRID),
        _constants((*PULLED, *PRESSED)),
        np.kron(np.eye(2), _from_zero(TANGENT_SIZE, len(STRAINS))),  # tension and compression apart
        _free,
        partial(_confined_stress, axis=2),
        similar=("fibre_yield", "irreversible_damage"),
    )


def _section() -> Place:
    """Return the place of the section's stress over the loss of its area."""
    return Place(
        "section",
        "a different stress of the crushed section as a function of its loss of area",
        "ln (area / area at rest)",
        "Confined transverse stress, outermost layer (MPa)",
        np.linspace(-0.5, 0.0, GRID),
        _constants(CRUSHED),
        _from_zero(TANGENT_SIZE, len(LOSSES)),
        _free,
        lambda test, at: _confined_stress(test, np.expm1(at), axis=1),
        similar=("crushing",),
    )


def _constants(names: Sequence[str]) -> tuple[Effect, ...]:
    def change(name: str, test: BendingTest, amount: float) -> BendingTest:
        def changed(material: Material) -> Material:
            own = material.law_constants
            return replace(material, law_constants=own | {name: own[name] + amount})

        return with_materials(test, changed)

    return tuple(_effect(name, TANGENT_SIZE, "1", partial(change, name)) for name in names)


def _free(test: BendingTest) -> BendingTest:
    """Return the test with the free-form law, with all of its constants stated."""
    zeros = dict.fromkeys((constant.name for constant in FREE_FORM.constants), 0.0)
    stated = with_materials(test, lambda m: replace(m, law_constants=zeros | m.law_constants))
    return replace(stated, law=FREE_FORM.name)


def _confined_stress(test: BendingTest, strain: Array, axis: int) -> Array:
    """Return the stress of the outermost layer when strained along one axis only, MPa."""
    material, law = test.stalk.layers[-1].material, law_named(test.law)
    parameters = law.parameters_of(material)
    kernel = PointKernel(law, tuple(parameters))
    stress = []
    for value in strain:
        F = np.eye(3)
        F[axis, axis] += value
        P = kernel.evaluate("stress", F, np.array(list(parameters.values())), np.zeros(1), 0.0)
        stress.append(P.reshape(3, 3)[axis, axis])
    return np.array(stress)


def _height(heights: Array) -> Place:
    """Return the place of the factor on the moduli over the height, whose specimen mean is 1."""
    number = min(HEIGHT_KNOTS, len(np.unique(heights)))
    knots = np.linspace(heights.min(), heights.max(), number)
    at = np.linspace(heights.min(), heights.max(), HEIGHT_POINTS)
    smooth = CubicSpline(knots, np.eye(number), bc_type="natural")(at).T
    centred = [unit - np.interp(heights, at, unit).mean() for unit in smooth]

    def prepared(test: BendingTest) -> BendingTest:
        if test.stalk.place_mm:
            return test
        places = tuple(map(float, at))
        stalk = replace(test.stalk, place_mm=places, place_factor=(1.0,) * len(places))
        return replace(test, stalk=stalk)

    def change(index: int, test: BendingTest, amount: float) -> BendingTest:
        factors = np.array(test.stalk.place_factor) + amount * centred[index]
        stalk = replace(test.stalk, place_factor=tuple(map(float, factors)))
        return replace(test, stalk=stalk)

    return Place(
        "height",
        "a factor on all moduli that varies with the place on the plant",
        "Place on the plant (mm)",
        "Factor on the moduli",
        np.linspace(heights.min(), heights.max(), GRID),
        tuple(
            _effect(f"height_{i + 1}", HEIGHT_SIZE, "1", partial(change, i)) for i in range(number)
        ),
        _from_mean(HEIGHT_SIZE, number),
        prepared,
        lambda test, at: np.asarray(test.stalk.factor_at(at)),
    )


def _added(values: Sequence[float], index: int, amount: float) -> tuple[float, ...]:
    return tuple(v + amount * (i == index) for i, v in enumerate(values))
