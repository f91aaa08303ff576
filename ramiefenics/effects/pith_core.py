"""Pith fills the void."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, Elastic, Layer, Material, SpecificationError

POISSON = 0.1
"""Poisson's ratio of pith: foams hardly widen when crushed (Gibson and Ashby 1997)."""

DENSITY_G_PER_CM3 = 0.05


def _foam(young_MPa: float) -> Material:
    return Material(Elastic.isotropic(young_MPa, POISSON), density_g_per_cm3=DENSITY_G_PER_CM3)


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    void = test.stalk.void_diameter_mm
    if void == 0.0:
        allowed = "must be above 0 mm for the effect pith_core: there is no void to fill"
        raise SpecificationError("stalk.void_diameter_mm", void, allowed)
    pith = Layer("pith", void, _foam(amplitude))
    stalk = replace(test.stalk, void_diameter_mm=0.0, layers=(pith, *test.stalk.layers))
    return replace(test, stalk=stalk)


PITH_CORE = Effect(
    name="pith_core",
    physics="Pith fills the void as an isotropic foam, and supports the section against "
    "flattening; the amplitude is its Young's modulus.",
    reference="Niklas 1992, Plant Biomechanics; Gibson and Ashby 1997, Cellular Solids",
    unit="MPa",
    bounds=(0.0, 5.0),
    typical=0.2,
    apply=_apply,
    enters="an isotropic layer in the void: stalk.layers",
)
