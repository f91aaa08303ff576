"""A node closes the void."""

from dataclasses import replace

from ramiefenics.effects.base import Effect
from ramiefenics.specification import BendingTest, SpecificationError


def _apply(test: BendingTest, amplitude: float) -> BendingTest:
    if amplitude == 0.0:
        return test
    if test.stalk.void_diameter_mm == 0.0:
        allowed = "must be above 0 mm for the effect node: there is no void to close"
        raise SpecificationError("stalk.void_diameter_mm", 0.0, allowed)
    if test.stalk.node_at_mm != 0.0:
        test = replace(test, numerics=test.numerics.whole_length())
    thickness = test.stalk.node_thickness_mm + amplitude
    return replace(test, stalk=replace(test.stalk, node_thickness_mm=thickness))


NODE = Effect(
    name="node",
    physics="A stiff diaphragm closes the void at stalk.node_at_mm, where the section then cannot "
    "flatten; the amplitude is its thickness.",
    reference="Niklas 1997, Annals of Botany 80, 437-448",
    unit="mm",
    bounds=(0.0, 20.0),
    typical=3.0,
    span_mm=100.0,
    apply=_apply,
    enters="cells within the bore: stalk.node_thickness_mm, stalk.node_at_mm",
    per_specimen=True,
)
