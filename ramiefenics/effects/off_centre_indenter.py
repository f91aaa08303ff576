"""The indenter is not midway between the supports."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, Fixture, GeneralFixture


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    return replace(
        test, fixture=_moved(test.fixture, amplitude), numerics=test.numerics.whole_length()
    )


def _moved(fixture: Fixture | GeneralFixture, by_mm: float) -> Fixture | GeneralFixture:
    if isinstance(fixture, GeneralFixture):
        cylinders = tuple(
            replace(c, z_mm=c.z_mm + by_mm) if c.moves else c for c in fixture.cylinders
        )
        return replace(fixture, cylinders=cylinders)
    return replace(fixture, indenter_offset_mm=fixture.indenter_offset_mm + by_mm)


OFF_CENTRE_INDENTER = Effect(
    name="off_centre_indenter",
    physics="The indenter comes down beside the middle between the supports, where the stalk is "
    "stiffer.",
    reference="Timoshenko 1955, Strength of Materials, Part I, chapter V",
    unit="mm",
    bounds=(-20.0, 20.0),
    typical=5.0,
    span_mm=100.0,
    even=True,  # both halves of a stalk are alike
    apply=_apply,
    enters="the place of the indenter: fixture.indenter_offset_mm",
)
