"""Plant stalks bent on a computer, with FEniCSx.

A `BendingTest` says what is bent and how; `simulate` bends it; `write_folder` keeps what came out.
"""

__version__ = "0.1.0"

import importlib
from typing import TYPE_CHECKING, Any

from ramiefenics import _start  # noqa: F401  first
from ramiefenics.effects import EFFECTS, Effect
from ramiefenics.measured import (
    Dataset,
    RawCurve,
    Seating,
    TextColumns,
    import_columns,
    import_instron,
    read_dataset,
)
from ramiefenics.published import check_anova, published_checks, published_table
from ramiefenics.solve.explicit import simulate_explicitly
from ramiefenics.solve.explicit_result import ExplicitResult
from ramiefenics.solve.result import BendingResult
from ramiefenics.solve.sensitivity import Parameter, Sensitivities, sensitivities
from ramiefenics.solve.simulate import simulate
from ramiefenics.specification import (
    BendingTest,
    Closure,
    ContactMethod,
    Elastic,
    Explicit,
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
    from ramiefenics.calibration.calibrate import calibrate
    from ramiefenics.calibration.outcome import Calibration
    from ramiefenics.convergence import Convergence, converge, order_and_limit
    from ramiefenics.discovery import Discovery, discover
    from ramiefenics.measured.dataset_folder import write_dataset
    from ramiefenics.reconciliation.outcome import Reconciliation
    from ramiefenics.reconciliation.printed_design import read_printed_design
    from ramiefenics.reconciliation.reconcile import reconcile
    from ramiefenics.reduction import Reduction, reduce_dataset
    from ramiefenics.results.folder import write_folder
    from ramiefenics.solve.figures import curve_figure, section_figure
    from ramiefenics.solve.pictures import deformed_picture
    from ramiefenics.validation import Validation, validate

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
    "Explicit",
    "ExplicitResult",
    "Fixture",
    "Friction",
    "Layer",
    "Machine",
    "Material",
    "MeshRecipe",
    "Numerics",
    "Parameter",
    "Protocol",
    "RawCurve",
    "Reconciliation",
    "Reduction",
    "Seating",
    "Sensitivities",
    "SpecificationError",
    "SpecificationWarning",
    "Stalk",
    "Stepping",
    "TextColumns",
    "Validation",
    "calibrate",
    "check_anova",
    "converge",
    "curve_figure",
    "deformed_picture",
    "discover",
    "import_columns",
    "import_instron",
    "mesh_recipe",
    "order_and_limit",
    "override",
    "published_checks",
    "published_table",
    "published_test",
    "ramie",
    "ramie_at_height",
    "read_dataset",
    "read_printed_design",
    "read_test",
    "recipe_names",
    "reconcile",
    "reduce_dataset",
    "section_figure",
    "sensitivities",
    "simulate",
    "simulate_explicitly",
    "validate",
    "write_dataset",
    "write_folder",
    "write_test",
]

_ON_DEMAND = {
    "Calibration": "calibration.outcome",
    "Convergence": "convergence",
    "Discovery": "discovery",
    "Reconciliation": "reconciliation.outcome",
    "calibrate": "calibration.calibrate",
    "converge": "convergence",
    "curve_figure": "solve.figures",
    "deformed_picture": "solve.pictures",
    "discover": "discovery",
    "order_and_limit": "convergence",
    "read_printed_design": "reconciliation.printed_design",
    "reconcile": "reconciliation.reconcile",
    "reduce_dataset": "reduction",
    "Reduction": "reduction",
    "section_figure": "solve.figures",
    "write_dataset": "measured.dataset_folder",
    "write_folder": "results.folder",
    "Validation": "validation",
    "validate": "validation",
}


def __getattr__(name: str) -> Any:
    """Import when it is asked for what simulating does not need, such as Matplotlib and PyVista."""
    if name in _ON_DEMAND:
        return getattr(importlib.import_module(f"{__name__}.{_ON_DEMAND[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
