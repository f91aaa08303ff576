"""Expansion of UFL's tensor expressions into graphs of scalar operations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import ufl
from ufl import classes
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering

from ramiefenics.model.kernels.scalars import Graph, Node
from ramiefenics.model.laws.base import Expr

CONDITIONS = {
    classes.LT: "lt",
    classes.GT: "gt",
    classes.LE: "le",
    classes.GE: "ge",
    classes.EQ: "eq",
    classes.NE: "ne",
    classes.AndCondition: "and",
    classes.OrCondition: "or",
    classes.NotCondition: "not",
}

FUNCTIONS = {
    classes.Sqrt: "sqrt",
    classes.Exp: "exp",
    classes.Ln: "log",
    classes.Sin: "sin",
    classes.Cos: "cos",
    classes.Tan: "tan",
    classes.Asin: "asin",
    classes.Acos: "acos",
    classes.Atan: "atan",
    classes.Sinh: "sinh",
    classes.Cosh: "cosh",
    classes.Tanh: "tanh",
    classes.Erf: "erf",
    classes.Abs: "abs",
}

Component = tuple[int, ...]


class UnknownOperation(Exception):
    """An operation in an expression has no counterpart in C."""


class Lowering:
    """Expands expressions of given terminals into one graph.

    Parameters
    ----------
    graph
        Graph to which the nodes belong.
    terminals
        Components of each terminal: an array of nodes in the terminal's shape.
    """

    def __init__(self, graph: Graph, terminals: Mapping[Expr, np.ndarray]) -> None:
        self._graph, self._terminals = graph, terminals
        self._known: dict[tuple, Node] = {}
        self._gradients: dict[tuple, dict[Component, Node]] = {}
        self._kept: list[Expr] = []  # as keys are identities; UFL frees duplicates

    def lower(self, expression: Expr) -> list[Node]:
        """Return the nodes of an expression's components, row by row.

        Raises
        ------
        UnknownOperation
            If an operation in it has no counterpart in C.
        """
        expression = apply_algebra_lowering(ufl.as_ufl(expression))
        shape = expression.ufl_shape
        return [self._component(expression, index, {}) for index in np.ndindex(*shape)]

    def _component(self, e: Expr, at: Component, indices: dict[int, int]) -> Node:
        """Return one component for given values of the free indices."""
        key = (id(e), at, tuple(indices[i] for i in e.ufl_free_indices))
        if key not in self._known:
            self._known[key] = self._new_component(e, at, indices)
            self._kept.append(e)
        return self._known[key]

    def _new_component(self, e: Expr, at: Component, indices: dict[int, int]) -> Node:
        graph, operands = self._graph, e.ufl_operands

        def scalars() -> list[Node]:
            return [self._component(operand, (), indices) for operand in operands]

        kind = type(e)
        if e in self._terminals:
            return Node(self._terminals[e][at])
        if isinstance(e, classes.Zero):
            return graph.constant(0.0)
        if isinstance(e, classes.ScalarValue):
            return graph.constant(float(e))
        if isinstance(e, classes.Identity):
            return graph.constant(float(at[0] == at[1]))
        if isinstance(e, classes.Indexed | classes.ComponentTensor | classes.IndexSum):
            return self._indexed(e, at, indices)
        if isinstance(e, classes.ListTensor):
            return self._component(operands[at[0]], at[1:], indices)
        if isinstance(e, classes.Conj | classes.Real):  # all values are real
            return self._component(operands[0], at, indices)
        if isinstance(e, classes.Variable):
            return graph.label(self._component(operands[0], at, {}), (operands[1].count(), at))
        if isinstance(e, classes.VariableDerivative):
            return self._derivative(e, at, indices)
        if isinstance(e, classes.Sum):
            return graph.add(*(self._component(operand, at, indices) for operand in operands))
        if isinstance(e, classes.Product):
            return graph.multiply(*scalars())
        if isinstance(e, classes.Division):
            a, b = operands
            return graph.divide(self._component(a, at, indices), self._component(b, (), indices))
        if isinstance(e, classes.Power):
            return graph.power(*scalars())
        if isinstance(e, classes.MinValue | classes.MaxValue):
            a, b = scalars()
            smaller = graph.condition("lt", a, b)
            return graph.select(smaller, *((a, b) if kind is classes.MinValue else (b, a)))
        if isinstance(e, classes.Conditional):
            condition = self._component(operands[0], (), indices)
            a, b = (self._component(operand, at, indices) for operand in operands[1:])
            return graph.select(condition, a, b)
        if kind in FUNCTIONS:
            return graph.function(FUNCTIONS[kind], *scalars())
        if kind in CONDITIONS:
            return graph.condition(CONDITIONS[kind], *scalars())
        raise UnknownOperation(f"{kind.__name__} is not supported in generated C code")

    def _indexed(self, e: Any, at: Component, indices: dict[int, int]) -> Node:
        inner, names = e.ufl_operands
        if isinstance(e, classes.Indexed):
            at = tuple(
                int(i) if isinstance(i, classes.FixedIndex) else indices[i.count()] for i in names
            )
            return self._component(inner, at, indices)
        if isinstance(e, classes.ComponentTensor):
            bound = {i.count(): value for i, value in zip(names, at, strict=True)}
            return self._component(inner, (), indices | bound)
        total = self._graph.constant(0.0)
        for value in range(e.dimension()):
            more = self._component(inner, at, indices | {names[0].count(): value})
            total = self._graph.add(total, more)
        return total

    def _derivative(self, e: Any, at: Component, indices: dict[int, int]) -> Node:
        """Return a derivative with respect to a `ufl.variable`."""
        of, by = e.ufl_operands
        rank = len(of.ufl_shape)
        end = self._component(of, at[:rank], indices)
        key = (end, by.label().count())
        if key not in self._gradients:
            places = list(np.ndindex(*by.ufl_shape))
            sources = [self._component(by, place, {}) for place in places]
            rates = self._graph.gradient(end, sources)
            self._gradients[key] = dict(zip(places, rates, strict=True))
        return self._gradients[key][at[rank:]]
