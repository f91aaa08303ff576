"""Bark slips on wood."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    bond = test.stalk.bond
    compliance = bond.compliance_mm_per_MPa + amplitude
    bond = replace(bond, compliance_mm_per_MPa=compliance)
    return replace(test, stalk=replace(test.stalk, bond=bond))


BARK_SLIP = Effect(
    name="bark_slip",
    physics="The outermost layer slips on the one inside it, as bark does on wood, and comes off "
    "where the stress between them exceeds stalk.bond.strength_MPa; the amplitude is the slip per "
    "shear stress.",
    reference="Newmark, Siess and Viest 1951, Proceedings of the Society for Experimental Stress "
    "Analysis 9, 75-92; Ortiz and Pandolfi 1999, International Journal for Numerical Methods in "
    "Engineering 44, 1267-1282",
    unit="mm/MPa",
    bounds=(0.0, 0.5),
    typical=0.1,
    apply=_apply,
    enters="a cohesive film between the two layers: stalk.bond.compliance_mm_per_MPa",
)
