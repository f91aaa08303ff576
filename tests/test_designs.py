"""Designs of experiments, their coding, and the region that they span."""

from __future__ import annotations

import numpy as np
import pyDOE3
import pytest

import ramiefenics as rf
from ramiefenics.calibration.designs import (
    Design,
    central_composite,
    latin_hypercube,
    plackett_burman,
    sobol,
)
from ramiefenics.calibration.factors import Factor, Space
from ramiefenics.calibration.region import Region
from ramiefenics.calibration.terms import model_matrix, model_slopes, model_terms

FRICTION = Factor("X1", ("fixture.friction.dynamic",), 0.05, 0.15)
PHLOEM = Factor("X2", ("stalk.layers.phloem.material.elastic.nu_XY",), 0.2, 0.4)
RADII = Factor("R", ("fixture.indenter_radius_mm", "fixture.support_radius_mm"), 4.0, 6.0)


def variance(design: Design, points: np.ndarray) -> np.ndarray:
    """Return the variance of a full quadratic's prediction, relative to that of a run."""
    terms = model_terms(design.coded.shape[1], "quadratic")
    inverse = np.linalg.inv((m := model_matrix(design.coded, terms)).T @ m)
    rows = model_matrix(points, terms)
    return np.einsum("ni,ij,nj->n", rows, inverse, rows)


@pytest.mark.parametrize(
    ("number", "alpha"), [(2, 1.414), (3, 1.682), (4, 2.0), (5, 2.0), (6, 2.378)]
)
def test_axial_distance_is_that_of_the_handbook(number: int, alpha: float) -> None:
    # NIST/SEMATECH e-Handbook, section 5.3.3.6.1: 2^k, and 2^(k-1) for 5 and 6 factors
    assert central_composite(number).alpha == pytest.approx(alpha, abs=5e-4)


@pytest.mark.parametrize("number", [2, 3, 4, 5, 6])
def test_rotatable_designs_predict_equally_well_in_all_directions(number: int) -> None:
    design = central_composite(number)
    directions = np.random.default_rng(1).standard_normal((50, number))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for radius in (0.5, 1.0, 1.7):
        at = variance(design, radius * directions)
        assert np.ptp(at) < 1e-10 * at.mean()
    squares = np.square(design.coded)  # Box and Hunter (1957): [iiii] = 3 [iijj]
    assert (squares**2).sum(axis=0) == pytest.approx(3.0 * (squares[:, 0] @ squares[:, 1]))


def test_face_centred_designs_do_not_and_stay_in_the_cube() -> None:
    design = central_composite(3, "face", centres=3)
    assert np.abs(design.coded).max() == 1.0
    assert len(design.coded) == 8 + 6 + 3
    at = variance(design, np.array([[1.0, 0.0, 0.0], np.ones(3) / np.sqrt(3.0)]))
    assert at[0] != pytest.approx(at[1], rel=0.05)


@pytest.mark.parametrize("number", [2, 3, 4])
def test_central_composite_is_that_of_another_code(number: int) -> None:
    other = pyDOE3.ccdesign(number, center=(0, 4), alpha="rotatable", face="circumscribed")
    ours = central_composite(number, centres=4).coded

    def listed(points: np.ndarray) -> list[tuple[float, ...]]:
        return sorted(map(tuple, np.round(points, 9) + 0.0))

    assert listed(ours) == listed(other)


def test_half_the_corners_still_tell_all_interactions_apart() -> None:
    design = central_composite(5, centres=1)
    assert len(design.coded) == 16 + 10 + 1
    terms = model_terms(5, "quadratic")
    assert np.linalg.matrix_rank(model_matrix(design.coded, terms)) == len(terms) == 21


@pytest.mark.parametrize("number", [3, 7, 11, 15, 19, 23])
def test_plackett_burman_columns_are_orthogonal_and_balanced(number: int) -> None:
    points = plackett_burman(number).coded
    runs = len(points)
    assert runs == 4 * (number // 4 + 1)
    assert np.array_equal(np.abs(points), np.ones_like(points))
    assert points.T @ points == pytest.approx(runs * np.eye(number))
    assert points.sum(axis=0) == pytest.approx(0.0)


def test_latin_hypercube_has_one_point_per_slice() -> None:
    points = latin_hypercube(4, 17, seed=3).coded
    slices = np.floor((points + 1.0) / 2.0 * 17).astype(int)
    assert np.array_equal(np.sort(slices, axis=0), np.tile(np.arange(17)[:, None], (1, 4)))
    assert np.array_equal(points, latin_hypercube(4, 17, seed=3).coded)
    assert not np.array_equal(points, latin_hypercube(4, 17, seed=4).coded)


def test_sobol_points_are_more_even_than_chance() -> None:
    points = sobol(2, 256).coded
    counts, _, _ = np.histogram2d(points[:, 0], points[:, 1], bins=16, range=[[-1, 1]] * 2)
    assert np.array_equal(counts, np.ones((16, 16)))  # a (0, 8, 2)-net
    assert len(sobol(2, 100).coded) == 100


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: central_composite(1), "factors = 1 must be 2 to 10"),
        (lambda: central_composite(11), "factors = 11 must be 2 to 10"),
        (lambda: central_composite(3, "round"), "alpha = 'round' must be 'rotatable'"),
        (lambda: central_composite(3, -1.0), "alpha = -1.0 must be"),
        (lambda: central_composite(3, centres=-1), "centres = -1 must be 0 or more"),
        (lambda: plackett_burman(27), "factors = 27 must have 4, 12 or 20 times"),
        (lambda: sobol(2, 1), "runs = 1 must be at least 2"),
    ],
)
def test_what_no_design_exists_for_is_refused(make: object, message: str) -> None:
    with pytest.raises(rf.SpecificationError, match=message.replace("(", r"\(")):
        make()  # type: ignore[operator]


def test_table_4_is_the_coding_of_the_published_study(screening: rf.BendingTest) -> None:
    design = central_composite(2)
    space = Space((FRICTION, PHLOEM), coded_high=1.682)
    # Table 4: levels -1.682, -1, 0, 1, 1.682, printed to two digits
    levels = np.array([-1.682, -1.0, 0.0, 1.0, 1.682])
    natural = space.natural(np.column_stack([levels, levels]))
    assert natural[:, 0] == pytest.approx([0.05, 0.07, 0.1, 0.13, 0.15], abs=0.005)
    assert natural[:, 1] == pytest.approx([0.2, 0.24, 0.3, 0.36, 0.4], abs=0.005)
    assert space.coded(natural) == pytest.approx(np.column_stack([levels, levels]))
    table = design.table(Space((FRICTION, PHLOEM), design.region.reach))
    assert table["X1"].min() == pytest.approx(0.05)  # the axial points are the ends
    assert table["X1_coded"].min() == pytest.approx(-np.sqrt(2.0))


def test_a_factor_sets_all_its_keys(screening: rf.BendingTest) -> None:
    low, high = Space((RADII, FRICTION)).tests(screening, np.array([[-1.0, 0.0], [1.0, 1.0]]))
    assert low.fixture.indenter_radius_mm == low.fixture.support_radius_mm == 4.0
    assert high.fixture.support_radius_mm == 6.0
    assert high.fixture.friction.dynamic == 0.15
    assert RADII.baseline(screening) == 5.0


def test_bad_factors_are_refused_in_one_sentence(screening: rf.BendingTest) -> None:
    with pytest.raises(rf.SpecificationError, match="high = 1 must be a number above 2"):
        Factor("X1", ("fixture.span_mm",), 2, 1)
    with pytest.raises(rf.SpecificationError, match="must be one word"):
        Factor("X 1", ("fixture.span_mm",), 1, 2)
    with pytest.raises(rf.SpecificationError, match="must not occur twice"):
        Space((FRICTION, FRICTION))
    with pytest.raises(rf.SpecificationError, match="'law' must be the key of a number"):
        Factor("X1", ("law",), 0.0, 1.0).baseline(screening)
    wide = Space((Factor("X1", ("fixture.friction.dynamic",), 0.0, 2.0),))
    with pytest.raises(rf.SpecificationError, match=r"factors\.X1.*at most the static"):
        wide.tests(screening, np.array([[1.0]]))


def test_region_is_the_box_cut_by_the_ball() -> None:
    design = central_composite(3)
    region = design.region
    assert region.reach == pytest.approx(8.0**0.25)
    assert region.radius == pytest.approx(np.sqrt(3.0))
    assert region.contains(design.coded).all()
    assert not region.contains(np.array([1.5, 1.5, 0.0]))
    points = region.sample(20000)
    assert region.contains(points).all()
    # the volume of the ball, less three pairs of caps
    height = region.radius - region.reach
    caps = 6.0 * np.pi * height**2 * (3.0 * region.radius - height) / 3.0
    volume = 4.0 / 3.0 * np.pi * region.radius**3 - caps
    assert len(points) / 20000 == pytest.approx(1.0, abs=0.05)
    inner = np.linalg.norm(points, axis=1) < 1.0
    assert inner.mean() == pytest.approx(4.0 / 3.0 * np.pi / volume, rel=0.03)
    cut = region.slice(1.5)
    assert cut.dimension == 2
    assert cut.radius == pytest.approx(np.sqrt(3.0 - 2.25))
    assert Region(2, 1.0, 2.0).is_box
    assert region.contains(region.pull_in(np.array([[3.0, 1.0, 0.0]]))).all()


def test_slopes_of_terms_are_their_differences() -> None:
    terms = model_terms(3, "quadratic")
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (20, 3))
    points[0] = 0.0
    slopes = model_slopes(points, terms)
    for factor in range(3):
        step = np.zeros(3)
        step[factor] = 1e-5
        central = (model_matrix(points + step, terms) - model_matrix(points - step, terms)) / 2e-5
        assert slopes[:, :, factor] == pytest.approx(central, abs=1e-8)
