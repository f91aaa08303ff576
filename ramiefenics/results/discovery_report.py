"""A discovery on one page of HTML that needs no other file."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ramiefenics.discovery import Discovery
from ramiefenics.results.discovery_findings import with_space
from ramiefenics.results.html import figure, page, table

CAPTIONS = {
    "residual": "What the fit of the factors leaves, before and after. Grey: specimens. "
    "Dashed: what is put down to mesh and simulator.",
    "suspects": "How much more probable each suspect makes the data, its amplitude fitted.",
    "left_out": "Each specimen predicted from all others.",
}


def report(found: Discovery, verdict: Mapping[str, Any], pictures: Sequence[Path]) -> str:
    """Return the page.

    Parameters
    ----------
    found
        The discovery.
    verdict
        Its summary.
    pictures
        PNG files, named as in `CAPTIONS`.
    """
    figures = "".join(figure(picture, CAPTIONS[picture.stem]) for picture in pictures)
    told = "".join(f'<p class="lead">{html.escape(text)}</p>' for text in verdict["findings"])
    mesh = html.escape(verdict["mesh"])
    factors = table(("factor", "value", "over sd"), _factor_rows(found))
    body = f"""{told}
{figures}
<h2>Suspects</h2>{_suspects(found)}
<h2>Fitted factors, mean of the specimens</h2>{factors}
<p>Specimens scatter by {100 * verdict["scatter"]["tau"]:.0f} % in each factor; the noise is
{100 * verdict["scatter"]["sigma"]:.2g} % of the peak force. {len(verdict["specimens"])} specimens,
{verdict["range_mm"][0]:g} to {verdict["range_mm"][1]:g} mm. Forces on the mesh recipe {mesh} are
corrected by up to {100 * verdict["mesh_correction"]:+.1f} % of the peak, as a finer mesh shows; of
what the fit leaves, up to {100 * verdict["put_down_to_simulator"]:+.1f} % is put down to mesh and
simulator.</p>
<h2>Made with</h2>{table(("program", "version"), list(verdict["versions"].items()))}"""
    return page(found.dataset.layout.title or found.dataset.folder.name, body)


def _suspects(found: Discovery) -> str:
    rows = []
    gains = {name: -1.0 if s.gain is None else s.gain for name, s in found.scores.items()}
    for name in sorted(gains, key=lambda key: -gains[key]):
        score, effect = found.scores[name], found.effects[name]
        if score.gain is None:
            rows.append((name, "", f"not tested: {score.reason}", effect.physics))
        else:
            size = f"{score.amplitude:.3g} ± {score.error:.2g}{with_space(effect.unit)}"
            note = f" ({score.reason})" if score.reason else ""
            text = f"{effect.physics} {effect.reference}."
            rows.append((name, f"{score.gain:.1f}", size + note, text))
    return table(("suspect", "log-likelihood gained", "amplitude", "physics"), rows)


def _factor_rows(found: Discovery) -> list[tuple[str, str, str]]:
    sd = found.dataset.layout.fit_sd
    return [(n, f"{math.exp(sd * m):.3f}", f"{m:+.1f}") for n, m in found.factor_moves.items()]
