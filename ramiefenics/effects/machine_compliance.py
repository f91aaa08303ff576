"""The testing machine is compliant."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    total = test.machine.compliance_mm_per_N + amplitude
    return replace(test, machine=replace(test.machine, compliance_mm_per_N=total))


MACHINE_COMPLIANCE = Effect(
    name="machine_compliance",
    physics="Frame, load cell and fixture deflect in proportion to the force, and the machine "
    "counts this deflection as displacement of the indenter.",
    reference="Kalidindi, Abusafieh and El-Danaf 1997, Experimental Mechanics 37, 210-215",
    unit="mm/N",
    bounds=(0.0, 0.05),
    typical=0.01,
    apply=_apply,
    enters="the machine's displacement: machine.compliance_mm_per_N",
    by_group=True,
)
