"""Plant stalks bent on a computer, with FEniCSx.

A `BendingTest` says what is bent and how; `simulate` bends it; `write_folder` keeps what came out.
"""

__version__ = "0.1.0"

import importlib
from typing import TYPE_CHECKING, Any

from ramiefenics.solve.result import BendingResult
from ramiefenics.solve.sensitivity import Parameter, Sensitivities, sensitivities
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import (
    BendingTest,
    Closure,
    ContactMethod,
    Elastic,
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

if TYPE_CHECKING:
    from ramiefenics.results.figures import curve_figure, section_figure
    from ramiefenics.results.folder import write_folder
    from ramiefenics.results.pictures import deformed_picture

__all__ = [
    "BendingResult",
    "BendingTest",
    "Closure",
    "ContactMethod",
    "Elastic",
    "Fixture",
    "Friction",
    "Layer",
    "Material",
    "MeshRecipe",
    "Numerics",
    "Parameter",
    "Protocol",
    "Sensitivities",
    "SpecificationError",
    "SpecificationWarning",
    "Stalk",
    "Stepping",
    "curve_figure",
    "deformed_picture",
    "mesh_recipe",
    "override",
    "published_test",
    "ramie",
    "ramie_at_height",
    "read_test",
    "recipe_names",
    "section_figure",
    "sensitivities",
    "simulate",
    "write_folder",
    "write_test",
]

_DRAWING = {
    "curve_figure": "figures",
    "deformed_picture": "pictures",
    "section_figure": "figures",
    "write_folder": "folder",
}


def __getattr__(name: str) -> Any:
    """Import what draws when it is asked for: simulating needs neither Matplotlib nor PyVista."""
    if name in _DRAWING:
        return getattr(importlib.import_module(f"{__name__}.results.{_DRAWING[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
