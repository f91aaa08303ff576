"""The folder of any result."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from ramiefenics.results.draft import draft
from ramiefenics.results.page import page
from ramiefenics.results.result import Result
from ramiefenics.results.text import unspoken
from ramiefenics.specification.files import archive_test


def write_folder(found: Result, folder: str | Path) -> Path:
    """Write tables, figures, specifications, summary and page of a result.

    They are CSV, PNG and TOML files by name, figures as PDF and SVG in ``figures``, a JSON file
    with all that is needed to repeat it, and ``report.html``, which needs no other file; besides,
    the Python files of the user's own that it was made with. They take the place of an earlier
    result in that folder, all at once.

    Parameters
    ----------
    found
        The result of a simulation or of a study; of a simulation on several ranks, on rank 0.
    folder
        Where to; made if it does not exist.

    Returns
    -------
    Path
        The folder.
    """
    folder = Path(folder)
    with draft(folder) as made:
        place = made / found.PLACE
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
        summary = json.dumps(found.summary(), indent=2, allow_nan=False)
        (place / found.SUMMARY).write_text(summary + "\n", encoding="utf-8")
        (place / "report.html").write_text(
            page(found, {k: v["png"] for k, v in pictures.items()}), encoding="utf-8"
        )
        found.write_more(made)
    return folder
