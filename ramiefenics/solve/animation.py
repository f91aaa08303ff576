"""Animation of a bending test beside its force curve."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from ramiefenics.results.style import BLUE, VERMILION
from ramiefenics.solve.figures import curve_figure
from ramiefenics.solve.pictures import check_snapshots, deformed_figure, largest_stress
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import SpecificationError

Frame = NDArray[np.uint8]
"""Pixels of shape (height, width, 3)."""

HEIGHT, STALK_WIDTH, CURVE_WIDTH = 448, 880, 528
"""Pixels of a frame and its two parts; those of the frame are multiples of 16, as films need."""

AHEAD = "#d0d0d0"
"""Colour of the part of the curve that is still to come."""


def animate(result: BendingResult, path: str | Path, seconds: float = 5.0) -> Path:
    """Write an animation of the saved states, all with the same colour scale.

    There is one frame for each saved state. A smoother film takes more of them: simulate with a
    smaller ``protocol.save_every_mm``, for instance ``simulate("table3", save_every_mm=0.25)``.

    Parameters
    ----------
    result
        Simulation with saved states.
    path
        File to write, which ends in .gif, or in .mp4, which needs the package imageio[ffmpeg], a
        part of ramiefenics[notebook].
    seconds
        Duration; a GIF shows the last state for another second.

    Raises
    ------
    SpecificationError
        If the name ends otherwise, the package is missing, or no state was saved.
    """
    path = Path(path)
    if path.suffix not in WRITERS:
        raise SpecificationError("path", str(path), f"must end in {' or '.join(WRITERS)}")
    if path.suffix == ".mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        allowed = (
            "must end in .gif, as the package imageio[ffmpeg] is not installed, which is a part of "
            "ramiefenics[notebook]"
        )
        raise SpecificationError("path", str(path), allowed)
    check_snapshots(result)
    limit = largest_stress(result)
    frames = [_frame(result, number, limit) for number in range(len(result.snapshots))]
    WRITERS[path.suffix](path, frames, seconds)
    return path


def _write_gif(path: Path, frames: Sequence[Frame], seconds: float) -> None:
    # one palette for all frames: that of the last frame, which has the most colours
    palette = Image.fromarray(frames[-1]).quantize(255)
    images = [Image.fromarray(frame).quantize(palette=palette) for frame in frames]
    each = int(1000.0 * seconds / len(frames))
    durations = [each] * (len(frames) - 1) + [each + 1000]  # the last state stays
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0)


def _write_mp4(path: Path, frames: Sequence[Frame], seconds: float) -> None:
    imageio = importlib.import_module("imageio.v3")
    imageio.imwrite(path, np.array(frames), fps=len(frames) / seconds)


WRITERS = {".gif": _write_gif, ".mp4": _write_mp4}
"""Functions that write frames to a file, by the end of its name."""


def _frame(result: BendingResult, number: int, limit_MPa: float) -> Frame:
    """Return the stalk in a saved state, and the curve, which is grey beyond that point."""
    curve, time_s = result.curve, result.snapshots[number].time_s
    columns = curve[["displacement_mm", "force_N"]].to_numpy()
    here = [np.interp(time_s, curve["time_s"], column) for column in columns.T]
    before = np.vstack([columns[curve["time_s"] < time_s], here])
    figure = curve_figure(result)
    axes = figure.axes[0]
    axes.get_lines()[0].set_color(AHEAD)  # the whole curve
    axes.plot(*before.T, "o-", color=BLUE, ms=3.5, lw=1.5)
    axes.plot(*here, "o", color=VERMILION, ms=9)
    stalk = deformed_figure(result, number, limit_MPa)
    return np.hstack([_pixels(stalk, STALK_WIDTH), _pixels(figure, CURVE_WIDTH)])


def _pixels(figure: Figure, width: int) -> Frame:
    figure.set_dpi(100)
    figure.set_size_inches(width / 100, HEIGHT / 100)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
