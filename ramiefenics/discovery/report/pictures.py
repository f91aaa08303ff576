"""The figures of a discovery, in the order of the questions that they answer."""

from __future__ import annotations

from functools import partial

from ramiefenics.discovery.report import figures, suspect_figures
from ramiefenics.discovery.report.outcome import Discovery
from ramiefenics.results.result import Picture


def pictures(found: Discovery) -> dict[str, Picture]:
    """Return the figures that apply to an outcome, by the name of their file."""
    return {
        **_learned(found),
        "residual": Picture(
            partial(figures.residual_figure, found),
            "What is wrong, and what is left of it: residuals without effects and, if any were "
            "fitted, with them; each specimen has its own factors, and amplitudes where these "
            "differ. Grey: single curves. Dashed: part attributed to mesh and simulator.",
        ),
        **_suspects(found),
        **_better(found),
        "left_out": Picture(
            partial(figures.left_out_figure, found),
            "The curves of each specimen, predicted from all other specimens.",
        ),
        **_next(found),
    }


def _learned(found: Discovery) -> dict[str, Picture]:
    if found.anatomy is None:
        return {}
    return {
        "anatomy": Picture(
            partial(figures.anatomy_figure, found, found.anatomy),
            "The function learned inside the model, with its 95 % band, compared with the "
            "baseline's own function and those of shipped effects at their typical sizes.",
        )
    }


def _suspects(found: Discovery) -> dict[str, Picture]:
    return {
        "suspects": Picture(
            partial(suspect_figures.suspects_figure, found),
            "Who is suspected: the probability of each suspect (dashed: practically certain), and "
            "its largest effect on the curves that the data do not exclude.",
        ),
        "sets": Picture(
            partial(suspect_figures.sets_figure, found),
            "Why these: the probability of each set of effects, and of none.",
        ),
        "alike": Picture(
            partial(suspect_figures.alike_figure, found),
            "What else it may be: similarity of the suspects' signatures after removal of what "
            "factors and simulator can imitate; where it is near 1, these data cannot tell the two "
            "apart.",
        ),
    }


def _better(found: Discovery) -> dict[str, Picture]:
    if found.gain is None:
        return {}
    return {
        "gain": Picture(
            partial(figures.gain_figure, found),
            "How much better: root mean square errors of predicted left-out curves, and the ratio "
            "of those with effects to those without, with its 95 % interval.",
        )
    }


def _next(found: Discovery) -> dict[str, Picture]:
    if found.plan is None:
        return {}
    return {
        "next": Picture(
            partial(suspect_figures.next_figure, found.plan),
            "What to measure next: how well each test would separate the effects left open "
            "(dashed: odds of 20).",
        )
    }
