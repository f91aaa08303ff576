"""A result on one page of HTML that needs no other file."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

from jinja2 import Environment, FileSystemLoader

from ramiefenics.results.manifest import versions
from ramiefenics.results.result import Result
from ramiefenics.results.text import cells

TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
)
TEMPLATES.filters["cells"] = cells


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
