"""The wall is thicker than noted."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, SpecificationError


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    void = test.stalk.void_diameter_mm
    if void == 0.0:
        allowed = "must be above 0 mm for the effect wall_thickness_error: there is no wall"
        raise SpecificationError("stalk.void_diameter_mm", void, allowed)
    narrower = void - 2.0 * amplitude
    if narrower <= 0.0:
        allowed = f"must be above {2.0 * amplitude:g} mm, twice the added thickness of the wall"
        raise SpecificationError("stalk.void_diameter_mm", void, allowed)
    return replace(test, stalk=replace(test.stalk, void_diameter_mm=narrower))


WALL_THICKNESS_ERROR = Effect(
    name="wall_thickness_error",
    physics="The wall is thicker than was noted, or, with a negative amplitude, thinner, at "
    "constant outer diameter: calipers do not show it, and a cut end may differ from midspan.",
    reference="Von Forell, Robertson, Lee and Cook 2015, Journal of Experimental Botany 66, "
    "4367-4371",
    unit="mm",
    bounds=(-1.5, 1.5),
    typical=0.3,
    span_mm=100.0,
    apply=_apply,
    enters="the radius of the bore: stalk.void_diameter_mm",
    per_specimen=True,
)
