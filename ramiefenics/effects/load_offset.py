"""The load cell was not zeroed."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    offset = test.machine.load_offset_N + amplitude
    return replace(test, machine=replace(test.machine, load_offset_N=offset))


LOAD_OFFSET = Effect(
    name="load_offset",
    physics="The load cell was zeroed with a force on it, or has drifted: all forces are off by a "
    "constant.",
    reference="ISO 7500-1:2018 (calibration of force-measuring systems)",
    unit="N",
    bounds=(-20.0, 20.0),
    typical=3.0,
    apply=_apply,
    enters="the machine's force: machine.load_offset_N",
    per_specimen=True,
    by_group=True,
)
