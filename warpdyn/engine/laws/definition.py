"""Check and register the class of a storey law, damper or stop when the class is defined."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Mapping
from difflib import get_close_matches
from types import CodeType, MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from warpdyn.engine.laws.parameter import Parameter
from warpdyn.engine.laws.springs import Variant
from warpdyn.engine.laws.written.checks import ARGUMENTS, check_memory, check_set_of_functions
from warpdyn.engine.laws.written.rewriting import written
from warpdyn.engine.laws.written.source import Captured, captured, device_function
from warpdyn.engine.methods.table import StoreyForces
from warpdyn.foundations.core.sources import sources_read

if TYPE_CHECKING:
    from warpdyn.engine.laws.biaxial.law import BiaxialLaw
    from warpdyn.engine.laws.contacts.contact import Contact
    from warpdyn.engine.laws.law import Device, Law, StoreyElement

#: Name in a scene -> class of the storey law.
LAWS: dict[str, type[Law]] = {}
#: Name in a scene -> class of the device; a device acts in parallel with the law of a storey.
DEVICES: dict[str, type[Device]] = {}
#: Name in a scene -> class of the contact; only springs of a lumped structure can have it.
CONTACTS: dict[str, type[Contact]] = {}
#: Name in a scene -> class of the biaxial law; only biaxial springs of a lumped structure can have it.
BIAXIAL_LAWS: dict[str, type[BiaxialLaw]] = {}

HALF_FLEXIBILITY = "half_flexibility"  # coefficient of the elastic energy of laws that do not define it
OF_STOREY = ("stiffness", "mass", "height")
# Names of properties of buildings and of variables of datasets. A parameter with such a name would be mistaken for it.
OF_CHOICES = ("law", "devices", "damping", "damped_storeys")
OF_BUILDINGS = ("gravity_load", "drift_capacity", "drift_ratio_capacity", "collapse_drift_ratio")
OF_DAMPING = ("damping_ratio", "damping_coefficient", "damping_modes")
OF_SAMPLES = ("sample", "structure", "storey", "floor", "motion", "motion_index", "im_level", "scale_factor", "event")
OF_RESULTS = ("building", "archetype", "archetype_index", "status", "unreliable", "time", "demand")
OF_OTHERS = frozenset(OF_CHOICES + OF_BUILDINGS + OF_DAMPING + OF_SAMPLES + OF_RESULTS)
OF_DEMANDS = re.compile(
    r"peak_|residual_drift|base_shear|time_of_|(input|hysteretic|viscous|kinetic|dissipated)_energy$"
)
COMPUTED = ("name", "parameters", "forces", "written", "captured", "has_rate")  # attributes that `define` sets
CLOSE = 0.8  # least similarity (difflib) of a misspelt name to a known name
SAMPLE_STIFFNESS = 1.0e7  # N/m


def define(cls: type[StoreyElement]) -> None:
    """Complete, check and register a new class of a law, damper or stop; its annotated fields become its parameters.

    Raises:
        TypeError: If the class breaks a rule; the message names the class and the rule.
    """
    body = {name: value for name, value in vars(cls).items() if not (name.startswith("__") and name != "__doc__")}
    if "__annotations__" not in vars(cls) and not any(value is not None for value in body.values()):
        return  # pickle creates an empty class and fills it later
    try:
        _define(cls, body)
    except TypeError as error:
        raise TypeError(f"{cls.kind} {cls.__name__}: {error}") from error.__cause__


def _define(cls: type[StoreyElement], body: Mapping[str, Any]) -> None:
    if not cls.__module__.startswith("warpdyn."):
        _check_names(cls, body)
    cls.name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
    functions = _functions(cls, body)
    cls.make_dataclass()
    cls.parameters = MappingProxyType(_parameters(cls))
    cls.describe()
    if "table" in body or not hasattr(cls, "table"):
        return  # Law and Device themselves
    _check_name(cls)
    if functions:
        _write(cls, functions)
    elif "variants" in body:
        cls.rows = MappingProxyType({name: variant.coefficients for name, variant in cls.variants.items()})
    elif "rows" in body:
        module = cls.device_functions or f"{cls.__module__.rpartition('.')[0]}.device_functions"
        cls.variants = MappingProxyType({name: Variant(name, tuple(row), module) for name, row in cls.rows.items()})
    elif not cls.variants and not cls.__module__.startswith("warpdyn."):
        check_set_of_functions((), cls.memory)
    cls.forces = StoreyForces((cls.name,), cls.is_linear, cls.has_rate, cls.relaxes)
    cls.written = _text_of(cls)
    if not cls.__name__.startswith("_"):
        cls.table[cls.name] = cls


def _check_names(cls: type[StoreyElement], body: Mapping[str, Any]) -> None:
    """Raise a TypeError if a name in the body of a user's class has no effect.

    A name has no effect if it is a misspelt form of a name that warpdyn reads, or the name of an attribute that warpdyn
    computes.
    """
    for name in COMPUTED:
        if name in body:
            raise TypeError(f"{name} is computed by warpdyn, so that this value has no effect: remove {name}")
    base = _first_of_warpdyn(cls)
    known = {each for each in {*vars(base), *base.__annotations__, *ARGUMENTS} if not each.startswith("_")}
    read = set().union(*(_names_read(value) for value in body.values()))
    for name in body.keys() - known - read - vars(cls).get("__annotations__", {}).keys():
        close = [] if name.startswith("_") else get_close_matches(name, known - set(COMPUTED), 1, CLOSE)
        if close:
            raise TypeError(
                f"{name} is not a name that warpdyn reads, so that it has no effect: rename it to {close[0]!r}, or to "
                f"_{name} if it is not meant as {close[0]!r}"
            )


def _first_of_warpdyn(cls: type) -> type:
    """Return the base class of all laws, dampers and stops (StoreyElement), for any order of a user's base classes."""
    return next(each for each in reversed(cls.__mro__) if each.__module__.startswith("warpdyn."))


def _names_read(value: Any) -> set[str]:
    """Return the names that the code of a function reads; the set is empty for values that are not functions."""
    function = device_function(value) or getattr(value, "__func__", value)
    waiting = [getattr(function, "__code__", None)]
    found = set[str]()
    while waiting:
        code = waiting.pop()
        if isinstance(code, CodeType):
            found.update(code.co_names)
            waiting += code.co_consts
    return found


def _parameters(cls: type[StoreyElement]) -> dict[str, Parameter]:
    """Return the parameters of a class as {name: parameter}, made from its dataclass fields.

    Raises:
        TypeError: If a field is not a parameter, or has a reserved name, no unit or a wrong default.
    """
    found: dict[str, Parameter] = {}
    for field in dataclasses.fields(cls):
        make = field.metadata.get("parameter")
        if make is None:
            raise TypeError(
                f"{field.name} is not a parameter: write {field.name}: float = wd.laws.parameter('N', 'what it is')"
            )
        if field.name in OF_STOREY:
            raise TypeError(
                f"parameter {field.name!r} has the name of a property of every storey: rename the parameter"
            )
        base = _first_of_warpdyn(cls)  # StoreyElement, whose attributes a parameter would replace
        is_taken = field.name in OF_OTHERS or field.name in {*vars(base), *base.__annotations__}
        if not cls.__module__.startswith("warpdyn.") and (is_taken or OF_DEMANDS.match(field.name)):
            raise TypeError(
                f"parameter {field.name!r} has the name of a property of buildings, or of a variable of datasets: "
                f"rename the parameter, for example {cls.name}_{field.name}"
            )
        try:
            found[field.name] = known = make if isinstance(make, Parameter) else make()
        except (ValueError, TypeError) as error:
            raise TypeError(f"parameter {field.name!r}: {error}") from error
        if not known.units:
            raise TypeError(f"parameter {field.name!r} has no unit: give a unit, such as 'N', or '1' for a ratio")
        if known.default is not None and known.violations(np.array([known.default])).any():
            raise TypeError(
                f"parameter {field.name!r} has the default {known.default:g}, which is not "
                f"{known.allowed}: correct default=, or the bounds low= and high="
            )
    return found


def _check_name(cls: type[StoreyElement]) -> None:
    """Raise a TypeError if a user's class has the name of a law, damper or stop of warpdyn, or of another kind."""
    for table in (cls.table, *(base.table for base in cls.kinds)):
        known = table.get(cls.name)
        if known is not None and known.__module__.startswith("warpdyn.") and known.__module__ != cls.__module__:
            raise TypeError(f"warpdyn has a {known.kind} {cls.name!r} already: give the class another name")
        if known is not None and table is not cls.table:
            raise TypeError(f"{cls.name!r} is a {known.kind} already: give the class another name")


def _functions(cls: type[StoreyElement], body: Mapping[str, Any]) -> dict[str, Captured]:
    """Remove the device functions from a new class; return them and those of its base classes: {name: function}."""
    found = dict(cls.captured)
    for name, value in body.items():
        function = device_function(value)
        if function is None and name in ARGUMENTS and callable(value):
            function = value
        if function is None:
            continue
        found[name] = captured(name, function)
        delattr(cls, name)
    cls.captured = found
    return found


def _write(cls: type[StoreyElement], functions: dict[str, Captured]) -> None:
    """Make the variant (set of device functions) of a class whose device functions are in the class body."""
    check_memory(cls.memory)
    check_set_of_functions(functions.keys() & ARGUMENTS.keys(), cls.memory)
    p = _sample(cls)
    derived = _asked(cls, "derived", p)
    if not isinstance(derived, dict):
        raise TypeError(
            f"derived must return a dictionary of coefficients, such as {{'yield_drift': p['yield_force'] / "
            f"p['stiffness']}}, got {type(derived).__name__}"
        )
    check_shapes(derived, p["stiffness"].shape)
    if cls.is_device and "stiffest" not in {name for each in cls.__mro__[:-3] for name in vars(each)}:
        raise TypeError(
            "stiffest is missing: define stiffest(p), which returns the device's largest tangent stiffness [N/m]"
        )
    stiffest = np.asarray(_asked(cls, "stiffest", p))
    if stiffest.shape not in ((), p["stiffness"].shape) or not np.isfinite(stiffest).all():
        raise TypeError(
            f"stiffest must return one finite number per storey for sample parameters, got {stiffest!r}: compute it "
            "from whole arrays such as p['stiffness']"
        )
    hidden = "" if "elastic_energy" in functions else HALF_FLEXIBILITY
    text = written(functions, cls.memory, ("stiffness", *cls.parameters, *derived), hidden)
    variant = Variant(f"{cls.name}_{text.digest}", text.coefficients, written=text)
    cls.variants = MappingProxyType({variant.name: variant})
    cls.rows = MappingProxyType({variant.name: variant.coefficients})
    cls.has_rate = "rate" in functions


def check_shapes(derived: Mapping[str, Any], shape: tuple[int, ...]) -> None:
    """Raise a TypeError if a coefficient from `derived` has a wrong shape.

    A coefficient must be one number, or have the shape `shape` [structure, storey]. If there are as many structures as
    storeys, NumPy would use one number per structure as one number per storey.
    """
    for name, values in derived.items():
        found = np.shape(values)
        if found and (len(found) != len(shape) or any(n not in (1, m) for n, m in zip(found, shape, strict=True))):
            raise TypeError(
                f"derived returns {name!r} of shape {found}; it must be one number, or one per structure and storey, "
                f"here shape {shape}: compute it from whole arrays such as p['stiffness'], with keepdims=True in sums"
            )


def _sample(cls: type[StoreyElement]) -> dict[str, np.ndarray]:
    """Return values of all parameters within their bounds, for one storey of one structure: {name: array [1, 1]}."""

    def value(known: Parameter) -> float:
        if known.default is not None:
            return known.default
        low, high = known.low, known.high
        if np.isfinite(low) and np.isfinite(high):
            return (low + high) / 2
        return low + 1 if np.isfinite(low) else high - 1 if np.isfinite(high) else 1.0

    values = {name: value(known) for name, known in cls.parameters.items()} | {"stiffness": SAMPLE_STIFFNESS}
    return {name: np.full((1, 1), number) for name, number in values.items()}


def _asked(cls: type[StoreyElement], name: str, p: dict[str, np.ndarray]) -> Any:
    """Return the result of the class method `name` for the parameters of `_sample`; raise a TypeError if it fails."""
    with np.errstate(all="ignore"):
        try:
            return getattr(cls, name)(p)
        except KeyError as error:
            raise TypeError(
                f"{name} reads the unknown parameter {error}: declare it as a field of the class, or read one of "
                f"these: {', '.join(p)}"
            ) from error
        except Exception as error:
            raise TypeError(
                f"{name} fails for sample parameters, arrays of shape [structure, storey] ({type(error).__name__}: "
                f"{error}): compute with whole arrays, and let every value within the parameters' bounds give a result"
            ) from error


def _text_of(cls: type[StoreyElement]) -> str:
    """Return the source text of a user's class, for the fingerprint of a run; "" for laws of warpdyn."""
    if cls.__module__.startswith("warpdyn."):
        return ""
    parts = [variant.written.text for variant in cls.variants.values() if variant.written is not None]
    for each in cls.__mro__:
        if each.__module__.startswith("warpdyn.") or each is object:
            continue
        for name, value in vars(each).items():
            function = getattr(value, "__func__", value)
            is_generated = name.startswith("__")  # by `dataclass`
            if inspect.isfunction(function) and function.__module__ == each.__module__ and not is_generated:
                parts += sources_read(function)
    return "\n\n".join(parts)
