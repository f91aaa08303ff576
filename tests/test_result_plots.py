"""Figures and films that a result draws."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from ramiefenics import BendingResult, SpecificationError

MEASURED = pd.DataFrame({"displacement_mm": [0.0, 5.0, 10.0], "force_N": [0.0, 60.0, 90.0]})


def test_measured_curves_are_drawn_beside_the_simulation(
    bent: BendingResult, tmp_path: Path
) -> None:
    MEASURED.to_csv(tmp_path / "stalk.csv", index=False)
    for measured, number in (
        (MEASURED, 1),
        (tmp_path / "stalk.csv", 1),
        ({"a": MEASURED, "b": 1.1 * MEASURED}, 2),
    ):
        axes = bent.plot(measured=measured).axes[0]
        lines = [line.get_xydata() for line in axes.get_lines()]
        assert np.allclose(lines[0], MEASURED)
        assert np.allclose(lines[number], bent.curve[["displacement_mm", "force_N"]])
        legend = axes.get_legend()
        assert legend is not None
        assert [text.get_text() for text in legend.get_texts()] == ["measured"]


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
    with pytest.raises(SpecificationError, match="must be at least 1; of several"):
        replace(bent, snapshots=()).view()
