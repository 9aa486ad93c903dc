"""Base classes of storey laws and of dampers and stops: parameters, bounds, and the coefficients that kernels read.

A law is a class whose fields are its parameters. An object such as `Bilinear(yield_force=1e6, hardening_ratio=0.05)`
contains values for all storeys of a building. Defining a class registers it in LAWS or DEVICES under its name in a
scene. Its device functions are in the class body (`laws.written`) or, for laws of warpdyn, in a module that is imported
when a kernel is built.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import inspect
import textwrap
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, dataclass_transform

import numpy as np

from warpdyn.engine.laws.definition import DEVICES, HALF_FLEXIBILITY, LAWS, check_shapes, define
from warpdyn.engine.laws.parameter import Parameter, names_of
from warpdyn.engine.laws.springs import Variant
from warpdyn.engine.laws.written.pickling import received_element, sent
from warpdyn.engine.laws.written.source import Captured
from warpdyn.engine.methods.table import StoreyForces
from warpdyn.foundations.core.checks import real_numbers
from warpdyn.foundations.core.description import html_table
from warpdyn.foundations.core.near_misses import did_you_mean

Values = Mapping[str, np.ndarray]
SHAPES = "Each parameter is one number for all storeys, or one number per storey, shape [storey], from the ground up."
ERRORS = """Raises:
    ValueError: If a parameter is out of its bounds, not finite, or neither a number nor a list of numbers.
    TypeError: If a parameter is missing or unknown."""


class Layout(enum.IntEnum):
    """Names of the elements of a vector, such as the coefficients or the history variables of a storey.

    The elements are numbered from 0. Device functions read `c[Coefficient.YIELD_DRIFT]`, which Warp compiles like
    `c[2]`. `names()` returns the keys of the same values in `named_coefficients` of the law. Define members as
    `enum.auto()`.
    """

    @staticmethod
    def _generate_next_value_(name: str, start: int, count: int, last_values: list[int]) -> int:
        return count

    @classmethod
    def names(cls, count: int | None = None) -> tuple[str, ...]:
        """Return the names of the first `count` elements (None: all elements) in lower case."""
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
    """Return a field of a law: a parameter with its units, bounds and default.

    Args:
        units: UDUNITS string, such as "N", "N m-1" or "m"; "1" for a ratio.
        long_name: Description, which the dataset contains.
        low: Lower bound [`units`].
        high: Upper bound [`units`].
        low_open: Whether the lower bound itself is forbidden.
        high_open: Whether the upper bound itself is forbidden.
        default: Default value [`units`]; None: the parameter is required.
        often_in_percent: Whether users often give the value in percent; the error message then suggests the ratio.
        opensees: OpenSees' name of the parameter.

    Example:
        >>> wd.laws.Bilinear.parameters["yield_force"].allowed
        'finite and above 0'
    """
    # The class reports errors in these values with its name.
    make = functools.partial(
        Parameter, units, long_name, low, high, low_open, high_open, default, often_in_percent, opensees
    )
    return _field(make, default)


def shared(parameter: Parameter, *, default: float | None = None, opensees: str = "") -> Any:
    """Return a field of a law for an existing parameter, such as `YIELD_FORCE` or `HARDENING_RATIO`.

    Args:
        parameter: The parameter.
        default: Default value in this law [units of the parameter]; None: the parameter is required.
        opensees: OpenSees' name of the parameter in this law.

    Example:
        >>> wd.laws.BoucWen.parameters["hardening_ratio"].opensees
        'alpha'
    """
    words = opensees or parameter.opensees
    return _field(functools.partial(dataclasses.replace, parameter, default=default, opensees=words), default)


def _field(make: Callable[[], Parameter], default: float | None) -> Any:
    return dataclasses.field(default=dataclasses.MISSING if default is None else default, metadata={"parameter": make})


def negative(parameter: Parameter, positive: str, *, opensees: str = "") -> Any:
    """Return a field for a parameter of the negative side of a backbone.

    If the user omits the parameter, the law uses the parameter of the positive side, whose name is `positive`.
    """
    words = f"{parameter.long_name}, negative side"
    found = dataclasses.replace(
        parameter, long_name=words, default=None, opensees=opensees, optional=parameter.optional or f"as `{positive}`"
    )
    return dataclasses.field(default=None, metadata={"parameter": found})


def _refusing_unknown_names(cls: type[StoreyElement], initialise: Callable[..., None]) -> Callable[..., None]:
    """Return `__init__` of a class, with an error for unknown parameters that suggests the correct name."""

    @functools.wraps(initialise)
    def checked(self: StoreyElement, *positional: Any, **values: Any) -> None:
        for name in values:
            if name not in cls.parameters:
                hint, known = did_you_mean(name, names_of(cls.parameters)), ", ".join(cls.parameters)
                raise TypeError(f"{cls.__name__} has no parameter {name!r}{hint}; its parameters are {known}")
        initialise(self, *positional, **values)

    return checked


def _described(cls: type[StoreyElement]) -> str:
    """Return the docstring of a law with an Args section before the example; the section describes the parameters."""
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
    """Base class of `Law` and `Device`; subclasses are frozen dataclasses whose fields are their parameters.

    Attributes:
        name: Name in a scene: the name of the class in lower case, with underscores between words.
        parameters: Parameters in addition to the storey stiffness: {name: parameter}.
        memory: Names of the memory values of device functions in the class body; all are 0 at the start.
        rows: Names of the sets of device functions, each with the names of the coefficients that the functions read.
        variants: The sets as objects; a class that uses the sets of another law defines `variants` instead of `rows`.
        device_functions: Module with the table SPRINGS of device functions; "" for the module `device_functions` in the
            package of the class.
        written: Source of the device functions in the class body; "" without such functions.
        opensees: Names of OpenSees' materials or elements with the same rules; a scene may use these names.
        is_linear: Whether the force is the stiffness times the drift.
        is_linear_until_yield: Whether a storey is linear until its drift first exceeds `yield_force` (or
            `yield_force_negative`) divided by the stiffness; without a `yield_force`: whether it is always linear.
        has_rate: Whether the memory follows a differential equation, which is integrated with the motion.
        relaxes: Whether the force changes with time at a constant drift; implicit methods do not support this.
        corners: Number of corners of the backbone that `ShearBuilding.from_capacity` fits; 0: a bilinear curve.
        exceptions: Checks of `wd.laws.certify` with a wider bound: {check: (bound, reason)}.
        kind: "law", "device", "contact" or "biaxial law".
        is_device: Whether the class is a device or a contact, without the stiffness of a storey.
        is_dashpot: Whether the force depends only on the velocity; then the class has no variants.
        forces: The properties that decide which integration methods can be used.
        captured: The device functions in the class body, as their author wrote them.
        table: LAWS, DEVICES, CONTACTS or BIAXIAL_LAWS.
        kinds: The classes Law, Device, Contact and BiaxialLaw.

    Example:
        >>> wd.laws.Bilinear.name, list(wd.laws.Bilinear.parameters)
        ('bilinear', ['yield_force', 'hardening_ratio'])
    """

    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]  # set by `dataclass` in each subclass
    name: ClassVar[str]
    parameters: ClassVar[Mapping[str, Parameter]] = MappingProxyType({})
    memory: ClassVar[tuple[str, ...]] = ()
    rows: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType({})
    variants: ClassVar[Mapping[str, Variant]] = MappingProxyType({})
    device_functions: ClassVar[str] = ""
    written: ClassVar[str] = ""
    opensees: ClassVar[tuple[str, ...]] = ()
    is_linear: ClassVar[bool] = False
    is_linear_until_yield: ClassVar[bool] = False
    has_rate: ClassVar[bool] = False
    relaxes: ClassVar[bool] = False
    corners: ClassVar[int] = 0
    exceptions: ClassVar[Mapping[str, tuple[float, str]]] = MappingProxyType({})
    kind: ClassVar[str] = "law"
    is_device: ClassVar[bool] = False
    is_dashpot: ClassVar[bool] = False
    forces: ClassVar[StoreyForces]
    captured: ClassVar[dict[str, Captured]] = {}
    table: ClassVar[dict[str, Any]]  # the registry of Law or Device
    kinds: ClassVar[tuple[type[Any], ...]] = ()

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        define(cls)

    @classmethod
    def make_dataclass(cls) -> None:
        """Make the class a frozen dataclass whose fields are its parameters."""
        dataclasses.dataclass(frozen=True, kw_only=True, repr=False)(cls)
        # Mypy rejects every assignment to a method, even to a method that `dataclass` has just made.
        cls.__init__ = _refusing_unknown_names(cls, cls.__init__)  # type: ignore[method-assign]

    @classmethod
    def describe(cls) -> None:
        """Add a description of the parameters to the docstring of the class."""
        cls.__doc__ = _described(cls)

    def __post_init__(self) -> None:
        for name, parameter in self.parameters.items():
            if parameter.optional and getattr(self, name) is None:
                continue
            values = real_numbers(name, getattr(self, name), parameter.units)
            if values.ndim > 1 or not values.size:
                raise ValueError(f"{name} must be one value or one per storey, got shape {values.shape}")
            problem = parameter.first_violation(name, values, ("storey",)[: values.ndim])
            if problem:
                raise ValueError(problem)
            object.__setattr__(self, name, tuple(values.tolist()) if values.ndim else values.item())

    def __repr__(self) -> str:
        given = {name: value for name, value in self.values().items() if value != self.parameters[name].default}
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in given.items())})"

    def __reduce__(self) -> tuple[Any, ...]:
        return received_element, (sent(type(self)), self.values())

    def _repr_html_(self) -> str:
        held = self.values()
        rows = [(self.parameters[name].long_name, name, held[name], self.parameters[name].units) for name in held]
        return html_table(type(self).__name__, rows, ("", "name", "value", "units"))

    def values(self) -> dict[str, float | tuple[float, ...]]:
        """Return the values of all parameters, including defaults; each is one value, or one value per storey."""
        values = {name: getattr(self, name) for name in self.parameters}
        return {name: value for name, value in values.items() if value is not None}

    @classmethod
    def spring(cls, p: Values) -> str:
        """Return the name of the set of device functions for these parameters, a key of `rows`; "" if there is one."""
        return next(iter(cls.rows), "")

    @classmethod
    def variant(cls, p: Values) -> Variant:
        """Return the variant (set of device functions) for these parameters, each [structure, storey]."""
        return cls.variants[cls.spring(p)]

    @staticmethod
    def derived(p: Values) -> dict[str, np.ndarray]:
        """Return further coefficients for device functions in the class body: {name: values}.

        The coefficients are computed once per structure. Put divisions into this method, because they are slow in
        device functions.

        Args:
            p: Parameters and stiffness of the storeys: {name: array of shape [structure, storey]}.
        """
        return {}

    @classmethod
    def named_coefficients(cls, p: Values, row: str) -> dict[str, np.ndarray]:
        """Return the coefficients of a set of device functions: {name: values}, shape [structure, storey].

        Args:
            p: Parameters and stiffness of the storeys: {name: array of shape [structure, storey]}.
            row: Name of the set, from `spring`.

        Raises:
            TypeError: If `derived` returns a coefficient of a wrong shape.
        """
        derived, shape = cls.derived(p), np.shape(p["stiffness"])
        check_shapes(derived, shape)
        known = {**p, **derived}
        if HALF_FLEXIBILITY in cls.rows[row]:
            # For a law this is the flexibility of the storey, for a device that of the device.
            stiffness = np.broadcast_to(cls.stiffest(p) if cls.is_device else p["stiffness"], shape)
            known[HALF_FLEXIBILITY] = np.divide(0.5, stiffness, out=np.zeros(shape), where=stiffness > 0)
        return {name: np.broadcast_to(known[name], shape) for name in cls.rows[row]}

    @classmethod
    def coefficients(cls, p: Values, row: str) -> tuple[np.ndarray, ...]:
        """Return the coefficients of a set of device functions, in the order of `rows`, each [structure, storey].

        Raises:
            TypeError: If the names from `named_coefficients` differ from the names in `rows`.
        """
        found, names = cls.named_coefficients(p, row), cls.rows.get(row, ())
        if found.keys() != set(names):
            wrong = sorted(found.keys() ^ set(names))
            raise TypeError(
                f"row {row!r} of law {cls.name!r} names the coefficients {', '.join(names)}, but named_coefficients() "
                f"differs in {', '.join(wrong)}: correct the row, or named_coefficients()"
            )
        return tuple(found[name] for name in names)

    @staticmethod
    def problem(p: Values) -> str | None:
        """Return a sentence about parameters that contradict each other, or None; `p` as in `derived`."""
        return None

    @staticmethod
    def caution(p: Values) -> str | None:
        """Return a warning about parameters that make results unreliable, or None; `p` as in `derived`."""
        return None

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Return whether every reversal of the drift, however small, damages a storey with these parameters.

        Rounding causes small reversals, so such storeys may need float64.
        """
        return False

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        """Return whether a small change of the step or the motion may change the peak drifts by a large amount.

        Peak drifts are sensitive if reversals cause damage, if the strength decreases with the drift, or if bodies
        collide.
        """
        return cls.counts_reversals(p)

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        """Return the largest tangent stiffness that storeys can have [N/m], shape [structure, storey]."""
        return p["stiffness"]

    @classmethod
    def steepest_damping(cls, p: Values) -> np.ndarray:
        """Return the largest slope of the force along the velocity [N s/m], [structure, storey]; usually 0."""
        return np.zeros_like(p["stiffness"])

    @classmethod
    def relaxation_rate(cls, p: Values) -> np.ndarray:
        """Return the rate [1/s] at which forces relax at a constant drift, [structure, storey]; 0: no relaxation."""
        return np.zeros_like(p["stiffness"])


class Law(StoreyElement):
    """Base class of storey laws: the force of a storey as a function of its drift history and its parameters.

    To define a law, derive a class. Its fields are parameters (`wd.laws.parameter`). Its device functions are
    `follow(drift, memory, c)`, or `rate(velocity, memory, c)` and `force(drift, memory, c)`. `wd.laws.certify` checks
    the law.

    Raises:
        TypeError: If the definition of the subclass breaks a rule.

    Example:
        >>> isinstance(wd.laws.Takeda(yield_force=1e6, hardening_ratio=0.02), wd.laws.Law)
        True
        >>> wd.laws.LAWS["takeda"].parameters["unloading_exponent"].default
        0.4
    """

    table = LAWS


class Device(StoreyElement):
    """Base class of dampers and stops, which act in parallel with the law of a storey; their strength may be 0.

    Example:
        >>> damper = wd.laws.ViscousDamper(damper_coefficient=2e6)
        >>> isinstance(damper, wd.laws.Device), "gap" in wd.laws.DEVICES
        (True, True)
    """

    table = DEVICES
    kind, is_device = "device", True


StoreyElement.kinds = (Law, Device)
#: Yield force [N], a parameter of most laws.
YIELD_FORCE = Parameter("N", "storey yield force", low=0.0, low_open=True)
#: Hardening ratio [1], a parameter of most laws.
HARDENING_RATIO = Parameter(
    *("1", "ratio of post-yield to initial storey stiffness"), low=0.0, high=1.0, high_open=True, often_in_percent=True
)
