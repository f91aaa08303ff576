"""Indenter and supports are rounder."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    fixture = test.fixture
    names = ["indenter_radius_mm", "support_radius_mm"]
    if fixture.other_support_radius_mm is not None:
        names.append("other_support_radius_mm")
    radii = {name: getattr(fixture, name) + amplitude for name in names}
    return replace(test, fixture=replace(fixture, **radii))


FIXTURE_RADIUS = Effect(
    name="fixture_radius",
    physics="Indenter and supports have a larger radius than was noted, or a smaller one: they "
    "crush the section less, and a bent stalk rolls on them, which changes its span.",
    reference="Mujika 2006, Polymer Testing 25, 214-220",
    unit="mm",
    bounds=(-4.0, 15.0),
    typical=3.0,
    apply=_apply,
    enters="the rigid cylinders: fixture.indenter_radius_mm, fixture.support_radius_mm",
)
