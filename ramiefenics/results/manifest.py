"""The summary of a run: its figures, and all that is needed to repeat it."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import math
import platform
from collections.abc import Mapping
from typing import Any

import numpy as np

import ramiefenics
from ramiefenics.model.compat import VERSION as DOLFINX_VERSION
from ramiefenics.solve.result import LOSSES, BendingResult
from ramiefenics.specification.files import to_dict

PACKAGES = ("petsc4py", "mpi4py", "numpy", "scipy", "gmsh", "pyvista", "statsmodels", "emcee")


def summarise(result: BendingResult) -> dict[str, Any]:
    """Return figures and manifest of a run, ready for JSON."""
    curve = result.curve
    force = curve["force_N"]
    work = float(curve["indenter_work_Nmm"].iloc[-1])
    most = float(curve["indenter_work_Nmm"].max())
    spent = float(curve["stored_energy_Nmm"].iloc[-1] + curve["friction_work_Nmm"].iloc[-1])
    imbalance = float((force - curve["support_force_N"]).abs().max())
    return {
        "max_force_N": result.max_force_N,
        "displacement_at_max_mm": result.displacement_at_max_mm,
        "has_force_maximum": result.has_force_maximum,
        "plateau_mm": list(result.peak.plateau_mm),
        "step_error_N": result.peak.step_error_N,
        "mesh_error_N": result.mesh_error_N,
        "slope_N_per_mm": result.slope_N_per_mm,
        "completed": result.completed,
        "ending": dataclasses.asdict(result.ending),
        "reached_mm": float(curve["displacement_mm"].max()),
        "force_imbalance": imbalance / result.max_force_N if result.max_force_N > 0 else None,
        "energy_imbalance": (work - spent) / most if most > 0 else None,
        "min_volume_ratio": float(curve["min_volume_ratio"].min()),
        "min_principal_stretch": float(curve["min_principal_stretch"].min()),
        "min_acoustic_MPa": (
            float(curve["min_acoustic_MPa"].min()) if result.test.numerics.acoustic_check else None
        ),
        "lost_at_mm": {name: result.losses_mm.get(name) for name in LOSSES},
        "jumps": [dataclasses.asdict(jump) for jump in result.jumps],
        **dataclasses.asdict(result.statistics),
        "mesh": result.test.numerics.mesh.name,
        "versions": versions(),
        "specification": to_dict(result.test),
    }


def versions() -> dict[str, str]:
    """Return the versions of all that computes."""
    found = {
        "ramiefenics": ramiefenics.__version__,
        "python": platform.python_version(),
        "dolfinx": DOLFINX_VERSION,
    }
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # a distribution may install a module without its metadata
    return found


def finite(value: Any) -> Any:
    """Return nested content as JSON knows it: no NaN, no infinity, plain numbers."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
