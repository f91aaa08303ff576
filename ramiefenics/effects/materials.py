"""Changes to the materials of all layers that several effects have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ramiefenics.model.laws import law_named
from ramiefenics.specification import BendingTest, LargeStrain, Material, SpecificationError

PARTS = {
    "saturating_fibre": frozenset[str](),
    "inelastic": frozenset({"inelastic"}),
    "viscoelasticity": frozenset({"viscoelasticity"}),
    "inelastic_viscoelasticity": frozenset({"inelastic", "viscoelasticity"}),
}
"""Inelastic parts of each law that otherwise equals the default one."""


def with_materials(test: BendingTest, change: Callable[[Material], Material]) -> BendingTest:
    """Return the test with every layer's material changed."""
    layers = tuple(replace(layer, material=change(layer.material)) for layer in test.stalk.layers)
    return replace(test, stalk=replace(test.stalk, layers=layers))


def with_large_strain(
    test: BendingTest, change: Callable[[LargeStrain], LargeStrain]
) -> BendingTest:
    """Return the test with every layer's constants at large strain changed."""
    return with_materials(test, lambda m: replace(m, large_strain=change(m.large_strain)))


def law_with(test: BendingTest, part: str) -> str:
    """Return the name of the law that has the parts of the test's law, and one more.

    Raises
    ------
    SpecificationError
        If the test's law is not in `PARTS`.
    """
    if test.law not in PARTS:
        allowed = f"must be one of {', '.join(PARTS)}, to which {part} can be added"
        raise SpecificationError("law", test.law, allowed)
    wanted = PARTS[test.law] | {part}
    return next(law for law, parts in PARTS.items() if parts == wanted)


def with_part(
    test: BendingTest, part: str, share: str, amount: float, **others: float
) -> BendingTest:
    """Return the test with an inelastic part in its law, and with more of that part's share.

    Parameters
    ----------
    test
        Test with a law in `PARTS`.
    part
        Inelastic part, as in `PARTS`.
    share
        Name of the constant of the law that is the part's share.
    amount
        Amount that is added to this constant.
    others
        Values to which other constants are set.

    Raises
    ------
    SpecificationError
        If the test has another law.
    """
    law = law_with(test, part)
    defaults = {constant.name: constant.default for constant in law_named(test.law).constants}

    def change(material: Material) -> Material:
        given = material.law_constants
        before = given.get(share, defaults.get(share)) or 0.0
        return replace(material, law_constants=given | {share: before + amount, **others})

    return replace(with_materials(test, change), law=law)
