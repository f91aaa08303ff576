"""The HTML page of a result: its tables, and its layout on screens."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ramiefenics.results.page import grid, page
from ramiefenics.results.result import Picture, Result, Table

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

MEASURE = """<script>
const button = document.querySelector("button"), heading = document.querySelector("th");
heading.click(); heading.click();
const first = document.querySelector("td").textContent;
document.title = [document.documentElement.scrollWidth <= innerWidth, first, button.textContent];
</script>"""


class Wide(Result):
    """A result with a table wider than any screen, and text that must be escaped or wrapped."""

    title = "A title with <angle brackets> & others"

    def findings(self) -> list[str]:
        return ["one_word_that_is_as_long_as_a_line_of_text_" * 4]

    def numbers(self) -> dict[str, Any]:
        return {}

    def tables(self) -> dict[str, Table]:
        columns = {f"column_{i}": np.arange(3) + i for i in range(40)}
        return {"wide": Table(pd.DataFrame(columns), "Forty columns.")}

    def figures(self) -> dict[str, Picture]:
        white = np.full((200, 3000, 3), 255, dtype=np.uint8)
        return {"strip": Picture(lambda: white, "A strip.")}


def whole() -> str:
    found = Wide()
    return page(found, {name: picture.png() for name, picture in found.figures().items()})


def test_numbers_are_on_the_right_and_text_is_text() -> None:
    data = pd.DataFrame(
        {"force_N": [1.5, np.nan], "low": ["(0.05)", "< 3 %"], "what": ["<b>", "a"]}
    )
    html = str(grid(data, "some"))
    kinds = re.findall(r"<t[hd]( class=\"number\")?>([^<]*)</t[hd]>", html)
    assert [bool(kind) for kind, _ in kinds] == [True, True, False] * 3
    assert [text for _, text in kinds][:3] == ["force N", "low", "what"]
    assert "&lt;b&gt;" in html


def test_page_has_contents_and_asks_for_nothing() -> None:
    html = whole()
    assert 'name="viewport"' in html
    assert "prefers-color-scheme: dark" in html
    assert "@media print" in html
    assert "&lt;angle brackets&gt; &amp; others" in html
    for link in re.findall(r'href="#(\w+)"', html):
        assert f'id="{link}"' in html
    assert "://" not in html


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here")
@pytest.mark.parametrize("width", [500, 1400])
def test_page_fits_the_screen_and_tables_sort(width: int, tmp_path: Path) -> None:
    """Forty columns scroll within their frame; Chromium's narrowest window has 500 pixels."""
    assert CHROMIUM is not None
    file = tmp_path / "page.html"
    file.write_text(whole().replace("</body>", MEASURE + "</body>"))
    options = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}/own"]
    options += [f"--window-size={width},900", "--enable-logging=stderr", "--dump-dom"]
    done = subprocess.run(
        [CHROMIUM, *options, f"file://{file}"], capture_output=True, text=True, timeout=120
    )
    assert "<title>true,2,Save as CSV</title>" in done.stdout
    assert "CONSOLE" not in done.stderr
