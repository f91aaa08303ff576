"""A manufactured solution at large strain, and the observed orders of convergence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import ufl
from dolfinx import fem

from ramiefenics.model.laws import LAWS
from ramiefenics.model.laws.base import Expr
from ramiefenics.model.solid import Solid
from ramiefenics.published.stalks import XYLEM
from ramiefenics.verification.block import (
    BoundaryValueProblem,
    all_around,
    block,
    layers,
    norm,
    prescribe,
    second_order,
)
from ramiefenics.verification.study import Array, Plot, Series, Study, near, observed_orders

LAW = "saturating_fibre"
AMPLITUDE = 0.1
SOURCE_DEGREE = {1: 4, 2: 6}
CELLS = {1: (4, 8, 16), 2: (2, 4, 8)}


def manufactured_displacement(x: Expr, module: Any) -> list[Expr]:
    """Return the exact displacement, mm, of a unit cube; fibres are stretched and compressed."""
    sin, cos, pi = module.sin, module.cos, np.pi
    return [
        AMPLITUDE * sin(pi * x[0]) * cos(pi * x[1]) * cos(pi * x[2]),
        -AMPLITUDE * cos(pi * x[0]) * sin(pi * x[1]) * cos(pi * x[2]),
        AMPLITUDE * x[0] * sin(pi * x[2] + x[1]),
    ]


def solve(order: int, cells: int) -> tuple[float, float]:
    """Return the L2 errors of the displacement and of its gradient."""
    even = np.linspace(0.0, 1.0, cells + 1)
    mesh = block(even, even, even)
    mesh = mesh if order == 1 else second_order(mesh)
    solid = Solid(mesh, layers(mesh), [XYLEM], LAW)
    exact = ufl.as_vector(manufactured_displacement(ufl.SpatialCoordinate(mesh), ufl))
    F = ufl.variable(ufl.Identity(3) + ufl.grad(exact))
    constants = {
        name: fem.Constant(mesh, value) for name, value in LAWS[LAW].parameters(XYLEM).items()
    }
    stress = ufl.diff(LAWS[LAW].energy(F, constants), F)
    fine = ufl.dx(mesh, metadata={"quadrature_degree": SOURCE_DEGREE[order]})

    def values(x: Array) -> Array:
        return np.array(manufactured_displacement(x, np))

    bcs = [prescribe(solid, all_around(mesh), values)]
    problem = BoundaryValueProblem(solid, bcs, lambda v: ufl.dot(ufl.div(stress), v) * fine)
    u = solid.displacement
    u.interpolate(values)
    problem.solve(1e-9)
    miss = u - exact
    gradient = ufl.grad(miss)
    return norm(ufl.inner(miss, miss) * fine), norm(ufl.inner(gradient, gradient) * fine)


def manufactured() -> Study:
    """Refine meshes of both element orders, and observe the orders of convergence."""
    rows, checks, series = [], [], []
    for order, counts in CELLS.items():
        errors = np.array([solve(order, cells) for cells in counts])
        sizes = [1.0 / cells for cells in counts]
        for k, name in enumerate(("L2", "H1")):
            orders = observed_orders(sizes, list(errors[:, k]))
            expected = order + 1 - k
            checks.append(
                near(
                    f"order {order}, last observed order of convergence in {name}",
                    orders[-1],
                    expected,
                    0.2 / expected,
                    "the theory's order, with meshes not yet in the limit",
                )
            )
            label = f"order {order}, {name}"
            series.append(Series(label, sizes, list(errors[:, k]), slope=expected))
        for cells, (l2, h1) in zip(counts, errors, strict=True):
            rows.append({"order": order, "cells": cells**3, "L2 (mm5/2)": l2, "H1 (mm3/2)": h1})
    return Study(
        "Manufactured solution",
        "A unit cube of xylem with fibres along Z, and a smooth displacement with strains up to "
        "40 % that stretches fibres in some places and makes them give way in others. The body "
        "force is the divergence of its stress, by symbolic differentiation (Roache 1998). "
        "Expected orders: p + 1 in L2, p for the gradient.",
        tuple(checks),
        pd.DataFrame(rows),
        Plot("cell size (mm)", "error (mm5/2 in L2, mm3/2 in H1)", tuple(series), log=True),
    )
