"""Scalar formulas as a graph without duplicates, and their exact derivatives.

Every operation is a node, identified by its position in the graph, where its operands precede it.
A node that exists already is not made again, so equal parts of formulas are computed once.
Derivatives are further nodes: one backward sweep gives the derivatives of one node with respect to
many (reverse mode), one forward sweep those of many nodes with respect to one (Griewank and Walther
2008, chapter 3).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

Node = int

CONDITIONS = ("lt", "gt", "le", "ge", "eq", "ne", "and", "or", "not")
"""Operations whose value is true or false; they have no derivative."""

FUNCTIONS: dict[str, Callable[[float], float]] = {
    name: getattr(math, name)
    for name in (
        *("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan"),
        *("sinh", "cosh", "tanh", "erf"),
    )
} | {"abs": abs, "sign": lambda x: math.copysign(1.0, x) if x else 0.0, "inverse": lambda x: 1 / x}
"""Functions of one number; ``inverse`` is its reciprocal."""

LONGEST_PRODUCT = 8
"""Largest integer power that is expanded into a product."""


class Graph:
    """A graph of scalar operations, which grows as formulas are added.

    Attributes
    ----------
    nodes
        Operation and operands of each node. The operand of ``constant`` is its value, that of
        ``input`` its name. The operands of ``label`` are a node and a mark; derivatives can be
        taken with respect to a label, whatever the node consists of. The operands of all other
        operations are nodes.
    """

    def __init__(self) -> None:
        self.nodes: list[tuple] = []
        self._known: dict[tuple, Node] = {}

    def _make(self, *node: object) -> Node:
        if node not in self._known:
            self._known[node] = len(self.nodes)
            self.nodes.append(node)
        return self._known[node]

    def input(self, name: str) -> Node:
        """Return the node of an input."""
        return self._make("input", name)

    def constant(self, value: float) -> Node:
        """Return the node of a constant."""
        return self._make("constant", float(value))

    def label(self, a: Node, mark: object) -> Node:
        """Return a label of a node, with respect to which derivatives may be taken."""
        return self._make("label", a, mark)

    def value(self, a: Node) -> float | None:
        """Return the value of a constant; None for any other node."""
        operation, *operands = self.nodes[a]
        return operands[0] if operation == "constant" else None

    def operands(self, a: Node) -> tuple[Node, ...]:
        """Return the nodes that are a node's operands."""
        operation, *operands = self.nodes[a]
        if operation in ("constant", "input"):
            return ()
        return (operands[0],) if operation == "label" else tuple(operands)

    def add(self, a: Node, b: Node) -> Node:
        """Return a + b."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.constant(x + y)
        if x == 0.0:
            return b
        if y == 0.0:
            return a
        return self._make("add", min(a, b), max(a, b))

    def multiply(self, a: Node, b: Node) -> Node:
        """Return a b."""
        x, y = self.value(a), self.value(b)
        if x is not None and y is not None:
            return self.constant(x * y)
        if x == 0.0 or y == 0.0:
            return self.constant(0.0)
        if x == 1.0:
            return b
        if y == 1.0:
            return a
        return self._make("multiply", min(a, b), max(a, b))

    def negative(self, a: Node) -> Node:
        """Return -a."""
        return self.multiply(self.constant(-1.0), a)

    def divide(self, a: Node, b: Node) -> Node:
        """Return a / b."""
        return self.multiply(a, self.function("inverse", b))

    def function(self, name: str, a: Node) -> Node:
        """Return one of `FUNCTIONS` of a."""
        x = self.value(a)
        return self._make(name, a) if x is None else self.constant(FUNCTIONS[name](x))

    def power(self, a: Node, b: Node) -> Node:
        """Return a to the b."""
        x, y = self.value(a), self.value(b)
        if y is None:
            return self._make("power", a, b)
        if x is not None:
            return self.constant(x**y)
        if y < 0.0:
            return self.function("inverse", self.power(a, self.constant(-y)))
        whole, rest = divmod(y, 1.0)
        if rest not in (0.0, 0.5) or whole > LONGEST_PRODUCT:
            return self._make("power", a, b)
        result = self.function("sqrt", a) if rest else self.constant(1.0)
        for _ in range(int(whole)):
            result = self.multiply(result, a)
        return result

    def condition(self, name: str, *operands: Node) -> Node:
        """Return one of `CONDITIONS` of the operands."""
        return self._make(name, *operands)

    def select(self, condition: Node, a: Node, b: Node) -> Node:
        """Return a where a condition holds, else b."""
        return a if a == b else self._make("select", condition, a, b)

    def _partial(self, node: Node) -> list[tuple[Node, Node]]:
        """Return pairs of an operand of a node and the derivative with respect to it."""
        operation, *operands = self.nodes[node]
        a = operands[0]
        if operation == "label":
            return [(a, self.constant(1.0))]
        if operation == "add":
            return [(operand, self.constant(1.0)) for operand in operands]
        if operation == "multiply":
            return [(a, operands[1]), (operands[1], a)]
        if operation == "power":
            b = operands[1]
            lower = self.power(a, self.add(b, self.constant(-1.0)))
            by_exponent = self.multiply(node, self.function("log", a))
            return [(a, self.multiply(b, lower)), (b, by_exponent)]
        if operation == "select":
            one, zero = self.constant(1.0), self.constant(0.0)
            _, b, c = operands
            return [(b, self.select(a, one, zero)), (c, self.select(a, zero, one))]
        if operation in FUNCTIONS:
            return [(a, self._slope(operation, a, node))]
        return []

    def _slope(self, name: str, a: Node, value: Node) -> Node:
        """Return the derivative of a function at its argument a, given its value there."""
        one, square = self.constant(1.0), self.multiply(a, a)
        if name == "sqrt":
            return self.divide(self.constant(0.5), value)
        if name == "exp":
            return value
        if name == "log":
            return self.function("inverse", a)
        if name == "inverse":
            return self.negative(self.multiply(value, value))
        if name == "abs":
            return self.function("sign", a)
        if name == "sign":
            return self.constant(0.0)
        if name == "sin":
            return self.function("cos", a)
        if name == "cos":
            return self.negative(self.function("sin", a))
        if name == "tan":
            return self.add(one, self.multiply(value, value))
        if name == "sinh":
            return self.function("cosh", a)
        if name == "cosh":
            return self.function("sinh", a)
        if name == "tanh":
            return self.add(one, self.negative(self.multiply(value, value)))
        if name == "atan":
            return self.function("inverse", self.add(one, square))
        if name == "erf":
            bell = self.function("exp", self.negative(square))
            return self.multiply(self.constant(2.0 / math.sqrt(math.pi)), bell)
        away = self.function("sqrt", self.add(one, self.negative(square)))
        slope = self.function("inverse", away)
        return slope if name == "asin" else self.negative(slope)

    def ancestors(self, ends: Iterable[Node]) -> list[Node]:
        """Return some nodes and all nodes that they depend on, in order."""
        found: set[Node] = set()
        waiting = list(ends)
        while waiting:
            node = waiting.pop()
            if node not in found:
                found.add(node)
                waiting += self.operands(node)
        return sorted(found)

    def dependent(self, nodes: Iterable[Node], sources: Iterable[Node]) -> set[Node]:
        """Return the sources, and those of some nodes, given in order, that depend on them."""
        found = set(sources)
        for node in nodes:
            if any(operand in found for operand in self.operands(node)):
                found.add(node)
        return found

    def gradient(self, end: Node, sources: Sequence[Node]) -> list[Node]:
        """Return the derivatives of one node with respect to many, in reverse mode."""
        path = self.ancestors([end])
        moving = self.dependent(path, sources)
        rate = dict.fromkeys(sources, self.constant(0.0)) | {end: self.constant(1.0)}
        for node in reversed(path):
            if node not in moving or node not in rate or node in sources:
                continue
            for operand, slope in self._partial(node):
                if operand in moving:
                    more = self.multiply(rate[node], slope)
                    rate[operand] = self.add(rate[operand], more) if operand in rate else more
        return [rate[source] for source in sources]

    def directional(self, ends: Sequence[Node], source: Node) -> list[Node]:
        """Return the derivatives of many nodes with respect to one, in forward mode."""
        path = self.ancestors(ends)
        moving = self.dependent(path, [source])
        zero = self.constant(0.0)
        rate = {source: self.constant(1.0)}
        for node in path:
            if node not in moving or node == source:
                continue
            total = zero
            if self.nodes[node][0] == "select":
                condition, a, b = self.operands(node)
                total = self.select(condition, rate.get(a, zero), rate.get(b, zero))
            else:
                for operand, slope in self._partial(node):
                    if operand in rate:
                        total = self.add(total, self.multiply(slope, rate[operand]))
            rate[node] = total
        return [rate.get(end, zero) for end in ends]

    def unlabelled(self, ends: Sequence[Node]) -> list[Node]:
        """Return the same formulas without any labels."""
        new: dict[Node, Node] = {}
        for node in self.ancestors(ends):
            operation, *_ = self.nodes[node]
            operands = [new[operand] for operand in self.operands(node)]
            if operation == "label":
                new[node] = operands[0]
            elif operation in ("add", "multiply"):
                new[node] = getattr(self, operation)(*operands)
            elif operands:
                new[node] = self._make(operation, *operands)
            else:
                new[node] = node
        return [new[end] for end in ends]
