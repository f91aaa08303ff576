"""Every verification study holds, and the tools that the studies use are correct."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from folders import check_folder, check_print

from ramiefenics import write_folder
from ramiefenics.verification import STUDIES, Check, Plot, Series, Study, StudyTask, Verification
from ramiefenics.verification.beam import LayeredTube
from ramiefenics.verification.figures import plot_figure
from ramiefenics.verification.study import at_least, at_most, near, observed_orders

pytestmark = pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")

QUICK = {"constants", "locking", "pinned", "sliding", "tangent"}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in QUICK else [pytest.mark.slow]) for n in STUDIES]
)
def test_study_holds(name: str) -> None:
    study = STUDIES[name]()
    assert study.checks
    for check in study.checks:
        assert check.passed, f"{check.what}: {check.value}, {check.limits}"


@pytest.mark.parametrize("hollow", [0.1, 0.5, 0.9])
def test_shear_stiffness_of_one_layer_is_cowpers(hollow: float) -> None:
    """Cowper (1966): it is 6 (1 + m^2)^2 / (7 (1 + m^2)^2 + 20 m^2) for a tube with nu = 0."""
    tube = LayeredTube((hollow, 1.0), (100.0,), (7.0,))
    square = (1 + hollow**2) ** 2
    coefficient = 6 * square / (7 * square + 20 * hollow**2)
    area = np.pi * (1 - hollow**2)
    assert tube.shear_N == pytest.approx(coefficient * 7.0 * area, rel=1e-4)  # numerical quadrature


def test_shear_stiffness_does_not_feel_a_cut_within_one_material() -> None:
    one = LayeredTube((0.4, 1.0), (100.0,), (7.0,))
    two = LayeredTube((0.4, 0.7, 1.0), (100.0, 100.0), (7.0, 7.0))
    assert two.shear_N == pytest.approx(one.shear_N, rel=1e-4)
    assert two.bending_Nmm2 == pytest.approx(one.bending_Nmm2)


def test_checks_keep_their_limits() -> None:
    assert near("x", 1.01, 1.0, 0.02, "").passed
    assert not near("x", -1.03, -1.0, 0.02, "").passed
    assert at_most("x", 1.0, 1.0, "").passed
    assert not at_least("x", 0.9, 1.0, "").passed
    assert not at_most("x", float("nan"), 1.0, "").passed


def test_orders_of_a_power_law() -> None:
    sizes = np.array([0.4, 0.2, 0.05])
    assert observed_orders(list(sizes), list(3 * sizes**2.5)) == pytest.approx([2.5, 2.5])


def test_report_tells_what_fails(tmp_path: Path) -> None:
    failed = Check("a claim", 3.0, 0.0, 1.0, "reason")
    plot = Plot("x (mm)", "y (N)", (Series("one", [1.0, 2.0], [1.0, 4.0]),), log=True)
    table = pd.DataFrame({"a (mm)": [1.5, float("nan")]})
    found = Verification({"s": Study("A title", "Text.", (failed,), table, plot)})
    write_folder(found, tmp_path)
    text = (tmp_path / "verification.md").read_text()
    summary, page = check_folder(tmp_path / "verification")
    assert summary["completed"] is False
    assert "reason" in page.texts
    check_print(found, "FAILS  A title: a claim 3, 0 to 1")
    assert "| [s](#a-title) | a claim | 3 | 0 to 1 | reason | **no** |" in text
    assert "| 1.5 |\n|  |" in text
    assert (tmp_path / "verification" / "s.png").read_bytes().startswith(b"\x89PNG")


def test_a_study_is_the_same_after_it_was_kept() -> None:
    table = pd.DataFrame({"case": ["a", "b"], "x (mm)": [1, 2], "y": np.array([0.1, np.nan])})
    plot = Plot("x", "y", (Series("one", np.array([1.0, 1 / 3]), table["x (mm)"], slope=2.0),))
    study = Study("A title", "Text.", (at_least("c", float(np.float32(0.1)), 0.0, "why"),), table)
    with pytest.MonkeyPatch.context() as patched:
        patched.setitem(STUDIES, "new", lambda: replace(study, plot=plot))
        task = StudyTask("new")
        again = task.read(task.compute())
    assert again.checks == study.checks
    assert again.plot is not None
    assert [*again.plot.series[0].x] == [1.0, 1 / 3]
    assert [*again.plot.series[0].y] == [1, 2]
    pd.testing.assert_frame_equal(again.table, table)


def verify(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "ramiefenics", "verify", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_command_writes_the_report(tmp_path: Path) -> None:
    done = verify("tangent", "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert "holds  Tangent: last observed order" in done.stdout
    page = (tmp_path / "out" / "verification.md").read_text()
    assert page.startswith("# Tangent\n\nVersions: ")
    assert "Every claim of the solver" not in page
    assert "convergence.md" not in page


def test_page_of_all_studies_has_an_introduction() -> None:
    passed = Check("a claim", 0.5, 0.0, 1.0, "reason")
    found = Verification({name: Study(name, "Text.", (passed,)) for name in STUDIES})
    assert found.title == "Verification"
    assert found.markdown().startswith("# Verification\n\nEvery claim of the solver, with the ")
    assert "## tangent\n" in found.markdown()


def test_unknown_study_ends_with_one_sentence(tmp_path: Path) -> None:
    done = verify("tangents", "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert re.search(r"studies = 'tangents' must be one of constants, ", done.stderr)
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_logarithmic_plot_has_the_slope_of_theory_and_few_ticks() -> None:
    sizes = np.array([0.5, 0.25, 0.125])
    series = (Series("a", sizes, 3.0 * sizes**2, slope=2), Series("b", sizes, sizes**2, slope=2))
    axes = plot_figure(Plot("size (mm)", "error", series, log=True)).axes[0]
    assert axes.get_xlabel() == "Size (mm)"
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in axes.get_lines()}
    assert list(lines)[:3] == ["a", "b", "slope 2"]  # which is named only once
    assert np.allclose(lines["slope 2"], lines["a"])
    axes.figure.canvas.draw()
    ticks = [text.get_text() for text in axes.get_xticklabels(which="both") if text.get_text()]
    assert {"0.2", "0.5"} <= set(ticks)
    assert not any("times" in text for text in ticks)


def test_curves_that_coincide_are_both_seen() -> None:
    series = (Series("a", (0, 1), (1, 1)), Series("b", (0, 1), (1, 1)))
    axes = plot_figure(Plot("x", "y", series, note="Nowhere: c")).axes[0]
    assert len({line.get_linestyle() for line in axes.get_lines()}) == 2
    assert axes.get_title("left") == "Nowhere: c"
