"""Bridges in the longitudinal direction: piers, deck segments, bearings, abutments with backfill, and gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from warpdyn.engine.laws.law import StoreyElement
from warpdyn.foundations.core.checks import checked_text, real_number, shortened
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names, with_suggestions
from warpdyn.model.structures.builders.rows.contacts import CONTACT_GROUP, contact_class, contact_spring
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.structure import LumpedStructure

LEFT, RIGHT = "left abutment", "right abutment"
Law = str | StoreyElement | type[StoreyElement]


@with_suggestions
class BridgeSupport:
    """A pier of a bridge, or an abutment with its backfill: a mass on a spring to the ground.

    Args:
        mass: Mass that moves with the top of the pier, or with the abutment [kg].
        stiffness: Initial stiffness in the longitudinal direction [N/m].
        law: Law of the spring: its name, its class, or an object with its parameters. See `warpdyn.laws.LAWS`.
        **parameters: Parameters of a law that is given by name, such as `yield_force` [N], and `damping_coefficient`
            [N s/m] and `deformation_capacity` [m] of the spring.

    Raises:
        ValueError: If the mass is not above 0. Other values are checked by `wd.longitudinal_bridge`.

    Example:
        >>> wd.BridgeSupport(60e3, 40e6, law="bilinear", yield_force=0.8e6, hardening_ratio=0.03)
        BridgeSupport(60000 kg, 4e+07 N/m)
    """

    def __init__(self, mass: float, stiffness: float, *, law: Law = "elastic", **parameters: Any) -> None:
        self.mass = real_number("BridgeSupport: mass [kg]", mass, above=0)
        self.stiffness = real_number("BridgeSupport: stiffness [N/m]", stiffness, above=0)
        self.law = law
        self.parameters = dict(parameters)

    def __repr__(self) -> str:
        return f"BridgeSupport({self.mass:g} kg, {self.stiffness:g} N/m)"


@with_suggestions
class Bearing:
    """The bearings between a deck segment and a support, or the restrainers between two segments: one spring.

    Its deformation is the displacement of the segment less that of the support.

    Args:
        segment: Name of the deck segment.
        support: Name of the pier or of the other segment, or "left abutment" or "right abutment".
        stiffness: Initial stiffness of all these bearings together [N/m]; None: for a device such as
            "friction_damper".
        law: Law of the spring: its name, its class, or an object with its parameters. A friction bearing is "bilinear"
            with the friction force as `yield_force` and a small `hardening_ratio`.
        name: Name of the spring; None: "bearing {segment} - {support}".
        **parameters: Parameters of a law that is given by name, such as `yield_force` [N], and `damping_coefficient`
            [N s/m] and `deformation_capacity` [m] of the spring.

    Raises:
        TypeError: If a name is not text.

    Example:
        >>> wd.Bearing("deck", "pier", 20e6, law="bilinear", yield_force=0.4e6, hardening_ratio=0.1)
        Bearing('deck', 'pier')
    """

    def __init__(
        self,
        segment: str,
        support: str,
        stiffness: float | None = None,
        *,
        law: Law = "elastic",
        name: str | None = None,
        **parameters: Any,
    ) -> None:
        self.segment = checked_text("Bearing: segment", segment)
        self.support = checked_text("Bearing: support", support)
        self.stiffness = stiffness
        self.law = law
        self.name = f"bearing {segment} - {support}" if name is None else checked_text("Bearing: name", name)
        self.parameters = dict(parameters)

    def __repr__(self) -> str:
        return f"Bearing({self.segment!r}, {self.support!r})"


@suggests_names
def longitudinal_bridge(
    deck: Mapping[str, float],
    piers: Mapping[str, BridgeSupport],
    bearings: Sequence[Bearing],
    *,
    gaps: Sequence[float | None],
    contact: str | type[StoreyElement],
    abutments: Mapping[str, BridgeSupport] | None = None,
    damping: str = "none",
    damping_ratio: float | None = None,
    damping_modes: tuple[int, int] | None = None,
    **parameters: float,
) -> LumpedStructure:
    """Return a bridge in the longitudinal direction, whose deck segments collide with each other and the abutments.

    Degrees of freedom: the deck segments and the piers with their names, and "left abutment" and "right abutment" if
    these move. Displacements are positive to the right. Segments are rigid. Springs: the bearings, the piers and the
    backfill of the abutments with the name of the pier or abutment, and contacts such as "contact deck - right
    abutment". Outputs: the change of each joint such as "joint deck - right abutment" [m], the displacement of its
    right side less that of its left side. The backfill is in the group "soil", and contacts in the group "contact";
    both do not count in the largest demand.

    A contact acts while the joint is closed by more than the gap. The gap is the parameter `clearance` of the contact
    and may be random. An abutment that is not in `abutments` is rigid, so that the contact stiffness is that of the
    backfill. An abutment with a yielding backfill that was pushed back remains there: the gap grows.

    Args:
        deck: Mass of each deck segment from left to right [kg], {name: mass}.
        piers: The piers, {name: pier}; {} for a deck without piers.
        bearings: The bearings between segments and supports.
        gaps: Gap of each joint from left to right [m], shape [segment + 1]: left abutment, joints between segments,
            right abutment. None: this joint does not close.
        contact: Name or class of the contact law of all joints: "one_sided_gap" (linear), or one of
            `warpdyn.laws.CONTACTS`, such as "kelvin_voigt_contact".
        abutments: Mass and backfill of "left abutment" and "right abutment"; an abutment that is missing is rigid.
        damping: Inherent damping, as for a LumpedStructure: "none", "rayleigh", "mass_proportional",
            "stiffness_proportional" or "modal".
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2.
        **parameters: Parameters of the contact law except `clearance`, one value each, such as `contact_stiffness`
            [N/m]. `impact_mass` [kg] is that of the two bodies, if it is not given.

    Returns:
        The bridge.

    Raises:
        ValueError: If a name is unknown or used twice, a value is out of its range, a number of gaps is wrong, or a
            segment can move freely.
        TypeError: If an argument is of another type.

    Example:
        >>> bridge = wd.longitudinal_bridge(
        ...     {"deck": 8e5},
        ...     {"pier": wd.BridgeSupport(6e4, 4e7, law="bilinear", yield_force=8e5, hardening_ratio=0.03)},
        ...     [wd.Bearing("deck", "pier", 2e7), wd.Bearing("deck", "left abutment", 3e6)],
        ...     gaps=[0.05, 0.05],
        ...     contact="one_sided_gap",
        ...     contact_stiffness=1.5e8,
        ... )
        >>> bridge.names_along("spring")[-2:]
        ('contact left abutment - deck', 'contact deck - right abutment')
    """
    where = "longitudinal_bridge()"
    for what, given in (("deck", deck), ("piers", piers), ("abutments", abutments or {})):
        if not isinstance(given, Mapping):
            raise TypeError(f"{where}: {what} must be a dictionary {{name: ...}}, got {shortened(given)}")
    if not deck:
        raise ValueError(f"{where}: deck is empty: give at least one segment, such as {{'deck': 8e5}}")
    segments = {
        checked_text(f"{where}: deck: a name", name): real_number(f"{where}: deck[{name!r}] [kg]", mass, above=0)
        for name, mass in deck.items()
    }
    supports = _supports(where, piers, abutments or {}, segments)
    masses = segments | {name: support.mass for name, support in supports.items()}
    springs = [
        _bearing(where, bearing, segments, [*masses, LEFT, RIGHT]) for bearing in _checked_bearings(where, bearings)
    ]
    for bearing in springs:
        for dof in [each for each in bearing.direction if each not in masses]:
            del bearing.direction[dof]  # a rigid abutment does not move
    springs += [
        Spring(name, {name: 1.0}, law=support.law, stiffness=support.stiffness, **support.parameters)
        for name, support in supports.items()
    ]
    law = contact_class(f"{where}: contact", contact)
    bodies = [LEFT, *segments, RIGHT]
    joints = list(pairwise(bodies))
    if isinstance(gaps, str | Mapping) or not isinstance(gaps, Sequence | np.ndarray):
        raise TypeError(f"{where}: gaps must be a list with one gap in m per joint, got {shortened(gaps)}")
    if len(gaps) != len(joints):
        raise ValueError(
            f"{where}: gaps has {len(gaps)} entries, but there are {len(joints)} joints, from the left to the right "
            "abutment: give one gap in m per joint, or None for a joint that does not close"
        )
    contacts, outputs = [], {}
    for place, (gap, (left, right)) in enumerate(zip(gaps, joints, strict=True)):
        moving = {dof: sign for dof, sign in ((left, 1.0), (right, -1.0)) if dof in masses}
        outputs[f"joint {left} - {right}"] = {dof: -sign for dof, sign in moving.items()}
        if gap is not None:
            own = tuple(masses[dof] for dof in moving)
            clear = real_number(f"{where}: gaps[{place}] [m]", gap, least=0)
            contacts.append(contact_spring(f"contact {left} - {right}", moving, law, clear, own, parameters))
    groups = {
        CONTACT_GROUP: [each.name for each in contacts],
        "soil": [each for each in (LEFT, RIGHT) if each in masses],
    }
    return LumpedStructure(
        masses,
        [*springs, *contacts],
        influence=dict.fromkeys(masses, 1.0),
        outputs=outputs,
        output_units=dict.fromkeys(outputs, "m"),
        groups={group: names for group, names in groups.items() if names},
        rotations=[],
        damping=damping,
        damping_ratio=damping_ratio,
        damping_modes=damping_modes,
    )


def _supports(
    where: str, piers: Mapping[str, Any], abutments: Mapping[str, Any], segments: Mapping[str, float]
) -> dict[str, BridgeSupport]:
    """Return the supports that move, {name: support}, or raise an error that names a wrong one."""
    for name in abutments:
        if name not in (LEFT, RIGHT):
            hint = did_you_mean(str(name), [LEFT, RIGHT])
            raise ValueError(f"{where}: abutments has the unknown name {name!r}{hint}; allowed: {LEFT!r}, {RIGHT!r}")
    for name in (*piers, *segments):
        if name in (LEFT, RIGHT) or (name in piers and name in segments):
            raise ValueError(f"{where}: {name!r} is the name of two parts of the bridge: rename the pier or segment")
    found = {}
    for what, given in (("piers", piers), ("abutments", abutments)):
        for name, support in given.items():
            if not isinstance(support, BridgeSupport):
                raise TypeError(f"{where}: {what}[{name!r}] must be a BridgeSupport, got {shortened(support)}")
            found[checked_text(f"{where}: {what}: a name", name)] = support
    return found


def _checked_bearings(where: str, bearings: object) -> Sequence[Bearing]:
    if not isinstance(bearings, list | tuple) or not all(isinstance(each, Bearing) for each in bearings):
        raise TypeError(f"{where}: bearings must be a list of Bearings, got {shortened(bearings)}")
    return bearings


def _bearing(where: str, bearing: Bearing, segments: Mapping[str, float], bodies: Sequence[str]) -> Spring:
    """Return the spring of a bearing, or raise a ValueError if it connects unknown parts."""
    if bearing.segment not in segments:
        hint = did_you_mean(bearing.segment, list(segments))
        raise ValueError(
            f"{where}: {bearing.name!r} is at the unknown deck segment {bearing.segment!r}{hint}; there are "
            f"{', '.join(map(repr, segments))}"
        )
    if bearing.support not in bodies or bearing.support == bearing.segment:
        hint = did_you_mean(bearing.support, list(bodies))
        raise ValueError(
            f"{where}: {bearing.name!r} rests on the unknown support {bearing.support!r}{hint}; there are "
            f"{', '.join(repr(each) for each in dict.fromkeys(bodies) if each != bearing.segment)}"
        )
    return Spring(
        bearing.name,
        {bearing.segment: 1.0, bearing.support: -1.0},
        law=bearing.law,
        stiffness=bearing.stiffness,
        **bearing.parameters,
    )
