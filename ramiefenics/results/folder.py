"""Writing of a result to a folder."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

from ramiefenics.results.draft import draft
from ramiefenics.results.page import page
from ramiefenics.results.result import Result
from ramiefenics.results.text import unspoken
from ramiefenics.specification.files import archive_test


def write_folder(
    found: Result, folder: str | Path, more: Callable[[Path], object] | None = None
) -> Path:
    """Write tables, figures, specifications, summary and page of a result.

    Tables, figures and specifications become CSV, PNG and TOML files with their names, and figures
    also PDF and SVG files in ``figures``. The summary is a JSON file with all that is needed to
    repeat the study, and the page, ``report.html``, needs no other file. The user's own Python
    files that the result was made with are copied, too. All files replace an earlier result in that
    folder at once.

    Parameters
    ----------
    found
        Result of a simulation or of a study; for a simulation on several ranks, that on rank 0.
    folder
        Folder to write to; created if it does not exist.
    more
        Writes further files to the folder that it is called with. They count as part of the result:
        ``lambda made: result.animate(made / "film.gif")``.

    Returns
    -------
    Path
        The folder.
    """
    folder = Path(folder)
    with draft(folder) as made:
        summary = found.summary()
        place = made / summary["folder"]["place"]
        place.mkdir(exist_ok=True)
        for name, table in found.tables().items():
            digits = f"%.{table.digits}g"
            unspoken(table.data).to_csv(place / f"{name}.csv", index=False, float_format=digits)
        for name, test in found.specifications().items():
            archive_test(test, place / f"{name}.toml")
        for path in found.user_files():
            shutil.copy(path, place)
        pictures = {name: picture.files() for name, picture in found.figures().items()}
        for name, files in pictures.items():
            for end, content in files.items():
                folder_of = place if end == "png" else place / "figures"
                folder_of.mkdir(exist_ok=True)
                (folder_of / f"{name}.{end}").write_bytes(content)
        text = json.dumps(summary, indent=2, allow_nan=False)
        (place / summary["folder"]["summary"]).write_text(text + "\n", encoding="utf-8")
        (place / "report.html").write_text(
            page(found, {k: v["png"] for k, v in pictures.items()}), encoding="utf-8"
        )
        found.write_more(made)
        if more is not None:
            more(made)
    return folder
