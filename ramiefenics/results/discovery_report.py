"""A discovery on one page of HTML that needs no other file."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ramiefenics.discovery import Discovery
from ramiefenics.discovery.verdict import Gain
from ramiefenics.results.html import figure, page, table

CAPTIONS = {
    "residual": "What the fit of the common parameters leaves, before and after. Grey: specimens. "
    "Dashed: what other meshes, and the simulator's own error, may account for.",
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
    body = f"""<p class="lead">{html.escape(sentence(found, verdict))}</p>
{figures}
<h2>Suspects</h2>{_suspects(found)}
<h2>Fitted common factors</h2>{table(("factor", "value"), _factor_rows(verdict))}
<p>Specimens scatter by {100 * verdict["scatter"]["tau"]:.0f} % in each factor; the noise is
{100 * verdict["scatter"]["sigma"]:.2g} % of the peak force. {len(verdict["specimens"])} specimens,
{verdict["range_mm"][0]:g} to {verdict["range_mm"][1]:g} mm, mesh recipe
{html.escape(verdict["mesh"])}.</p>
<h2>Made with</h2>{table(("program", "version"), list(verdict["versions"].items()))}"""
    return page(found.dataset.layout.title or found.dataset.folder.name, body)


def sentence(found: Discovery, verdict: Mapping[str, Any]) -> str:
    """Return the verdict in words."""
    names = " or ".join(name.replace("_", " ") for name in found.causes)
    p = f"p = {found.p_value:.2g}"
    if found.verdict == "none":
        alone = [n for n, s in found.scores.items() if s.gain is not None and s.reason]
        but = f", though {', '.join(alone)} would explain a single specimen" if alone else ""
        return f"Nothing is missing that these data could show ({p}){but}."
    if found.verdict == "unknown":
        return (
            "Something is missing, and it is none of the suspects "
            f"(what the best of them leaves has p = {found.misfit_p_value:.2g})."
        )
    assert found.gain is not None  # a suspect was fitted
    assert found.shape_gain is not None
    gain = (
        f"Curves of specimens left out are predicted with an error of {_errors(found.gain)}; "
        f"the shape of these curves, with the specimen's own stiffness fitted, with an error of "
        f"{_errors(found.shape_gain)}."
    )
    if found.verdict == "ambiguous":
        return f"Something is missing ({p}): {names}, which these data do not tell apart. {gain}"
    amplitude = verdict["amplitudes"][found.causes[0]]
    unit = _unit(amplitude["unit"])
    low, high = amplitude["interval"]
    size = f"{amplitude['value']:.3g}{unit} (95 % interval {low:.3g} to {high:.3g})"
    return f"The cause is {names}: {size}, {p}. {gain}"


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _errors(gain: Gain) -> str:
    low, high = gain.interval
    return (
        f"{gain.rmse_after_N:.2f} N instead of {gain.rmse_before_N:.2f} N "
        f"(ratio {gain.ratio:.2f}, 95 % interval {low:.2f} to {high:.2f})"
    )


def _suspects(found: Discovery) -> str:
    rows = []
    gains = {name: -1.0 if s.gain is None else s.gain for name, s in found.scores.items()}
    for name in sorted(gains, key=lambda key: -gains[key]):
        score, effect = found.scores[name], found.effects[name]
        if score.gain is None:
            rows.append((name, "", f"not tested: {score.reason}", effect.physics))
        else:
            size = f"{score.amplitude:.3g} ± {score.error:.2g}{_unit(effect.unit)}"
            note = f" ({score.reason})" if score.reason else ""
            text = f"{effect.physics} {effect.reference}."
            rows.append((name, f"{score.gain:.1f}", size + note, text))
    return table(("suspect", "log-likelihood gained", "amplitude", "physics"), rows)


def _factor_rows(verdict: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(name, f"{math.exp(v):.3f}") for name, v in verdict["log_factors"].items()]
