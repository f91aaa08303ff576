"""Generation of C functions from graphs of scalar operations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ramiefenics.model.kernels.scalars import CONDITIONS, Graph, Node

OPERATORS = {"add": "+", "multiply": "*"} | {
    **{"lt": "<", "gt": ">", "le": "<=", "ge": ">=", "eq": "==", "ne": "!="},
    **{"and": "&", "or": "|"},
}


def function(
    name: str,
    arguments: str,
    graph: Graph,
    results: Sequence[Node],
    at_points: Mapping[str, str],
    of_cell: Mapping[str, str],
) -> str:
    """Return a C function that evaluates formulas at all quadrature points of a cell.

    It is a loop over the points without branches, which the compiler can vectorise.

    Parameters
    ----------
    name, arguments
        Name and arguments of the function. A further argument, ``out``, receives the results, each
        at all points.
    graph
        Graph that contains the formulas.
    results
        Nodes to evaluate.
    at_points, of_cell
        C expressions of the inputs by their names in the graph: those that vary from point to
        point, `q` being the point's number, and those that do not.
    """
    nodes = graph.ancestors(results)
    varying = graph.dependent(nodes, [graph.input(name) for name in at_points])
    inputs = {**at_points, **of_cell}
    text = {node: _reference(graph, node) for node in nodes}
    before: list[str] = []
    inside: list[str] = []
    for node in nodes:
        operation, *operands = graph.nodes[node]
        if operation == "constant":
            continue
        if operation == "input":
            formula = inputs[operands[0]]
        else:
            formula = _formula(operation, [text[operand] for operand in operands])
        if operation in CONDITIONS:
            text[node] = formula
        else:
            lines = inside if node in varying else before
            lines.append(f"const double {text[node]} = {formula};")
    for place, node in enumerate(results):
        inside.append(f"out[{place} * PADDED_POINTS + q] = {text[node]};")
    return "\n".join(
        (
            f"static void {name}({arguments}, double *restrict out)",
            "{",
            *(f"  {line}" for line in before),
            "  for (int q = 0; q < PADDED_POINTS; ++q) {",
            *(f"    {line}" for line in inside),
            "  }",
            "}",
            "",
        )
    )


def _reference(graph: Graph, node: Node) -> str:
    value = graph.value(node)
    return f"t{node}" if value is None else f"({value!r})"


def _formula(operation: str, operands: list[str]) -> str:
    if operation in OPERATORS:
        return f"({f' {OPERATORS[operation]} '.join(operands)})"
    a, *others = operands
    if operation == "inverse":
        return f"1.0 / {a}"
    if operation == "not":
        return f"!{a}"
    if operation == "sign":
        return f"({a} > 0.0 ? 1.0 : {a} < 0.0 ? -1.0 : 0.0)"
    if operation == "select":
        return f"{a} ? {others[0]} : {others[1]}"
    names = {"abs": "fabs", "power": "pow"}
    return f"{names.get(operation, operation)}({', '.join(operands)})"
