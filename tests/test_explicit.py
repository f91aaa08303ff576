"""The bending test with inertia: drive, friction, mass, energies, and the quasi-static limit."""

from __future__ import annotations

import os
import re
import signal
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from dolfinx import fem
from folders import check_folder
from matplotlib import image
from mpi4py import MPI

from ramiefenics import BendingTest, override, read_test, simulate, simulate_explicitly, write_test
from ramiefenics.cli import main
from ramiefenics.model.bending import BendingProblem
from ramiefenics.model.equations import Equations, Term
from ramiefenics.solve.central_differences import CentralDifferences
from ramiefenics.solve.explicit import SmoothStart
from ramiefenics.solve.explicit_result import Point
from ramiefenics.solve.mass import lumped_mass


def forces(problem: BendingProblem, term: Term) -> np.ndarray:
    """Return the forces that a term exerts on all components."""
    found = np.zeros(len(problem.displacement.x.array))
    term.add_forces(found)
    return found


@pytest.fixture(scope="module")
def quick(coarse: BendingTest) -> BendingTest:
    """A test that is far too fast, but takes only a second or two."""
    changes = ["protocol.travel_mm=0.4", "numerics.explicit.duration_s=0.001"]
    return override(coarse, changes)


def test_indenter_starts_smoothly_and_arrives() -> None:
    start = SmoothStart(travel_mm=14.0, duration_s=0.1, ramp=0.2)
    time = np.linspace(0.0, 0.1, 100_001)
    travel = np.array([start.travel(t) for t in time])
    speed = np.gradient(travel, time)
    x = np.minimum(time / 0.02, 1.0)
    exact = start.speed_mm_per_s * (10 * x**3 - 15 * x**4 + 6 * x**5)
    assert speed[1:-1] == pytest.approx(exact[1:-1], abs=1e-6 * start.speed_mm_per_s)
    assert travel[0] == 0.0
    assert travel[-1] == pytest.approx(14.0, rel=1e-12)


def sliding(problem: BendingProblem, travel: float) -> None:
    """Move the stalk with the indenter, pressed in by 0.01 mm, and slip it along Z."""
    shift = (0.0, 0.01 - travel, 0.04 * travel)
    problem.displacement.interpolate(lambda x: np.outer(shift, x[0] ** 0))


def test_friction_of_many_small_steps_is_that_of_long_ones(coarse: BendingTest) -> None:
    """Steady slip of 0.04 of the travel, in steps of 0.2 mm and of a hundredth of that."""
    length, end, parts = 0.2, 4.0, 100
    problems = [BendingProblem(coarse, MPI.COMM_SELF) for _ in range(2)]
    for problem, step in zip(problems, (length, length / parts), strict=True):
        sliding(problem, 0.0)
        problem.contact.advance()
        for number in range(1, round(end / step) + 1):
            problem.place(step, step)
            sliding(problem, number * step)
            if number < round(end / step):
                problem.contact.advance()
    expected, found = (forces(problem, problem.terms[1]) for problem in problems)
    along = expected.reshape(-1, 3)[:, 2]
    assert np.abs(along).max() > 0.1 * np.abs(expected).max()  # there is friction
    # a slip of 0.8 presliding lengths in a short step is resolved to 1e-3 of that length
    assert found == pytest.approx(expected, abs=5e-3 * np.abs(along).max())
    works = [p.contact.sums()[0].friction_work_Nmm for p in problems]
    assert works[1] == pytest.approx(works[0], rel=2e-2)


def test_parts_of_the_residual_add_up(coarse: BendingTest) -> None:
    problem = BendingProblem(coarse, MPI.COMM_SELF)
    sliding(problem, 0.3)
    problem.displacement.x.array[::7] += 0.02
    total = problem.displacement.x.petsc_vec.duplicate()
    Equations(problem.displacement, problem.terms, []).residual(total)
    whole, parts = total.array, [forces(problem, term) for term in problem.terms]
    assert sum(parts) == pytest.approx(whole, abs=1e-10 * np.abs(whole).max())
    assert min(np.abs(part).max() for part in parts[:2]) > 0.0  # the void is open


@pytest.mark.parametrize("order", [1, 2])
def test_lumped_mass_is_positive_and_whole(coarse: BendingTest, order: int) -> None:
    """Second-order elements have no inner nodes, and their row sums would be negative."""
    changes = [
        f"numerics.mesh.order={order}",
        f"numerics.mesh.serendipity={str(order == 2).lower()}",
    ]
    problem = BendingProblem(override(coarse, changes), MPI.COMM_SELF)
    mass = lumped_mass(problem)
    assert mass.min() > 0.0
    matrix = fem.assemble_matrix(problem.mass).to_dense()
    rows = matrix.sum(axis=1)
    assert bool(rows.min() > 0.0) is (order == 1)
    assert mass.reshape(-1, 3).sum(axis=0) == pytest.approx(rows.sum() / 3, rel=1e-10)


def test_scaled_mass_is_a_test_so_much_faster(quick: BendingTest) -> None:
    """Without rate effects only the duration over the root of the mass factor matters."""
    slow = override(
        quick, ["numerics.explicit.mass_factor=9", "numerics.explicit.duration_s=0.003"]
    )
    fast, scaled = (simulate_explicitly(test, MPI.COMM_SELF) for test in (quick, slow))
    assert fast.completed
    assert scaled.statistics.steps == fast.statistics.steps
    assert scaled.statistics.mass_g == pytest.approx(9 * fast.statistics.mass_g)
    assert scaled.statistics.added_mass_g == pytest.approx(8 * fast.statistics.mass_g)
    same = [name for name in fast.curve if not name.startswith("time")]
    expected = pytest.approx(fast.curve[same].to_numpy(), rel=1e-3, abs=1e-6, nan_ok=True)
    assert scaled.curve[same].to_numpy() == expected
    assert fast.statistics.evaluations < 1.2 * fast.statistics.steps


def test_energy_that_appears_ends_the_run(
    quick: BendingTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = CentralDifferences.longest_step
    monkeypatch.setattr(CentralDifferences, "longest_step", lambda self: 1.2 * true(self))
    result = simulate_explicitly(quick, MPI.COMM_SELF)
    assert result.ending.kind == "energy"
    assert "appeared at" in result.ending.reason
    assert not result.completed
    assert result.curve["displacement_mm"].iloc[-1] < 0.4


@pytest.mark.mpi
def test_ranks_do_not_matter(quick: BendingTest) -> None:
    alone, shared = (simulate_explicitly(quick, c) for c in (MPI.COMM_SELF, MPI.COMM_WORLD))
    assert shared.completed
    names = ["displacement_mm", "force_N", "support_force_N", "kinetic_energy_Nmm"]
    # the time step is estimated from random vectors, which differ between ranks
    expected = pytest.approx(alone.curve[names].to_numpy(), rel=0.02, abs=0.01)
    assert shared.curve[names].to_numpy() == expected


@pytest.mark.slow
def test_slow_test_is_quasi_static(coarse: BendingTest) -> None:
    """The curves with and without inertia agree, as the energies imply."""
    changes = ["numerics.stepping.max_step_mm=0.25", "numerics.stepping.first_step_mm=0.25"]
    static = simulate(override(coarse, changes), MPI.COMM_SELF)
    result = simulate_explicitly(
        override(coarse, ["numerics.explicit.duration_s=0.03"]), MPI.COMM_SELF
    )
    assert result.completed
    peak, anywhere = result.differences(static.curve)
    assert abs(peak) < 0.03
    assert anywhere < 0.05
    curve = result.curve
    assert result.energy_error < 0.05
    late = curve[curve["displacement_mm"] > 1.5]
    assert (late["kinetic_energy_Nmm"] < 0.05 * late["stored_energy_Nmm"]).all()
    spent = static.curve.iloc[-1]
    assert curve["stored_energy_Nmm"].iloc[-1] == pytest.approx(
        spent["stored_energy_Nmm"], rel=0.03
    )
    # without drag the stalk oscillates, and the friction work is a third smaller
    assert curve["friction_work_Nmm"].iloc[-1] == pytest.approx(
        spent["friction_work_Nmm"], rel=0.05
    )


def arguments(test: BendingTest, folder: Path, *more: str) -> list[str]:
    write_test(test, folder / "test.toml")
    out = ["--out", str(folder / "out")]
    return ["ramiefenics", "explicit", str(folder / "test.toml"), *out, *more]


def test_command_writes_the_folder_and_reports(
    quick: BendingTest,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.argv", arguments(quick, tmp_path))
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    told = capsys.readouterr().out
    assert "largest force" in told
    assert "note: not quasi-static" in told
    out = tmp_path / "out"
    assert read_test(out / "specification.toml") == quick
    curve, static = (pd.read_csv(out / f"{name}.csv") for name in ("curve", "implicit"))
    summary, page = check_folder(out)
    assert f"The largest force is {summary['max_force_N']:.2f} N" in " ".join(page.texts)
    assert summary["max_force_N"] == pytest.approx(curve["force_N"].max())
    assert summary["implicit_max_force_N"] == pytest.approx(static["force_N"].max())
    assert summary["quasi_static"] is False
    # the force integrated over the travel is the work
    work = np.trapezoid(curve["force_N"], curve["displacement_mm"])
    assert work == pytest.approx(curve["indenter_work_Nmm"].iloc[-1], rel=0.1)
    assert image.imread(out / "explicit.png").std() > 0.05


@pytest.mark.parametrize(
    ("assignment", "sentence"),
    [
        ("numerics.explicit.duration_s=0", "numerics.explicit.duration_s = 0 must be .* above 0 s"),
        ("numerics.explicit.mass_factor=0.5", "mass_factor = 0.5 must be a number at least 1"),
        ("numerics.explicit.step_share=1.1", "step_share = 1.1 must be .* at most 1"),
        ("numerics.explicit.ramp=0", "ramp = 0 must be .* above 0"),
        ("numerics.explicit.durations=1", "durations = 1 .*nearest .*'duration_s'"),
        ("numerics.explicit=fast", "numerics.explicit = 'fast' must be a table"),
    ],
)
def test_bad_settings_get_one_sentence(
    assignment: str,
    sentence: str,
    quick: BendingTest,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.argv", arguments(quick, tmp_path, "--set", assignment))
    with pytest.raises(SystemExit) as stop:
        main()
    told = capsys.readouterr().err
    assert stop.value.code == 2
    assert re.search(sentence, told)
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_interrupt_keeps_the_curve(quick: BendingTest) -> None:
    assert threading.current_thread() is threading.main_thread()
    points: list[Point] = []

    def interrupt_at_second(point: Point) -> None:
        points.append(point)
        if len(points) == 3:
            os.kill(os.getpid(), signal.SIGINT)

    result = simulate_explicitly(quick, MPI.COMM_SELF, on_point=interrupt_at_second)
    assert result.ending.kind == "interrupted"
    assert len(result.curve) == len(points) == 4
    assert points[2].travel_mm < points[3].travel_mm < points[2].travel_mm + 0.1


def test_files_without_the_table_take_its_defaults(
    coarse: BendingTest, tmp_path: Path, change: Callable[..., BendingTest]
) -> None:
    path = tmp_path / "old.toml"
    write_test(coarse, path)
    text = path.read_text()
    start = text.index("[numerics.explicit]")
    end = text.find("\n[", start + 1)
    path.write_text(text[:start] + (text[end + 1 :] if end > 0 else ""))
    assert read_test(path) == coarse
