"""Find the classes of laws, dampers and stops that a user gives as names, OpenSees' names, classes or objects."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws import BIAXIAL_LAWS, CONTACTS, DEVICES, LAWS
from warpdyn.engine.laws.building_law import missing_at
from warpdyn.engine.laws.law import Device, Law, StoreyElement
from warpdyn.foundations.core.checks import real_numbers
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean

Given = str | StoreyElement | type[StoreyElement]
Own = dict[str, ArrayLike]  # parameters from objects such as `Bilinear(yield_force=1e6, ...)`
Kind = TypeVar("Kind", bound=StoreyElement)


def law_name(given: object) -> str:
    """Return the name of a storey law; `given` is its name, its OpenSees name, its class, or an object of the class.

    Raises:
        ValueError: If no such law exists; the message suggests similar names.
    """
    return _given_class("storey law", given, LAWS).name


def devices_and_values(
    devices: Sequence[Given], others: Collection[str], laws: Sequence[type[Law]] = ()
) -> tuple[tuple[type[Device], ...], Own]:
    """Return the classes of the dampers and stops of a building, and the parameters of those given as objects.

    Args:
        devices: The dampers and stops, each a name, a class or an object.
        others: Names of the parameters that are given to the building.
        laws: Classes of the laws of the building.

    Raises:
        TypeError: If `devices` is not a list or tuple.
        ValueError: If a name is unknown, a device shares a parameter with another device or with a law, or a parameter
            is given twice.
    """
    if isinstance(devices, str) or not isinstance(devices, list | tuple):
        raise TypeError(f"devices must be a tuple of names or devices, such as ('friction_damper',), got {devices!r}")
    kinds = tuple(_given_class("device", device, DEVICES) for device in devices)
    for place, kind in enumerate(kinds):
        for other in (*laws, *kinds[:place]):
            if common := set(kind.parameters) & set(other.parameters):
                what, remedy = "device", "choose one of these devices"
                if not other.is_device:
                    users = [each.__name__ for each in (kind, other) if each.written]
                    what = "law"
                    remedy = f"rename the parameter in class {users[0]}" if users else "choose another law or device"
                raise ValueError(
                    f"{what} {other.name!r} and device {kind.name!r} share the parameter {min(common)!r}, and a storey "
                    f"can have only one value of it: {remedy}"
                )
    own: Own = {name: value for each in devices if isinstance(each, Device) for name, value in each.values().items()}
    _refuse_twice(own, others, "devices")
    return kinds, own


def laws_and_values(law: Given | Sequence[Given], others: Mapping[str, ArrayLike]) -> tuple[tuple[type[Law], ...], Own]:
    """Return the classes of the laws of a building, and the parameters of the laws that are given as objects.

    Args:
        law: One law for all storeys, or a list with one law per storey.
        others: Parameters that are given to the building, for laws that are given by name.

    Returns:
        The classes: one, or one per storey; and {name of a parameter: values}.

    Raises:
        ValueError: If a name is unknown, a parameter is given twice, or a law object in a list has several values of a
            parameter.
    """
    if not isinstance(law, list | tuple):
        own: Own = {**law.values()} if isinstance(law, Law) else {}
        kind = _given_class("storey law", law, LAWS)
        _refuse_twice(own, others, "law")
        return (kind,), own
    kinds = tuple(_given_class("storey law", each, LAWS) for each in law or (None,))
    own = {}
    for name in dict.fromkeys(name for each in law if isinstance(each, Law) for name in each.values()):
        own[name] = of_storeys = np.full(len(law), np.nan)
        by_name = [i for i, each in enumerate(law) if not isinstance(each, Law) and name in kinds[i].parameters]
        if not by_name:
            _refuse_twice({name}, others, "law")
        for storey, each in enumerate(law):
            if isinstance(each, Law) and name in each.parameters:
                value = getattr(each, name)
                if value is None:
                    of_law = f"{name} is missing at storey {storey + 1}, whose law is {kinds[storey].name!r}"
                    raise ValueError(f"{of_law}: give it in all storeys with this law, or in none of them")
                of_storeys[storey] = _only_value(name, value, storey)
        for storey in by_name:
            value = others.get(name, kinds[storey].parameters[name].default)
            if value is None:
                raise ValueError(missing_at(name, storey, kinds[storey].name))
            values = real_numbers(name, value, kinds[storey].parameters[name].units)
            if values.size not in (1, len(law)):
                raise ValueError(
                    f"{name} has {values.size} values and law has {len(law)}: give one value per storey, or one value"
                )
            of_storeys[storey] = np.broadcast_to(values, len(law))[storey]
    return kinds, own


def class_and_values(
    what: str, given: object, table: Mapping[str, type[Kind]], others: Collection[str]
) -> tuple[type[Kind], dict[str, float | tuple[float, ...]]]:
    """Return the class of the law of a spring, and its parameters if it is given as an object.

    Args:
        what: Kind of the law, for messages.
        given: Its name, its class, or an object with its parameters.
        table: CONTACTS or BIAXIAL_LAWS.
        others: Names of the parameters that are given to the spring.

    Raises:
        ValueError: If the name is unknown, or a parameter is given twice.
    """
    kind = _given_class(what, given, table)
    own = given.values() if isinstance(given, StoreyElement) else {}
    _refuse_twice(own, others, "law")
    return kind, own


def check_written(texts: Mapping[str, str], where: str) -> None:
    """Check that the users' laws, dampers and stops in a stored scene are defined; warn if their source has changed.

    Args:
        texts: {name: source of the law, damper or stop when the scene was stored}.
        where: The place of the stored scene, for messages.

    Raises:
        ValueError: If a law, damper or stop is not defined.
    """
    for name, text in texts.items():
        known: type[StoreyElement] | None = LAWS.get(name) or DEVICES.get(name)
        if known is None:
            raise ValueError(
                f"{where} has the law or device {name!r}, which is not part of warpdyn: define its class first. Its "
                f"device functions were:\n{text}"
            )
        if known.written != text:
            warn_caller(
                f"{where}: the class of {name!r} has changed since the description was written, so results differ. To "
                "reproduce the old results, restore its device functions from 'written_laws' of the description"
            )


def _only_value(name: str, value: float | tuple[float, ...], storey: int) -> float:
    if isinstance(value, tuple):
        raise ValueError(
            f"{name} of the law of storey {storey + 1} must be one value, got {len(value)}: a law in a list of laws "
            "belongs to one storey"
        )
    return value


def _refuse_twice(own: Collection[str], others: Collection[str], what: str) -> None:
    """Raise a ValueError if a parameter is given twice: in an object of a law, damper or stop, and to the building."""
    for name in own:
        if name in others:
            raise ValueError(
                f"{name} is given twice: by {what}=, and as a parameter of the building; remove {name}= there"
            )


def _given_class(what: str, given: object, table: Mapping[str, type[Kind]]) -> type[Kind]:
    """Return the class of a law, damper or stop that is given by a name, a class or an object."""
    kind = given if isinstance(given, type) else type(given)
    if issubclass(kind, StoreyElement) and hasattr(kind, "forces") and kind.table is table:
        return cast(type[Kind], kind)
    if isinstance(given, str) and given in table:
        return table[given]
    known = _opensees(table)
    meant = known.get(given, ()) if isinstance(given, str) else ()
    if len(meant) == 1:
        return table[meant[0]]
    if meant:
        raise ValueError(
            f"OpenSees' {given!r} may mean several laws or devices; choose one: {', '.join(map(repr, meant))}"
        )
    hint = _of_the_other_kind(given, table) or did_you_mean(given, [*known, *table])
    names = ", ".join(map(repr, [*table, *known]))
    raise ValueError(f"unknown {what} {given!r}{hint}; allowed: {names}")


def _of_the_other_kind(given: object, table: Mapping[str, type[StoreyElement]]) -> str:
    """Return a hint for a message if a damper or stop was given as `law`, or a law in `devices`; else ""."""
    name = type(given).name if isinstance(given, StoreyElement) and hasattr(type(given), "name") else given
    if table is not CONTACTS and isinstance(name, str) and name in CONTACTS:
        return f": {name!r} is a contact, which only a Spring of a LumpedStructure can have"
    if table is not BIAXIAL_LAWS and isinstance(name, str) and name in BIAXIAL_LAWS:
        return f": {name!r} is a biaxial law, which only a BiaxialSpring of a LumpedStructure can have"
    other: Mapping[str, type[StoreyElement]] = LAWS if table is DEVICES else DEVICES
    if isinstance(given, StoreyElement) and type(given).name in other:
        names: tuple[str, ...] = (type(given).name,)
    elif isinstance(given, str):
        names = (given,) if given in other else _opensees(other).get(given, ())
    else:
        names = ()
    if not names:
        return ""
    return f", a storey law: law={names[0]!r}" if table is DEVICES else f", a device: devices=({names[0]!r},)"


def _opensees(table: Mapping[str, type[StoreyElement]]) -> dict[str, tuple[str, ...]]:
    """Return {OpenSees' name: names in warpdyn of the laws, dampers or stops that it may mean}."""
    found: dict[str, tuple[str, ...]] = {}
    for name, element in table.items():
        for word in element.opensees:
            found[word] = (*found.get(word, ()), name)
    return found
