"""Plant stalks bent on a computer, with FEniCSx.

A `BendingTest` says what is bent and how; `simulate` bends it; `write_folder` keeps what came out.
"""

__version__ = "0.1.0"

from ramiefenics.results.folder import write_folder
from ramiefenics.solve.result import BendingResult
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import (
    BendingTest,
    ContactMethod,
    Elastic,
    FibreCompression,
    Fixture,
    Friction,
    Layer,
    Material,
    MeshRecipe,
    Numerics,
    Protocol,
    SpecificationError,
    SpecificationWarning,
    Stalk,
    Stepping,
    mesh_recipe,
    override,
    published_test,
    ramie,
    ramie_at_height,
    read_test,
    recipe_names,
    write_test,
)

__all__ = [
    "BendingResult",
    "BendingTest",
    "ContactMethod",
    "Elastic",
    "FibreCompression",
    "Fixture",
    "Friction",
    "Layer",
    "Material",
    "MeshRecipe",
    "Numerics",
    "Protocol",
    "SpecificationError",
    "SpecificationWarning",
    "Stalk",
    "Stepping",
    "mesh_recipe",
    "override",
    "published_test",
    "ramie",
    "ramie_at_height",
    "read_test",
    "recipe_names",
    "simulate",
    "write_folder",
    "write_test",
]
