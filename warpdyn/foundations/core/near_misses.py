"""Suggestions of similar known names for an unknown name."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
Class = TypeVar("Class", bound=type)
LEAST_BEGINNING, MOST_BEGUN = 3, 3  # fewest letters of a beginning that is completed, and most names suggested for it


def did_you_mean(name: object, known: Mapping[str, str] | Iterable[str]) -> str:
    """Return " (did you mean 'yield_force'?)" if a known name is similar, otherwise "".

    Args:
        name: The unknown name.
        known: Known names; or a mapping from known names to the names to suggest, such as OpenSees' names -> warpdyn's.
    """
    if not isinstance(name, str):
        return ""
    known = known if isinstance(known, Mapping) else {word: word for word in known}
    by_lower = {word.lower(): suggested for word, suggested in known.items()}
    wanted = name.lower().replace(" ", "_").replace("-", "_")
    close = difflib.get_close_matches(wanted, by_lower, n=1, cutoff=0.7)
    if not close and len(wanted) >= LEAST_BEGINNING:  # "newmark" is completed to "newmark_average", "newmark_linear"
        close = [word for word in by_lower if word.startswith(wanted)][:MOST_BEGUN]
    return f" (did you mean {' or '.join(repr(by_lower[word]) for word in close)}?)" if close else ""


def refuse_unknown(function: str, named: Collection[str], known: Collection[str], names: Mapping[str, str]) -> None:
    """Raise a TypeError if a call has an argument that the function does not have; the message suggests a similar name.

    Args:
        function: Name of the function.
        named: Names of the arguments in the call.
        known: Names of the function's arguments.
        names: Name that a user may try -> name to suggest.
    """
    for unknown in named:
        if unknown not in known:
            hint = did_you_mean(unknown, names)
            raise TypeError(f"{function}() has no argument {unknown!r}{hint}; it takes {', '.join(known)}")


def _too_many(function: str, count: int, of_place: list[str]) -> str:
    """Return the message for a call with too many arguments without a name.

    Args:
        function: Name of the function.
        count: Number of arguments without a name in the call.
        of_place: Names of the arguments that may be given without a name.
    """
    advice = "give the others by name, name=value"
    if len(of_place) == 1:
        advice = f"to give several values, use one list, {function}([first, second])"
    number = f"{len(of_place)} argument{'s' if len(of_place) != 1 else ''}"
    return f"{function}() takes {number} without a name ({', '.join(of_place)}), got {count}: {advice}"


def suggests_names(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function with better TypeErrors: the error about an unknown argument suggests a similar name.

    If the function accepts any keyword argument, only the error about a missing required argument suggests names.
    """
    parameters = list(inspect.signature(function).parameters.values())
    own = [each for each in parameters if each.name not in ("self", "cls")]
    first = len(parameters) - len(own)  # 1 if there is `self` or `cls`
    known = [each.name for each in own if each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL)]
    needed = [each.name for each in own if each.default is each.empty and each.name in known]
    of_place = [each.name for each in own if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD)]
    takes_any_place = any(each.kind is each.VAR_POSITIONAL for each in own)
    takes_any = any(each.kind is each.VAR_KEYWORD for each in own)
    name = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]

    @functools.wraps(function)
    def checked(*given: P.args, **named: P.kwargs) -> R:
        if not takes_any_place and len(given) - first > len(of_place):
            raise TypeError(_too_many(name, len(given) - first, of_place))
        if not takes_any:
            refuse_unknown(name, named, known, {word: word for word in known})
        missing = [each for each in needed if each not in named and each not in known[: max(0, len(given) - first)]]
        if missing:
            unknown = [word for word in named if word not in known]
            hints = [f"{word!r}{hint}" for word in unknown if (hint := did_you_mean(word, missing))]
            hint = hints[0] if hints else ""
            said = f": it has no argument {hint}" if hint else ""
            raise TypeError(f"{name}() needs {' and '.join(missing)}{said}; it takes {', '.join(known)}")
        return function(*given, **named)

    return checked


def with_suggestions(cls: Class) -> Class:
    """Return the class; its constructor is decorated with `suggests_names`, which suggests similar argument names."""
    made: Any = cls
    made.__init__ = suggests_names(made.__init__)
    return cls
