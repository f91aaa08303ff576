"""Hyperelastic laws, one module each; a new one is listed here."""

from ramiefenics.model.laws.base import Law
from ramiefenics.model.laws.isotropic import ISOTROPIC
from ramiefenics.model.laws.neo_hookean import NEO_HOOKEAN
from ramiefenics.model.laws.saint_venant_kirchhoff import SAINT_VENANT_KIRCHHOFF
from ramiefenics.model.laws.saturating_fibre import SATURATING_FIBRE
from ramiefenics.specification import BendingTest, SpecificationError

LAWS: dict[str, Law] = {
    law.name: law for law in (SATURATING_FIBRE, NEO_HOOKEAN, SAINT_VENANT_KIRCHHOFF, ISOTROPIC)
}


def check_law(test: BendingTest) -> None:
    """Check that a test's law can take the constants of every layer.

    Raises
    ------
    SpecificationError
        If not; the field's dotted name is complete.
    """
    for layer in test.stalk.layers:
        try:
            LAWS[test.law].parameters(layer.material)
        except SpecificationError as error:
            raise error.inside(f"stalk.layers.{layer.name}.material") from error


__all__ = ["LAWS", "Law", "check_law"]
