"""Order, limit and error of mesh refinement, and the study that measures them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder
from matplotlib import image
from mpi4py import MPI

import ramiefenics as rf
from ramiefenics.cli import main
from ramiefenics.convergence.study import LADDERS
from ramiefenics.runs import KeptRun, SharedRuns, simulation, store
from ramiefenics.solve.quasistatic import Ending
from ramiefenics.solve.result import Statistics

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

CONSTANT = (1.0, 2.0, 4.0, 8.0)
UNEVEN = (0.7, 0.85, 1.3, 2.9)


@pytest.mark.parametrize("sizes", [CONSTANT, UNEVEN])
@pytest.mark.parametrize("order", [0.75, 1.0, 2.0, 3.7])
@pytest.mark.parametrize("constant", [0.3, -0.3])
def test_a_power_law_is_continued_exactly(
    sizes: Sequence[float], order: float, constant: float
) -> None:
    values = [50.0 + constant * h**order for h in sizes]
    found = rf.order_and_limit(sizes, values)
    assert found.behaviour == "converging"
    assert found.order == pytest.approx(order, rel=1e-8)
    assert found.limit == pytest.approx(50.0, rel=1e-10)
    # the index is 1.25 times the remaining error, which is known here
    assert found.gci == pytest.approx(1.25 * abs(values[0] - 50.0) / values[0], rel=1e-7)
    assert found.uncertainty == found.gci


def test_meshes_may_come_in_any_order_and_unit() -> None:
    values = [50.0 + h**1.5 for h in UNEVEN]
    shuffled = [2, 0, 3, 1]
    found = rf.order_and_limit([1e3 * UNEVEN[k] for k in shuffled], [values[k] for k in shuffled])
    assert found.order == pytest.approx(1.5, rel=1e-8)


@pytest.mark.parametrize(
    ("cells", "values", "order", "limit", "change", "gci"),
    [
        ((18000, 8000, 4500), (6.063, 5.972, 5.863), 1.53, 6.1685, 1.5, 2.2),
        ((18000, 4500, 980), (10.7880, 10.7250, 10.6050), 0.75, 10.8801, 0.6, 1.1),
        ((18000, 4500, 980), (6.0042, 5.9624, 6.0909), None, None, 0.7, 0.5),
    ],
)
def test_published_examples(
    cells: Sequence[int],
    values: Sequence[float],
    order: float | None,
    limit: float | None,
    change: float,
    gci: float,
) -> None:
    # Celik et al. (2008), Table 1, in two dimensions, to the digits printed; for the oscillating
    # example they also print an order and a limit
    found = rf.order_and_limit([1.0 / math.sqrt(n) for n in cells], values)
    assert found.behaviour == ("oscillating" if order is None else "converging")
    assert found.order == (order and pytest.approx(order, abs=0.005))
    assert found.limit == (limit and pytest.approx(limit, abs=1e-4))
    assert found.change is not None
    assert 100.0 * found.change == pytest.approx(change, abs=0.05)
    assert found.gci is not None
    assert 100.0 * found.gci == pytest.approx(gci, abs=0.05)


@pytest.mark.parametrize("sizes", [CONSTANT, UNEVEN])
def test_oscillation_gets_no_order_and_an_uncertainty_that_holds(sizes: Sequence[float]) -> None:
    values = [50.0 + (-1) ** k * 0.2 * h**1.5 for k, h in enumerate(sizes)]
    found = rf.order_and_limit(sizes, values)
    assert found.behaviour == "oscillating"
    assert found.order is None
    assert found.limit is None
    assert found.uncertainty is not None
    assert found.uncertainty > abs(values[0] - 50.0) / values[0]


def test_meshes_that_agree_by_accident_get_no_index() -> None:
    found = rf.order_and_limit((1.0, 1.2, 1.5), (94.895, 94.868, 95.477))
    assert found.behaviour == "oscillating"
    assert found.gci is None
    assert found.uncertainty == pytest.approx((95.477 - 94.868) / 2.0 / 94.895)
    found = rf.order_and_limit((1.0, 1.2, 1.5), (94.64, 94.65, 95.36))  # same without a sign change
    assert found.behaviour == "converging"
    assert found.order is not None
    assert found.order > 10.0
    assert found.limit is None
    assert found.gci is None
    assert found.uncertainty == pytest.approx((95.36 - 94.64) / 2.0 / 94.64)


@pytest.mark.parametrize(
    "values",
    [
        (4.0, 2.0, 1.0),  # differences grow
        (1.0, 2.0, 1.5),  # grow with alternating sign
        (3.0, 2.0, 1.0),  # stay the same
        (2.0, 1.0, 1.0),  # appear on the finest mesh
        tuple(h**0.2 for h in (1.0, 2.0, 4.0)),  # hardly shrink
    ],
)
def test_no_order_is_made_up(values: Sequence[float]) -> None:
    found = rf.order_and_limit((1.0, 2.0, 4.0), values)
    assert found.behaviour == "not converging"
    assert found.order is None
    assert found.limit is None
    assert found.gci is None
    assert found.spread == pytest.approx((max(values) - min(values)) / 2.0 / values[0])


def test_differences_must_shrink_by_more_than_the_meshes_ratios_ask() -> None:
    # differences are halved, but so is the logarithm of the ratio: the limit of vanishing order
    assert rf.order_and_limit((1.0, 1.1, 1.1**3), (0.0, 1.0, 3.0)).behaviour == "not converging"


def test_two_meshes_tell_no_order() -> None:
    for sizes, values in (((1.0, 2.0), (3.0, 2.0)), ((1.0, 2.0, 4.0), (math.nan, 3.0, 2.0))):
        found = rf.order_and_limit(sizes, values)
        assert found.behaviour == "too few"
        assert found.order is None
        assert found.change == pytest.approx(1.0 / 3.0)
    assert rf.order_and_limit((1.0, 2.0, 4.0), (7.0, 7.0, 8.0)).behaviour == "unchanged"


@pytest.mark.parametrize("sizes", [(1.0, 2.0, 2.0), (0.0, 1.0, 2.0)])
def test_meshes_of_the_same_size_are_refused(sizes: Sequence[float]) -> None:
    with pytest.raises(ValueError, match="must be positive and all different"):
        rf.order_and_limit(sizes, (1.0, 2.0, 3.0))


class Manufactured(SharedRuns):
    """Instant runs whose curves are ``(10 + 3 h^2) x`` with h the cell size in mm."""

    def __init__(self, ends_at_mm: dict[str, float]) -> None:
        self.ends_at_mm = ends_at_mm

    def has(self, test: rf.BendingTest) -> bool:
        return False

    def run(self, test: rf.BendingTest, on_step: Callable[..., None] | None = None) -> KeptRun:
        mesh, travel = test.numerics.mesh, test.protocol.travel_mm
        cells = 5 * mesh.angular_elements**3
        inner, *_, outer = test.stalk.radii_mm
        volume = math.pi * (outer**2 - inner**2) * test.stalk.length_mm / 4.0  # of a quarter
        end = self.ends_at_mm.get(mesh.name, travel)
        x = np.linspace(0.0, end, 15)
        curve = pd.DataFrame(
            {
                "displacement_mm": x,
                "force_N": (10.0 + 3.0 * (volume / cells) ** (2.0 / 3.0)) * x,
                "min_volume_ratio": 1.0,
                "min_principal_stretch": 1.0,
                "min_acoustic_MPa": 1.0,
            }
        )
        ending = Ending("completed") if end == travel else Ending("physical", "the void has closed")
        statistics = Statistics(3 * cells, cells, len(x) - 1, 30, 60, 0, 1.0, 1)
        return KeptRun(rf.BendingResult(test, curve, (), statistics, ending), 1e-3 * cells)


def test_a_ladder_takes_changes_and_shows_a_bar_in_a_notebook(
    screening: rf.BendingTest, cell: list[str]
) -> None:
    study = rf.converge(screening, 1, 3, Manufactured({}), travel_mm=7.0)
    assert study.test == rf.as_test(screening, travel_mm=7.0)
    assert '<progress value="0" max="1"></progress> compiling' in cell[0]
    assert cell[-1].startswith("ladder_q1_3, ")


def test_a_ladder_of_known_limit(screening: rf.BendingTest) -> None:
    told: list[float] = []
    study = rf.converge(
        screening, 2, runs=Manufactured({}), on_progress=lambda share, _: told.append(share)
    )
    assert list(study.meshes["mesh"]) == list(LADDERS[2])
    assert study.positions_mm == (4.0, 8.0, 14.0)
    expected = {"slope_N_per_mm": 10.0, "force_4mm_N": 40.0, "force_8mm_N": 80.0}
    expected |= {"force_14mm_N": 140.0, "max_force_N": 140.0}
    assert {n: found.limit for n, found in study.quantities.items()} == pytest.approx(expected)
    for name, found in study.quantities.items():
        assert found.order == pytest.approx(2.0)
        slopes = np.diff(np.log(study.errors(name))) / np.diff(np.log(study.meshes["cell_size_mm"]))
        assert slopes == pytest.approx(2.0)
    assert study.completed
    assert study.notes() == []
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)


def test_what_does_not_complete_is_told_and_the_rest_goes_on(screening: rf.BendingTest) -> None:
    test = rf.override(screening, ["protocol.travel_mm=7"])
    study = rf.converge(test, 1, 4, Manufactured({"ladder_q1_4": 5.0}))
    assert study.positions_mm == (2.0, 4.0, 7.0)
    assert not study.completed
    assert study.notes() == ["ladder_q1_4 did not complete the travel: the void has closed"]
    assert study.meshes["force_7mm_N"].isna().tolist() == [False, False, False, True]
    # from the three finest meshes that reached it
    assert study.quantities["force_7mm_N"].limit == pytest.approx(70.0)
    assert study.quantities["force_4mm_N"].limit == pytest.approx(40.0)
    # the force was still rising: its maximum is not known
    assert math.isnan(study.meshes["max_force_N"].iloc[-1])


def run_command(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["ramiefenics", "converge", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def celik_order(cells: Sequence[int], values: Sequence[float]) -> float:
    """Iterate equations (3) of the procedure of Celik et al. (2008); meshes from coarse to fine."""
    r32, r21 = (cells[1] / cells[0]) ** (1 / 3), (cells[2] / cells[1]) ** (1 / 3)
    ratio = (values[0] - values[1]) / (values[1] - values[2])
    s, p = math.copysign(1.0, ratio), 1.0
    for _ in range(1000):
        q = math.log((r21**p - s) / (r32**p - s))
        p = abs(math.log(abs(ratio)) + q) / math.log(r21)
    return p


def test_command_resumes_and_writes_what_it_found(
    screening: rf.BendingTest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    test = rf.override(screening, ["protocol.travel_mm=0.35", "numerics.acoustic_check=false"])
    spec, out = tmp_path / "short.toml", tmp_path / "out"
    rf.write_test(test, spec)
    monkeypatch.setattr(store, "RUNS", tmp_path / "runs")
    arguments = [str(spec), "--order", "1", "--meshes", "3", "--out", str(out)]
    simulate, asked = simulation.simulate, []

    def until_the_third(*given: object) -> rf.BendingResult:
        asked.append(given[0].numerics.mesh.name)
        if asked[-1] == "ladder_q1_3":
            raise KeyboardInterrupt
        return simulate(*given)

    monkeypatch.setattr(simulation, "simulate", until_the_third)
    assert run_command(monkeypatch, *arguments) == 130
    assert "kept: run the command again" in capsys.readouterr().err
    assert not out.exists()

    def only_the_third(*given: object) -> rf.BendingResult:
        assert given[0].numerics.mesh.name == "ladder_q1_3"
        return simulate(*given)

    monkeypatch.setattr(simulation, "simulate", only_the_third)
    assert run_command(monkeypatch, *arguments) == 0
    told = capsys.readouterr().out
    assert all(name in told for name in LADDERS[1][:3])
    assert max(map(len, told.splitlines()[-9:])) <= 120

    meshes = pd.read_csv(out / "convergence.csv")
    assert list(meshes["mesh"]) == list(LADDERS[1][:3])
    assert (meshes[["unknowns", "cells", "newton_iterations", "cpu_s", "wall_s"]] > 0).all(None)
    again = simulate(rf.override(test, ["numerics.mesh=ladder_q1_1"]), MPI.COMM_SELF)
    assert meshes["max_force_N"][0] == pytest.approx(again.max_force_N, rel=1e-7)
    assert meshes["slope_N_per_mm"][0] == pytest.approx(again.slope_N_per_mm, rel=1e-7)
    rows = pd.read_csv(out / "richardson.csv").set_index("quantity")
    forces = ["force_0.1mm_N", "force_0.2mm_N", "force_0.35mm_N"]
    assert list(rows.index) == ["max_force_N", "slope_N_per_mm", *forces]
    for name, row in rows.iterrows():
        if row["behaviour"] == "converging":
            assert row["order"] == pytest.approx(celik_order(meshes["cells"], meshes[name]), 1e-4)
        else:
            assert math.isnan(row["order"])
    summary, page = check_folder(out)
    limit = f"{rows['finest_value']['max_force_N']:.5g} N on the finest mesh"
    assert f"Maximum force: {limit}" in told
    assert f"Maximum force: {limit}" in " ".join(page.texts)
    assert summary["meshes"]["ladder_q1_2"]["dofs"] == meshes["unknowns"][1]
    assert {"dolfinx", "ramiefenics"} <= set(summary["versions"])
    assert rf.read_test(out / "specification.toml") == test
    for name in ("curves", "error"):
        pixels = image.imread(out / f"{name}.png")[..., :3]
        assert min(pixels.shape[:2]) > 400
        assert 0.2 < np.all(pixels > 0.99, axis=2).mean() < 0.98

    def never(*_: object) -> None:
        raise AssertionError("nothing is left to simulate")

    monkeypatch.setattr(simulation, "simulate", never)
    before = (out / "convergence.csv").read_bytes()
    assert run_command(monkeypatch, *arguments) == 0
    assert (out / "convergence.csv").read_bytes() == before
    assert run_command(monkeypatch, *arguments, "--jobs", "2") == 0  # the same runs serve
    assert (out / "convergence.csv").read_bytes() == before  # times included


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--order", "3"], "order = 3 must be 1 or 2"),
        (["--meshes", "2"], "meshes = 2 must be between 3 and 5"),
        (["--meshes", "6"], "meshes = 6 must be between 3 and 5"),
        (["--set", "numerics.mesh=fine"], "must leave the mesh to the ladder"),
        (["--set", "protocol.travel_mm=-1"], "protocol.travel_mm = -1 must be a number above 0 mm"),
        (["--law", "isotropic"], "stalk.layers.xylem.material"),
    ],
)
def test_bad_commands_end_with_one_sentence(
    options: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run_command(monkeypatch, "table3", "--out", str(tmp_path / "out"), *options) == 2
    told = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("note")]
    assert len(told) == 1
    assert message in told[0]
    assert not (tmp_path / "out").exists()


def test_results_are_kept_by_content(coarse: rf.BendingTest, tmp_path: Path) -> None:
    test = rf.override(coarse, ["protocol.travel_mm=0.5"])
    runs = SharedRuns(MPI.COMM_SELF, tmp_path)
    assert not runs.has(test)
    first = runs.run(test)
    assert runs.has(test)
    assert not runs.has(rf.override(test, ["protocol.travel_mm=0.6"]))
    again = runs.run(test)
    assert again.cpu_s == first.cpu_s > 0.0
    assert again.result.statistics == first.result.statistics
    pd.testing.assert_frame_equal(again.result.curve, first.result.curve)
    simulated = rf.simulate(test, MPI.COMM_SELF)
    pd.testing.assert_frame_equal(first.result.curve, simulated.curve)
    assert again.result.losses_mm == simulated.losses_mm
