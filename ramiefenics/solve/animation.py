"""Animation of a bending test beside its force curve."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from ramiefenics.results.style import VERMILION
from ramiefenics.solve.figures import curve_figure
from ramiefenics.solve.pictures import check_snapshots, deformed_figure, largest_stress
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import SpecificationError

HEIGHT = 4.5
"""Height of a frame, in hundreds of pixels."""


def animate(result: BendingResult, path: str | Path, seconds: float = 5.0) -> Path:
    """Write an animation of the saved states, all with the same colour scale.

    Parameters
    ----------
    result
        Simulation with saved states, see `Protocol.save_every_mm`.
    path
        File to write, which ends in .gif, or in .mp4, which needs the package imageio[ffmpeg].
    seconds
        Duration; a GIF shows the last state for another second.

    Raises
    ------
    SpecificationError
        If the name ends otherwise, the package is missing, or no state was saved.
    """
    path = Path(path)
    if path.suffix not in (".gif", ".mp4"):
        raise SpecificationError("path", str(path), "must end in .gif or .mp4")
    check_snapshots(result)
    limit = largest_stress(result)
    frames = [_frame(result, number, limit) for number in range(len(result.snapshots))]
    if path.suffix == ".mp4":
        _write_film(path, frames, seconds)
        return path
    # one palette for all frames: that of the last frame, which has the most colours
    palette = Image.fromarray(frames[-1]).quantize(255)
    images = [Image.fromarray(frame).quantize(palette=palette) for frame in frames]
    each = int(1000.0 * seconds / len(frames))
    durations = [each] * (len(frames) - 1) + [each + 1000]  # the last state stays
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0)
    return path


def _write_film(path: Path, frames: list[NDArray[np.uint8]], seconds: float) -> None:
    try:
        imageio = importlib.import_module("imageio.v3")
    except ImportError as error:
        allowed = "must end in .gif, as the package imageio[ffmpeg] is not installed"
        raise SpecificationError("path", str(path), allowed) from error
    imageio.imwrite(path, np.array(frames), fps=len(frames) / seconds)


def _frame(result: BendingResult, number: int, limit: float) -> NDArray[np.uint8]:
    """Return the stalk in a saved state, and the curve with that point marked."""
    figure = curve_figure(result)
    figure.set_size_inches(HEIGHT * 1.2, HEIGHT)
    time_s = result.snapshots[number].time_s
    here = [
        np.interp(time_s, result.curve["time_s"], result.curve[c])
        for c in ("displacement_mm", "force_N")
    ]
    figure.axes[0].plot(*here, "o", color=VERMILION, ms=9)
    stalk = deformed_figure(result, number, limit)
    stalk.set_size_inches(HEIGHT * 1.9, HEIGHT)
    return np.hstack([_pixels(stalk), _pixels(figure)])


def _pixels(figure: Figure) -> NDArray[np.uint8]:
    figure.set_dpi(100)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
