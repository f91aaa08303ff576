"""Calibration studies: files, runs, and a calibration whose answer is known."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print
from matplotlib import image
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.calibration import posterior
from ramiefenics.calibration.calibrate import calibrate
from ramiefenics.calibration.campaign import run_campaign
from ramiefenics.calibration.responses import response
from ramiefenics.calibration.study import read_study
from ramiefenics.cli import main
from ramiefenics.runs import simulation, store

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

FRICTION = "fixture.friction.dynamic"
POISSON = "stalk.layers.phloem.material.elastic.nu_XY"

STUDY = f"""
title = "Two known numbers"
baseline = "table3"
mesh = "screening"
[design]
kind = "central_composite"
centres = 3
[[factors]]
name = "mu"
keys = ["{FRICTION}"]
low = 0.05
high = 0.15
[[factors]]
name = "nu"
keys = ["{POISSON}"]
low = 0.2
high = 0.4
"""


def forces(test: rf.BendingTest, x: np.ndarray) -> np.ndarray:
    """Return a curve that a quadratic surface reproduces; nu stiffens it, and mu mainly late."""
    mu = test.fixture.friction.dynamic
    nu = test.stalk.layers[-1].material.elastic.nu_XY
    return 10.0 * x * (1.0 + nu + 2.0 * nu**2) + 3.0 * mu * x**2


class Pretended:
    """A simulator that takes no time, counts requests, and fails or stops where it is told to."""

    def __init__(self, as_result: Callable[..., rf.BendingResult]) -> None:
        self.as_result = as_result
        self.asked: list[rf.BendingTest] = []
        self.fails: Callable[[rf.BendingTest], bool] = lambda test: False
        self.stops: Callable[[rf.BendingTest], bool] = lambda test: False

    def __call__(
        self, test: rf.BendingTest, comm: MPI.Comm | None = None, on_step: object = None
    ) -> rf.BendingResult:
        self.asked.append(test)
        if self.fails(test):
            raise RuntimeError("the solver is out of memory")
        end = 5.0 if self.stops(test) else test.protocol.travel_mm
        x = np.linspace(0.0, end, 29)
        return self.as_result(test, x, forces(test, x))


@pytest.fixture(autouse=True)
def _short_chains(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the chains; sampling is tested elsewhere."""
    monkeypatch.setattr(posterior, "STEPS", 200)
    monkeypatch.setattr(posterior, "DISCARDED", 50)


@pytest.fixture
def pretended(
    monkeypatch: pytest.MonkeyPatch, as_result: Callable[..., rf.BendingResult]
) -> Pretended:
    simulator = Pretended(as_result)
    monkeypatch.setattr(simulation, "simulate", simulator)
    return simulator


@pytest.fixture
def threads() -> Executor:
    return ThreadPoolExecutor(2)


def study_file(folder: Path, responses: str, **changes: str) -> Path:
    path, text = folder / "study.toml", STUDY
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text + responses, encoding="utf-8")
    return path


def targets(test: rf.BendingTest, error: float) -> str:
    """Return two forces of a known stalk, as the responses of a study."""
    at = forces(test, np.array([2.0, 14.0]))
    names = ("force_2mm_N", "force_14mm_N")
    return "".join(
        f'[[responses]]\nname = "{name}"\ntarget = {value}\nerror = {error}\n'
        for name, value in zip(names, at, strict=True)
    )


@pytest.fixture
def truth(screening: rf.BendingTest) -> rf.BendingTest:
    return rf.override(screening, [f"{FRICTION}=0.11", f"{POISSON}=0.27"])


def test_a_known_stalk_is_found_again(
    truth: rf.BendingTest, pretended: Pretended, threads: Executor, tmp_path: Path
) -> None:
    study = study_file(tmp_path, targets(truth, 0.02))
    told: list[int] = []
    found = calibrate(study, rf.Runs(tmp_path / "runs", threads, told.append))
    assert found.completed
    assert found.fit is not None
    assert found.fit.optimum.met
    assert found.fit.test.fixture.friction.dynamic == pytest.approx(0.11, abs=2e-4)
    assert found.fit.test.stalk.layers[-1].material.elastic.nu_XY == pytest.approx(0.27, abs=2e-4)
    assert [p.verdict for p in found.fit.profiles] == ["determined", "determined"]
    assert found.fit.confirmation is not None
    assert found.fit.confirmation.test == found.fit.test
    assert sum(told) == len(pretended.asked) == 9 + 1  # the centre runs once; a confirmation
    assert found.campaign.distinct == 9
    assert len(found.runs) == 4 + 4 + 3
    again = calibrate(study, rf.Runs(tmp_path / "runs", threads))
    assert len(pretended.asked) == 10  # nothing was simulated twice
    assert again.campaign.simulated == 0
    pd.testing.assert_frame_equal(again.runs, found.runs)


def test_one_number_leaves_both_parameters_open(
    truth: rf.BendingTest, pretended: Pretended, threads: Executor, tmp_path: Path
) -> None:
    one = targets(truth, 20.0).split("[[responses]]")[2]
    found = calibrate(
        study_file(tmp_path, f"[[responses]]{one}"), rf.Runs(tmp_path / "runs", threads)
    )
    assert found.fit is not None
    # each changes the force at 14 mm by about 30 N to either side of the middle
    assert [p.verdict for p in found.fit.profiles] == ["not determined", "not determined"]
    text = " ".join(found.findings())
    assert "mu is not determined by these data" in text
    assert "One combination of the 2 parameters is determined" in text
    assert " ± 20 N (standard error) and is " in text
    pictured = found.figures()["optimum"]
    assert "1 where the parameters fit" in pictured.caption
    assert "the point of least misfit" in pictured.caption
    assert pictured.figure().axes[-1].get_ylabel() == "Fits"
    values = found.overview()
    assert values is not None
    assert all(text.startswith("(") for text in [*values["95 % low"], *values["95 % high"]])


def test_failing_runs_are_told_and_left_out(
    truth: rf.BendingTest, pretended: Pretended, threads: Executor, tmp_path: Path
) -> None:
    def numbers(test: rf.BendingTest) -> tuple[float, float]:
        return test.fixture.friction.dynamic, test.stalk.layers[-1].material.elastic.nu_XY

    pretended.fails = lambda test: numbers(test)[0] < 0.07 and numbers(test)[1] < 0.25
    pretended.stops = lambda test: numbers(test)[0] > 0.149
    study = study_file(tmp_path, targets(truth, 0.1))
    found = calibrate(study, rf.Runs(tmp_path / "runs", threads))
    assert not found.completed
    endings = found.runs["ending"]
    assert endings[0] == "failed: the solver is out of memory"
    assert (endings == "the void has closed").sum() == 1
    text = " ".join(found.findings())
    assert "Run 1 did not complete: failed: the solver is out of memory." in text
    # the run that stopped at 5 mm still has a force at 2 mm, and none at 14 mm
    assert found.runs["force_2mm_N"].isna().sum() == 1
    assert found.runs["force_14mm_N"].isna().sum() == 2
    assert found.fit is not None
    assert found.fit.test.fixture.friction.dynamic == pytest.approx(0.11, abs=1e-3)
    pretended.fails = lambda test: False
    calibrate(study, rf.Runs(tmp_path / "runs", threads))
    # the failed runs are tried again, and so is the optimum, which they move; all else is kept
    assert len(pretended.asked) == 9 + 1 + 2
    pretended.fails = lambda test: True
    with pytest.raises(rf.SpecificationError, match="runs with force_2mm_N = 0 must be more than"):
        calibrate(study, rf.Runs(tmp_path / "other", threads))


@pytest.mark.parametrize("kind", ["plackett_burman", "latin_hypercube", "sobol"])
def test_other_designs_run_too(
    kind: str, truth: rf.BendingTest, pretended: Pretended, threads: Executor, tmp_path: Path
) -> None:
    study = study_file(tmp_path, '[[responses]]\nname = "max_force_N"\n', central_composite=kind)
    found = calibrate(study, rf.Runs(tmp_path / "runs", threads))
    assert found.fit is None
    assert list(found.surfaces) == ["max_force_N"]
    assert found.findings() == []
    expected = 4 if kind == "plackett_burman" else 20
    assert len(found.runs) == expected
    inside = found.runs["mu"].between(0.05 - 1e-9, 0.15 + 1e-9)
    assert inside.all()
    if kind == "plackett_burman":
        assert found.surfaces["max_force_N"].labels[0] == "constant"


def test_targets_may_come_from_a_data_set(
    truth: rf.BendingTest, pretended: Pretended, threads: Executor, tmp_path: Path
) -> None:
    data = tmp_path / "stalks"
    data.mkdir()
    (data / "dataset.toml").write_text('baseline = "table3"\n')
    generator, x = np.random.default_rng(3), np.linspace(0.0, 14.0, 141)
    names, tops = [f"s{i}" for i in range(8)], []
    for name in names:
        force = forces(truth, x) * generator.normal(1.0, 0.01)
        force[20] += generator.normal(0.0, 0.5)  # the reading at 2 mm
        tops.append([np.interp(2.0, x, force), force.max()])
        pd.DataFrame({"displacement_mm": x, "force_N": force}).to_csv(data / f"{name}.csv")
    table = pd.DataFrame({"specimen": names, "curve": [f"{name}.csv" for name in names]})
    table.to_csv(data / "specimens.csv", index=False)
    responses = "".join(
        f'[[responses]]\nname = "{name}"\ndataset = "stalks"\n'
        for name in ("force_2mm_N", "max_force_N")
    )
    measured = read_study(study_file(tmp_path, responses)).targets()
    assert measured is not None
    assert measured.values == pytest.approx(np.mean(tops, axis=0), rel=1e-4)
    # most of the specimens' scatter is common to both responses, and so is their means' error
    assert measured.covariance == pytest.approx(np.cov(np.array(tops).T) / 8.0, rel=1e-3)
    found = calibrate(tmp_path / "study.toml", rf.Runs(tmp_path / "runs", threads))
    assert found.fit is not None
    assert found.fit.optimum.met


def test_wishes_are_weighed_against_each_other(
    screening: rf.BendingTest, pretended: Pretended, threads: Executor, tmp_path: Path
) -> None:
    # the early force depends mainly on nu, the late one also on mu: a low early and a high late
    # force need the smallest nu and the largest mu
    goals = """
[[responses]]
name = "force_2mm_N"
goal = { kind = "minimum", low = 20.0, high = 40.0 }
[[responses]]
name = "force_14mm_N"
goal = { kind = "maximum", low = 100.0, high = 400.0 }
"""
    path = study_file(tmp_path, goals, **{"centres = 3": 'centres = 3\nalpha = "face"'})
    found = calibrate(path, rf.Runs(tmp_path / "runs", threads))
    assert found.fit is None
    desired = found.desired
    assert desired is not None
    mu, nu = np.meshgrid(np.linspace(0.05, 0.15, 201), np.linspace(0.2, 0.4, 201))
    early, late = (10.0 * x * (1 + nu + 2 * nu**2) + 3.0 * mu * x**2 for x in (2.0, 14.0))
    worth = np.sqrt(np.clip((40 - early) / 20, 0, 1) * np.clip((late - 100) / 300, 0, 1))
    assert desired.desirability == pytest.approx(worth.max(), rel=1e-3)
    best = np.unravel_index(worth.argmax(), worth.shape)
    assert desired.test.fixture.friction.dynamic == pytest.approx(mu[best], abs=1e-3)
    layer = desired.test.stalk.layers[-1]
    assert layer.material.elastic.nu_XY == pytest.approx(nu[best], abs=2e-3)
    out = rf.write_folder(found, tmp_path / "out")
    assert rf.read_test(out / "desirable.toml") == desired.test
    assert (out / "desirability.png").exists()
    check_folder(out)
    check_print(found, f"Most desirable point ({desired.desirability:.3g} of 1)")


def test_responses_of_a_known_curve() -> None:
    # a parabola F = 12 x - x^2, sampled finely: its maximum is 36 at 6
    x = np.linspace(0.0, 10.0, 2001)
    curve = pd.DataFrame({"displacement_mm": x, "force_N": 12.0 * x - x**2})
    assert response("max_force_N").of(curve) == pytest.approx(36.0)
    assert response("displacement_at_max_mm").of(curve) == pytest.approx(6.0)
    ends = [6.0 - np.sqrt(36.0 - force) for force in (3.6, 14.4)]
    assert response("slope_N_per_mm").of(curve) == pytest.approx(10.8 / np.diff(ends)[0], rel=1e-4)
    assert response("force_2.5mm_N").of(curve) == pytest.approx(30.0 - 6.25)
    work = 6.0 * 2.51**2 - 2.51**3 / 3.0
    assert response("energy_2.51mm_Nmm").of(curve) == pytest.approx(work, rel=1e-5)
    assert np.isnan(response("force_11mm_N").of(curve))
    assert np.isnan(response("energy_11mm_Nmm").of(curve))
    for name in ("force_mm_N", "force_4mm_Nmm", "energy_4mm_N", "peak"):
        with pytest.raises(rf.SpecificationError, match="must be one of max_force_N"):
            response(name)


def test_responses_are_those_of_the_result(bent: rf.BendingResult) -> None:
    assert response("max_force_N").of_result(bent) == bent.max_force_N
    assert response("slope_N_per_mm").of_result(bent) == bent.slope_N_per_mm
    assert response("displacement_at_max_mm").of_result(bent) == bent.displacement_at_max_mm


def test_the_published_study_is_that_of_the_paper() -> None:
    study = read_study("table4")
    space = study.space(study.plan())
    runs = study.plan().table(space)
    assert len(runs) == 20  # Table 5
    assert (runs[["X1_coded", "X2_coded", "X3_coded"]] == 0.0).all(axis=1).sum() == 6
    assert [runs[f"X{i}"].min() for i in (1, 2, 3)] == pytest.approx([0.05, 0.2, 0.2])
    assert [runs[f"X{i}"].max() for i in (1, 2, 3)] == pytest.approx([0.15, 0.4, 0.4])
    measured = study.targets()
    assert measured is not None
    assert measured.values == pytest.approx([84.8])
    assert measured.errors == pytest.approx([5.51 / np.sqrt(10.0)], rel=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('baseline = "table3"', 'baseline = "table9"', "test = 'table9' must be one of table3"),
        ("low = 0.05", "low = 0.5", "factors.mu.high = 0.15 must be a number above 0.5"),
        ("high = 0.15", "high = 0.9", "must be at most the static coefficient"),
        (FRICTION, "fixture.friction.rolling", "must be the key of a number"),
        ("centres = 3", "centres = -3", "design.centres = -3 must be a whole number"),
        ("central_composite", "box", "design.kind = 'box' must be one of"),
        ('mesh = "screening"', 'mesh = "rough"', "is not a mesh recipe"),
        ("max_force_N", "peak_N", "response = 'peak_N' must be one of max_force_N"),
        ("target = 100", "target = 100\ndataset = 'd'", "must be left out if there is a target"),
        ("error = 2", "", "error must be given if and only if there is a target"),
        ("error = 2", "error = 0", "error = 0 must be a number above 0"),
        (
            "error = 2",
            'error = 2\ngoal = { kind = "most", low = 1.0, high = 2.0 }',
            "goal.kind = 'most' must be one of 'target', 'maximum', 'minimum'",
        ),
        ('title = "Two', 'model = "cubic"\ntitle = "Two', "model = 'cubic' must be one of"),
        ('title = "Two', 'folder = "x"\ntitle = "Two', "must be left out: it is the folder of"),
    ],
)
def test_bad_studies_end_with_one_sentence(
    old: str,
    new: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    target = '[[responses]]\nname = "max_force_N"\ntarget = 100\nerror = 2\n'
    path = study_file(tmp_path, target)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert run_command(monkeypatch, str(path), "--out", str(tmp_path / "out")) == 2
    told = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("note")]
    assert len(told) == 1
    assert message in told[0]
    assert not (tmp_path / "out").exists()


def run_command(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["ramiefenics", "calibrate", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def test_folder_has_tables_figures_specification_and_report(
    truth: rf.BendingTest, pretended: Pretended, threads: Executor, tmp_path: Path
) -> None:
    found = calibrate(
        study_file(tmp_path, targets(truth, 0.5)), rf.Runs(tmp_path / "runs", threads)
    )
    out = rf.write_folder(found, tmp_path / "out")
    runs = pd.read_csv(out / "runs.csv")
    assert len(runs) == 11
    assert runs["force_2mm_N"].to_numpy() == pytest.approx(found.runs["force_2mm_N"].to_numpy())
    anova = pd.read_csv(out / "anova.csv")
    assert set(anova["response"]) == {"force_2mm_N", "force_14mm_N"}
    good = pd.read_csv(out / "optimum_set.csv")
    limit = good["chi2"][0] + 5.992  # 95 % of two degrees of freedom
    assert (good["chi2"] <= limit).all()
    assert good[["mu", "nu"]].iloc[0].to_numpy() == pytest.approx([0.11, 0.27], abs=2e-3)
    known = pd.read_csv(out / "identifiability.csv").set_index("parameter")
    assert list(known.index) == ["mu", "nu"]
    assert rf.read_test(out / "calibrated.toml") == found.fit.test  # type: ignore[union-attr]
    summary, page = check_folder(out)
    assert summary["optimum"]["targets_met"] is True
    assert summary["design"] == {
        "kind": "central composite",
        "runs": 11,
        "distinct": 9,
        "alpha": pytest.approx(np.sqrt(2.0)),
    }
    assert {"statsmodels", "emcee", "ramiefenics"} <= set(summary["versions"])
    pictures = sorted(path.stem for path in out.glob("*.png"))
    assert len(pictures) == 4 + 3 * 2
    assert page.rows > 40
    check_print(found, f"{found.fit.optimum.predicted[0]:.4g} N at the optimum")
    values = found.overview()
    assert values is not None
    for row, low, high in zip(values.itertuples(), known["low"], known["high"], strict=True):
        assert row.calibrated == pytest.approx(known["optimum"][row.parameter])
        assert (float(row[4]), float(row[5])) == pytest.approx((low, high), rel=1e-3)
    printed = str(found)
    assert printed.index(values["95 % low"][0]) < printed.index(found.findings()[0])
    for name in pictures:
        pixels = image.imread(out / f"{name}.png")[..., :3]
        assert min(pixels.shape[:2]) > 400
        assert 0.1 < np.all(pixels > 0.99, axis=2).mean() < 0.98
    screening_only = study_file(tmp_path, '[[responses]]\nname = "max_force_N"\n')
    rf.write_folder(calibrate(screening_only, rf.Runs(tmp_path / "runs", threads)), out)
    assert not (out / "calibrated.toml").exists()  # old files are removed


@pytest.fixture(scope="module")
def real(coarse: rf.BendingTest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with the real simulator, one second per run."""
    folder = tmp_path_factory.mktemp("real")
    test = rf.override(coarse, ["protocol.travel_mm=1"])
    rf.write_test(test, folder / "coarse.toml")
    text = STUDY.replace('"table3"', '"coarse.toml"').replace('mesh = "screening"\n', "")
    text = text.replace("centres = 3", 'centres = 2\nalpha = "face"')
    text += '[[responses]]\nname = "force_1mm_N"\ntarget = 12\nerror = 0.5\n'
    (folder / "study.toml").write_text(text)
    return folder


def test_an_interrupted_campaign_goes_on_where_it_was(real: Path, tmp_path: Path) -> None:
    study = read_study(real / "study.toml")
    design = study.plan()
    short = rf.override(study.test(), ["protocol.travel_mm=0.3"])
    tests = study.space(design).tests(short, design.coded[[0, 8, 8]])
    before = run_campaign(tests[:1], rf.Runs(tmp_path))
    assert before.simulated == 1
    counts: list[int] = []
    after = run_campaign(tests, rf.Runs(tmp_path, on_done=counts.append))
    assert after.simulated == 1  # the first is kept, and the two centres are the same run
    assert counts == [1, 1]
    assert after.outcomes[1] is after.outcomes[2]
    for outcome in after.outcomes[:2]:
        direct = rf.simulate(outcome.test, MPI.COMM_SELF)
        assert outcome.result is not None
        # to the last bit, in any process, kept or not
        assert outcome.result.curve.equals(direct.curve)
    assert before.outcomes[0].result is not None
    assert after.outcomes[0].result is not None
    assert before.outcomes[0].result.curve.equals(after.outcomes[0].result.curve)


@pytest.mark.slow
def test_command_calibrates_and_bend_goes_on_from_there(
    real: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(store, "RUNS", tmp_path / "runs")
    out = tmp_path / "out"
    assert run_command(monkeypatch, str(real / "study.toml"), "--out", str(out)) == 0
    told = capsys.readouterr().out
    assert "was measured as 12 ± 0.5 N" in told
    assert f"results in {out}" in told.replace("\n", "")
    runs = pd.read_csv(out / "runs.csv")
    test = rf.read_test(out / "calibrated.toml")
    direct = rf.simulate(test, MPI.COMM_SELF)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["optimum"]["simulated_max_force_N"] == pytest.approx(direct.max_force_N)
    # the surface of a smooth response predicts the simulation to a fraction of the runs' range
    predicted = summary["optimum"]["predicted"]["force_1mm_N"]
    assert predicted == pytest.approx(direct.max_force_N, abs=0.05 * np.ptp(runs["force_1mm_N"]))


@pytest.mark.slow
def test_mpi_workers_do_a_campaign(real: Path, tmp_path: Path) -> None:
    script = tmp_path / "campaign.py"
    script.write_text(
        f"""
from pathlib import Path
from mpi4py import MPI
from mpi4py.futures import MPICommExecutor
from ramiefenics import Runs
from ramiefenics.calibration.campaign import run_campaign
from ramiefenics.calibration.study import read_study

with MPICommExecutor(MPI.COMM_WORLD) as pool:
    if pool is not None:  # on the first rank
        study = read_study({str(real / "study.toml")!r})
        design = study.plan()
        tests = study.space(design).tests(study.test(), design.coded[[0, 3, 8]])
        done = run_campaign(tests, Runs(Path({str(tmp_path)!r}) / "runs", pool))
        print(done.simulated, *(f"{{o.result.max_force_N:.9e}}" for o in done.outcomes))
"""
    )
    own = ("OMPI_", "PMIX_", "PRTE_MCA_")
    environment = {key: value for key, value in os.environ.items() if not key.startswith(own)}
    environment |= {
        key: "1" for key in ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM")
    }
    command = ["mpirun", "-n", "2", sys.executable, str(script)]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True, timeout=300
    )
    simulated, *values = done.stdout.split()
    assert simulated == "3"
    study = read_study(real / "study.toml")
    design = study.plan()
    tests = study.space(design).tests(study.test(), design.coded[[0, 3, 8]])
    for test, value in zip(tests, values, strict=True):
        assert float(value) == pytest.approx(rf.simulate(test, MPI.COMM_SELF).max_force_N, rel=1e-8)
