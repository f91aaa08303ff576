"""What several effects do to the materials of all layers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ramiefenics.specification import BendingTest, LargeStrain, Material, SpecificationError

ELASTIC_LAW = "saturating_fibre"


def with_materials(test: BendingTest, change: Callable[[Material], Material]) -> BendingTest:
    """Return the test with every layer's material changed."""
    layers = tuple(replace(layer, material=change(layer.material)) for layer in test.stalk.layers)
    return replace(test, stalk=replace(test.stalk, layers=layers))


def with_large_strain(
    test: BendingTest, change: Callable[[LargeStrain], LargeStrain]
) -> BendingTest:
    """Return the test with every layer's constants at large strain changed."""
    return with_materials(test, lambda m: replace(m, large_strain=change(m.large_strain)))


def checked_law(test: BendingTest, law: str) -> str:
    """Return a law's name, if it is the test's, or can take the place of the elastic default.

    Raises
    ------
    SpecificationError
        If the test has another law.
    """
    if test.law not in (ELASTIC_LAW, law):
        allowed = f"must be {ELASTIC_LAW} or {law}: two laws that remember cannot be one"
        raise SpecificationError("law", test.law, allowed)
    return law


def with_law(
    test: BendingTest, law: str, share: str, amount: float, **others: float
) -> BendingTest:
    """Return the test with a law, and more of a share that is one of its constants.

    Parameters
    ----------
    test
        Of that law, or the elastic default, which is the same where the law's shares are zero.
    law
        Its name.
    share
        The constant's.
    amount
        What is added to it.
    others
        What other constants are set to.

    Raises
    ------
    SpecificationError
        If the test has another law.
    """

    def change(material: Material) -> Material:
        given = material.law_constants
        added = {share: given.get(share, 0.0) + amount, **others}
        return replace(material, law_constants=given | added)

    return replace(with_materials(test, change), law=checked_law(test, law))
