"""A run's folder: everything is written beside it first, then moved in."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from matplotlib.image import imsave

from ramiefenics.results.fields import write_fields
from ramiefenics.results.figures import curve_figure, section_figure
from ramiefenics.results.manifest import summarise
from ramiefenics.results.pictures import deformed_picture
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import write_test


def write_folder(result: BendingResult, folder: str | Path) -> Path:
    """Write curve, summary, specification, fields and pictures of a run.

    Files of an earlier run in that folder are replaced; nothing appears half-written.

    Parameters
    ----------
    result
        The run, from rank 0.
    folder
        Where to; made if it does not exist.

    Returns
    -------
    Path
        The folder.
    """
    folder = Path(folder)
    with drafting(folder) as draft:
        result.curve.to_csv(draft / "curve.csv", index=False, float_format="%.8g")
        summary = json.dumps(summarise(result), indent=2)
        (draft / "summary.json").write_text(summary + "\n", encoding="utf-8")
        write_test(result.test, draft / "specification.toml")
        curve_figure(result).savefig(draft / "curve.png")
        if result.snapshots:
            write_fields(result.snapshots, draft / "fields")
            section_figure(result).savefig(draft / "section.png")
            imsave(draft / "deformed.png", deformed_picture(result))
    return folder


@contextmanager
def drafting(folder: Path) -> Iterator[Path]:
    """Give a folder to write to, and move what is in it into `folder` once all has been written."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".writing-", dir=folder) as name:
        yield Path(name)
        for made in sorted(Path(name).iterdir()):
            place = folder / made.name
            if place.is_dir():
                shutil.rmtree(place)
            made.replace(place)
