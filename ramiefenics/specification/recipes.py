"""Mesh recipes by name, from the folder `meshes`."""

from __future__ import annotations

import difflib
import functools
import tomllib
from pathlib import Path

from ramiefenics.specification.errors import SpecificationError
from ramiefenics.specification.numerics import MeshRecipe


def recipe_folder() -> Path:
    """Return the folder of the recipes."""
    return Path(__file__).resolve().parents[1] / "meshes"


def recipe_names() -> list[str]:
    """Return the names of all recipes, sorted."""
    return sorted(path.stem for path in recipe_folder().glob("*.toml"))


@functools.cache
def mesh_recipe(name: str) -> MeshRecipe:
    """Return the recipe of that name.

    Raises
    ------
    SpecificationError
        If there is none.
    """
    if name not in recipe_names():
        near = difflib.get_close_matches(name, recipe_names(), n=1)
        hint = f", the nearest is {near[0]!r}" if near else ""
        raise SpecificationError(
            "", name, f"is no mesh recipe{hint}; known: {', '.join(recipe_names())}"
        )
    with (recipe_folder() / f"{name}.toml").open("rb") as stream:
        data = tomllib.load(stream)
    return MeshRecipe(name=name, **data)
