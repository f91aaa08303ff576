"""A material law as C functions, generated from its expressions in UFL."""

from __future__ import annotations

import functools
from typing import Any

import basix.ufl
import numpy as np
import ufl

from ramiefenics.model.kernels.lowering import Lowering
from ramiefenics.model.kernels.scalars import Graph, Node
from ramiefenics.model.kernels.source import function
from ramiefenics.model.laws.base import Expr, Law

ARGUMENTS = (
    "const double *restrict F, const double *restrict p, const double *restrict last,\n"
    "  double duration"
)


@functools.cache
def material_source(law: Law, parameters: tuple[str, ...], local: tuple[str, ...] = ()) -> str:
    """Return C functions that evaluate a law at all quadrature points of a cell.

    They are ``law_stress``; ``law_tangent``, the derivative of the stress, whose last two indices
    are those of the deformation gradient; ``law_energies``, the energies stored, and dissipated so
    far; and ``law_update``, the internal variables at the end of the step, in the order in which
    they are stated, followed by the energy dissipated so far.

    Parameters
    ----------
    law
        The law.
    parameters
        Names of its parameters, in the order in which the functions take them.
    local
        Names of the parameters that vary from point to point. Each has values at all points, which
        follow the other parameters.

    Raises
    ------
    UnknownOperation
        If the law uses an operation that has no counterpart in C.
    """
    graph = Graph()
    terminals: dict[Expr, np.ndarray] = {}
    domain = ufl.Mesh(basix.ufl.element("Lagrange", "hexahedron", 1, shape=(3,)))

    def given(name: str, shape: tuple[int, ...]) -> Expr:
        constant = ufl.Constant(domain, shape=shape)
        names = np.array([f"{name}{i}" for i in range(int(np.prod(shape)))]).reshape(shape)
        terminals[constant] = np.vectorize(graph.input, otypes=[int])(names)
        return constant

    start: dict[str, Any] = {} if law.memory is None else dict(law.memory.start)
    gradient = given("F", (3, 3))
    F = ufl.variable(gradient)
    p = {name: given(f"p_{name}_", ()) for name in (*parameters, *local)}
    last = {name: given(f"last_{name}_", np.shape(value)) for name, value in start.items()}
    duration = given("duration", ())
    lower = Lowering(graph, terminals).lower
    state = law.state(F, p, last, duration)
    stress = lower(law.stress(F, p, last, duration))
    components = terminals[gradient].ravel()
    rates = [graph.directional(stress, component) for component in components]
    tangent = [rate[i] for i in range(9) for rate in rates]
    before = graph.input("dissipated")
    lost = graph.add(before, *lower(law.dissipated(F, p, last, state, duration)))
    energies = [*lower(law.stored(F, p, state)), lost]
    update = [node for name in start for node in lower(state[name])] + [lost]
    places = {f"F{i}": f"F[{i} * PADDED_POINTS + q]" for i in range(9)}
    remembered = [str(graph.nodes[n][1]) for name in last for n in terminals[last[name]].ravel()]
    remembered += ["dissipated"] if start else []
    places |= {name: f"last[{i} * PADDED_POINTS + q]" for i, name in enumerate(remembered)}
    places |= {
        f"p_{name}_0": f"p[{len(parameters)} + {i} * PADDED_POINTS + q]"
        for i, name in enumerate(local)
    }
    of_cell = {f"p_{name}_0": f"p[{i}]" for i, name in enumerate(parameters)}
    of_cell["duration0"] = "duration"
    if not start:
        of_cell["dissipated"] = "0.0"

    def c(name: str, results: list[Node]) -> str:
        return function(f"law_{name}", ARGUMENTS, graph, graph.unlabelled(results), places, of_cell)

    parts = {"stress": stress, "tangent": tangent, "energies": energies, "update": update}
    return "\n".join(c(name, results) for name, results in parts.items())
