"""Source of the device functions in a class body; it can be compared, hashed, pickled and compiled in any process."""

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
    """The rewritten device functions of one law.

    Args:
        text: Source of the functions, rewritten for Warp.
        functions: (Name in the class body, such as "follow"; name in the text) of each function.
        imports: (Name in the text, module, attribute) of each function of warpdyn that the text calls.
        coefficients: Names of the coefficients, in the order of the vector.
        memory: Names of the memory values, in the order of the vector.
    """

    text: str
    functions: tuple[tuple[str, str], ...]
    imports: tuple[tuple[str, str, str], ...]
    coefficients: tuple[str, ...]
    memory: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Eight characters of a hash of the source, the coefficients and the memory values."""
        return hashlib.sha256(repr((self.text, self.imports, self.coefficients, self.memory)).encode()).hexdigest()[:8]


@dataclass(frozen=True)
class Captured:
    """A device function as its author wrote it.

    Args:
        name: Name of the function.
        node: Syntax tree of its definition.
        values: Values of names that are defined outside of the function; undefined names are omitted.
    """

    name: str
    node: ast.FunctionDef
    values: Mapping[str, Any]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle only the name of the function: `Written` contains the source, and `values` may contain modules."""
        return Captured, (self.name, None, {})


def device_function(value: object) -> Callable[..., Any] | None:
    """Return the Python function of a Warp function (`@wp.func`); None for other values. Warp is not imported."""
    is_warp = type(value).__module__.partition(".")[0] == "warp" and type(value).__name__ == "Function"
    return getattr(value, "func", None) if is_warp else None


def captured(name: str, function: Callable[..., Any]) -> Captured:
    """Return the definition of a function, and the values from outside of the function that it reads.

    Raises:
        TypeError: If the source of the function is not available, as in an interactive prompt.
    """
    try:
        text = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError):
        raise TypeError(
            f"the source of {name} is not available: define the class in a file or in a notebook cell"
        ) from None
    node = ast.parse(text).body[0]
    if not isinstance(node, ast.FunctionDef):
        raise TypeError(f"{name} must be written with def, not as a lambda: a kernel contains its statements")
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
