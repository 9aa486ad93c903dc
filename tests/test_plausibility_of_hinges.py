"""Implausible rotations of Ibarra-Medina-Krawinkler hinges are warned of; errors name a likely wrong unit."""

from __future__ import annotations

import math
import re

import pytest
from frame_cases import braced, portal

import warpdyn as wd

pytestmark = pytest.mark.fast
# W-sections of steel (Lignos and Krawinkler 2011): theta_p 0.03, theta_pc 0.2, theta_u 0.2 and Lambda 1.
STEEL = {
    "law": "ibarra_medina_krawinkler_bilinear",
    "yield_force": 4e5,
    "plastic_drift_to_capping": 0.03,
    "post_capping_drift": 0.2,
    "capping_force_ratio": 1.1,
    "ultimate_drift": 0.2,
    "strength_deterioration_drift": 1.0,
    "post_capping_deterioration_drift": 1.0,
    "unloading_deterioration_drift": 1.0,
}


def with_hinge(spring: float | None = None, **more: float) -> wd.HingedFrame:
    """Return the portal with a hinge of 0.03 rad to capping, whose spring has 5.1e8 N m/rad, at one end of its beam."""
    arguments = portal().description()
    beam = arguments["members"]["B1_1"]
    beam["spring_start"] = spring or beam["spring_start"]
    return wd.HingedFrame(wd.Frame(**arguments), {("B1_1", "start"): STEEL | more}, damping="modal", damping_ratio=0.02)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"ultimate_drift": 0.0},  # never
        {"ultimate_drift": 0.031},  # above 4e5 / 5.1e8 + 0.03 = 0.0308
        {"ultimate_drift": 1e9},
        {"ultimate_drift": 1.0},
        {"strength_deterioration_drift": 0.0, "unloading_deterioration_drift": 1e9},
        {"strength_deterioration_drift": 0.2, "unloading_deterioration_drift": 5.0},
    ],
)
def test_usual_hinges_get_no_warning(more, recwarn):
    with_hinge(**more)
    assert not recwarn.list


@pytest.mark.parametrize(
    ("more", "meant"),
    [
        ({"ultimate_drift": 6.0}, "ultimate_drift of the hinge 'B1_1 start' is 6 rad .*: if given in percent, .* 0.06"),
        ({"ultimate_drift": 11.5}, "is 11.5 rad .*in percent, .* 0.115 rad, or if given in degrees, it would be 0.201"),
        ({"ultimate_drift": 6.0}, "or give ultimate_drift=0 for a hinge that never loses its strength"),
        (
            {"ultimate_drift": 0.2, "ultimate_drift_negative": 6.0},
            r"ultimate_drift of the hinge 'B1_1 start' \(ultimate_drift_negative\) is 6 rad",
        ),
        (
            {"ultimate_drift": 0.02},
            r"\(0.02 and 0.03079 rad\) of 'B1_1 start' is 0.649.*: the hinge loses all strength before its "
            "capping point: give ultimate_drift as the total rotation",
        ),
        (
            {"ultimate_drift": 0.04, "plastic_drift_to_capping_negative": 0.05},
            r"\(0.04 and 0.05079 rad\) of 'B1_1 start' is 0.787",
        ),
        ({"plastic_drift_to_capping": 3.0}, "plastic_drift_to_capping of the hinge .* is 3 rad .*in percent, .* 0.03"),
        (
            {"unloading_deterioration_drift": 100.0},
            r"\(unloading_deterioration_drift\) of the hinge 'B1_1 start' is 100 rad .*in percent, it would be 1 rad",
        ),
        ({"strength_deterioration_drift": 33.0}, "is 33 rad .*it may be the ratio lambda: multiply it by the plastic"),
    ],
)
def test_rotations_in_another_unit_are_warned_of(more, meant):
    with pytest.warns(UserWarning, match=meant) as caught:
        with_hinge(**more)
    assert len(caught) == 1


@pytest.mark.parametrize(
    ("spring", "more", "meant"),
    [
        (None, {"yield_force": 4e8}, "if yield_force is in N mm, give yield_force=400000"),
        (None, {"yield_force": 4e8, "capping_force_ratio": 1.0}, "ultimate_drift .*give yield_force=400000"),
        (5e5, {}, r"yield_force / stiffness, is 0.8 rad .* is in kN m/rad, give 5e\+08 \[N m/rad\]"),
    ],
)
def test_a_moment_in_newton_millimetres_is_refused_with_its_unit(spring, more, meant):
    with pytest.raises(ValueError, match=f"'B1_1 start': .*{meant}"):
        with_hinge(spring, **more)


MISSING = object()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"yield_force": MISSING}, r"yield_force \(yield moment \[N m\]\) is missing"),
        ({"post_capping_drift": MISSING}, r"\(rotation from the capping point to zero moment \[rad\]\) is missing"),
        ({"ultimate_drift": 1e-6}, r"above the yield rotation of 0.00078\d+ rad$"),  # 4e5 / 5.1e8
        (
            {"ultimate_drift_negative": 1e-6},
            r"ultimate_drift_negative is 1e-06.* the yield rotation of 0.00078\d+ rad$",
        ),
        ({"residual_force_ratio": 20.0}, "residual_force_ratio is 20; it must be .* below 1; 20 % is 0.2$"),
        (
            {"yield_force": math.inf},
            r"yield_force is inf; .* never yields, give \{'law': 'elastic'\}, or yield_force=1e\+12 with capping",
        ),
        ({"yield_force": math.inf, "law": "bilinear"}, r"yields, give \{'law': 'elastic'\}, or yield_force=1e\+12$"),
        ({"yield_force": 1e12}, "give {'law': 'elastic'}, or capping_force_ratio=1 with this yield_force$"),
    ],
)
def test_messages_of_hinges_are_about_rotations_and_moments(more, message):
    row = {name: value for name, value in (STEEL | more).items() if value is not MISSING}
    if row["law"] == "bilinear":
        row = {"law": "bilinear", "yield_force": row["yield_force"], "hardening_ratio": 0.02}
    with pytest.raises(ValueError, match=message) as caught:
        wd.HingedFrame(portal(), {("B1_1", "start"): row})
    assert not re.search(r"\bdrift|\bstorey|\bforces?\b", str(caught.value))


def test_hinges_that_never_yield_are_written_as_the_messages_say(recwarn):
    bilinear = {"law": "bilinear", "yield_force": 1e12, "hardening_ratio": 0.02}
    for row in ({"law": "elastic"}, bilinear, STEEL | {"yield_force": 1e12, "capping_force_ratio": 1.0}):
        wd.HingedFrame(
            portal(), {("B1_1", "start"): row | ({"ultimate_drift": 0.0} if "ultimate_drift" in row else {})}
        )
    assert not recwarn.list


def test_messages_of_braces_are_about_forces_and_elongations():
    with pytest.raises(ValueError, match=r"'D1 axial': yield_force \(axial yield force \[N\]\) is missing"):
        wd.HingedFrame(braced(), {("D1", "axial"): {"law": "elastic_perfectly_plastic"}})


def test_a_steep_hardening_line_is_refused_without_a_unit():
    # The yield rotation is 0.0008 rad, so that the line is as steep as the elastic one if the moment grows 39 times.
    with pytest.raises(ValueError, match=r"it must be below 39.*less stiff than the elastic line$"):
        with_hinge(capping_force_ratio=40.0)
