"""What the published calibration determines, from its own numbers without any simulation.

    ./run python benchmarks/published_calibration.py [FOLDER]

Fits the published maximum forces (Table 5, with seven rows of its design corrected) and asks which
parameters the target, 84.8 N with the standard error of ten specimens, determines. The figure goes
to FOLDER, `docs` by default; the numbers are printed.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from ramiefenics.calibration.campaign import Campaign
from ramiefenics.calibration.designs import Design
from ramiefenics.calibration.factors import Space
from ramiefenics.calibration.figures import level_figure
from ramiefenics.calibration.fit import fit_targets
from ramiefenics.calibration.misfit import Misfit, Targets
from ramiefenics.calibration.outcome import Calibration
from ramiefenics.calibration.selection import select_surface
from ramiefenics.calibration.study import read_study
from ramiefenics.reconciliation.printed_design import table5
from ramiefenics.reconciliation.reconcile import reconcile
from ramiefenics.surrogate import Effort

ALPHA = 1.682
CAMPAIGN = Campaign((), 0, Effort(0, 0, 0.0))
"""No simulations: the forces are the published ones."""

CASES = {"ten specimens' mean, 1.74 N": 1.742, "a perfect measurement": 1e-6}


def main(folder: Path) -> None:
    """Print what the target determines, and draw the optimum."""
    warnings.simplefilter("ignore")
    repaired = reconcile(*table5())
    points, values = repaired.repairs[0], repaired.printed.responses
    study = read_study("table4")
    space, baseline = Space(study.factors, ALPHA), study.test()
    surface = select_surface("max_force_N", space.names, points, values)
    print("terms:", ", ".join(surface.labels))
    print({name: round(value, 4) for name, value in surface.quality.items()})
    for what, error in CASES.items():
        targets = Targets(("max_force_N",), np.array([84.8]), np.array([[error**2]]))
        design = Design("central composite", points, ALPHA)
        fit = fit_targets(Misfit((surface,), targets, design.region), space, baseline)
        names = {"row": "run", repaired.printed.response: "max_force_N"}
        runs = repaired.design.rename(columns=names).assign(ending="completed")
        surfaces = {"max_force_N": surface}
        found = Calibration(study, baseline, space, design, CAMPAIGN, runs, surfaces, fit)
        print(f"\n{what}; of the surface {surface.prediction_error:.2f} N")
        print("\n".join(found.findings()))
        print("contraction of the prior variance:", fit.posterior.contraction.round(2))
    shown = replace(fit.misfit, targets=replace(targets, covariance=np.array([[0.3**2]])))
    picture = level_figure(found, replace(fit, misfit=shown))
    picture.savefig(folder / "published_optimum.png", dpi=130)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs"))
