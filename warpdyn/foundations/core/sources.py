"""Source texts of functions of the user, and the constants that they read; a run is identified by them."""

from __future__ import annotations

import inspect
import linecache
from collections.abc import Callable
from types import CodeType
from typing import Any

import numpy as np

OF_LIBRARIES = ("warpdyn.", "numpy", "warp.")  # modules whose functions are not functions of the user
CONSTANTS = (int, float, str, tuple, list, dict, np.ndarray)  # classes of the constants whose values are recorded


def source_of_function(function: Callable[..., Any]) -> str:
    """Return the source text of a function; if the source is not available, its bytecode as text."""
    code = function.__code__
    linecache.checkcache(code.co_filename)  # the user may have edited the file in this process
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return repr((code.co_code, code.co_consts, code.co_names))


def sources_read(
    function: Callable[..., Any], source_of: Callable[[Callable[..., Any]], str] = source_of_function
) -> list[str]:
    """Return the source text of a function, the constants that it reads, and both for each function that it calls.

    Functions of warpdyn, NumPy and Warp are left out: only functions of the user are listed.

    Args:
        function: The function.
        source_of: Function that returns the source text of `function`.
    """
    return _sources(function, source_of, set())


def _sources(
    function: Callable[..., Any], source_of: Callable[[Callable[..., Any]], str], seen: set[CodeType]
) -> list[str]:
    if function.__code__ in seen:
        return []
    seen.add(function.__code__)
    found = [source_of(function)]
    read = inspect.getclosurevars(function)
    for name, value in sorted({**read.globals, **read.nonlocals}.items()):
        if inspect.isfunction(value) and not value.__module__.startswith(OF_LIBRARIES):
            found += _sources(value, source_of_function, seen)
        elif isinstance(value, CONSTANTS):
            found.append(f"{name} = {value!r}")
    return found
