"""The void is off the stalk's axis."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, SpecificationError


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    if test.stalk.void_diameter_mm == 0.0:
        allowed = "must be above 0 mm for the effect eccentric_void: there is no void to move"
        raise SpecificationError("stalk.void_diameter_mm", 0.0, allowed)
    offset = test.stalk.void_offset_mm + amplitude
    return replace(test, stalk=replace(test.stalk, void_offset_mm=offset))


ECCENTRIC_VOID = Effect(
    name="eccentric_void",
    physics="The void is nearer to the indenter than to the opposite side, or, with a negative "
    "amplitude, farther from it: the wall is thinner on one side, and the section's second moment "
    "of area is smaller.",
    reference="Niklas 1992, Plant Biomechanics",
    unit="mm",
    bounds=(-2.5, 2.5),
    typical=1.0,
    span_mm=100.0,
    apply=_apply,
    enters="the nodes of the mesh: stalk.void_offset_mm",
    per_specimen=True,
)
