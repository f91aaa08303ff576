"""A result on one page of HTML that needs no other file."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup

from ramiefenics.results.manifest import versions
from ramiefenics.results.result import Result
from ramiefenics.results.text import cells


def grid(data: pd.DataFrame) -> Markup:
    """Return a table."""
    named = cells(data).rename(columns=lambda name: str(name).replace("_", " "))
    with pd.option_context("display.max_colwidth", None):  # long texts as they are
        return Markup(named.to_html(index=False, border=0))


TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
)
TEMPLATES.filters["grid"] = grid


def brief(found: Result) -> str:
    """Return title, findings, overview and notes, as part of a page."""
    return TEMPLATES.get_template("brief.html").render(found=found)


def page(found: Result, pictures: Mapping[str, bytes]) -> str:
    """Return the whole page.

    Parameters
    ----------
    found
        The result.
    pictures
        Its figures as PNG files, by name.
    """
    figures = [
        (base64.b64encode(pictures[name]).decode(), picture.caption)
        for name, picture in found.figures().items()
    ]
    template = TEMPLATES.get_template("page.html")
    return template.render(found=found, figures=figures, versions=versions())
