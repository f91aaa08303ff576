"""The recorded displacement is too large by a factor."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    scale = test.machine.displacement_scale * (1.0 + amplitude)
    return replace(test, machine=replace(test.machine, displacement_scale=scale))


DISPLACEMENT_SCALE = Effect(
    name="displacement_scale",
    physics="The displacement of the drive is recorded too large, or too small, by a factor; the "
    "amplitude is this factor minus one.",
    reference="ISO 9513:2012 (calibration of extensometer systems)",
    unit="1",
    bounds=(-0.2, 0.2),
    typical=0.05,
    apply=_apply,
    enters="the machine's displacement: machine.displacement_scale",
    by_group=True,
)
