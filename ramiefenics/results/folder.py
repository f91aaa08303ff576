"""The folder of a run: curve, summary, specification, fields, pictures."""

from __future__ import annotations

import json
from pathlib import Path

from matplotlib.image import imsave

from ramiefenics.results.draft import draft
from ramiefenics.results.fields import write_fields
from ramiefenics.results.figures import curve_figure, section_figure
from ramiefenics.results.manifest import summarise
from ramiefenics.results.pictures import deformed_picture
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import write_test


def write_folder(result: BendingResult, folder: str | Path) -> Path:
    """Write curve, summary, specification, fields and pictures of a run.

    They take the place of an earlier result in that folder, all at once.

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
    with draft(folder) as made:
        result.curve.to_csv(made / "curve.csv", index=False, float_format="%.8g")
        summary = json.dumps(summarise(result), indent=2)
        (made / "summary.json").write_text(summary + "\n", encoding="utf-8")
        write_test(result.test, made / "specification.toml")
        curve_figure(result).savefig(made / "curve.png")
        if result.snapshots:
            write_fields(result.snapshots, made / "fields")
            section_figure(result).savefig(made / "section.png")
            imsave(made / "deformed.png", deformed_picture(result))
    return folder
