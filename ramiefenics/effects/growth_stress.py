"""The stalk is under stress before loading."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    tissue = test.stalk.tissue
    tissue = replace(tissue, growth_strain=tissue.growth_strain + amplitude)
    return replace(test, stalk=replace(test.stalk, tissue=tissue))


GROWTH_STRESS = Effect(
    name="growth_stress",
    physics="Fibres are in tension outside and in compression inside, in equilibrium, before the "
    "stalk is touched, so that fibres on the compressed side give way later; the amplitude is the "
    "strain at the surface.",
    reference="Archer 1986, Growth Stresses and Strains in Trees; Kutschera 1989, Physiologia "
    "Plantarum 77, 157-163",
    unit="1",
    bounds=(-0.02, 0.02),
    typical=0.002,
    apply=_apply,
    enters="the fibres' stretch at rest at every quadrature point: stalk.tissue.growth_strain",
)
