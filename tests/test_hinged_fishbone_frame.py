"""Fish-bones of frames with hinges: joined properties, equality with the elastic fish-bone, and refused frames."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import four_storey, portal, two_storey

import warpdyn as wd

STEEL = {"law": "bilinear", "yield_force": 3e5, "hardening_ratio": 0.003}


def hinges_of(frame: wd.Frame, law: dict = STEEL) -> dict:
    """Return this hinge at every end with a spring."""
    found = {}
    for place, name in enumerate(frame.members):
        for side, end in enumerate(("start", "end")):
            if np.isfinite(frame.geometry.end_springs[place, side]) and frame.members[name]["kind"] != "truss":
                found[name, end] = law
    return found


@pytest.mark.parametrize("make", [portal, two_storey, four_storey], ids=lambda make: make.__name__)
def test_periods_are_those_of_the_elastic_fishbone(make):
    frame = make()
    bone = wd.HingedFishbone.from_frame(frame, hinges_of(frame), p_delta=False)
    np.testing.assert_allclose(bone.modal()["period"], wd.fishbone(frame).modal()["period"], rtol=1e-12)


def test_hinges_are_sums_and_weighted_means():
    frame = two_storey()
    hinges = hinges_of(frame)
    weak, strong = STEEL | {"yield_force": 2e5, "hardening_ratio": 0.01}, STEEL | {"yield_force": 6e5}
    for end in ("start", "end"):
        hinges["C1_1", end], hinges["C1_2", end] = weak, strong
        hinges["B2_1", end] = STEEL | {"yield_force": 1e5 if end == "start" else 2e5}
    bone = wd.HingedFishbone.from_frame(frame, hinges)
    found = bone.hinges
    assert found["C1", "start"]["yield_force"] == pytest.approx(8e5, rel=1e-12)
    assert found["C1", "start"]["hardening_ratio"] == pytest.approx((0.01 + 0.003) / 2, rel=1e-12)  # equal stiffnesses
    assert found["B2", "start"]["yield_force"] == pytest.approx(3e5, rel=1e-12)
    assert set(found) == {(f"C{storey}", end) for storey in (1, 2) for end in ("start", "end")} | {
        (f"B{floor}", "start") for floor in (1, 2)
    }


def test_one_yield_moment_in_another_unit_among_joined_hinges_is_named():
    frame = portal()
    hinges = hinges_of(frame)
    hinges["C1_2", "start"] = STEEL | {"yield_force": 300.0}
    pair = r"\('C1_1', 'start'\): 300000 N m, \('C1_2', 'start'\): 300 N m"
    meant = rf"columns of storey 1; {pair}\) is 1000 .*with one given in kN m"
    with pytest.warns(UserWarning, match=meant) as caught:
        wd.HingedFishbone.from_frame(frame, hinges)
    assert len(caught) == 1
    for strength in (3e4, 1e12):  # a weak column, and one that is meant to stay elastic
        hinges["C1_2", "start"] = STEEL | {"yield_force": strength}
        wd.HingedFishbone.from_frame(frame, hinges)


def test_a_wall_beside_columns_gives_no_warning():
    description = portal().description()
    description["sections"]["wall"] = {"elastic_modulus": 3e10, "area": 1.5, "second_moment": 4.5}
    description["members"]["C1_2"] |= {"section": "wall", "spring_start": 2.025e12, "spring_end": 2.025e12}
    frame = wd.Frame(**description)
    wall = STEEL | {"yield_force": 5e7}
    hinges = hinges_of(frame) | {("C1_2", end): wall for end in ("start", "end")}
    wd.HingedFishbone.from_frame(frame, hinges)


def test_energy_capacities_are_added():
    frame = portal()
    law = {
        "law": "ibarra_medina_krawinkler_bilinear",
        "plastic_drift_to_capping": 0.02,
        "post_capping_drift": 0.2,
        "capping_force_ratio": 1.1,
    }
    one, other = (
        law | {"yield_force": 2e5, "strength_deterioration_drift": 1.0},
        law | {"yield_force": 6e5, "strength_deterioration_drift": 2.0, "plastic_drift_to_capping": 0.04},
    )
    hinges = hinges_of(frame, one) | {("C1_2", end): other for end in ("start", "end")}
    joined = wd.HingedFishbone.from_frame(frame, hinges).hinges["C1", "end"]
    assert joined["yield_force"] * joined["strength_deterioration_drift"] == pytest.approx(2e5 * 1 + 6e5 * 2, rel=1e-12)
    assert joined["plastic_drift_to_capping"] == pytest.approx((2e5 * 0.02 + 6e5 * 0.04) / 8e5, rel=1e-12)


def test_the_fishbone_of_half_outer_columns_carries_the_plastic_load_of_the_frame():
    """A portal: the fish-bone has the plastic moments of all hinges, so that both mechanisms have the same load."""
    plastic = {"law": "elastic_perfectly_plastic", "yield_force": 3e5}
    bone = wd.HingedFishbone.from_frame(portal(), hinges_of(portal(), plastic), p_delta=False)
    pushed = wd.pushover(bone, np.linspace(0, 0.2, 21)[1:])
    assert float(pushed["base_shear"][-1]) == pytest.approx(4 * 3e5 / 4.0, rel=1e-6)  # two columns of 4 m


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "hinges must be a dictionary with at least one hinge"),
        ({("C9", "start"): STEEL}, r"\('C9', 'start'\) is not an end of a member"),
        ({("C1_1", "start"): STEEL}, "columns of storey 1: the end .'C1_2', 'start'. has no hinge, but others have"),
        (
            {("C1_1", "start"): STEEL, ("C1_2", "start"): {"law": "elastic_perfectly_plastic", "yield_force": 1e5}},
            "columns of storey 1: the hinges .* have different laws or parameters",
        ),
        ({("C1_1", "start"): 3e5}, "needs a dictionary with 'law', got 300000.0"),
        ({("L1", "start"): STEEL}, "the end .'L1', 'start'. has no spring"),
    ],
)
def test_wrong_hinges_are_named(changes, message):
    with pytest.raises(ValueError, match=message):
        wd.HingedFishbone.from_frame(portal(), changes)
