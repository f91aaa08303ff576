"""Checks that every folder of results must pass, whatever the study."""

from __future__ import annotations

import json
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pandas as pd

from ramiefenics.results.result import Result
from ramiefenics.results.stored import read_stored

sys.path.append(str(Path(__file__).parents[1] / "docs"))
import results_page


class Page(HTMLParser):
    """Texts, number of table rows, and sources of pictures and links of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.sources: list[str] = []
        self.rows = 0
        self.feed(text)

    def handle_data(self, data: str) -> None:
        self.texts.append(data.strip())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for name, value in attrs if name in ("src", "href")]
        self.sources = [source for source in self.sources if not source.startswith("#")]
        self.rows += tag == "tr"


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


def check_folder(folder: Path, summary: str = "summary.json") -> tuple[dict[str, Any], Page]:
    """Check summary, page and pictures against each other; return summary and page."""
    told = json.loads((folder / summary).read_text(), parse_constant=refuse)
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "://" not in text  # nothing to fetch; base64 may spell "http", but has no colon
    page = Page(text)
    assert len(page.sources) == len(list(folder.glob("*.png")))
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    assert told["findings"]
    assert set(told["findings"]) <= set(page.texts)
    assert {"dolfinx", "ramiefenics"} <= set(told["versions"])
    check_stored(folder, told)
    check_described(folder / summary, told)
    return told, page


def check_described(summary: Path, told: dict[str, Any]) -> None:
    """Check that the reference describes all keys and columns, and no column that is not there."""
    result = told["folder"]["result"]
    for path in (summary, *summary.parent.glob("*.csv")):
        known = results_page.names_in(result, path.name)
        names = list(told if path == summary else pd.read_csv(path, nrows=0))
        strange = [name for name in names if not any(results_page.fits(k, name) for k in known)]
        missing = [k for k in known if not any(results_page.fits(k, name) for name in names)]
        assert not strange, (path.name, strange)
        assert not missing or path == summary, (path.name, missing)


def check_stored(folder: Path, told: dict[str, Any]) -> None:
    """Check that a folder reads back with the same summary, and has figures as vectors."""
    stored = read_stored(folder)
    assert stored.summary() == told
    assert stored.title in repr(stored)
    for table in stored.tables().values():
        assert len(table.data.columns)
    for name, picture in stored.figures().items():
        assert picture.draw().ndim == 3
        vectors = {path.suffix for path in (folder / "figures").glob(f"{name}.*")}
        assert vectors in ({".pdf", ".svg"}, set())  # pictures made of pixels have none


def check_print(found: Result, *numbers: str) -> None:
    """Check that a result prints its findings and the numbers to a terminal and in a notebook."""
    printed, page = repr(found), Page(found._repr_html_())
    assert printed == str(found)
    for text in found.findings():
        assert text in printed
        assert text in page.texts
    assert len(page.sources) == bool(found.figures())
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    for number in numbers:
        assert number in printed
        assert number in " ".join(page.texts)
    assert len(printed.splitlines()) < 60
