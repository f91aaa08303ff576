"""Plant stalks bent on a computer, with FEniCSx.

A `BendingTest` says what is bent and how; `simulate` bends it; `write_folder` keeps what came out.
"""

__version__ = "0.1.0"

import importlib
from typing import TYPE_CHECKING, Any

from ramiefenics.effects import EFFECTS, Effect
from ramiefenics.measured import Dataset, read_dataset
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
    Machine,
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
    from ramiefenics.calibration.calibrate import Calibration, calibrate
    from ramiefenics.convergence import Convergence, converge, order_and_limit
    from ramiefenics.discovery import Discovery, discover
    from ramiefenics.results.calibration_folder import write_calibration
    from ramiefenics.results.convergence_folder import write_convergence
    from ramiefenics.results.discovery_folder import write_discovery
    from ramiefenics.results.figures import curve_figure, section_figure
    from ramiefenics.results.folder import write_folder
    from ramiefenics.results.pictures import deformed_picture

__all__ = [
    "EFFECTS",
    "BendingResult",
    "BendingTest",
    "Calibration",
    "Closure",
    "ContactMethod",
    "Convergence",
    "Dataset",
    "Discovery",
    "Effect",
    "Elastic",
    "Fixture",
    "Friction",
    "Layer",
    "Machine",
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
    "calibrate",
    "converge",
    "curve_figure",
    "deformed_picture",
    "discover",
    "mesh_recipe",
    "order_and_limit",
    "override",
    "published_test",
    "ramie",
    "ramie_at_height",
    "read_dataset",
    "read_test",
    "recipe_names",
    "section_figure",
    "sensitivities",
    "simulate",
    "write_calibration",
    "write_convergence",
    "write_discovery",
    "write_folder",
    "write_test",
]

_ON_DEMAND = {
    "Calibration": "calibration.calibrate",
    "Convergence": "convergence",
    "Discovery": "discovery",
    "calibrate": "calibration.calibrate",
    "converge": "convergence",
    "curve_figure": "results.figures",
    "deformed_picture": "results.pictures",
    "discover": "discovery",
    "order_and_limit": "convergence",
    "section_figure": "results.figures",
    "write_calibration": "results.calibration_folder",
    "write_convergence": "results.convergence_folder",
    "write_discovery": "results.discovery_folder",
    "write_folder": "results.folder",
}


def __getattr__(name: str) -> Any:
    """Import when it is asked for what simulating does not need, such as Matplotlib and PyVista."""
    if name in _ON_DEMAND:
        return getattr(importlib.import_module(f"{__name__}.{_ON_DEMAND[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
