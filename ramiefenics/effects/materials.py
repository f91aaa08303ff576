"""What several effects do to the materials of all layers."""

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
"""What is not elastic in the laws that are the default one but for that."""


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
    """Return the name of the law that has what the test's law has, and a part more.

    Raises
    ------
    SpecificationError
        If the test's law is not made of such parts.
    """
    if test.law not in PARTS:
        allowed = f"must be one of {', '.join(PARTS)}, to which {part} can be added"
        raise SpecificationError("law", test.law, allowed)
    wanted = PARTS[test.law] | {part}
    return next(law for law, parts in PARTS.items() if parts == wanted)


def with_part(
    test: BendingTest, part: str, share: str, amount: float, **others: float
) -> BendingTest:
    """Return the test with a part in its law, and more of a share that is one of its constants.

    Parameters
    ----------
    test
        Of a law in `PARTS`.
    part
        The law in which that share is all that is not elastic.
    share
        The constant's name.
    amount
        What is added to it.
    others
        What other constants are set to.

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
