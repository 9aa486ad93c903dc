"""Contacts that builders put between two masses, or between a mass and an obstacle at rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from warpdyn.engine.laws import CONTACTS
from warpdyn.engine.laws.contacts.contact import Contact
from warpdyn.engine.laws.devices.parameters import OneSidedGap
from warpdyn.engine.laws.law import StoreyElement
from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.lumped.contact import reduced_mass
from warpdyn.model.structures.lumped.spring import Spring

CONTACT_GROUP = "contact"  # group of the contacts, which do not count in the largest demand


def contact_class(what: str, given: object) -> type[StoreyElement]:
    """Return the class of a contact law that is given by its name or class.

    Args:
        what: Name of the builder and the argument, for messages.
        given: Name or class: "one_sided_gap" (linear) or one of `warpdyn.laws.CONTACTS`.

    Raises:
        TypeError: If an object is given, whose clearance the builder would have to replace.
        ValueError: If the law is not a contact.
    """
    if isinstance(given, StoreyElement):
        raise TypeError(
            f"{what} is the object {shortened(given)}, which has a clearance: give the name {type(given).name!r}, "
            "and its parameters except clearance= as arguments"
        )
    # Bodies with a clearance between them are not pressed together.
    known = {OneSidedGap.name: OneSidedGap, **{name: each for name, each in CONTACTS.items() if each.is_device}}
    if isinstance(given, type) and issubclass(given, Contact | OneSidedGap) and given.is_device:
        return given
    if isinstance(given, str) and given in known:
        return cast(type[StoreyElement], known[given])
    hint = did_you_mean(given, list(known)) if isinstance(given, str) else ""
    raise ValueError(f"{what} is {shortened(given)}{hint}; allowed: {', '.join(map(repr, known))}")


def contact_spring(
    name: str,
    direction: Mapping[str, float],
    law: type[StoreyElement],
    clearance: float,
    masses: tuple[float, ...],
    parameters: Mapping[str, Any],
) -> Spring:
    """Return a contact. A law with the parameter `impact_mass` gets that of the masses if it is not given.

    Args:
        name: Name of the contact.
        direction: Coefficients of the approach of the two bodies.
        law: Class of the contact law.
        clearance: Clear distance of the bodies at rest [m].
        masses: Both masses [kg], or the only mass if the other body is at rest.
        parameters: Other parameters of the law.
    """
    if "clearance" in parameters:
        raise ValueError(f"spring {name!r}: the gap is the clearance of the contact: remove clearance=")
    own: dict[str, Any] = dict(parameters)
    if "impact_mass" in law.parameters:
        own.setdefault("impact_mass", reduced_mass(*masses) if len(masses) == 2 else masses[0])
    return Spring(name, direction, law=law, clearance=clearance, **own)
