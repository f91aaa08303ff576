"""Indenter and supports have larger radii than noted."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, Fixture, GeneralFixture


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    return replace(test, fixture=_rounder(test.fixture, amplitude))


def _rounder(fixture: Fixture | GeneralFixture, by_mm: float) -> Fixture | GeneralFixture:
    if isinstance(fixture, GeneralFixture):
        cylinders = tuple(replace(c, radius_mm=c.radius_mm + by_mm) for c in fixture.cylinders)
        return replace(fixture, cylinders=cylinders)
    other = fixture.other_support_radius_mm
    return replace(
        fixture,
        indenter_radius_mm=fixture.indenter_radius_mm + by_mm,
        support_radius_mm=fixture.support_radius_mm + by_mm,
        other_support_radius_mm=None if other is None else other + by_mm,
    )


FIXTURE_RADIUS = Effect(
    name="fixture_radius",
    physics="Indenter and supports have a larger radius than was noted, or a smaller one: they "
    "crush the section less, and a bent stalk rolls on them, which changes its span.",
    reference="Mujika 2006, Polymer Testing 25, 214-220",
    unit="mm",
    bounds=(-4.0, 15.0),
    typical=3.0,
    span_mm=100.0,
    apply=_apply,
    enters="the rigid cylinders: fixture.indenter_radius_mm, fixture.support_radius_mm",
)
