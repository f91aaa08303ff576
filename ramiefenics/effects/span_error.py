"""The supports are not where they should be."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, SpecificationError


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    if test.fixture.span_mm == 0.0:
        raise SpecificationError("span_mm", 0.0, "must be above 0 mm: a single support has none")
    span = test.fixture.span_mm + amplitude
    return replace(test, fixture=replace(test.fixture, span_mm=span))


SPAN_ERROR = Effect(
    name="span_error",
    physics="The supports are farther apart than was noted, or, with a negative amplitude, nearer; "
    "a beam's stiffness goes with the third power of that.",
    reference="Timoshenko 1955, Strength of Materials, Part I, chapter V",
    unit="mm",
    bounds=(-20.0, 20.0),
    typical=4.0,
    apply=_apply,
    enters="the place of the supports: fixture.span_mm",
)
