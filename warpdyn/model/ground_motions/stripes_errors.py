"""Better errors for missing or unknown arguments of Stripes."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar

Kind = TypeVar("Kind", bound=type)


def named_in_errors(kind: Kind) -> Kind:
    """Return the class Stripes with better TypeErrors: they name missing or unknown arguments and explain `levels`."""
    make: Callable[..., None] = kind.__init__  # type: ignore[misc] # __init__ of this class
    signature = inspect.signature(make)

    @functools.wraps(make)
    def checked(self: object, *given: Any, **named: Any) -> None:
        try:
            signature.bind(self, *given, **named)
        except TypeError as error:
            unknown = [name for name in named if name not in signature.parameters]
            renamed = f"; {unknown[0]!r} is called 'levels'" if unknown and unknown[0].startswith("levels") else ""
            raise TypeError(
                f"Stripes(motions, levels, measure): {error}{renamed}; levels are intensities of the measure, such as "
                "[0.1, 0.2, 0.4], and levels_for(scene, limits) returns levels at which the curves rise"
            ) from None
        make(self, *given, **named)

    kind.__init__ = checked  # type: ignore[misc] # as above
    return kind
