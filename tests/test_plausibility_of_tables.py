"""One section, one gravity load or all stiffnesses of a frame in another unit are warned of before a run."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import four_storey, portal

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = pytest.mark.fast
MOTION = wd.GroundMotion(np.sin(np.arange(200) / 10), 0.01)


def with_section(name: str, **factors: float) -> None:
    """Make the four-storey frame with properties of one section that are multiplied by factors."""
    arguments = four_storey().description()
    arguments["sections"][name] |= {key: factor * arguments["sections"][name][key] for key, factor in factors.items()}
    wd.Frame(**arguments)


@pytest.mark.parametrize(
    ("factors", "meant"),
    [
        (
            {"area": 1e4},
            r"area of the section 'C2_1' \(195.5 m2\) over the median of others \(0.01445 m2\) is 13526.8 .*: "
            "with area given in cm2, it would be 1.35",
        ),
        ({"area": 1e6}, "with area given in mm2, it would be 1.35"),
        ({"second_moment": 1e8}, "radius of gyration .* 'C2_1' .*: with second_moment given in cm4, it would be 0.265"),
        ({"second_moment": 1e12}, "radius of gyration .* 'C2_1' .*: with second_moment given in mm4, it would be 0.26"),
        ({"area": 1e4, "second_moment": 1e8}, "with area in cm2 and second_moment in cm4, it would be 0.265"),
        (
            {"elastic_modulus": 1e-6},
            "elastic_modulus of the section 'C2_1' .*: if given in MPa or N/mm2, it would be 2.06",
        ),
    ],
)
def test_one_section_in_another_unit_is_warned_of(factors, meant):
    with pytest.warns(UserWarning, match=meant) as caught:
        with_section("C2_1", **factors)
    assert len(caught) == 1


def test_rigid_members_are_not_warned_of():
    with_section("B2_1", second_moment=1e3)  # a rigid cap beam: radius of gyration of 8.2 m
    with_section("B2_1", second_moment=1e3, area=10.0)
    with_section("B2_1", area=1e4)  # between nodes of a rigid floor, so that it has no effect
    with_section("C2_1", area=100 / 0.01954835)  # 100 m2, so that the column keeps its length


def with_load(name: str, factor: float, make=four_storey) -> None:
    arguments = make().description()
    arguments["nodes"][name]["gravity_load"] *= factor
    wd.Frame(**arguments)


@pytest.mark.parametrize(
    ("name", "factor", "make", "meant"),
    [
        ("J2_2", -1.0, four_storey, r"node 'J2_2' \(-124446 N\) over the median of nodes above and below .*minus sign"),
        (
            "J2_2",
            1e-3,
            four_storey,
            "node 'J2_2' .* is 0.00109.*: with gravity_load given in kN or kN/m, it would be 1.09",
        ),
        ("J2_2", 1e3, four_storey, "node 'J2_2' .* is 995.* multiplied by 1,000 twice, or in another unit"),
        ("L3", 1e-3, four_storey, "node 'L3' .* is 0.00105.*: with gravity_load given in kN or kN/m, it would be 1.05"),
        ("J1_1", 1e-3, portal, r"node 'J1_1' \(50 N\) over the median of all nodes \(50000 N\) is 0.001 "),
    ],
)
def test_one_gravity_load_in_another_unit_is_warned_of(name, factor, make, meant):
    with pytest.warns(UserWarning, match=meant) as caught:
        with_load(name, factor, make)
    assert len(caught) == 1


def test_light_and_missing_gravity_loads_are_not_warned_of():
    with_load("J2_2", 0.1)
    with_load("L3", 0.1)
    with_load("L3", 0.0)


def test_one_load_of_a_member_in_another_unit_is_warned_of():
    arguments = four_storey().description()
    for name, row in arguments["members"].items():
        row |= {"gravity_load": 20e3 if "B" in name else 0.0}
    for load, meant in (
        (20.0, r"member 'B2_2' \(20 N/m\) .* is 0.001 .*: with gravity_load given in kN or kN/m, it would be 1."),
        (-20e3, "member 'B2_2' .*: gravity_load is downward if it is above 0: remove the minus sign"),
    ):
        arguments["members"]["B2_2"]["gravity_load"] = load
        with pytest.warns(UserWarning, match=meant):
            wd.Frame(**arguments)
    arguments["members"]["B2_2"]["gravity_load"] = 5e3
    wd.Frame(**arguments)


@pytest.mark.parametrize(
    ("factors", "meant"),
    [
        (
            {"second_moment": 1e-3},
            r"first period is 4[0-9]\.[0-9]* s .*: masses .kg., elastic_modulus .Pa. or second_moment .m4. may",
        ),
        (
            {"spring": 1e-6},
            r"first period is 38[0-9.]* s .*spring_start and spring_end may be in kN m/rad instead of N m/rad",
        ),
        ({"masses": 1e-3}, "first period over height is 0.0026.*: with masses given in tonnes, it would be 0.083"),
    ],
)
@pytest.mark.meant_as_given("frame_gravity_over_weight", "end_spring")
def test_an_unusual_period_names_the_tables_of_the_frame(factors, meant):
    # The period of the frame is 1.37 s; the springs keep their stiffness, or the members keep theirs.
    arguments = four_storey().description()
    for row in arguments["sections"].values():
        row |= {"second_moment": factors.get("second_moment", 1.0) * row.get("second_moment", 0.0)}
    for row in arguments["members"].values():
        ends = ("spring_start", "spring_end")
        row |= {end: factors.get("spring", 1.0) * row[end] for end in ends if end in row}
    arguments["masses"] = {name: factors.get("masses", 1.0) * 3.2e5 for name in arguments["masses"]}
    frame = wd.Frame(**arguments).lumped(damping="modal", damping_ratio=0.02)
    with pytest.warns(UserWarning, match=meant) as caught:
        warn_of_implausible(wd.Scene(frame, MOTION))
    assert len(caught) == 1
    assert "stiffness" not in str(caught[0].message)
