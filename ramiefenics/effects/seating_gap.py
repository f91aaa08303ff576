"""The record begins before the indenter touches."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    total = test.machine.seating_gap_mm + amplitude
    return replace(test, machine=replace(test.machine, seating_gap_mm=total))


SEATING_GAP = Effect(
    name="seating_gap",
    physics="The machine's displacement is zeroed before the indenter touches the stalk and the "
    "stalk sits on both supports.",
    reference="ASTM D790-17, Annex A1 (toe compensation)",
    unit="mm",
    bounds=(0.0, 2.0),
    typical=0.4,
    span_mm=100.0,
    apply=_apply,
    enters="the machine's displacement: machine.seating_gap_mm",
    per_specimen=True,
    by_group=True,
)
