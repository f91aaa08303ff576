"""The section is not round."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    stalk, wider = test.stalk, 1.0 + amplitude / 2.0
    layers = tuple(
        replace(layer, outer_diameter_mm=wider * layer.outer_diameter_mm) for layer in stalk.layers
    )
    stalk = replace(
        stalk,
        layers=layers,
        void_diameter_mm=wider * stalk.void_diameter_mm,
        section_height_mm=(1.0 - amplitude / 2.0) * stalk.height_mm,
    )
    return replace(test, stalk=stalk)


OVALITY = Effect(
    name="ovality",
    physics="The section is an ellipse of the noted mean diameter that lies on its broad side, or, "
    "with a negative amplitude, on its narrow side; the amplitude is the difference between its "
    "diameters over their mean. If the section is turned (stalk.rotation_deg), the effect varies "
    "approximately as the cosine of twice the angle.",
    reference="Ottesen, Larson, Stubbs and Cook 2022, in silico Plants 4",
    unit="1",
    bounds=(-0.3, 0.3),
    typical=0.1,
    apply=_apply,
    enters="the nodes of the mesh: stalk.section_height_mm and all diameters",
    per_specimen=True,
)
