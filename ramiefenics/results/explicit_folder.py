"""The folder of a simulation with inertia: curve, summary, figure."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

from ramiefenics.results.draft import draft
from ramiefenics.results.explicit_figures import explicit_figure
from ramiefenics.results.manifest import versions
from ramiefenics.solve.explicit_result import QUASI_STATIC, ExplicitResult
from ramiefenics.solve.result import BendingResult
from ramiefenics.specification import write_test
from ramiefenics.specification.files import to_dict


def write_explicit_folder(
    result: ExplicitResult, folder: str | Path, implicit: BendingResult | None = None
) -> Path:
    """Write curve, summary, specification and figure; with the quasi-static curve if there is one.

    They take the place of an earlier result in that folder, all at once.

    Parameters
    ----------
    result
        The run, from rank 0.
    folder
        Where to; made if it does not exist.
    implicit
        A quasi-static run of the same test on the same mesh.

    Returns
    -------
    Path
        The folder.
    """
    folder = Path(folder)
    with draft(folder) as made:
        result.curve.to_csv(made / "curve.csv", index=False, float_format="%.8g")
        if implicit is not None:
            implicit.curve.to_csv(made / "implicit.csv", index=False, float_format="%.8g")
        summary = json.dumps(summarise_explicit(result, implicit), indent=2)
        (made / "summary.json").write_text(summary + "\n", encoding="utf-8")
        write_test(result.test, made / "specification.toml")
        explicit_figure(result, implicit).savefig(made / "explicit.png")
    return folder


def summarise_explicit(
    result: ExplicitResult, implicit: BendingResult | None = None
) -> dict[str, Any]:
    """Return figures and manifest of a run, ready for JSON."""
    curve = result.curve
    summary: dict[str, Any] = {}
    early = math.isnan(result.kinetic_share)  # ended before energies are judged
    if implicit is not None:
        peak, anywhere = result.differences(implicit.curve)
        summary = {
            "implicit_max_force_N": implicit.max_force_N,
            "max_force_over_implicit": peak,
            "largest_difference_over_implicit_max": anywhere,
        }
    return {
        "max_force_N": result.max_force_N,
        "displacement_at_max_mm": result.displacement_at_max_mm,
        **summary,
        "completed": result.completed,
        "ending": dataclasses.asdict(result.ending),
        "reached_mm": float(curve["displacement_mm"].iloc[-1]),
        "kinetic_over_stored_energy": None if early else result.kinetic_share,
        "quasi_static": result.quasi_static,
        "energy_error": None if early else result.energy_error,
        "mass_factor": result.test.numerics.explicit.mass_factor,
        **dataclasses.asdict(result.statistics),
        "mesh": result.test.numerics.mesh.name,
        "versions": versions(),
        "specification": to_dict(result.test),
    }


def sentences(result: ExplicitResult, implicit: BendingResult | None = None) -> list[str]:
    """Return what is to be said of a run, line by line."""
    statistics = result.statistics
    force, at = result.max_force_N, result.displacement_at_max_mm
    lines = [f"largest force {force:.2f} N at {at:.2f} mm"]
    if implicit is not None:
        peak, anywhere = (100 * share for share in result.differences(implicit.curve))
        lines.append(
            f"quasi-static {implicit.max_force_N:.2f} N; the largest forces differ by "
            f"{peak:+.2f} %, the curves nowhere by more than {anywhere:.2f} % of it"
        )
    if result.completed:
        lines.append(
            f"energy conserved within {100 * result.energy_error:.2g} %; kinetic energy at most "
            f"{100 * result.kinetic_share:.2g} % of the stored"
        )
    lines.append(
        f"mass {statistics.mass_g:.4g} g, {statistics.added_mass_g:.4g} g of it added; indenter "
        f"at {statistics.speed_mm_per_s:.4g} mm/s"
    )
    lines.append(
        f"{statistics.dofs} unknowns, {statistics.steps} steps of "
        f"{1e6 * statistics.least_time_step_s:.3g} us and more, {statistics.wall_s:.1f} s"
    )
    if result.completed and not result.quasi_static:
        lines.append(
            f"note: not quasi-static, kinetic energy or damping above {100 * QUASI_STATIC:g} %"
        )
    return lines
