"""What a storey law is to a scene: its parameters, their bounds, and the coefficients a kernel reads.

A law is a class whose fields are its parameters:

    class Bilinear(Law):
        yield_force: ArrayLike = shared(YIELD_FORCE)
        hardening_ratio: ArrayLike = shared(HARDENING_RATIO)

        rows = {"bilinear": Coefficient.names()}

        @staticmethod
        def named_coefficients(p, row):
            ...

The class says what the law takes and what its kernels read; an object of it, `Bilinear(yield_force=1e6,
hardening_ratio=0.05)`, holds the values of one storey, or of every storey of a building.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import inspect
import re
import textwrap
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, dataclass_transform

import numpy as np

from warpdyn.engine.laws.parameter import Parameter, names_of
from warpdyn.foundations.core.checks import real_numbers
from warpdyn.foundations.core.description import html_table
from warpdyn.foundations.core.near_misses import did_you_mean

Values = Mapping[str, np.ndarray]
SHAPES = "Each parameter is one number for all storeys, or has one for each, shape [storey], from the ground up."
ERRORS = """Raises:
    ValueError: If a parameter is out of its bounds, not finite, or neither a number nor a row of numbers.
    TypeError: If a parameter is missing, or the name of one is unknown."""


class Layout(enum.IntEnum):
    """Names of the values of a short vector, in their order from 0: coefficients of a storey, or its memory.

    Device functions read `c[Coefficient.YIELD_DRIFT]`, which Warp compiles as it does `c[2]`; `names` are what the
    law's `named_coefficients` calls the same values. Members are given as `enum.auto()`.
    """

    @staticmethod
    def _generate_next_value_(name: str, start: int, count: int, last_values: list[int]) -> int:
        return count

    @classmethod
    def names(cls, count: int | None = None) -> tuple[str, ...]:
        """Return the names in lower case, of the first so many values or of all."""
        return tuple(member.name.lower() for member in cls)[:count]


def parameter(
    units: str,
    long_name: str,
    *,
    low: float = -np.inf,
    high: float = np.inf,
    low_open: bool = False,
    high_open: bool = False,
    default: float | None = None,
    often_in_percent: bool = False,
    opensees: str = "",
) -> Any:
    """Return a field of a law: a parameter with its units, bounds and default, as `Parameter` describes them."""
    found = Parameter(units, long_name, low, high, low_open, high_open, default, often_in_percent, opensees)
    return shared(found, default=default)


def shared(parameter: Parameter, *, default: float | None = None, opensees: str = "") -> Any:
    """Return a field for a parameter that several laws have; they may differ in its default and OpenSees' name."""
    found = dataclasses.replace(parameter, default=default, opensees=opensees or parameter.opensees)
    return dataclasses.field(default=dataclasses.MISSING if default is None else default, metadata={"parameter": found})


def negative(parameter: Parameter, positive: str, *, opensees: str = "") -> Any:
    """Return a field for a parameter of the negative side of a law; without it, the value of `positive` counts."""
    words = f"{parameter.long_name}, negative side"
    found = dataclasses.replace(
        parameter, long_name=words, default=None, opensees=opensees, optional=parameter.optional or f"as `{positive}`"
    )
    return dataclasses.field(default=None, metadata={"parameter": found})


def _refusing_unknown_names(cls: type[StoreyElement], initialise: Callable[..., None]) -> Callable[..., None]:
    """Return a class's `__init__` with an error that suggests a name for one that the class does not take."""

    @functools.wraps(initialise)
    def checked(self: StoreyElement, *positional: Any, **values: Any) -> None:
        for name in values:
            if name not in cls.parameters:
                hint, takes = did_you_mean(name, names_of(cls.parameters)), ", ".join(cls.parameters)
                raise TypeError(f"{cls.__name__} has no parameter {name!r}{hint}; it takes {takes}")
        initialise(self, *positional, **values)

    return checked


def _described(cls: type[StoreyElement]) -> str:
    """Return a class's docstring with its arguments, as their fields describe them, before its example."""
    text = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
    arguments = "\n".join(
        textwrap.fill(f"{name}: {known.description}", 100, initial_indent=" " * 4, subsequent_indent=" " * 8)
        for name, known in cls.parameters.items()
    )
    head, example, tail = text.partition("\n\nExample:")
    if not arguments:
        return f"{text}\n"
    return f"{head}\n\n{SHAPES}\n\nArgs:\n{arguments}\n\n{ERRORS}{example}{tail}\n"


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter, shared))
class StoreyElement:
    """What laws and devices have in common; subclasses are frozen dataclasses whose fields are their parameters.

    Attributes:
        name: What a scene calls it: the name of the class in lower case, words apart.
        parameters: Its parameters beside the storey stiffness, each one value or one a storey.
        rows: The rows of device functions it can lead to, and the names of the coefficients that each of them reads.
        opensees: What OpenSees calls its material or element; a scene may use these names.
        is_linear_until_yield: Whether a storey is linear, and remembers nothing, until its drift first passes
            `yield_force` or `yield_force_negative` over the stiffness (or for ever, without a `yield_force`).

    Example:
        >>> wd.laws.Bilinear.name, list(wd.laws.Bilinear.parameters)
        ('bilinear', ['yield_force', 'hardening_ratio'])
    """

    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]  # what `dataclass` gives each subclass
    name: ClassVar[str]
    parameters: ClassVar[Mapping[str, Parameter]] = MappingProxyType({})
    rows: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType({})
    opensees: ClassVar[tuple[str, ...]] = ()
    is_linear_until_yield: ClassVar[bool] = False

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        dataclasses.dataclass(frozen=True, kw_only=True, repr=False)(cls)
        fields = dataclasses.fields(cls)
        cls.name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        cls.parameters = MappingProxyType({field.name: field.metadata["parameter"] for field in fields})
        # Mypy refuses every assignment to a method, even to one that `dataclass` has just made.
        cls.__init__ = _refusing_unknown_names(cls, cls.__init__)  # type: ignore[method-assign]
        cls.__doc__ = _described(cls)

    def __post_init__(self) -> None:
        for name, parameter in self.parameters.items():
            if parameter.optional and getattr(self, name) is None:
                continue
            values = real_numbers(name, getattr(self, name))
            if values.ndim > 1 or not values.size:
                raise ValueError(f"{name} must be one value or one a storey, got shape {values.shape}")
            problem = parameter.first_violation(name, values, ("storey",)[: values.ndim])
            if problem:
                raise ValueError(problem)
            object.__setattr__(self, name, tuple(values.tolist()) if values.ndim else values.item())

    def __repr__(self) -> str:
        given = {name: value for name, value in self.values().items() if value != self.parameters[name].default}
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in given.items())})"

    def _repr_html_(self) -> str:
        held = self.values()
        rows = [(self.parameters[name].long_name, name, held[name], self.parameters[name].units) for name in held]
        return html_table(type(self).__name__, rows, ("", "name", "value", "units"))

    def values(self) -> dict[str, float | tuple[float, ...]]:
        """Return the values of all given parameters and defaults, one value or one per storey each."""
        values = {name: getattr(self, name) for name in self.parameters}
        return {name: value for name, value in values.items() if value is not None}

    @classmethod
    def spring(cls, p: Values) -> str:
        """Return the row of device functions for storeys of these parameters: the only row, where there is one."""
        return next(iter(cls.rows), "")

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        """Return what a row's device functions read, by the names in `rows`.

        Args:
            p: Parameters, each [structure, storey], beside "stiffness".
            row: The row, as `spring` returns it.
        """
        return {}

    @classmethod
    def coefficients(cls, p: Values, row: str) -> tuple[np.ndarray, ...]:
        """Return what a row's device functions read, in their order.

        Raises:
            TypeError: If `named_coefficients` returns other names than the row reads.
        """
        found, names = cls.named_coefficients(p, row), cls.rows.get(row, ())
        if found.keys() != set(names):
            wrong = sorted(found.keys() ^ set(names))
            raise TypeError(f"row {row!r} of {cls.name!r} reads {names}; named_coefficients differs in {wrong}")
        return tuple(found[name] for name in names)

    @staticmethod
    def problem(p: Values) -> str | None:
        """Return a sentence on what is wrong between the parameters, or None."""
        return None

    @staticmethod
    def caution(p: Values) -> str | None:
        """Return a sentence on what its parameters make of its answers, for a warning, or None."""
        return None

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Return whether each reversal of the drift, however small, damages storeys of these parameters.

        Rounding makes reversals of its own, so that float32 may be too coarse for such storeys.
        `tests/test_reversals.py` measures every law and compares this answer with the measured one.
        """
        return False

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        """Return whether a slightly other step or motion may change the peak drifts of such storeys a lot.

        This is so if they count reversals, if their strength falls with the drift, or if they come into contact.
        """
        return cls.counts_reversals(p)

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        """Return the largest tangent stiffness [N/m] that storeys can come to, [structure, storey]."""
        return p["stiffness"]

    @classmethod
    def relaxation_rate(cls, p: Values) -> np.ndarray:
        """Return the rate [1/s] at which forces relax at a constant drift, [structure, storey]; 0 if they do not."""
        return np.zeros_like(p["stiffness"])


class Law(StoreyElement):
    """A storey law: the force of a storey at its drift, by its parameters and the path that led there.

    Example:
        >>> isinstance(wd.laws.Takeda(yield_force=1e6, hardening_ratio=0.02), wd.laws.Law)
        True
        >>> wd.laws.LAWS["takeda"].parameters["unloading_exponent"].default
        0.4
    """


class Device(StoreyElement):
    """What stands beside a storey's law, with parameters of its own; a storey without one has a strength of 0.

    Example:
        >>> damper = wd.laws.ViscousDamper(damper_coefficient=2e6)
        >>> isinstance(damper, wd.laws.Device), list(wd.laws.DEVICES)
        (True, ['friction_damper', 'gap', 'one_sided_gap', 'viscous_damper', 'maxwell_damper'])
    """


#: The yield force [N] that most laws have among their parameters.
YIELD_FORCE = Parameter("N", "storey yield force", low=0.0, low_open=True)
#: The hardening ratio [1] that most laws have among their parameters.
HARDENING_RATIO = Parameter("1", "ratio of post-yield to initial storey stiffness", low=0.0, high=1.0, high_open=True)
