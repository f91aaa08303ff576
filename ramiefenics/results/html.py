"""Pages of HTML that need no other file."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

STYLE = """body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto;
padding: 0 1rem; color: #222 } table { border-collapse: collapse } th, td { padding: .2rem .8rem;
text-align: left; border-bottom: 1px solid #ccc } img { max-width: 100% }
.lead { font-size: 1.2rem } .wide { overflow-x: auto }
figure { margin: 1.5rem 0 } figcaption { color: #555 }"""


def page(title: str, body: str) -> str:
    """Return a page; the title is text, the body HTML."""
    title = html.escape(title)
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style></head>
<body><h1>{title}</h1>
{body}
</body></html>
"""


def figure(picture: Path, caption: str) -> str:
    """Return a PNG file with its caption, the picture inside."""
    data = base64.b64encode(picture.read_bytes()).decode()
    caption = html.escape(caption)
    return (
        f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a table of texts."""

    def line(cells: Sequence[Any], tag: str) -> str:
        return "".join(f"<{tag}>{html.escape(str(cell))}</{tag}>" for cell in cells)

    body = "".join(f"<tr>{line(row, 'td')}</tr>" for row in rows)
    return f'<div class="wide"><table><tr>{line(head, "th")}</tr>{body}</table></div>'


def frame(data: pd.DataFrame, digits: int = 4) -> str:
    """Return a table of numbers to so many digits; what is NaN stays empty."""

    def cell(value: Any) -> str:
        if isinstance(value, float):
            return "" if value != value else f"{value:.{digits}g}"  # NaN is not itself
        return str(value)

    rows = [[cell(value) for value in row] for row in data.itertuples(index=False)]
    return table([str(column).replace("_", " ") for column in data.columns], rows)
