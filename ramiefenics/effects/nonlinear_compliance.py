"""The compliant fixture stiffens as the force grows."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    total = test.machine.bedding_compliance_mm_per_N + amplitude
    return replace(test, machine=replace(test.machine, bedding_compliance_mm_per_N=total))


NONLINEAR_COMPLIANCE = Effect(
    name="nonlinear_compliance",
    physics="Rough faces of the fixture bed in as they are pressed together: their deflection "
    "grows logarithmically with the force relative to machine.bedding_force_N; the amplitude is "
    "their compliance at zero force.",
    reference="Persson 2007, Physical Review Letters 99, 125502",
    unit="mm/N",
    bounds=(0.0, 0.1),
    typical=0.02,
    apply=_apply,
    enters="the machine's displacement: machine.bedding_compliance_mm_per_N",
    by_group=True,
)
