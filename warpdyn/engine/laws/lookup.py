"""What a scene gives for laws and devices: names, OpenSees' names, classes, or objects with their parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws import DEVICES, LAWS
from warpdyn.engine.laws.building_law import missing_at
from warpdyn.engine.laws.law import Device, Law, StoreyElement
from warpdyn.foundations.core.checks import real_numbers
from warpdyn.foundations.core.near_misses import did_you_mean

Given = str | StoreyElement | type[StoreyElement]
Own = dict[str, ArrayLike]  # parameters that laws or devices bring along


def law_name(given: object) -> str:
    """Return the name of a storey law that is given by its name or OpenSees', its class or an object of it.

    Raises:
        ValueError: If there is no such law; the message suggests a name for a near miss.
    """
    return _name("storey law", given, LAWS)


def device_name(given: object) -> str:
    """Return the name of a device, as `law_name` does that of a law."""
    return _name("device", given, DEVICES)


def devices_and_values(devices: Sequence[Given], others: Collection[str]) -> tuple[tuple[str, ...], Own]:
    """Return the names of a building's devices, and the parameters of those that are objects.

    Args:
        devices: The devices.
        others: Names of the parameters that are given beside them.

    Raises:
        TypeError: If they are no list or tuple.
        ValueError: If there is no device of a name, two share a parameter, or one is given twice.
    """
    if isinstance(devices, str) or not isinstance(devices, list | tuple):
        raise TypeError(f"devices must be a tuple of names or devices, such as ('friction_damper',), got {devices!r}")
    names = tuple(device_name(device) for device in devices)
    for place, name in enumerate(names):
        for other in names[:place]:
            common = set(DEVICES[name].parameters) & set(DEVICES[other].parameters)
            if common:
                raise ValueError(
                    f"devices {other!r} and {name!r} share the parameter {min(common)!r}: a storey has one"
                )
    own: Own = {name: value for each in devices if isinstance(each, Device) for name, value in each.values().items()}
    _refuse_twice(own, others, "devices")
    return names, own


def laws_and_values(law: Given | Sequence[Given], others: Mapping[str, ArrayLike]) -> tuple[tuple[str, ...], Own]:
    """Return the name of each storey's law, or of the one of all, and the parameters of laws that are objects.

    Args:
        law: One law, or one a storey.
        others: Parameters that are given beside them; they count where a law is given by its name.

    Raises:
        ValueError: If there is no law of a name, a parameter is given twice, or an object has several values of one
            for a single storey.
    """
    if not isinstance(law, list | tuple):
        name = law_name(law)
        own: Own = {**law.values()} if isinstance(law, Law) else {}
        _refuse_twice(own, others, "law")
        return (name,), own
    names = tuple(law_name(each) for each in law or (None,))
    own = {}
    for name in dict.fromkeys(name for each in law if isinstance(each, Law) for name in each.values()):
        own[name] = of_storeys = np.full(len(law), np.nan)
        by_name = [i for i, each in enumerate(law) if not isinstance(each, Law) and name in LAWS[names[i]].parameters]
        if not by_name:
            _refuse_twice({name}, others, "law")
        for storey, each in enumerate(law):
            if isinstance(each, Law) and name in each.parameters:
                value = getattr(each, name)
                if value is None:
                    of_law = f"{name} is missing at storey {storey + 1}, whose law is {names[storey]!r}"
                    raise ValueError(f"{of_law}: give it in every storey of a law that has it, or in no storey")
                of_storeys[storey] = _only_value(name, value, storey)
        for storey in by_name:
            value = others.get(name, LAWS[names[storey]].parameters[name].default)
            if value is None:
                raise ValueError(missing_at(name, storey, names[storey]))
            values = real_numbers(name, value)
            if values.size not in (1, len(law)):
                raise ValueError(f"{name} has {values.size} values and law has {len(law)}: one value a storey, or one")
            of_storeys[storey] = np.broadcast_to(values, len(law))[storey]
    return names, own


def _only_value(name: str, value: float | tuple[float, ...], storey: int) -> float:
    if isinstance(value, tuple):
        raise ValueError(f"{name} of the law of storey {storey + 1} must be one value, got {len(value)}")
    return value


def _refuse_twice(own: Collection[str], others: Collection[str], what: str) -> None:
    """Raise a ValueError if a parameter that laws or devices bring along is given beside them, too."""
    for name in own:
        if name in others:
            raise ValueError(f"{name} is given twice: by {what}=, and as a parameter of the building")


def _name(what: str, given: object, table: Mapping[str, type[StoreyElement]]) -> str:
    """Return the name in a table of what is given by a name, a class or an object."""
    kind = given if isinstance(given, type) else type(given)
    if issubclass(kind, StoreyElement) and kind.name in table:
        return kind.name
    if isinstance(given, str) and given in table:
        return given
    known = _opensees(table)
    meant = known.get(given, ()) if isinstance(given, str) else ()
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise ValueError(f"OpenSees' {given!r} is one of several here: {', '.join(map(repr, meant))}; name one of them")
    hint = _of_the_other_kind(given, table) or did_you_mean(given, [*known, *table])
    names = ", ".join(map(repr, [*table, *known]))
    raise ValueError(f"unknown {what} {given!r}{hint}; allowed: {names}")


def _of_the_other_kind(given: object, table: Mapping[str, type[StoreyElement]]) -> str:
    """Return a hint where a device is given as a storey's law, or a law as a device."""
    if not isinstance(given, str):
        return ""
    other: Mapping[str, type[StoreyElement]] = LAWS if table is DEVICES else DEVICES
    names = (given,) if given in other else _opensees(other).get(given, ())
    if not names:
        return ""
    return f", a storey law: law={names[0]!r}" if table is DEVICES else f", a device: devices=({names[0]!r},)"


def _opensees(table: Mapping[str, type[StoreyElement]]) -> dict[str, tuple[str, ...]]:
    """Return OpenSees' names, each with ours of what it may stand for."""
    found: dict[str, tuple[str, ...]] = {}
    for name, element in table.items():
        for word in element.opensees:
            found[word] = (*found.get(word, ()), name)
    return found
