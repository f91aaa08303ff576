"""Fibres wind around the stalk."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    tissue = test.stalk.tissue
    tissue = replace(tissue, fibre_angle_deg=tissue.fibre_angle_deg + amplitude)
    stalk = replace(test.stalk, tissue=tissue)
    return replace(test, numerics=test.numerics.whole(), stalk=stalk)


FIBRE_ANGLE = Effect(
    name="fibre_angle",
    physics="The grain is spiral: fibres lean from the stalk's axis and wind around it, so that "
    "the matrix between them is sheared where they would be stretched; the amplitude is the angle.",
    reference="Lekhnitskii 1963, Theory of Elasticity of an Anisotropic Elastic Body; Kubler 1991, "
    "Trees 5, 125-135",
    unit="degrees",
    bounds=(-30.0, 30.0),
    typical=5.0,
    even=True,  # fibres that wind the other way give the mirror image
    apply=_apply,
    enters="the fibres' direction at every quadrature point: stalk.tissue.fibre_angle_deg",
)
