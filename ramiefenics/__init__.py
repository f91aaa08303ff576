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
    Target,
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
    from ramiefenics.reconciliation.printed_design import read_printed_design
    from ramiefenics.reconciliation.reconcile import Reconciliation, reconcile
    from ramiefenics.reduction import Reduction, reduce_dataset
    from ramiefenics.results.calibration_folder import write_calibration
    from ramiefenics.results.convergence_folder import write_convergence
    from ramiefenics.results.dataset_folder import write_dataset
    from ramiefenics.results.discovery_folder import write_discovery
    from ramiefenics.results.explicit_folder import write_explicit_folder
    from ramiefenics.results.figures import curve_figure, section_figure
    from ramiefenics.results.folder import write_folder
    from ramiefenics.results.pictures import deformed_picture
    from ramiefenics.results.reconcile_report import write_reconciliation
    from ramiefenics.results.reduction_folder import write_reduction
    from ramiefenics.results.validation_folder import write_validation
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
    "Target",
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
    "write_calibration",
    "write_convergence",
    "write_dataset",
    "write_discovery",
    "write_explicit_folder",
    "write_folder",
    "write_reconciliation",
    "write_reduction",
    "write_test",
    "write_validation",
]

_ON_DEMAND = {
    "Calibration": "calibration.calibrate",
    "Convergence": "convergence",
    "Discovery": "discovery",
    "Reconciliation": "reconciliation.reconcile",
    "calibrate": "calibration.calibrate",
    "converge": "convergence",
    "curve_figure": "results.figures",
    "deformed_picture": "results.pictures",
    "discover": "discovery",
    "order_and_limit": "convergence",
    "read_printed_design": "reconciliation.printed_design",
    "reconcile": "reconciliation.reconcile",
    "reduce_dataset": "reduction",
    "Reduction": "reduction",
    "section_figure": "results.figures",
    "write_calibration": "results.calibration_folder",
    "write_convergence": "results.convergence_folder",
    "write_dataset": "results.dataset_folder",
    "write_discovery": "results.discovery_folder",
    "write_explicit_folder": "results.explicit_folder",
    "write_folder": "results.folder",
    "write_reconciliation": "results.reconcile_report",
    "write_reduction": "results.reduction_folder",
    "Validation": "validation",
    "validate": "validation",
    "write_validation": "results.validation_folder",
}


def __getattr__(name: str) -> Any:
    """Import when it is asked for what simulating does not need, such as Matplotlib and PyVista."""
    if name in _ON_DEMAND:
        return getattr(importlib.import_module(f"{__name__}.{_ON_DEMAND[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
