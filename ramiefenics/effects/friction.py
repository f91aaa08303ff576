"""Friction on the fixture is higher than noted."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    friction = test.fixture.friction
    coefficients = {name: getattr(friction, name) + amplitude for name in ("static", "dynamic")}
    changed = replace(test.fixture, friction=replace(friction, **coefficients))
    return replace(test, fixture=changed)


FRICTION = Effect(
    name="friction",
    physics="Both coefficients of friction between stalk and fixture are higher than those noted, "
    "or lower: the supports hold back the underside of the stalk, which slides on them, on the "
    "calibration stalk outwards to about 6 mm of travel and inwards from about 8 mm on.",
    reference="Batista 2015, International Journal of Non-Linear Mechanics 69, 84-92",
    unit="1",
    bounds=(-0.1, 0.8),
    typical=0.3,
    apply=_apply,
    enters="Coulomb's law at all contacts: fixture.friction",
)
