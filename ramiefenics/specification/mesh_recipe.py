"""Refinement of the tube's mesh; named recipes come from the folder `meshes`."""

from __future__ import annotations

import csv
import dataclasses
import difflib
import functools
import tomllib
from dataclasses import dataclass
from pathlib import Path

from ramiefenics.specification.checks import check_choice, check_integer, check_number
from ramiefenics.specification.defaults import Default, put_in_order
from ramiefenics.specification.errors import SpecificationError

LONGEST_UNDER_A_CYLINDER = 0.09
"""Largest `MeshRecipe.contact_size`, nearly two radii: a longer cell may miss the cylinder."""

ORDERED = ("contact_size", "coarse_size")
"""Fields of `MeshRecipe` whose values ascend."""

STEEPEST = 1000.0
"""Largest ratio of element sizes in a graded row; beyond it, nodes made by Gmsh coincide."""


@dataclass(frozen=True)
class MeshRecipe:
    """How finely the tube is divided into hexahedra.

    The cost and accuracy of each named recipe are stated in the folder `meshes`.

    Attributes
    ----------
    name
        Name of the recipe; ``custom`` if a value differs from the recipe of that name.
    order
        Polynomial order of displacement and geometry, 1 or 2.
    angular_elements
        Elements along half the circumference; even, and rounded up to a multiple of four if the
        core is solid.
    wall_elements
        Elements through the layers inside the outermost one, distributed by thickness with at least
        one per layer (a solid core has a block of elements in addition).
    rind_elements
        Elements through the outermost layer.
    contact_size
        Element length along Z under a cylinder, relative to the shortest of the span, 9 diameters
        and 21 radii of the cylinder; at most `coarse_size`. If only one of the two is changed, that
        of a named recipe moves to where it does not contradict it.
    contact_zone
        Half length of the zone with that element length around each cylinder, relative to the
        shorter of the span and 9 diameters.
    growth
        Increase of the element length per distance from the nearest such zone.
    coarse_size
        Largest element length along Z, relative to the shorter of the span and 9 diameters.
    bore_growth
        Ratio of the size of an element to that of the one before, outwards from the bore through
        each layer.
    side_growth
        Ratio of the size of an element to that of the one before, from the stalk's sides (Y = 0),
        where the flattened void bends, to its top and bottom.
    serendipity
        Whether to omit the displacement's nodes inside faces and cells: 20 instead of 27 per cell
        of order 2. Cells of order 1 have no such nodes.
    """

    order: int
    angular_elements: int
    wall_elements: int
    rind_elements: int
    contact_size: float
    contact_zone: float
    growth: float
    coarse_size: float
    bore_growth: float = 1.0
    side_growth: float = 1.0
    serendipity: bool = False
    name: str = "custom"

    def __post_init__(self) -> None:
        """Check counts and sizes."""
        check_choice(self, "order", (1, 2))
        check_integer(self, "angular_elements", 2)
        if self.angular_elements % 2:
            raise SpecificationError("angular_elements", self.angular_elements, "must be even")
        check_integer(self, "wall_elements", 1)
        check_integer(self, "rind_elements", 1)
        put_in_order(self, ORDERED)
        if self.contact_size > LONGEST_UNDER_A_CYLINDER:
            allowed = f"must be a number at most {LONGEST_UNDER_A_CYLINDER:g}"
            raise SpecificationError("contact_size", self.contact_size, allowed)
        check_number(self, "contact_zone", at_least=0.0)
        check_number(self, "growth", at_least=0.0)
        check_number(self, "bore_growth", at_least=1.0, at_most=3.0)
        check_number(self, "side_growth", at_least=1.0, at_most=3.0)
        self._check_grading("side_growth", self.angular_elements // 2)
        self._check_grading("bore_growth", self.wall_elements)
        check_choice(self, "serendipity", (False, True))
        object.__setattr__(self, "serendipity", self.serendipity and self.order == 2)
        if self.name in _names():
            recipe = _unnamed(self.name)
            if dataclasses.replace(self, name=recipe.name) != recipe:
                object.__setattr__(self, "name", recipe.name)

    def _check_grading(self, name: str, elements: int) -> None:
        """Check that the smallest element is not negligible beside the largest."""
        ratio = getattr(self, name)
        largest = STEEPEST ** (1.0 / elements)
        if ratio > largest:
            allowed = f"must be at most {largest:.4g} for {elements} elements in a row"
            raise SpecificationError(name, ratio, allowed)

    @property
    def max_force_error(self) -> float | None:
        """Relative error of the maximum force with this recipe; None if it was not measured.

        Measured on the specimens named in `meshes/README.md`; stored in `meshes/errors.csv`.
        """
        return _errors().get(self.name)


def recipe_folder() -> Path:
    """Return the folder of the recipes."""
    return Path(__file__).resolve().parents[1] / "meshes"


def recipe_names() -> list[str]:
    """Return the names of all recipes, sorted."""
    return list(_names())


@functools.cache  # every new recipe looks here
def _names() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in recipe_folder().glob("*.toml")))


@functools.cache
def mesh_recipe(name: str, field: str = "mesh") -> MeshRecipe:
    """Return the recipe of a given name.

    Parameters
    ----------
    name
        Name of the recipe.
    field
        Name of the field for which it is asked, for the message.

    Raises
    ------
    SpecificationError
        If there is no such recipe.
    """
    if name not in recipe_names():
        near = difflib.get_close_matches(name, recipe_names(), n=1)
        hint = f", the nearest is {near[0]!r}" if near else ""
        allowed = f"is not a mesh recipe{hint}; known: {', '.join(recipe_names())}"
        raise SpecificationError(field, name, allowed)
    return dataclasses.replace(_unnamed(name), name=name)


@functools.cache
def _unnamed(name: str) -> MeshRecipe:
    with (recipe_folder() / f"{name}.toml").open("rb") as stream:
        values = tomllib.load(stream)
    return MeshRecipe(**values | {name: Default(values[name]) for name in ORDERED})


@functools.cache
def _errors() -> dict[str, float]:
    with (recipe_folder() / "errors.csv").open() as stream:
        return {row["recipe"]: float(row["max_force_error"]) for row in csv.DictReader(stream)}
