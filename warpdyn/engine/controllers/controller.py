"""The base class of controllers, and the controllers of warpdyn."""

from __future__ import annotations

import dataclasses
import inspect
import textwrap
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, dataclass_transform

import numpy as np

from warpdyn.engine.laws.law import parameter
from warpdyn.engine.laws.parameter import Parameter
from warpdyn.engine.laws.written.checks import OF_CONTROLLERS, check_memory
from warpdyn.engine.laws.written.rewriting import written
from warpdyn.engine.laws.written.source import Captured, Written, captured, device_function
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import did_you_mean

EXAMPLE = (
    "@wp.func\n    def command(measured: Any, memory: Any, c: Any):\n        return -c.coefficient * measured.rate"
)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter,))
class Controller:
    """Base class of controllers: a function of measured values that returns the command of an actuator.

    A subclass declares its parameters as fields, and a device function `command(measured, memory, c)` that is called at
    each sampling instant for each actuator. The command is a force [N] for an `Actuator`, a coefficient [N s/m] for a
    `VariableDamper`, and a voltage [V] for an `MRDamper`. A function with memory returns the command and then the new
    values of the memory.

    Attributes:
        parameters: Parameters of the controller: {name: parameter}.
        memory: Names of the memory values of each actuator; they are 0 at the start.
        acts_on: Kind of actuator that takes the commands: "force", "damper" or "magnetorheological"; None: any kind.
        written: Source of the device function.

    Raises:
        TypeError: If the class breaks a rule, or a parameter is missing or unknown.
        ValueError: If a parameter is out of its bounds.

    Example:
        >>> wd.control.SkyhookDamper(coefficient=2e3).coefficients()
        array([2000.])
    """

    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]
    parameters: ClassVar[Mapping[str, Parameter]] = MappingProxyType({})
    memory: ClassVar[tuple[str, ...]] = ()
    acts_on: ClassVar[str | None] = None
    written: ClassVar[Written]
    captured: ClassVar[dict[str, Captured]] = {}

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        try:
            _define(cls)
        except TypeError as error:
            raise TypeError(f"controller {cls.__name__}: {error}") from error.__cause__

    def __post_init__(self) -> None:
        for name, known in self.parameters.items():
            value = real_number(f"{name} [{known.units}]", getattr(self, name))
            problem = known.first_violation(name, np.array(value), ())
            if problem:
                raise ValueError(problem)
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={getattr(self, name):g}" for name in self.parameters)
        return f"{type(self).__name__}({values})"

    @staticmethod
    def derived(p: Mapping[str, float]) -> dict[str, float]:
        """Return further coefficients that `command` may read as `c.NAME`.

        Args:
            p: The parameters: {name: value}.
        """
        return {}

    def coefficients(self) -> np.ndarray:
        """Return the values of the coefficients that the device function reads, shape [coefficient]."""
        values = {name: getattr(self, name) for name in self.parameters}
        values |= self.derived(values)
        return np.array([float(values[name]) for name in self.written.coefficients])

    def description(self) -> dict[str, Any]:
        """Return the controller as a dictionary, for the JSON of the scene."""
        kind = type(self)
        own = kind.__module__.startswith("warpdyn.")
        found: dict[str, Any] = {"type": kind.__name__ if own else f"{kind.__module__}.{kind.__qualname__}"}
        found |= {name: getattr(self, name) for name in self.parameters}
        return found if own else found | {"written": self.written.text}


def _define(cls: type[Controller]) -> None:
    functions = _functions(cls)
    dataclasses.dataclass(frozen=True, kw_only=True, repr=False)(cls)
    cls.parameters = MappingProxyType(_parameters_of_controller(cls))
    cls.__init__ = _refusing_unknown_names(cls, cls.__init__)  # type: ignore[method-assign]
    cls.__doc__ = _documented(cls)
    check_memory(cls.memory)
    if "command" not in functions:
        raise TypeError(f"its device function is missing: define\n\n    {EXAMPLE}")
    sample = {name: _sample(known) for name, known in cls.parameters.items()}
    derived = cls.derived(sample)
    if not isinstance(derived, dict):
        raise TypeError(f"derived must return a dictionary of coefficients, got {type(derived).__name__}")
    cls.written = written(functions, cls.memory, (*cls.parameters, *derived), "")


def _functions(cls: type[Controller]) -> dict[str, Captured]:
    found = dict(cls.captured)
    for name, value in list(vars(cls).items()):
        function = device_function(value)
        if function is not None:
            delattr(cls, name)  # Warp functions cannot be pickled
        elif name in OF_CONTROLLERS and callable(value):
            function = value
        if function is not None:
            found[name] = captured(name, function)
    cls.captured = found
    return found


def _parameters_of_controller(cls: type[Controller]) -> dict[str, Parameter]:
    found: dict[str, Parameter] = {}
    for field in dataclasses.fields(cls):
        make = field.metadata.get("parameter")
        if make is None:
            raise TypeError(
                f"{field.name} has no unit and description: write {field.name}: float = "
                "wd.laws.parameter('N', 'what it is')"
            )
        try:
            found[field.name] = make if isinstance(make, Parameter) else make()
        except (ValueError, TypeError) as error:
            raise TypeError(f"parameter {field.name!r}: {error}") from error
    return found


def _sample(known: Parameter) -> float:
    """Return a value of a parameter within its bounds."""
    if known.default is not None:
        return known.default
    low, high = known.low, known.high
    if np.isfinite(low) and np.isfinite(high):
        return (low + high) / 2
    return low + 1 if np.isfinite(low) else high - 1 if np.isfinite(high) else 1.0


def _refusing_unknown_names(cls: type[Controller], initialise: Callable[..., None]) -> Callable[..., None]:
    def checked(self: Controller, *unnamed: Any, **values: Any) -> None:
        if unnamed:
            names = ", ".join(f"{name}=..." for name in cls.parameters)
            raise TypeError(f"{cls.__name__} takes its parameters by name: {cls.__name__}({names})")
        for name in values:
            if name not in cls.parameters:
                hint, known = did_you_mean(name, list(cls.parameters)), ", ".join(cls.parameters) or "none"
                raise TypeError(f"{cls.__name__} has no parameter {name!r}{hint}; its parameters are {known}")
        initialise(self, **values)

    checked.__signature__ = inspect.signature(initialise)  # type: ignore[attr-defined]
    return checked


def _documented(cls: type[Controller]) -> str:
    """Return the docstring of a controller with an Args section, which describes the parameters."""
    text = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
    arguments = "\n".join(
        textwrap.fill(f"{name}: {known.description}", 100, initial_indent=" " * 4, subsequent_indent=" " * 8)
        for name, known in cls.parameters.items()
    )
    if not arguments or "Args:" in text:
        return f"{text}\n"
    head, example, tail = text.partition("\n\nExample:")
    errors = "Raises:\n    ValueError: If a parameter is out of its bounds.\n    TypeError: If a parameter is missing."
    return f"{head}\n\nArgs:\n{arguments}\n\n{errors}{example}{tail}\n"
