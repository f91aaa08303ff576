"""The supports are farther apart than noted."""

import math
from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, GeneralFixture, SpecificationError


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    fixture = test.fixture
    if all(cylinder.moves or cylinder.z_mm == 0.0 for cylinder in fixture.cylinders):
        allowed = "must have supports on either side of midspan for the effect span_error"
        raise SpecificationError("fixture", None, allowed)
    if isinstance(fixture, GeneralFixture):
        cylinders = tuple(
            c if c.moves else replace(c, z_mm=c.z_mm + amplitude / 2.0 * math.copysign(1.0, c.z_mm))
            for c in fixture.cylinders
        )
        return replace(test, fixture=replace(fixture, cylinders=cylinders))
    return replace(test, fixture=replace(fixture, span_mm=fixture.span_mm + amplitude))


SPAN_ERROR = Effect(
    name="span_error",
    physics="The supports are farther apart than was noted, or, with a negative amplitude, closer "
    "together; a beam's stiffness is inversely proportional to the third power of the span.",
    reference="Timoshenko 1955, Strength of Materials, Part I, chapter V",
    unit="mm",
    bounds=(-20.0, 20.0),
    typical=4.0,
    span_mm=100.0,
    apply=_apply,
    enters="the place of the supports: fixture.span_mm",
    by_group=True,
)
