"""A result on one HTML page that needs no other file."""

from __future__ import annotations

import base64
import dataclasses
import re
from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup, escape

from ramiefenics.results.manifest import versions
from ramiefenics.results.result import Result
from ramiefenics.results.text import cells, label_of, unspoken, words_of
from ramiefenics.specification import BendingTest
from ramiefenics.specification.files import dump_test

NUMBER = re.compile(r"\(?[<>]? ?[-+]?[\d.]*(e[-+]?\d+)?( ?%)?\)?")
"""Cell that is aligned to the right: a number, or nothing."""

PLAIN = re.compile(r"-?\d+(\.\d+)?")
"""Number without an exponent."""

SHORT = 24
"""Number of characters up to which the cells of a column are kept in one line."""

WIDE = 12
"""Number of columns beyond which headings are upright when printed."""


def grid(data: pd.DataFrame, name: str = "overview", digits: int = 8) -> Markup:
    """Return a table as HTML, with numbers aligned at their decimal points.

    Parameters
    ----------
    data
        Content of the table.
    name
        Name of the file to which it can be saved.
    digits
        Significant digits of numbers in that file.
    """
    text = cells(data).replace({"True": "yes", "False": "no"})
    saved = cells(unspoken(data), digits)
    columns = [
        _column(str(name), str(kept), text.iloc[:, k].to_list(), saved.iloc[:, k].to_list())
        for k, (name, kept) in enumerate(zip(text, saved, strict=True))
    ]
    rows = list(zip(*columns, strict=True)) or [()]  # a table may have no columns
    head, *body = (f"<tr>{''.join(row)}</tr>" for row in rows)
    told = f'data-name="{escape(name)}" style="--columns: {len(columns)}"'
    kind = ' class="wide"' if len(columns) > WIDE else ""
    start = f'<div class="grid"><table{kind} {told}><thead>{head}</thead><tbody>'
    return Markup("\n".join([start, *body, "</tbody></table></div>"]))


def _column(name: str, kept: str, texts: list[str], saved: list[str]) -> list[str]:
    """Return heading and cells of a column, each with the text in the file where it differs."""
    number = all(map(NUMBER.fullmatch, texts))
    kind = "number" if number else "short" if all(len(text) <= SHORT for text in texts) else ""
    tails = [_tail(text) if number else 0.0 for text in texts]
    made = [_cell("th", words_of(name), {"scope": "col", "data-name": kept}, kind)]
    for text, value, tail in zip(texts, saved, tails, strict=True):
        told = {"data-value": value} if value != text else {}
        if number and tail < max(tails) and PLAIN.fullmatch(text):
            told["style"] = f"--tail: {max(tails) - tail:g}"
        made.append(_cell("td", text, told, kind))
    return made


def _tail(text: str) -> float:
    """Return the width of a plain number from its decimal point on, in digits."""
    point = text.find(".")
    return len(text) - point - 0.5 if point >= 0 and PLAIN.fullmatch(text) else 0.0


def _cell(tag: str, text: str, attributes: Mapping[str, str], kind: str) -> str:
    shown = {"class": kind} if kind else {}
    right = {"align": "right"} if kind == "number" else {}
    told = {**shown, **right, **attributes}
    listed = "".join(f' {name}="{escape(value)}"' for name, value in told.items())
    return f"<{tag}{listed}>{escape(text)}</{tag}>"


def subject(found: Result) -> str:
    """Return what a result is about, in one line; empty if it has no specification of its own."""
    test = found.specifications().get("specification")
    if test is None:
        return ""
    stalk = test.stalk
    layers = ", ".join(layer.name for layer in stalk.layers)
    return (
        f"Stalk of {stalk.outer_diameter_mm:.4g} mm in diameter and {stalk.length_mm:.4g} mm in "
        f"length ({layers}), law {Path(test.law).name}, mesh {test.numerics.mesh.name}"
    )


def _toml(test: BendingTest) -> str:
    """Return a test as the file beside the page has it, whose law is in the same folder."""
    return dump_test(dataclasses.replace(test, law=Path(test.law).name))


TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
)
TEMPLATES.filters |= {"grid": grid, "title_of": label_of, "toml": _toml}


def brief(found: Result) -> str:
    """Return title, findings, overview, notes and main figure, as part of a notebook."""
    main = next(iter(found.figures().values()), None)
    figure = None if main is None else (_base64(main.png()), main.caption)
    html = TEMPLATES.get_template("brief.html").render(found=found, figure=figure, level=3)
    return f'<div style="overflow-x: auto">\n{html}</div>\n'


def _base64(png: bytes) -> str:
    return base64.b64encode(png).decode()


def page(found: Result, pictures: Mapping[str, bytes]) -> str:
    """Return the whole page of a result.

    Parameters
    ----------
    found
        The result.
    pictures
        Its figures as PNG files, by name.
    """
    figures = [
        (_base64(pictures[name]), picture.caption) for name, picture in found.figures().items()
    ]
    tables = {name: table for name, table in found.tables().items() if table.caption}
    template = TEMPLATES.get_template("page.html")
    return template.render(
        found=found,
        subject=subject(found),
        figures=figures,
        tables=tables,
        versions=versions(),
        level=1,
    )
