"""A result on one HTML page that needs no other file."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd
from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup, escape

from ramiefenics.results.manifest import versions
from ramiefenics.results.result import Result
from ramiefenics.results.text import cells

NUMBER = re.compile(r"\(?[<>]? ?[-+]?[\d.]*(e[-+]?\d+)?( ?%)?\)?")
"""Cell that is aligned to the right: a number, or nothing."""


def grid(data: pd.DataFrame, name: str = "overview") -> Markup:
    """Return a table as HTML, with numbers aligned to the right.

    Parameters
    ----------
    data
        Content of the table.
    name
        Name of the file to which it can be saved.
    """
    text = cells(data)
    kinds = [' class="number"' * all(map(NUMBER.fullmatch, text[column])) for column in text]
    head = _row("th", [str(column).replace("_", " ") for column in text], kinds)
    body = [_row("td", row, kinds) for row in text.itertuples(index=False)]
    start = f'<div class="grid"><table data-name="{escape(name)}"><thead>{head}</thead><tbody>'
    return Markup("\n".join([start, *body, "</tbody></table></div>"]))


def _row(tag: str, texts: Iterable[str], kinds: Iterable[str]) -> str:
    each = zip(texts, kinds, strict=True)
    return f"<tr>{''.join(f'<{tag}{kind}>{escape(text)}</{tag}>' for text, kind in each)}</tr>"


def title_of(name: str) -> str:
    """Return the name of a table as a title."""
    return name.capitalize().replace("_", " ")


TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
)
TEMPLATES.filters |= {"grid": grid, "title_of": title_of}


def brief(found: Result) -> str:
    """Return title, findings, overview, notes and main figure, as part of a page."""
    main = next(iter(found.figures().values()), None)
    figure = None if main is None else (_base64(main.png()), main.caption)
    return TEMPLATES.get_template("brief.html").render(found=found, figure=figure)


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
    return template.render(found=found, figures=figures, tables=tables, versions=versions())
