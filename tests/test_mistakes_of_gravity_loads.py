"""Weights given as masses, loads of leaning columns in kN and other small loads of frames are warned of."""

from __future__ import annotations

import pytest
from frame_cases import REFERENCE_MODELS, braced, eight_storey, four_storey, portal

import warpdyn as wd

pytestmark = pytest.mark.fast


def with_masses(make, factor: float, loads: float = 1.0) -> wd.Frame:
    """Return a frame with masses multiplied by one factor, and gravity loads by another."""
    arguments = make().description()
    arguments["masses"] = {
        name: {way: factor * mass for way, mass in row.items()} if isinstance(row, dict) else factor * row
        for name, row in arguments["masses"].items()
    }
    for row in arguments["nodes"].values():
        row["gravity_load"] = loads * row.get("gravity_load", 0.0)
    return wd.Frame(**arguments)


@pytest.mark.parametrize("make", REFERENCE_MODELS.values())
@pytest.mark.parametrize("share", [0.9, 1.0, 1.1])
def test_masses_as_weights_are_found_in_frames_with_leaning_columns(make, share):
    with_masses(make, share)
    with pytest.warns(UserWarning, match="masses as weights in N: multiply the loads or divide the masses by 9.81"):
        with_masses(make, share * 9.80665)


def perimeter(mass: float, share: float) -> wd.Frame:
    """Return the four-storey frame without a leaning column, under a share of the weight of the masses."""
    arguments = four_storey().description()
    arguments["nodes"] = {name: row for name, row in arguments["nodes"].items() if name[0] != "L"}
    arguments["members"] = {name: row for name, row in arguments["members"].items() if name[0] != "L"}
    arguments["supports"].pop("L0")
    arguments["sections"].pop("leaning")
    for name, nodes in arguments["diaphragms"].items():
        arguments["diaphragms"][name] = [node for node in nodes if node[0] != "L"]
    joints = [name for name in arguments["nodes"] if name[1] != "0"]
    for name in joints:
        arguments["nodes"][name]["gravity_load"] = share * 9.80665 * 4 * 3.2e5 / len(joints)
    arguments["masses"] = {name: mass * 3.2e5 for name in arguments["masses"]}
    return wd.Frame(**arguments)


def test_masses_as_weights_are_found_without_a_leaning_column_by_the_period():
    for share in (0.08, 0.1, 0.11, 0.13, 0.9, 1.3):  # loads over masses of 0.8 to 13 m/s2, and a period of 1.3 s
        perimeter(1.0, share)
    with pytest.warns(UserWarning, match="gravity loads of the frame over its masses is 0.9 m/s2 .*masses as weights"):
        perimeter(9.80665, 0.9)
    with pytest.warns(UserWarning, match="gravity loads of the frame over its masses is 1.1 m/s2 .*masses as weights"):
        perimeter(9.80665, 1.1)


def with_loads(make, of: str, factor: float) -> wd.Frame:
    """Return a frame whose loads of leaning columns ("L") or joints ("J") are multiplied by a factor."""
    arguments = make().description()
    for name, row in arguments["nodes"].items():
        if name[0] == of:
            row["gravity_load"] = factor * row.get("gravity_load", 0.0)
    return wd.Frame(**arguments)


@pytest.mark.parametrize("make", [portal, four_storey, eight_storey])
@pytest.mark.parametrize(
    ("factor", "meant"),
    [(1e-3, "gravity_load of leaning columns given in kN, it would be 1"), (1e-6, "given in MN, it would be 1")],
)
def test_loads_of_leaning_columns_in_kilonewtons_are_warned_of(make, factor, meant):
    with_loads(make, "L", 0.1)
    with_loads(make, "L", 2.0)
    with_loads(make, "L", 0.0)  # the leaning column carries nothing
    with pytest.warns(UserWarning, match=f"gravity loads of leaning columns over the weight .*{meant}") as caught:
        with_loads(make, "L", factor)
    assert len(caught) == 1


def test_loads_of_a_leaning_column_alone_are_compared_with_the_masses():
    with pytest.warns(UserWarning, match="masses of the frame times g over its gravity loads") as caught:
        with_loads(braced, "L", 1e-3)
    assert len(caught) == 1
    assert "leaning" not in str(caught[0].message)


@pytest.mark.parametrize("make", [portal, four_storey, eight_storey])
def test_loads_of_joints_in_kilonewtons_are_warned_of(make):
    with_loads(make, "J", 0.1)
    with_loads(make, "J", 0.0)
    meant = (
        "gravity loads of joints and beams over those of leaning columns .* with gravity_load of joints or beams given"
    )
    with pytest.warns(UserWarning, match=f"{meant} in kN or kN/m, it would be 0.[01]"):
        with_loads(make, "J", 1e-3)


def with_loads_of_beams(load: float) -> wd.Frame:
    arguments = portal().description()
    arguments["nodes"] = {name: row | {"gravity_load": 0.0} for name, row in arguments["nodes"].items()}
    arguments["members"]["B1_1"]["gravity_load"] = load
    arguments["masses"] = {}
    return wd.Frame(**arguments)


def test_a_load_per_length_in_kilonewtons_is_warned_of():
    with_loads_of_beams(25e3)
    with_loads_of_beams(60.0)  # a light steel member
    with_loads_of_beams(10.0)  # a unit load
    with pytest.warns(
        UserWarning, match="median gravity_load of the members is 25 N/m .*: if given in kN/m, .* 2.5e.04"
    ):
        with_loads_of_beams(25.0)


def with_loads_of_nodes(load: float, scale: float = 1.0) -> wd.Frame:
    """Return the portal without masses, with equal loads at its joints; its lengths are multiplied by a factor."""
    arguments = portal().description() | {"masses": {}}
    for name, row in arguments["nodes"].items():
        row |= {"gravity_load": load if name in ("J1_1", "J1_2") else 0.0, "x": scale * row["x"], "y": scale * row["y"]}
    return wd.Frame(**arguments)


def test_loads_of_nodes_in_kilonewtons_are_warned_of_without_masses():
    for load in (25e3, 1.0, 10.0):
        with_loads_of_nodes(load)
    with_loads_of_nodes(25.0, scale=0.1)  # a model in a laboratory
    with pytest.warns(
        UserWarning, match="largest gravity_load of a node is 25 N .*: if given in kN, it would be 2.5e.04"
    ):
        with_loads_of_nodes(25.0)


def test_static_loads_in_kilonewtons_are_warned_of(recwarn):
    frame = portal()
    for loads in ({"floor 1": {"fx": 25e3}}, {"J1_1": {"fy": -5e3}}, {"floor 1": {"fx": 1.0}}, {"J1_1": {"mz": 10.0}}):
        frame.static(loads)
    frame.static({"floor 1": {"fx": 2.0}}, gravity=True)
    for pattern in ((1.0, 3.0), (0.25, 0.75), (0.333, 0.667), (0.4, 1.0)):
        frame.static({name: {"fx": load} for name, load in zip(("floor 1", "J1_1"), pattern, strict=True)})
    frame.static(member_loads={"B1_1": {"qy": -25e3}})
    assert not recwarn.list
    meant = "under the static loads over the size .*|static loads over the weight .*"
    for given in (
        {"loads": {"J1_1": {"fy": -5.0}}},
        {"loads": {"floor 1": {"fx": 25.0}}},
        {"member_loads": {"B1_1": {"qy": -2.5}}},
    ):
        with pytest.warns(UserWarning, match=f"({meant}): with loads given in kN, kN m or kN/m, it") as caught:
            frame.static(**given)
        assert len(caught) == 1
