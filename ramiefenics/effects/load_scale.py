"""The load cell reads too high by a factor."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    scale = test.machine.load_scale * (1.0 + amplitude)
    return replace(test, machine=replace(test.machine, load_scale=scale))


LOAD_SCALE = Effect(
    name="load_scale",
    physics="The load cell reads too high, or too low, by a factor; the amplitude is this "
    "factor minus one.",
    reference="ISO 7500-1:2018 (calibration of force-measuring systems)",
    unit="1",
    bounds=(-0.3, 0.3),
    typical=0.1,
    apply=_apply,
    enters="the machine's force: machine.load_scale",
    by_group=True,
)
