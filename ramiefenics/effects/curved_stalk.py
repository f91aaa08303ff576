"""The stalk is bowed."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    curvature = test.stalk.curvature_per_m + amplitude
    return replace(test, stalk=replace(test.stalk, curvature_per_m=curvature))


CURVED_STALK = Effect(
    name="curved_stalk",
    physics="The stalk's axis is an arc before it is touched: it bows towards the indenter, which "
    "moves the contacts on the supports outwards, or, with a negative amplitude, away from it; the "
    "amplitude is its curvature k, with which it rises by k L^2 / 8 over a span L.",
    reference="Timoshenko and Gere 1961, Theory of Elastic Stability, chapter 7",
    unit="1/m",
    bounds=(-3.0, 3.0),
    typical=0.8,
    apply=_apply,
    enters="the nodes of the mesh, and the fibres' direction: stalk.curvature_per_m",
    per_specimen=True,
)
