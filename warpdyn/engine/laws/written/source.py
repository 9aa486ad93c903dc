"""Device functions of a class body as text, which can be compared, hashed, pickled and built in any process."""

from __future__ import annotations

import ast
import builtins
import hashlib
import inspect
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Written:
    """The device functions of one law.

    Args:
        text: Their source, with coefficients and memory values as places of vectors.
        functions: From the names in the class body ("follow", "tangent") to the names in the text.
        imports: Name in the text, module and attribute of each function of warpdyn that the text calls.
        coefficients: Names of the coefficients, in the order of their places.
        memory: Names of the memory values, in the order of their places.
    """

    text: str
    functions: tuple[tuple[str, str], ...]
    imports: tuple[tuple[str, str, str], ...]
    coefficients: tuple[str, ...]
    memory: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Eight letters that differ for other functions, coefficients or memory values."""
        return hashlib.sha256(repr((self.text, self.imports, self.coefficients, self.memory)).encode()).hexdigest()[:8]


@dataclass(frozen=True)
class Captured:
    """A function as its author wrote it.

    Args:
        name: Its name.
        node: Its definition.
        values: Values of the names that it reads and does not assign; a name without a value is missing.
    """

    name: str
    node: ast.FunctionDef
    values: Mapping[str, Any]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the name only: the text of the law is complete, and values may be modules."""
        return Captured, (self.name, None, {})


def device_function(value: object) -> Callable[..., Any] | None:
    """Return the Python function of a Warp function (`@wp.func`), or None; warp need not be imported."""
    is_warp = type(value).__module__.partition(".")[0] == "warp" and type(value).__name__ == "Function"
    return getattr(value, "func", None) if is_warp else None


def captured(name: str, function: Callable[..., Any]) -> Captured:
    """Return a function's definition and the values that it reads.

    Raises:
        TypeError: If its source is not available, as in an interactive prompt.
    """
    try:
        text = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError):
        raise TypeError(
            f"the source of {name} is not available: define the class in a file or in a notebook cell"
        ) from None
    node = ast.parse(text).body[0]
    if not isinstance(node, ast.FunctionDef):
        raise TypeError(f"{name} must be written with def")
    code = function.__code__
    ast.increment_lineno(node, code.co_firstlineno - 1)
    cells = zip(code.co_freevars, function.__closure__ or (), strict=True)
    scope = {**vars(builtins), **function.__globals__}
    for free, cell in cells:
        try:
            scope[free] = cell.cell_contents
        except ValueError:  # a name that is assigned after the class
            scope.pop(free, None)
    read = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
    return Captured(name, node, {name: scope[name] for name in read & scope.keys()})
