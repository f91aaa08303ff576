"""Recorded forces, their derivatives and fits, for linear springs with closed solutions."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from formula import Formula
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.discovery.curves.blocks import Blocks
from ramiefenics.discovery.curves.factors import factors
from ramiefenics.discovery.curves.linearised import Linearised, Model
from ramiefenics.discovery.curves.meshes import finer, limit
from ramiefenics.discovery.curves.observed import Observed, observe
from ramiefenics.discovery.curves.prediction import Predictor
from ramiefenics.discovery.planning.power import predicted_evidence
from ramiefenics.discovery.search.fitted import Fitted
from ramiefenics.discovery.search.fitting import Fitter
from ramiefenics.discovery.synthetic import make_dataset
from ramiefenics.measured.noise import level
from ramiefenics.measured.record import POINTS
from ramiefenics.runs import Done

STIFFNESS_N_PER_MM, COMPLIANCE_MM_PER_N, GAP_MM = 10.0, 0.02, 0.2
"""Stiffness for vanishing cell size, compliance of the machine, and its gap.

The gap ends below the points that make up the first reading."""

FINER, FINEST = 0.97, 0.96
"""Stiffness on two finer meshes, relative to that on the mesh of the analysis."""

EXTRAPOLATED = FINER + limit()[0] * (FINEST - FINER)
"""Stiffness for vanishing cell size, relative to the same."""

AT_MM = np.linspace(0.5, 6.0, 12)


class Springs:
    """Stand-in for `Runs` that simulates springs, whose stiffness depends on mesh and xylem."""

    def __init__(self, stiffness: dict[rf.MeshRecipe, float], modulus_MPa: float) -> None:
        self._stiffness, self._modulus_MPa = stiffness, modulus_MPa

    def map(self, tasks: list) -> list[Done[pd.DataFrame]]:
        u = np.linspace(0.0, 7.0, 71)
        curves = []
        for task in tasks:
            scale = axial_modulus_MPa(task.test) / self._modulus_MPa
            force = scale * self._stiffness[task.test.numerics.mesh] * u
            by_factors = {factor.name: force for factor in task.factors}
            curve = pd.DataFrame({"displacement_mm": u, "force_N": force, **by_factors})
            curves.append(Done(curve))
        return curves


def axial_modulus_MPa(test: rf.BendingTest) -> float:
    return test.stalk.layers[0].material.elastic.E_Z_MPa


@pytest.fixture
def springs(screening: rf.BendingTest) -> Springs:
    mesh = screening.numerics.mesh
    stiffness = STIFFNESS_N_PER_MM / EXTRAPOLATED
    meshes = {
        mesh: stiffness,
        finer(mesh): FINER * stiffness,
        finer(finer(mesh)): FINEST * stiffness,
    }
    return Springs(meshes, axial_modulus_MPa(screening))


@pytest.fixture
def dataset(screening: rf.BendingTest) -> SimpleNamespace:
    return SimpleNamespace(
        baseline=screening,
        layout=SimpleNamespace(fit=["xylem.axial"], fit_sd=0.1),
    )


def observed(at_mm: np.ndarray, force_N: np.ndarray | None = None) -> Observed:
    """Return one measured curve."""
    at, force = at_mm[None], np.ones((1, len(at_mm))) if force_N is None else force_N[None]
    return Observed(at, force, force.max(axis=1), Blocks.of(["A"], len(at_mm)))


@pytest.fixture
def predictor(screening: rf.BendingTest, springs: Springs) -> Predictor:
    return Predictor([screening], observed(AT_MM), springs)


def loose(gap_mm: float) -> rf.Effect:
    """Return the effect of a compliant machine with a gap."""

    def apply(test: rf.BendingTest, compliance: float) -> rf.BendingTest:
        changes = [f"machine.compliance_mm_per_N={compliance}", f"machine.seating_gap_mm={gap_mm}"]
        return rf.override(test, changes)

    return rf.Effect("loose", "A loose machine.", "none", "mm/N", (0.0, 0.05), 1e-4, apply)


@pytest.mark.parametrize("gap_mm", [0.0, GAP_MM])
def test_changes_pass_through_the_machine(
    screening: rf.BendingTest, predictor: Predictor, gap_mm: float
) -> None:
    used = factors(screening, ["xylem.axial"])
    effect = loose(gap_mm)
    model = Model(used, np.zeros((1, 1)), {"loose": (effect, COMPLIANCE_MM_PER_N)})
    found = predictor.linearise(model, {"loose": effect})
    # F = k u and d = gap + u + c F: F = k (d - gap) / (1 + c k), and its derivatives
    k, c, d = STIFFNESS_N_PER_MM, COMPLIANCE_MM_PER_N, AT_MM - gap_mm
    force, by_log_k = k * d / (1 + c * k), k * d / (1 + c * k) ** 2
    assert np.allclose(found.force[0], force, rtol=1e-9)
    # the finite differences are a thousandth, and 0.000025 mm/N for c: errors of that order
    assert np.allclose(found.by_own[0, 0], by_log_k, rtol=1e-3)
    # nine cosines share the variance: a constant, and four more of full amplitude and four of a
    # fifth, whose squares are half on average
    first = limit()[1] * (FINEST - FINER) / np.sqrt(1.0 + (4.0 + 4.0 / 25.0) / 2.0)
    assert np.allclose(found.by_mesh[0, 0], first * by_log_k, rtol=1e-3)
    assert np.allclose(found.by_effects["loose"][0], -(k**2) * d / (1 + c * k) ** 2, rtol=1e-3)


def test_meshes_explain_no_more_than_finer_ones_show(
    screening: rf.BendingTest, springs: Springs
) -> None:
    """Readings are so close that a line through the points of each is the curve itself."""
    predictor = Predictor([screening], observed(np.linspace(0.5, 6.0, 331)), springs)
    found = predictor.linearise(Model(factors(screening, ["xylem.axial"]), np.zeros((1, 1))), {})
    on_mesh = found.force - found.mesh_correction
    assert np.allclose(found.mesh_correction, (EXTRAPOLATED - 1.0) * on_mesh, rtol=1e-9)
    relative = found.by_mesh[0] / found.force[0]
    together = np.sqrt((relative**2).sum(axis=0).mean())
    # the finite differences are a thousandth
    assert together == pytest.approx(limit()[1] * (FINER - FINEST), rel=1e-3)


class Sensitive(Springs):
    """Springs whose stiffness depends on the mesh with a power above one.

    Parameters
    ----------
    springs
        Springs with a power of one.
    power
        Returns what is added to the power for a test.
    """

    def __init__(self, springs: Springs, power: Callable[[rf.BendingTest], float]) -> None:
        super().__init__(springs._stiffness, springs._modulus_MPa)
        self._power = power

    def map(self, tasks: list) -> list[Done[pd.DataFrame]]:
        coarse = max(self._stiffness.values())
        found = []
        for task, done in zip(tasks, super().map(tasks), strict=True):
            relative = self._stiffness[task.test.numerics.mesh] / coarse
            curve = done.result()
            force = curve["force_N"] * relative ** self._power(task.test)
            found.append(Done(curve.assign(force_N=force)))
        return found


def damage_of(test: rf.BendingTest) -> float:
    return test.stalk.layers[0].material.large_strain.fibre_damage


def together(test: rf.BendingTest) -> float:
    return 5.0 * damage_of(test) * test.stalk.layers[0].material.large_strain.bimodularity


def extrapolated(power: float) -> float:
    """Return the force extrapolated from three meshes, relative to that on the coarsest."""
    return FINER**power + limit()[0] * (FINEST**power - FINER**power)


def test_what_finer_meshes_change_is_found_for_all_effects_together(
    screening: rf.BendingTest, springs: Springs
) -> None:
    effects = {name: rf.EFFECTS[name] for name in ("fibre_damage", "bimodular_fibre")}
    there = {name: (effect, effect.typical) for name, effect in effects.items()}
    runs = Sensitive(springs, together)
    travel = np.linspace(0.5, 6.0, 331)  # so close that curves are straight in each reading
    predictor = Predictor([screening], observed(travel), runs)
    model = Model(factors(screening, ["xylem.axial"]), np.zeros((1, 1)))
    for name, effect in effects.items():
        alone = predictor.linearise(model.changed(*there[name]), {name: effect})
        assert alone.force[0] == pytest.approx(STIFFNESS_N_PER_MM * travel, rel=1e-9)
    model = dataclasses.replace(model, effects=there)
    power = 1.0 + together(model.test(screening, np.zeros(1)))
    last = FINEST**power - FINER**power
    roughly = predictor.linearise(model, effects, roughly=True)
    for found in (predictor.confirm(roughly), predictor.linearise(model, effects)):
        on_mesh = found.force[0] - found.mesh_correction[0]
        assert found.force[0] == pytest.approx(extrapolated(power) * on_mesh, rel=1e-9)
        relative = found.by_mesh[0] / found.force[0]
        # the finite differences are a thousandth
        sd = np.sqrt((relative**2).sum(axis=0).mean())
        assert sd == pytest.approx(limit()[1] * abs(last), rel=2e-3)


def test_what_meshes_change_in_another_stalk_is_not_taken_for_that_by_an_effect(
    springs: Springs,
) -> None:
    """The stalk in the middle stands for the others, and the effect changes no forces."""
    tests = [rf.ramie(outer, 7.4, 0.67) for outer in (13.8, 14.4, 15.0)]
    tests = [rf.override(test, ["numerics.mesh=screening"]) for test in tests]
    at = np.tile(AT_MM, (3, 1))
    seen = Observed(at, np.ones_like(at), np.ones(3), Blocks.of("ABC", len(AT_MM)))
    uneven = Sensitive(springs, lambda test: test.stalk.outer_diameter_mm - 14.0)
    predictor = Predictor(tests, seen, uneven)
    plain = Model(factors(tests[0], ["xylem.axial"]), np.zeros((3, 1)))
    damage = rf.EFFECTS["fibre_damage"]
    damaged = plain.changed(damage, damage.typical)
    found, without = predictor.linearise(damaged, {}), predictor.linearise(plain, {})
    assert np.abs(without.mesh_correction).min() > 0.0
    assert np.allclose(found.mesh_correction, without.mesh_correction, rtol=1e-9)


def test_what_an_effect_adds_to_mesh_changes_is_found_for_each_span(springs: Springs) -> None:
    stalk = rf.override(rf.ramie(14.4, 7.4, 0.67), ["numerics.mesh=screening"])
    tests = [rf.override(stalk, [f"fixture.span_mm={span}"]) for span in (100.0, 70.0)]

    def power(test: rf.BendingTest) -> float:
        return damage_of(test) * test.fixture.span_mm

    travel = np.linspace(0.5, 6.0, 331)  # so close that curves are straight in each reading
    at = np.tile(travel, (2, 1))
    seen = Observed(at, np.ones_like(at), np.ones(2), Blocks.of("AA", len(travel)))
    predictor = Predictor(tests, seen, Sensitive(springs, power))
    damage = rf.EFFECTS["fibre_damage"]
    plain = Model(factors(tests[0], ["xylem.axial"]), np.zeros((1, 1)))
    model = plain.changed(damage, damage.typical)
    found = predictor.linearise(model, {})
    for test, force, correction in zip(
        predictor.tests(model), found.force, found.mesh_correction, strict=True
    ):
        expected = extrapolated(1.0 + power(test))
        assert force == pytest.approx(expected * (force - correction), rel=1e-9)


def test_a_kink_is_read_as_on_a_measured_curve(
    screening: rf.BendingTest, predictor: Predictor
) -> None:
    """The gap ends among the points of the first reading."""
    gap = 0.4
    used = factors(screening, ["xylem.axial"])
    model = Model(used, np.zeros((1, 1)), {"loose": (loose(gap), 0.0)})
    found = predictor.linearise(model, {}).force[0]
    travel = np.linspace(0.0, 6.0, 1201)
    force = STIFFNESS_N_PER_MM * np.maximum(travel - gap, 0.0)
    curve = pd.DataFrame({"displacement_mm": travel, "force_N": force})
    # twenty points in half a millimetre, compared with a hundred
    assert found[0] == pytest.approx(level(curve, 0.5, 0.25), abs=0.05)
    assert found[0] > STIFFNESS_N_PER_MM * (0.5 - gap) + 0.2
    assert found[1:] == pytest.approx(STIFFNESS_N_PER_MM * (AT_MM[1:] - gap), rel=1e-6)


@pytest.mark.parametrize("order", [1.5, 2.0, 3.0, 4.0])
def test_the_limit_of_meshes_is_where_richardson_says(order: float) -> None:
    """The force is F(h) = 1 + h^p, on cells of size 1 and 2/3."""
    coarse, fine = 2.0, 1.0 + (2.0 / 3.0) ** order
    mean, sd = limit()
    assert abs(coarse + mean * (fine - coarse) - 1.0) < 2.0 * sd * (coarse - fine)
    assert abs(coarse + mean * (fine - coarse) - 1.0) < coarse - 1.0


def test_residuals_are_the_baselines_wherever_the_model_is_linearised(
    screening: rf.BendingTest, dataset: SimpleNamespace, springs: Springs
) -> None:
    """The priors of factors and amplitudes stay in place, and the spring is linear in both."""
    data = observed(AT_MM, 1.1 * STIFFNESS_N_PER_MM * (AT_MM - GAP_MM))
    predictor, gap = Predictor([screening], data, springs), rf.EFFECTS["seating_gap"]
    used, fitter = factors(screening, ["xylem.axial"]), Fitter(dataset, data, predictor)
    residuals = []
    for log_factor, there in ((0.0, {}), (0.0, {gap.name: (gap, 0.1)})):
        model = Model(used, np.full((1, 1), log_factor), there)
        curves = predictor.linearise(model, {gap.name: gap})
        residuals.append(fitter.evidence(curves, {gap.name: gap}).residual)
    # a gap shifts the curve: its signature is the same at any amplitude, except at the first point
    assert residuals[1][:, 1:] == pytest.approx(residuals[0][:, 1:], abs=1e-9)
    expected = (data.force_N - STIFFNESS_N_PER_MM * AT_MM) / data.peak_N[:, None]
    assert residuals[0] == pytest.approx(expected, abs=1e-9)


def test_what_cancels_for_a_typical_stalk_cancels_for_all() -> None:
    """Forces are proportional to all moduli together, as to the scale of the load cell."""
    tests = [rf.override(rf.ramie(14.4, 7.4, 0.67), ["numerics.mesh=screening"])] * 3
    at = np.tile(AT_MM, (3, 1))
    blocks = Blocks.of(["A", "B", "C"], len(AT_MM))
    data = Observed(at, np.ones_like(at), np.ones(3), blocks)
    predictor, scale = Predictor(tests, data, Formula()), rf.EFFECTS["load_scale"]
    used = factors(tests[0])
    own = np.array([[0.4, 0.1, 0.2, -0.2], np.zeros(4), [-0.3, -0.2, -0.1, 0.1]])
    found = predictor.linearise(Model(used, own), {scale.name: scale})
    by_scale = found.by_effects[scale.name]
    # the finite differences are a hundredth
    assert np.allclose(found.by_common.sum(axis=1), by_scale, rtol=0.01)
    assert np.allclose(found.by_own.sum(axis=1), found.force, rtol=0.01)
    assert np.allclose(found.by_own[1], found.by_common[1])
    shares = found.by_common / by_scale[:, None]
    assert np.allclose(shares, shares[1], rtol=1e-6)  # whatever a stalk's own factors


def test_only_specimens_that_are_far_from_their_fit_move(
    screening: rf.BendingTest, dataset: SimpleNamespace, springs: Springs
) -> None:
    at = np.tile(AT_MM, (3, 1))
    data = Observed(at, at, at.max(axis=1), Blocks.of(["A", "B", "C"], len(AT_MM)))
    fitter = Fitter(dataset, data, Predictor([screening] * 3, data, springs))
    here = Model(factors(screening, ["xylem.axial"]), np.array([[0.1], [0.2], [0.3]]))
    for fitted, whole, expected in (
        ([0.15, 0.5, 0.25], [0, 1, 2], [0.1, 0.5, 0.3]),
        ([0.15, 0.5, 0.25], [0, 2], [0.1, 0.2, 0.3]),  # the one that is far is broken
    ):
        fit = SimpleNamespace(
            log_factors=np.array(fitted)[:, None], evidence=SimpleNamespace(whole=whole)
        )
        moved = fitter._move(here, fit, {}, {})
        assert moved.model.log_factors[:, 0] == pytest.approx(expected)


def test_factors_that_turn_back_go_half_as_far(
    screening: rf.BendingTest, dataset: SimpleNamespace, springs: Springs
) -> None:
    """Whole steps of the first would go to and fro between 0.1 and 0.4 for ever."""
    at = np.tile(AT_MM, (2, 1))
    data = Observed(at, at, at.max(axis=1), Blocks.of(["A", "B"], len(AT_MM)))
    fitter = Fitter(dataset, data, Predictor([screening] * 2, data, springs))
    model, visited = Model(factors(screening, ["xylem.axial"]), np.array([[0.1], [0.1]])), []
    for _ in range(5):
        turning = 0.5 - model.log_factors[0, 0]  # linearised where it is, it fits there
        fit = SimpleNamespace(
            log_factors=np.array([[turning], [1.3]]), evidence=SimpleNamespace(whole=[0, 1])
        )
        model = fitter._move(model, fit, {}, {}).model
        visited.append(model.log_factors[:, 0])
    first, second = np.transpose(visited)
    assert first == pytest.approx([0.4, 0.25, 0.25, 0.25, 0.25])
    assert second == pytest.approx([0.6, 1.1, 1.3, 1.3, 1.3])  # half a unit at most


class Softening(Springs):
    """Springs of which damage takes the more, the stiffer the xylem is."""

    def map(self, tasks: list) -> list[Done[pd.DataFrame]]:
        found = []
        for task, done in zip(tasks, super().map(tasks), strict=True):
            damage = task.test.stalk.layers[0].material.large_strain.fibre_damage
            share = 1.0 - 0.6 * damage * axial_modulus_MPa(task.test) / self._modulus_MPa
            curve = done.result().set_index("displacement_mm")
            found.append(Done((share * curve).reset_index()))
        return found


def test_amplitudes_that_turn_back_stop_where_they_would_stay(
    screening: rf.BendingTest, dataset: SimpleNamespace, springs: Springs
) -> None:
    """Whole steps, 2.5 times too long, would go to and fro around 0.3 for ever."""
    damage = rf.EFFECTS["fibre_damage"]
    data = Observed(AT_MM[None], AT_MM[None], AT_MM[-1:], Blocks.of(["A"], len(AT_MM)))
    runs = Softening(springs._stiffness, springs._modulus_MPa)
    fitter = Fitter(dataset, data, Predictor([screening], data, runs))
    model, visited = Model(factors(screening, ["xylem.axial"]), np.zeros((1, 1))), []
    for _ in range(4):
        start = model.amplitude(damage.name)
        fit = SimpleNamespace(
            log_factors=np.zeros((1, 1)),
            evidence=SimpleNamespace(whole=[0]),
            sd=lambda name: 0.01,
        )
        added = {damage.name: (damage, start - 2.5 * (start - 0.3))}
        model = fitter._move(model, fit, added, {}).model
        visited.append(model.amplitude(damage.name))
    assert visited == pytest.approx([0.5, 0.3, 0.3, 0.3])  # the typical amplitude at most


def test_a_fit_that_moves_on_keeps_what_simulating_all_curves_has_shown(
    screening: rf.BendingTest, dataset: SimpleNamespace, springs: Springs
) -> None:
    """One stalk stands for all three, which is wrong by several per cent for the other two.

    What damage takes changes by a quarter at most in the move: the amplitude grows by a tenth, and
    the moduli shrink by 0.15. What was found before must be right but for that share.
    """
    at, damage = np.tile(AT_MM, (3, 1)), rf.EFFECTS["fibre_damage"]
    data = Observed(at, at, at.max(axis=1), Blocks.of(["A", "B", "C"], len(AT_MM)))
    runs = Softening(springs._stiffness, springs._modulus_MPa)
    predictor = Predictor([screening] * 3, data, runs)
    fitter = Fitter(dataset, data, predictor)
    used, own = factors(screening, ["xylem.axial"]), np.array([[-0.2], [0.0], [0.2]])
    model = Model(used, own, {damage.name: (damage, 0.5)})
    fit = SimpleNamespace(
        log_factors=1.1 * own - 0.15,
        evidence=SimpleNamespace(whole=[0, 1, 2]),
        amplitudes={damage.name: 0.55},
        sd=lambda name: 0.01,
    )
    errors = []
    for curves in (
        predictor.linearise(model, {}),
        fitter.confirm(predictor.linearise(model, {}), 0.0),
    ):
        moved = fitter.move(Fitted(curves, fit), {damage.name: damage})
        assert moved.model.amplitude(damage.name) == 0.55
        exact = predictor.confirm(moved).force
        errors.append(np.abs(moved.force / exact - 1.0).max())
    assert errors[0] > 0.04
    assert errors[1] < 0.25 * errors[0]


def test_effects_that_have_no_meaning_are_refused_by_name(
    screening: rf.BendingTest, springs: Springs
) -> None:
    solid = rf.override(screening, ["stalk.void_diameter_mm=0"])
    predictor = Predictor([solid], observed(AT_MM), springs)
    model = Model(factors(solid, ["xylem.axial"]), np.zeros((1, 1)))
    suspects = {name: rf.EFFECTS[name] for name in ("seating_gap", "eccentric_void")}
    found = predictor.linearise(model, suspects)
    assert list(found.by_effects) == ["seating_gap"]
    assert "there is no void to move" in found.refused["eccentric_void"]


def test_an_effect_that_cannot_be_applied_twice_has_a_derivative(tmp_path: Path) -> None:
    """A void that pith fills cannot be filled again."""
    make_dataset(tmp_path / "data", [], 1, Formula(), specimens=2)
    dataset = rf.read_dataset(tmp_path / "data")
    predictor = Predictor([record.test for record in dataset.records], observe(dataset), Formula())
    pith, used = rf.EFFECTS["pith_core"], factors(dataset.baseline, dataset.layout.fit)
    model = Model(used, np.zeros((2, len(used))), {"pith_core": (pith, 0.1)})
    curves = predictor.linearise(model, {"pith_core": pith})
    assert not curves.refused
    assert np.isfinite(curves.by_effects["pith_core"]).all()


def test_where_the_typical_size_is_too_much_less_is_tried(
    screening: rf.BendingTest, springs: Springs
) -> None:
    gap = rf.EFFECTS["seating_gap"]

    def apply(test: rf.BendingTest, amount: float) -> rf.BendingTest:
        if amount > 0.3 * gap.typical:
            raise rf.SpecificationError("gap", amount, "must be smaller")
        return gap.apply(test, amount)

    predictor = Predictor([screening], observed(AT_MM), springs)
    model = Model(factors(screening, ["xylem.axial"]), np.zeros((1, 1)))
    narrow = dataclasses.replace(gap, name="narrow", apply=apply)
    found = predictor.linearise(model, {"seating_gap": gap, "narrow": narrow})
    assert not found.refused
    by_gap, by_narrow = (found.by_effects[name][:, 1:] for name in ("seating_gap", "narrow"))
    assert by_narrow == pytest.approx(by_gap, rel=1e-6)  # any step is exact on a straight line


@pytest.mark.slow
def test_signatures_are_what_the_typical_amplitudes_change(screening: rf.BendingTest) -> None:
    """Most of these changes are not in proportion to the amplitude.

    The tolerance is for the finer meshes, which change all forces by a few per cent, and for
    interpolation between steps. The derivative by friction would miss by more than its largest
    change.
    """
    test = rf.override(screening, ["protocol.travel_mm=9"])
    names = ("span_error", "friction", "fibre_damage", "curved_stalk")
    effects = {name: rf.EFFECTS[name] for name in names}
    evidence = predicted_evidence([test], effects, 0.1, rf.Runs())
    at = test.protocol.travel_mm * np.arange(1.0, POINTS + 1.0) / POINTS

    def force(test: rf.BendingTest) -> np.ndarray:
        curve = rf.simulate(test, MPI.COMM_SELF).curve
        return np.interp(at, curve["displacement_mm"], curve["force_N"])

    before = force(test)
    for name, effect in effects.items():
        expected = (force(effect.apply(test, effect.typical)) - before) / before.max()
        found = effect.typical * evidence.suspects[name].signature[0]
        assert found == pytest.approx(expected, abs=0.2 * np.abs(expected).max()), name


class SofterMeshes:
    """Stand-in for `Runs` in which finer meshes lower the force, by a share that grows."""

    SHARES = (0.0, 0.01, 0.015)

    def __init__(self, mesh: rf.MeshRecipe) -> None:
        self._meshes = (mesh, finer(mesh), finer(finer(mesh)))
        self.refined: set[float] = set()

    def map(self, tasks: list) -> list[Done[pd.DataFrame]]:
        u, curves = np.linspace(0.0, 12.0, 241), []
        for task in tasks:
            refined = self._meshes.index(task.test.numerics.mesh)
            if refined:
                self.refined.add(task.test.fixture.span_mm)
            force = u * (1.0 - self.SHARES[refined] * u)
            slopes = {factor.name: force for factor in task.factors}
            curves.append(Done(pd.DataFrame({"displacement_mm": u, "force_N": force, **slopes})))
        return curves


def test_finer_meshes_may_be_simulated_for_the_first_test_only(screening: rf.BendingTest) -> None:
    """They change the second, of twice the travel, as the first at half of its displacement."""
    first = rf.override(screening, ["protocol.travel_mm=6"])
    tests = [first, rf.override(first, ["protocol.travel_mm=12", "fixture.span_mm=70"])]
    at = np.stack([AT_MM, 2.0 * AT_MM])
    both = dataclasses.replace(observed(AT_MM), at_mm=at, blocks=Blocks.of(["A", "A"], len(AT_MM)))
    runs = SofterMeshes(screening.numerics.mesh)
    predictor = Predictor(tests, both, runs)
    predictor.share_mesh_changes(Predictor(tests[:1], observed(AT_MM), runs).mesh_changes)
    force = predictor.linearise(Model(factors(first, ["xylem.axial"]), np.zeros((1, 1))), {}).force
    _, fine, finest = SofterMeshes.SHARES
    share = fine + limit()[0] * (finest - fine)
    expected = at * (1.0 - share * AT_MM)
    # the first reading includes forces at less displacement, where changes are not known
    assert force[:, 1:] == pytest.approx(expected[:, 1:], rel=1e-3)
    assert runs.refined == {first.fixture.span_mm}


def test_tasks_go_as_far_as_the_straight_part_that_zeroes(
    screening: rf.BendingTest, springs: Springs
) -> None:
    """This part may extend beyond the compared range, and a toe comes before it."""
    data = observed(AT_MM)
    plain = Predictor([screening], data, springs).task(screening).test.protocol
    assert plain.travel_mm == AT_MM[-1]
    long = dataclasses.replace(data, straight_mm=((0.1, AT_MM[-1] + 1.0),))
    task = Predictor([screening], long, springs).task(screening)
    assert task.test.protocol.travel_mm > AT_MM[-1] + 1.0


@pytest.mark.parametrize(("at", "steady"), [(0.99, True), (0.5, False)])
def test_a_fit_at_its_bound_is_steady_where_it_was_linearised(at: float, steady: bool) -> None:
    """At its bound an amplitude has no standard deviation."""
    fit = SimpleNamespace(
        evidence=SimpleNamespace(whole=[0]),
        log_factors=np.zeros((1, 2)),
        chosen=("fibre_damage",),
        amplitudes={"fibre_damage": 0.99},
        sd=lambda name: 0.0,
    )
    model = SimpleNamespace(
        log_factors=np.zeros((1, 2)), amplitude=lambda name: at, effects={"fibre_damage": None}
    )
    assert Fitted(SimpleNamespace(model=model), fit).steady == steady


SHARES = np.array([[0.7, 0.3], [0.4, 0.6]])
"""Powers of two moduli to which the forces of two stalks are proportional."""


def powers(log_factors: np.ndarray) -> Linearised:
    """Return curves that are products of powers of two moduli, and begin with an offset of 1 N."""
    force = np.exp((SHARES * log_factors).sum(axis=1))[:, None] * np.linspace(0.0, 300.0, 7)
    by_own = SHARES[..., None] * force[:, None]
    none = np.zeros((2, 0, 7))
    model, effects = Model((), log_factors), {"scale": 0.2 * force}
    return Linearised(model, force + 1.0, 0.0 * force, by_own, by_own, none, effects, {})


def test_forces_between_simulations_are_powers_of_the_moduli() -> None:
    """An offset of the load cell is not multiplied where it is all there is.

    Elsewhere it is, though it should not be; the tolerance is what that amounts to.
    """
    here, there = np.zeros((2, 2)), np.array([[0.5, -0.3], [-0.4, 0.6]])
    found, exact = powers(here).at(there, np.arange(2)), powers(there)
    assert found.force[:, 0] == pytest.approx(1.0)
    assert found.force == pytest.approx(exact.force, rel=1e-2)
    assert found.by_own == pytest.approx(exact.by_own, rel=1e-2)
    assert found.by_effects["scale"] == pytest.approx(exact.by_effects["scale"], rel=1e-2)


def test_forces_are_proportional_to_all_moduli_together() -> None:
    force = powers(np.zeros((2, 2))).force - 1.0
    plain = dataclasses.replace(powers(np.zeros((2, 2))), force=force)
    twice = plain.at(np.full((2, 2), np.log(2.0)), np.arange(2))
    assert twice.force == pytest.approx(2.0 * force)
