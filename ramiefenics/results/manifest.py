"""Versions in the summary of a result, and conversion of its values to the types of JSON."""

from __future__ import annotations

import importlib.metadata
import math
import platform
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from ramiefenics.model.compat import VERSION as DOLFINX_VERSION

PACKAGES = ("petsc4py", "mpi4py", "numpy", "scipy", "gmsh", "pyvista", "statsmodels", "emcee")


def versions() -> dict[str, str]:
    """Return the versions of all software that takes part in the computation."""
    found = {
        "ramiefenics": sys.modules["ramiefenics"].__version__,  # it imports this module
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
    """Return nested content in the types of JSON, with None for NaN and infinity."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
