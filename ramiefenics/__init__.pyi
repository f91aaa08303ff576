"""Public names of the package; each is imported from its module on first use."""

__version__: str

from .calibration.calibrate import calibrate as calibrate
from .calibration.outcome import Calibration as Calibration
from .comparison import Comparison as Comparison, compare as compare
from .convergence import (
    Convergence as Convergence,
    converge as converge,
    order_and_limit as order_and_limit,
)
from .discovery import (
    Discovery as Discovery,
    discover as discover,
)
from .discovery.planning.plan import Plan as Plan, plan as plan
from .discovery.planning.power import Design as Design
from .effects import (
    EFFECTS as EFFECTS,
    SUSPECTS as SUSPECTS,
    Companion as Companion,
    Effect as Effect,
)
from .measured import (
    Dataset as Dataset,
    RawCurve as RawCurve,
    Reader as Reader,
    Seating as Seating,
    read_dataset as read_dataset,
    read_raw as read_raw,
)
from .measured.dataset_folder import write_dataset as write_dataset
from .published import (
    check_anova as check_anova,
    published_checks as published_checks,
    published_table as published_table,
    published_test as published_test,
    ramie as ramie,
    ramie_at_height as ramie_at_height,
)
from .reconciliation.outcome import Reconciliation as Reconciliation
from .reconciliation.printed_design import read_printed_design as read_printed_design
from .reconciliation.reconcile import reconcile as reconcile
from .reduction import (
    Reduction as Reduction,
    reduce_dataset as reduce_dataset,
)
from .results.folder import write_folder as write_folder
from .results.style import style as style
from .runs import Runs as Runs, dask_workers as dask_workers, workers as workers
from .solve.animation import animate as animate
from .solve.explicit import simulate_explicitly as simulate_explicitly
from .solve.explicit_result import ExplicitResult as ExplicitResult
from .solve.figures import (
    curve_figure as curve_figure,
    section_figure as section_figure,
)
from .solve.pictures import deformed_figure as deformed_figure
from .solve.pictures import view as view
from .solve.reading import read_folder as read_folder
from .solve.result import BendingResult as BendingResult
from .solve.sensitivity import (
    Parameter as Parameter,
    Sensitivities as Sensitivities,
    sensitivities as sensitivities,
)
from .solve.simulate import simulate as simulate
from .specification import (
    BendingTest as BendingTest,
    Bond as Bond,
    LargeStrain as LargeStrain,
    ContactMethod as ContactMethod,
    Elastic as Elastic,
    Explicit as Explicit,
    Fixture as Fixture,
    Cylinder as Cylinder,
    Friction as Friction,
    GeneralFixture as GeneralFixture,
    Layer as Layer,
    Machine as Machine,
    Material as Material,
    MeshRecipe as MeshRecipe,
    Numerics as Numerics,
    Protocol as Protocol,
    SpecificationError as SpecificationError,
    SpecificationWarning as SpecificationWarning,
    Stalk as Stalk,
    Stepping as Stepping,
    Target as Target,
    Tissue as Tissue,
    mesh_recipe as mesh_recipe,
    override as override,
    read_test as read_test,
    recipe_names as recipe_names,
    write_test as write_test,
)
from .specification.sources import as_test as as_test
from .sweep import Sweep as Sweep, sweep as sweep
from .validation import (
    Validation as Validation,
    validate as validate,
)
