"""Columns of the tables of a frame, and the rows of supports, diaphragms, masses and loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from warpdyn.foundations.core.checks import checked_text, real_number, shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.frames.tables.table import Column, Rows, check_names_known, read_table

DIRECTIONS = ("ux", "uy", "rz")
FORCES = ("fx", "fy", "mz")
SUPPORTS = {
    "fixed": {"ux": True, "uy": True, "rz": True},
    "pinned": {"ux": True, "uy": True},
    "roller": {"uy": True},
}
NONE = "none"
NODE_COLUMNS = {
    "x": Column(units="m"),
    "y": Column(units="m"),
    "support": Column(NONE, is_text=True, allowed=(NONE, *SUPPORTS)),
    "diaphragm": Column(NONE, is_text=True),
    "mass": Column(0.0, "kg", least=0.0),
    "gravity_load": Column(0.0, "N"),
}
MEMBER_COLUMNS = {
    "start": Column(is_text=True),
    "end": Column(is_text=True),
    "section": Column(is_text=True),
    "kind": Column("beam", is_text=True, allowed=("beam", "truss")),
    "release": Column(NONE, is_text=True, allowed=(NONE, "start", "end", "both")),
    "spring_start": Column(np.inf, "N m/rad", least=0.0, may_be_infinite=True),
    "spring_end": Column(np.inf, "N m/rad", least=0.0, may_be_infinite=True),
    **{f"offset_{end}_{axis}": Column(0.0, "m") for end in ("start", "end") for axis in "xy"},
    "gravity_load": Column(0.0, "N/m"),
    "p_delta": Column("yes", is_text=True, allowed=("yes", "no")),
}
SECTION_COLUMNS = {
    "elastic_modulus": Column(units="Pa", above=0.0),
    "area": Column(units="m2", above=0.0),
    "second_moment": Column(0.0, "m4", least=0.0),
    "shear_modulus": Column(0.0, "Pa", least=0.0),
    "shear_area": Column(0.0, "m2", least=0.0),
    "mass_per_length": Column(0.0, "kg/m", least=0.0),
    "moment_capacity": Column(np.inf, "N m", above=0.0, may_be_infinite=True),
    "axial_capacity": Column(np.inf, "N", above=0.0, may_be_infinite=True),
    "shear_capacity": Column(np.inf, "N", above=0.0, may_be_infinite=True),
}
LOAD_COLUMNS = {force: Column(0.0, unit) for force, unit in zip(FORCES, ("N", "N", "N m"), strict=True)}
MEMBER_LOADS = {"qx": "N/m", "qy": "N/m", "px": "N", "py": "N", "at": "m"}


def read_supports(given: object, nodes: Rows) -> dict[str, dict[str, bool | float]]:
    """Return {node: {direction: True if it is fixed, or the stiffness of a spring}} of all supported nodes."""
    found: dict[str, dict[str, bool | float]] = {
        name: dict(SUPPORTS[row["support"]]) for name, row in nodes.items() if row["support"] != NONE
    }
    if given is None:
        return found
    if not isinstance(given, Mapping):
        raise TypeError(f"supports must be a dictionary, such as {{'A': 'fixed'}}, got {shortened(given)}")
    check_names_known("supports", list(given), nodes, "node")
    for node, support in given.items():
        if node in found:
            raise ValueError(f"supports: node {node!r} already has a support in the table of nodes: give it once")
        found[node] = _support(node, support)
    return found


def _support(node: str, given: object) -> dict[str, bool | float]:
    if isinstance(given, str):
        if given not in SUPPORTS:
            hint = did_you_mean(given, list(SUPPORTS))
            raise ValueError(
                f"supports: node {node!r} has the unknown support {given!r}{hint}; allowed are "
                f"{', '.join(map(repr, SUPPORTS))}, or a dictionary such as {{'ux': True, 'uy': 5e7}}"
            )
        return dict(SUPPORTS[given])
    if not isinstance(given, Mapping):
        raise TypeError(
            f"supports: node {node!r} must have 'fixed', 'pinned', 'roller' or a dictionary such as "
            f"{{'ux': True, 'uy': 5e7}} (a stiffness in N/m or N m/rad), got {shortened(given)}"
        )
    found: dict[str, bool | float] = {}
    for direction, value in given.items():
        if direction not in DIRECTIONS:
            raise ValueError(f"supports: node {node!r} names {direction!r}; directions are {', '.join(DIRECTIONS)}")
        if isinstance(value, bool | np.bool_):
            found |= {direction: True} if value else {}
        else:
            found[direction] = real_number(f"supports: stiffness {direction} of node {node!r}", value, above=0)
    return found


def read_diaphragms(given: object, nodes: Rows) -> dict[str, list[str]]:
    """Return {diaphragm: nodes with one common horizontal displacement}."""
    found: dict[str, list[str]] = {}
    for name, row in nodes.items():
        if row["diaphragm"] != NONE:
            found.setdefault(row["diaphragm"], []).append(name)
    if given is not None:
        if not isinstance(given, Mapping):
            raise TypeError(f"diaphragms must be a dictionary {{name: list of nodes}}, got {shortened(given)}")
        for name, listed in given.items():
            if not isinstance(listed, list | tuple):
                raise TypeError(f"diaphragms: {name!r} must be a list of nodes, got {shortened(listed)}")
            check_names_known(f"diaphragms: {name!r}", listed, nodes, "node")
            found.setdefault(checked_text("diaphragms: a name", name), []).extend(listed)
    tied: dict[str, str] = {}
    for name, listed in found.items():
        levels = [nodes[node]["y"] for node in listed]
        if max(levels) - min(levels) > 1e-6 * max(1.0, *map(abs, levels)):
            low, high = listed[int(np.argmin(levels))], listed[int(np.argmax(levels))]
            raise ValueError(
                f"diaphragms: the nodes {low!r} and {high!r} of {name!r} are at different heights ({min(levels):g} and "
                f"{max(levels):g} m); a rigid floor is horizontal"
            )
        for node in listed:
            if node in tied:
                raise ValueError(f"diaphragms: node {node!r} is listed in {tied[node]!r} and in {name!r}: list it once")
            tied[node] = name
        if name in nodes or any(name == f"{node} {direction}" for node in nodes for direction in DIRECTIONS):
            raise ValueError(f"diaphragms: {name!r} is also the name of a node: give the diaphragm another name")
    return found


def read_masses(given: object, nodes: Rows, diaphragms: Mapping[str, Sequence[str]]) -> dict[str, dict[str, float]]:
    """Return {node or diaphragm: {direction: mass}}; one number for a node acts in x and y."""
    found = {name: {"ux": row["mass"], "uy": row["mass"]} for name, row in nodes.items() if row["mass"]}
    if given is None:
        return found
    if not isinstance(given, Mapping):
        raise TypeError(f"masses must be a dictionary {{node or diaphragm: mass [kg]}}, got {shortened(given)}")
    check_names_known("masses", list(given), {**diaphragms, **nodes}, "node or diaphragm")
    for name, value in given.items():
        if name in found:
            raise ValueError(f"masses: node {name!r} already has a mass in the table of nodes: give it once")
        if not isinstance(value, Mapping):
            value = dict.fromkeys(("ux",) if name in diaphragms else ("ux", "uy"), value)
        for direction in value:
            if direction not in (("ux",) if name in diaphragms else DIRECTIONS):
                allowed = "'ux'" if name in diaphragms else ", ".join(map(repr, DIRECTIONS))
                raise ValueError(f"masses: {name!r} names the direction {direction!r}; allowed: {allowed}")
        found[name] = {
            direction: real_number(f"masses: {direction} of {name!r} [kg or kg m2]", each, least=0)
            for direction, each in value.items()
        }
    return found


def read_loads(argument: str, given: object, names: Sequence[str]) -> Rows:
    """Return the forces on nodes, and horizontal forces on diaphragms, {name: {"fx": N, "fy": N, "mz": N m}}."""
    if given is None:
        return {}
    rows = read_table(argument, given, "node", LOAD_COLUMNS)
    check_names_known(argument, list(rows), names, "node or diaphragm")
    return rows


def read_member_loads(given: object, members: Rows) -> list[dict[str, Any]]:
    """Return the loads on members, a list of dictionaries with the keys "member" and those of MEMBER_LOADS."""
    if given is None:
        return []
    rows: list[tuple[str, Mapping[str, Any]]] = []
    if isinstance(given, pd.DataFrame):
        given = given.to_dict("records")
    if isinstance(given, Mapping):
        for name, row in given.items():
            rows += [(name, each) for each in (row if isinstance(row, list | tuple) else [row])]
    elif isinstance(given, list | tuple) and all(isinstance(row, Mapping) and "member" in row for row in given):
        rows = [(row["member"], {key: value for key, value in row.items() if key != "member"}) for row in given]
    else:
        raise TypeError(
            "member_loads must be a dictionary {member: {'qy': -1e4}} or a list of dictionaries with the key 'member', "
            f"got {shortened(given)}"
        )
    check_names_known("member_loads", [name for name, _ in rows], members, "member")
    found = []
    for name, row in rows:
        if not isinstance(row, Mapping):
            raise TypeError(f"member_loads: member {name!r} must be a dictionary such as {{'qy': -1e4}}, got {row!r}")
        load: dict[str, Any] = {"member": name, "at": None, **dict.fromkeys(("qx", "qy", "px", "py"), 0.0)}
        for key, value in row.items():
            if key not in MEMBER_LOADS:
                hint = did_you_mean(key, list(MEMBER_LOADS))
                raise ValueError(
                    f"member_loads: member {name!r} has the unknown key {key!r}{hint}; keys are "
                    f"{', '.join(MEMBER_LOADS)}"
                )
            load[key] = real_number(f"member_loads: {key} of {name!r} [{MEMBER_LOADS[key]}]", value)
        if (load["px"] or load["py"]) and load["at"] is None:
            raise ValueError(
                f"member_loads: the point load on member {name!r} has no place: give at=, its distance from the "
                "start [m]"
            )
        found.append(load)
    return found
