"""Better TypeErrors for functions whose first argument is a Scene."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from warpdyn.foundations.core.near_misses import refuse_unknown
from warpdyn.model.scene.scene import Scene

P = ParamSpec("P")
R = TypeVar("R")
# Wrong names of arguments that users try, and that are not similar to the right name -> the right name.
OTHER_NAMES = {"samples": "structures", "count": "structures", "workers": "threads"}
BY_PLACE = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)  # kinds of positional arguments


def takes_scene(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function with checks: its first argument must be a Scene, and the names of arguments must be known.

    Raises:
        TypeError: If the first argument is not a scene, there are too many positional arguments, or a name is unknown.
    """
    known = inspect.signature(function).parameters
    names = {name: name for name in known} | {word: name for word, name in OTHER_NAMES.items() if name in known}
    most = sum(parameter.kind in BY_PLACE for parameter in known.values())

    @functools.wraps(function)
    def checked(*given: P.args, **named: P.kwargs) -> R:
        name = function.__name__
        scene = given[0] if given else named.get("scene")
        refuse_unknown(name, named, known, names)
        if (given or "scene" in named) and not isinstance(scene, Scene):
            kinds = ", ".join(type(each).__name__ for each in given) or type(scene).__name__
            raise TypeError(f"{name}() takes a Scene, got {kinds}; give {name}(Scene(structure, excitation))")
        if len(given) > most:
            by_name = ", ".join(list(known)[most:])
            raise TypeError(
                f"{name}() takes {most} positional arguments, got {len(given)}; give these by name: {by_name}"
            )
        return function(*given, **named)

    return checked
