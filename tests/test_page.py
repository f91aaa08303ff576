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

import ramiefenics as rf
from ramiefenics.results.page import grid, page
from ramiefenics.results.result import Picture, Result, Table
from ramiefenics.results.text import words_of

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

MEASURE = """<script>
const button = document.querySelector("button"), heading = document.querySelector("th");
heading.click(); heading.click();
const first = document.querySelector("td").textContent;
document.title = [document.documentElement.scrollWidth <= innerWidth, first, button.textContent];
</script>"""


SAVE = """<pre id="saved"></pre><script>
URL.createObjectURL = (blob) => {
  blob.text().then((text) => { document.querySelector("#saved").textContent = text; });
  return "#";
};
document.querySelector("button").click();
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
        columns["column_9"] = np.arange(3) + 1 / 3
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
    kinds = re.findall(r"<t[hd]( class=\"number\" align=\"right\")?[^>]*>([^<]*)</t[hd]>", html)
    assert [bool(kind) for kind, _ in kinds] == [True, True, False] * 3
    assert [text for _, text in kinds][:3] == ["force (N)", "low", "what"]
    assert "&lt;b&gt;" in html


def test_a_table_is_saved_with_the_digits_and_names_of_its_file() -> None:
    data = pd.DataFrame({"force_N": [115.73728, 2.0], "held": [True, False], "why": ["=1", "a"]})
    html = str(grid(data, "some"))
    assert 'scope="col" data-name="force_N">force (N)</th>' in html
    assert 'data-value="115.73728">115.7</td>' in html
    assert 'data-value="True">yes</td>' in html
    assert 'data-value="&#39;=1">=1</td>' in html
    assert html.count("data-value") == 4  # both of the bools


def test_an_empty_table_has_no_cells() -> None:
    assert "<thead><tr></tr></thead>" in grid(pd.DataFrame())


def test_decimal_points_are_below_each_other() -> None:
    html = str(grid(pd.DataFrame({"force_N": [9.348, 13.51, 110.0, 1e-9]})))
    shifts = re.findall(r'<td class="number" align="right"( style="[^"]*")?>([^<]*)</td>', html)
    assert [text for _, text in shifts] == ["9.348", "13.51", "110", "1e-09"]
    assert [shift for shift, _ in shifts] == ["", ' style="--tail: 1"', ' style="--tail: 3.5"', ""]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("slope_N_per_mm", "slope (N/mm)"),
        ("indenter_work_Nmm", "indenter work (N mm)"),
        ("cpu_s", "CPU (s)"),
        ("f_value", "F value"),
        ("error_percent", "error (%)"),
        ("min_volume_ratio", "min volume ratio"),
        ("s", "s"),
    ],
)
def test_units_of_headings_are_in_brackets(name: str, words: str) -> None:
    assert words_of(name) == words


def test_page_names_the_stalk_and_holds_its_specification(screening: rf.BendingTest) -> None:
    class Told(Wide):
        def specifications(self) -> dict[str, rf.BendingTest]:
            return {"specification": screening}

    html = page(Told(), {"strip": b""})
    title = "Stalk of 14.23 mm in diameter and 180 mm in length (xylem, phloem)"
    assert title in re.findall("<title>(.*)</title>", html)[0]
    assert f"<p>{title}" in html
    assert "span_mm = 100.0" in html
    assert "<h2>Figures</h2>" in html


def test_a_notebook_shows_a_small_title_and_scrolls_what_is_wide() -> None:
    html = Wide()._repr_html_()
    assert html.startswith('<div style="overflow-x: auto">\n<h3>A title')


def test_page_has_contents_and_asks_for_nothing() -> None:
    html = whole()
    assert 'name="viewport"' in html
    assert "prefers-color-scheme: dark" in html
    assert "@media print" in html
    assert "&lt;angle brackets&gt; &amp; others" in html
    for link in re.findall(r'href="#(\w+)"', html):
        assert f'id="{link}"' in html
    assert "://" not in html


def measured(html: str, width: int, folder: Path) -> str:
    """Return what Chromium makes of a page that measures itself; its errors are checked."""
    assert CHROMIUM is not None
    file = folder / "page.html"
    file.write_text(html.replace("</body>", MEASURE + "</body>"))
    options = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/own"]
    options += [f"--window-size={width},900", "--enable-logging=stderr", "--dump-dom"]
    done = subprocess.run(
        [CHROMIUM, *options, f"file://{file}"], capture_output=True, text=True, timeout=120
    )
    assert "CONSOLE" not in done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here")
@pytest.mark.parametrize("width", [500, 1400])
def test_page_fits_the_screen_and_tables_sort(width: int, tmp_path: Path) -> None:
    """Forty columns scroll within their frame; Chromium's narrowest window has 500 pixels."""
    assert "<title>true,2,Save as CSV</title>" in measured(whole(), width, tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here")
def test_page_fits_the_paper(tmp_path: Path) -> None:
    """Printed tables have no frame; between its margins, A4 has 1032 pixels across."""
    assert "size: A4 landscape; margin: 12mm" in whole()
    printed = whole().replace("@media print", "@media all")
    assert "<title>true,2," in measured(printed, 1032, tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here")
def test_a_saved_table_is_that_of_its_file(tmp_path: Path) -> None:
    saved = whole().replace("</body>", SAVE + "</body>")
    text = measured(saved, 1400, tmp_path)
    assert '"column_8","column_9","column_10"' in text
    assert '"8","0.33333333","10"' in text
