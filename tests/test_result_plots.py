"""Figures and films that a result draws."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import Simulate
from matplotlib import rcParams
from matplotlib.figure import Figure
from mpi4py import MPI
from PIL import Image
from typer.testing import CliRunner

from ramiefenics import (
    BendingResult,
    BendingTest,
    Dataset,
    SpecificationError,
    override,
    read_folder,
    simulate,
    style,
    write_folder,
)
from ramiefenics.cli import app
from ramiefenics.measured.layout import Layout
from ramiefenics.measured.raw import RawCurve
from ramiefenics.measured.record import Record
from ramiefenics.solve import animation
from ramiefenics.solve.pictures import deformed_figure, largest_stress

MEASURED = pd.DataFrame({"displacement_mm": [0.0, 5.0, 10.0], "force_N": [0.0, 60.0, 90.0]})


def test_measured_curves_are_drawn_beside_the_simulation(
    bent: BendingResult, tmp_path: Path
) -> None:
    MEASURED.to_csv(tmp_path / "stalk.csv", index=False)
    for measured, number in (
        (MEASURED, 1),
        (tmp_path / "stalk.csv", 1),
        ({"a": MEASURED, "b": 1.1 * MEASURED}, 2),
        ({"a": RawCurve(tmp_path / "a.csv", MEASURED), "b": MEASURED}, 2),  # as of read_raw
        (
            Dataset(
                tmp_path, Layout("table3"), bent.test, (Record("a", "a", bent.test, MEASURED),)
            ),
            1,
        ),
    ):
        axes = bent.plot(measured=measured).axes[0]
        lines = [line.get_xydata() for line in axes.get_lines()]
        assert np.allclose(lines[0], MEASURED)
        assert np.allclose(lines[number], bent.curve[["displacement_mm", "force_N"]])
        legend = axes.get_legend()
        assert legend is not None
        assert [text.get_text() for text in legend.get_texts()] == ["measured", "simulated"]


@pytest.mark.parametrize(
    ("content", "told"),
    [(b"a,b\n1,2\n", "displacement_mm is missing"), (b"\xff\xfe\0", "must be a CSV file")],
)
def test_a_file_that_is_no_curve(
    bent: BendingResult, tmp_path: Path, content: bytes, told: str
) -> None:
    (tmp_path / "stalk.csv").write_bytes(content)
    with pytest.raises(SpecificationError, match=told):
        bent.plot(measured=tmp_path / "stalk.csv")


def test_what_is_no_measured_curve_is_told(bent: BendingResult, tmp_path: Path) -> None:
    text = MEASURED.assign(force_N=["0", "60", "90"])
    for measured, told in (
        (MEASURED.to_numpy(), "measured = '<ndarray>' must be a table with displacement_mm"),
        (MEASURED.rename(columns={"force_N": "F"}), "force_N is missing"),
        ({"a": text}, "must have numbers in the columns displacement_mm and force_N"),
        (tmp_path, r"must be a CSV file; of a folder of measured data pass read_dataset"),
    ):
        with pytest.raises(SpecificationError, match=told):
            bent.plot(measured=measured)  # type: ignore[arg-type]


def test_labels_of_a_section_are_within_the_figure(
    coarse: BendingTest, simulated: Simulate
) -> None:
    """As far from its edge as the layout is to keep them, 0.04 inches."""
    figure = simulated(override(coarse, ["protocol.travel_mm=14"])).plot("section")
    figure.savefig(BytesIO())
    assert figure.axes[0].yaxis.label.get_window_extent().x0 > 0.04 * figure.dpi


def test_any_figure_by_name(bent: BendingResult) -> None:
    assert bent.plot().axes[0].get_ylabel() == "Force (N)"
    assert bent.plot("deformed").axes[0].images
    with pytest.raises(SpecificationError, match="must be one of curve, section, deformed"):
        bent.plot("stress")


def test_film_has_a_frame_for_every_saved_state(bent: BendingResult, tmp_path: Path) -> None:
    short = replace(bent, snapshots=(bent.snapshots[0], bent.snapshots[-1]))
    with Image.open(short.animate(tmp_path / "bend.gif", seconds=2.0)) as film:
        assert film.n_frames == 2  # type: ignore[attr-defined]
        frames = []
        for number in range(2):
            film.seek(number)
            frames.append(np.asarray(film.convert("RGB"), dtype=float))
            assert film.info["duration"] == (1000, 2000)[number]
    halves = [np.abs(frames[1] - frames[0])[:, part] for part in (slice(800), slice(800, None))]
    assert all((half > 50.0).any(axis=2).sum() > 100 for half in halves)  # stalk and mark moved
    with pytest.raises(SpecificationError, match=r"must end in \.gif or \.mp4"):
        bent.animate(tmp_path / "bend.avi")
    with pytest.raises(SpecificationError, match="must be at least 1; of several"):
        replace(bent, snapshots=()).animate(tmp_path / "none.gif")


def test_scene_has_the_stalk_between_its_cylinders(bent: BendingResult) -> None:
    scene = bent.view()
    bounds = [actor.GetBounds() for actor in scene.actors.values()][:-1]  # without the scale
    stalk, *cylinders = bounds
    half = bent.test.stalk.length_mm / 2.0
    assert stalk[4:] == pytest.approx((-half, half), abs=2.0)  # all of it, bent
    assert len(cylinders) == 3
    ends = scene.scalar_bars["Axial stress (MPa)"].GetLookupTable().GetTableRange()
    assert ends == pytest.approx((-largest_stress(bent), largest_stress(bent)))
    width, height = scene.window_size
    assert scene.camera.parallel_scale * width / height > 0.45 * bent.test.stalk.length_mm
    with pytest.raises(SpecificationError, match="must be at least 1; of several"):
        replace(bent, snapshots=()).view()


def test_a_film_draws_the_curve_up_to_the_frame(
    bent: BendingResult, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    drawn: list[Figure] = []
    pixels = animation._pixels

    def keep(figure: Figure, width: int) -> animation.Frame:
        drawn.append(figure)
        return pixels(figure, width)

    monkeypatch.setattr(animation, "_pixels", keep)
    middle = bent.snapshots[len(bent.snapshots) // 2]
    replace(bent, snapshots=(middle,)).animate(tmp_path / "bend.gif")
    whole, *_, before, _ = drawn[1].axes[0].get_lines()
    curve = bent.curve[bent.curve["displacement_mm"] <= middle.travel_mm]
    assert np.allclose(before.get_xydata(), curve[["displacement_mm", "force_N"]])
    assert whole.get_color() == animation.AHEAD
    assert len(whole.get_xydata()) == len(bent.curve)


def test_what_films_and_scenes_need_is_told(
    bent: BendingResult, monkeypatch: pytest.MonkeyPatch, cell: list[str], tmp_path: Path
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    needed = r"package imageio\[ffmpeg\] is not installed, .* part of ramiefenics\[notebook\]"
    with pytest.raises(SpecificationError, match=needed):
        bent.animate(tmp_path / "bend.mp4")
    with pytest.warns(UserWarning, match=r"still picture, .* part of ramiefenics\[notebook\]"):
        bent.view()


def test_states_of_a_result_that_was_read_from_a_folder(
    bent: BendingResult, tmp_path: Path
) -> None:
    read = read_folder(write_folder(bent, tmp_path / "bent"))
    assert isinstance(read, BendingResult)
    for draw in (read.view, lambda: read.animate(tmp_path / "bend.gif")):
        with pytest.raises(SpecificationError, match="read from a folder has none: simulate"):
            draw()


@pytest.mark.filterwarnings("ignore::ramiefenics.SpecificationWarning")
def test_a_film_is_a_part_of_the_result(
    coarse: BendingTest,
    simulated: Simulate,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """So it does not stay beside another result."""
    short = override(coarse, ["protocol.travel_mm=0.5"])
    monkeypatch.setattr("ramiefenics.solve.simulate.simulate", lambda test, **_: simulated(short))
    folder = tmp_path / "out"
    for options, there in ((["--animate"], True), ([], False)):
        done = CliRunner().invoke(app, ["bend", "table3", "--out", str(folder), *options])
        assert done.exit_code == 0, done.output
        assert (folder / "animation.gif").exists() == there
        assert ("animation.gif" in (folder / ".written").read_text().splitlines()) == there


def test_a_simulation_shows_a_bar_in_a_notebook(coarse: BendingTest, cell: list[str]) -> None:
    test = override(coarse, ["protocol.travel_mm=0.5"])
    result = simulate(test, MPI.COMM_SELF)
    end = result.curve.iloc[-1]
    assert cell[0].startswith('<progress value="0" max="')
    assert cell[-1].startswith(f"0.50 mm, {end['force_N']:.1f} N, ")
    shown = len(cell)
    simulate(test, MPI.COMM_SELF, on_step=lambda step: None)
    assert len(cell) == shown
    with ThreadPoolExecutor(1) as pool:
        pool.submit(simulate, test, MPI.COMM_SELF).result()
    assert len(cell) == shown


def test_a_section_names_its_layers_and_the_undeformed_outline(bent: BendingResult) -> None:
    texts = {text.get_text() for text in bent.plot("section").axes[0].texts}
    assert texts == {"xylem", "phloem", "undeformed", "indenter"}


def test_a_picture_of_the_stalk_has_directions_and_their_length(bent: BendingResult) -> None:
    axes = deformed_figure(bent).axes[0]
    assert {text.get_text() for text in axes.texts} == {"X", "Y", "Z", "10 mm each"}
    assert "of travel, force" in axes.get_title("left")
    x, y, z = (line.get_xydata() for line in axes.get_lines())
    assert y[1, 1] < y[0, 1]  # rows of pixels count downwards
    assert np.isclose(y[1, 0], y[0, 0])
    assert z[1, 0] < z[0, 0] < x[1, 0]


def test_figures_of_users_can_have_the_style_of_results() -> None:
    with style():
        assert not rcParams["legend.frameon"]
        assert rcParams["axes.grid"]
    assert rcParams["legend.frameon"]
