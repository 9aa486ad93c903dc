"""Sections, springs, supports and offsets of frames in another unit are warned of; sound ones are not."""

from __future__ import annotations

import pytest
from frame_cases import REFERENCE_MODELS, eight_storey, four_storey, portal, two_storey

import warpdyn as wd

pytestmark = pytest.mark.fast


def with_section(make, name: str, **values: float) -> wd.Frame:
    arguments = make().description()
    arguments["sections"][name] |= values
    return wd.Frame(**arguments)


@pytest.mark.parametrize("make", [portal, two_storey, four_storey, eight_storey])
@pytest.mark.parametrize(
    ("factor", "meant"),
    [
        (100.0, "if multiplied by 100 by mistake .1 cm4 is 1e-8 m4., it would be [01]"),
        (1e4, "if multiplied by 1e4 by mistake .1 cm4 is 1e-8 m4, 1 mm4 is 1e-12 m4., it would be [01]"),
        (1e-2, "if divided by 100 by mistake .1 cm4 is 1e-8 m4., it would be [01]"),
        (1e-4, "if divided by 1e4 by mistake .*, it would be [01]"),
    ],
)
def test_one_second_moment_of_a_column_with_a_wrong_power_of_ten_is_warned_of(make, factor, meant):
    nominal = make().sections["C1_1"]["second_moment"]
    with pytest.warns(
        UserWarning, match=f"second_moment over area..2 of the section 'C1_1' .* others .*{meant}"
    ) as caught:
        with_section(make, "C1_1", second_moment=factor * nominal)
    assert len(caught) == 1


def two_sections(**column: float) -> wd.Frame:
    """Return a portal with one section of columns and one of the beam."""
    nodes = {"A": (0.0, 0.0), "B": (0.0, 4.0), "C": (6.0, 4.0), "D": (6.0, 0.0)}
    members = {"left": ("A", "B", "c"), "beam": ("B", "C", "b"), "right": ("D", "C", "c")}
    sections = {
        "c": {"elastic_modulus": 2e11, "area": 0.0118, "second_moment": 1.49e-4} | column,
        "b": {"elastic_modulus": 2e11, "area": 0.0084, "second_moment": 2.31e-4},
    }
    return wd.Frame(nodes, members, sections, supports={"A": "fixed", "D": "fixed"})


def test_a_second_moment_is_compared_with_steel_sections_if_there_are_no_others():
    two_sections()
    two_sections(area=0.25, second_moment=0.25**2 / 12)  # a square column of concrete
    two_sections(area=1.25, second_moment=0.25 * 5.0**3 / 12)  # a wall
    two_sections(area=0.0296, second_moment=1.2e-4)  # HE 600 B about its weak axis
    two_sections(second_moment=0.1)  # rigid
    with pytest.warns(UserWarning, match=r"over that of deep steel sections \(6\) is 178.* it would be 1.78"):
        two_sections(second_moment=0.149)


def test_second_moments_that_are_meant_are_not_warned_of():
    shape = four_storey().sections["C1_1"]
    with_section(four_storey, "C1_1", second_moment=shape["second_moment"] / 27)  # weak axis of a W690 x 125
    with_section(four_storey, "C1_1", second_moment=10.0)  # rigid
    with_section(four_storey, "C1_1", second_moment=1.6e-2, area=0.25)  # concrete columns below
    with_section(four_storey, "B1_1", second_moment=100 * shape["second_moment"])  # a rigid beam
    arguments = four_storey().description()
    for name in arguments["members"]:
        if name[0] == "L":  # a leaning column of beams without moments
            arguments["members"][name] |= {"kind": "beam"}
    arguments["sections"]["leaning"] = {"elastic_modulus": 206e9, "area": 0.02, "second_moment": 1.3e-7}
    wd.Frame(**arguments)


@pytest.mark.parametrize("make", [portal, two_storey, four_storey, eight_storey])
@pytest.mark.parametrize("factor", [10.0, 100.0, 300.0, 1e3, 1e4])
def test_rigid_beams_are_not_warned_of(make, factor):
    arguments = make().description()
    beams = [name for name in arguments["sections"] if name[0] == "B"]
    for names in (beams[:1], beams):
        changed = {name: dict(row) for name, row in arguments["sections"].items()}
        members = {name: dict(row) for name, row in arguments["members"].items()}
        for name in names:
            changed[name]["second_moment"] *= factor
            members[name] |= {end: factor * members[name][end] for end in ("spring_start", "spring_end")}
        wd.Frame(**arguments | {"sections": changed, "members": members})


@pytest.mark.parametrize("make", [model for model in REFERENCE_MODELS.values() if model.__name__ != "braced"])
@pytest.mark.parametrize("factor", [1e-3, 1e-6])
def test_springs_of_all_ends_in_kilonewton_metres_are_warned_of(make, factor):
    """The springs are 10 times 6 E I / L."""

    def frame(factor: float) -> wd.Frame:
        arguments = make().description()
        for row in arguments["members"].values():
            row |= {end: factor * row[end] for end in ("spring_start", "spring_end") if end in row}
        return wd.Frame(**arguments)

    frame(0.01)
    frame(1e3)
    unit = {1e-3: "kN m/rad, it would be (10|5),", 1e-6: "MN m/rad, it would be (10|5)"}[factor]
    with pytest.warns(
        UserWarning, match=f"rotational spring over 6 E I / L .*spring_start or spring_end given in {unit}"
    ):
        frame(factor)


def with_spring(spring: float) -> wd.Frame:
    """Return the two-section portal with equal springs at the ends of its beam, whose 6 E I / L is 4.6e7 N m/rad."""
    arguments = two_sections().description()
    arguments["members"]["beam"] |= {"spring_start": spring, "spring_end": spring}
    return wd.Frame(**arguments)


def test_a_semi_rigid_connection_in_kilonewton_metres_is_warned_of():
    for spring in (5e5, 4.6e7, 4.6e9):  # a fin plate, a semi-rigid and a rigid connection
        with_spring(spring)
    with pytest.warns(
        UserWarning, match="at the start of member 'beam' is 0.00099.*given in kN m/rad, it would be 0.99"
    ):
        with_spring(4.6e4)


def test_hinges_do_not_repeat_the_warning_of_springs():
    arguments = portal().description()
    hinge = {"law": "bilinear", "yield_force": 4e5, "hardening_ratio": 0.02}
    arguments["members"]["B1_1"]["spring_start"] *= 1e-4
    with pytest.warns(UserWarning, match="'B1_1' is 0.001 .*in kN m/rad, it would be 1"):
        frame = wd.Frame(**arguments)
    wd.HingedFrame(frame, {("B1_1", "start"): hinge}, damping="modal", damping_ratio=0.02)


def supported(**springs: float) -> wd.Frame:
    """Return the portal with 70 t on springs of its supports, under the weight at its joints."""
    arguments = two_sections().description()
    for name in "BC":
        arguments["nodes"][name] |= {"gravity_load": 343e3}
    arguments |= {"diaphragms": {"floor": ["B", "C"]}, "masses": {"floor": 70e3}}
    return wd.Frame(**arguments | {"supports": dict.fromkeys("AD", {"ux": True, "uy": True, "rz": True} | springs)})


@pytest.mark.parametrize(
    ("direction", "usual", "meant"),
    [
        # 343 kN over 20 MN/m are 17 mm.
        (
            "uy",
            2e7,
            "settlement of the springs of supports under gravity at node 'A' is 17.15 m .*uy given in kN/m, .* 0.017",
        ),
        # 687 kN over twice 7 MN/m are 49 mm.
        (
            "ux",
            7e6,
            "horizontal displacement of the springs .* is 49.0.* m .*: with ux given in kN/m, it would be 0.049",
        ),
        # 6 E I / L is 44.7 MN m/rad.
        (
            "rz",
            2e7,
            "rotational spring of the support .*at node 'A' is 0.000447.*: with rz given in kN m/rad, .* 0.447",
        ),
    ],
)
def test_springs_of_supports_in_kilonewtons_are_warned_of(direction, usual, meant):
    supported(**{direction: usual})
    supported(**{direction: 100 * usual})
    with pytest.warns(UserWarning, match=meant):
        supported(**{direction: 1e-3 * usual})


def test_isolators_below_a_frame_are_not_warned_of():
    supported(ux=1.4e5)  # 4.4 s
    supported(uy=5e6)  # 69 mm


def test_masses_per_length_in_tonnes_are_warned_of():
    two_sections(mass_per_length=7850 * 0.0118)
    two_sections(mass_per_length=5e3)  # with the mass of a floor
    two_sections(area=1.0, mass_per_length=100.0)  # a large area on purpose
    for given, meant in (
        (5.0, "423.7.* kg/m3 .*in t/m, it would be 4.24e.05"),
        (0.0926, "7.84.* kg/m3 .*t/m, .* 7.85e.03"),
    ):
        with pytest.warns(UserWarning, match=f"mass_per_length over area of the section 'c'.* is {meant}"):
            two_sections(mass_per_length=given)


def with_offsets(start: float, end: float) -> wd.Frame:
    arguments = two_sections().description()
    arguments["members"]["beam"] |= {"offset_start_x": start, "offset_end_x": end}
    return wd.Frame(**arguments)


@pytest.mark.parametrize(
    ("start", "end", "meant"),
    [
        (300.0, -300.0, "'beam' is 100 .*: with offsets given in mm, it would be 0.1"),
        (0.0, -30.0, "'beam' is 5 .*: with offsets given in cm, it would be 0.05"),
        (
            4.0,
            -4.0,
            "'beam' is 1.33.*the offsets of both ends may exceed the length of the member, or have a wrong sign",
        ),
    ],
)
def test_offsets_in_another_unit_are_warned_of(start, end, meant):
    with pytest.warns(
        UserWarning, match=f"rigid end offset over the distance of the nodes of the member {meant}"
    ) as caught:
        with_offsets(start, end)
    assert len(caught) == 1
    assert "length of the member 'beam'" not in str(caught[0].message)


def test_usual_offsets_are_not_warned_of():
    with_offsets(0.3, -0.3)
    with_offsets(2.5, -2.5)  # between walls
    with pytest.raises(ValueError, match=r"no length .*Offsets are in m, from the node to the end of the member"):
        with_offsets(3.0, -3.0)
