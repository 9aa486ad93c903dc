"""The text of a recorded computation: statements of a kernel that compute each required value once."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from warpdyn.engine.tracing.nodes import OPERATIONS, Node

SIMPLE = (0.0, 1.0, -1.0, 2.0, 0.5)  # constants that are written in the text


class Program:
    """Statements of a kernel that compute recorded values.

    Attributes:
        constants: Values of the kernel's argument `constants`, so that scenes with other numbers have the same text.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.constants: list[float] = []
        self._names: dict[Node, str] = {}

    def name_of(self, node: Node) -> str:
        """Return the text of a recorded value, such as a variable's name; first add the statements that compute it."""
        waiting = [node]
        while waiting:  # without recursion: sums over storeys are deep
            each = waiting[-1]
            if each in self._names:
                waiting.pop()
                continue
            missing = [other for other in each.arguments if other not in self._names]
            if missing:
                waiting += missing
                continue
            waiting.pop()
            self._names[each] = self._text(each)
        return self._names[node]

    def names_of(self, nodes: Iterable[Node]) -> list[str]:
        """Return the text of each of these recorded values, such as the name of a variable in the kernel."""
        return [self.name_of(node) for node in nodes]

    def add(self, statement: str) -> None:
        """Add a statement to the program."""
        self.lines.append(f"    {statement}")

    @property
    def text(self) -> str:
        """The statements as one text, one per line."""
        return "\n".join(self.lines)

    def _text(self, node: Node) -> str:
        if node.operation == "constant":
            if isinstance(node.value, float) and np.isfinite(node.value) and node.value not in SIMPLE:
                self.constants.append(node.value)
                return f"constants[{len(self.constants) - 1}]"
            return _literal(node.value)
        arguments = [self._names[each] for each in node.arguments]
        if node.operation == "input":
            text = str(node.value)
        elif node.operation in OPERATIONS:
            text = OPERATIONS[node.operation].text.format(*arguments)
        else:
            text = f"{node.operation}({', '.join(arguments)})"
        name = f"t{len(self._names)}"
        self.add(f"{name} = {text}")
        return name


def _literal(value: object) -> str:
    """Return the text of a constant in a kernel."""
    if isinstance(value, bool):
        return f"bool({value})"
    assert isinstance(value, float)
    if np.isfinite(value):
        return f"wp.float64({value!r})"
    return "wp.float64(wp.nan)" if np.isnan(value) else f"wp.float64({'-' * (value < 0)}wp.inf)"
