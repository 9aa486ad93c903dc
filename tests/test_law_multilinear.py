"""Elastic-perfectly-plastic, trilinear and quadrilinear storeys against OpenSees and by hand."""

import numpy as np
import pytest
from law_steps import check_steps
from opensees import finer, growing, material_forces, ratcheting, wandering

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("pushed_drift_ratio")]

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8]), 50),
    "random": wandering(8 * YIELD_DRIFT, 40, 37, seed=1),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 40),
    "small": wandering(2 * YIELD_DRIFT, 40, 37, seed=2),
}
TRILINEAR = {"ductility_2": 2.25, "force_ratio_2": 1.5, "hardening_ratio": 0.05}
QUADRILINEAR = TRILINEAR | {"ductility_3": 5.25, "force_ratio_3": 1.8}
FAR = 100 * YIELD_DRIFT
SECOND = 2.25 * YIELD_DRIFT, 1.5 * YIELD_FORCE  # 0.4 of the initial stiffness leads there
THIRD = 5.25 * YIELD_DRIFT, 1.8 * YIELD_FORCE  # and 0.1 there


def further(point):
    """Return OpenSees' last point, which lies far on the line after ours."""
    return point[0] + FAR, point[1] + 0.05 * STIFFNESS * FAR


CASES = {
    "elastic_perfectly_plastic": ({}, "ElasticPP", (STIFFNESS, YIELD_DRIFT)),
    "trilinear": (TRILINEAR, "MultiLinear", (YIELD_DRIFT, YIELD_FORCE, *SECOND, *further(SECOND))),
    "quadrilinear": (QUADRILINEAR, "MultiLinear", (YIELD_DRIFT, YIELD_FORCE, *SECOND, *THIRD, *further(THIRD))),
}


def building(law, **parameters):
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law, **({"yield_force": YIELD_FORCE} | parameters))


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("law", CASES)
def test_forces_are_those_of_opensees(law, protocol):
    parameters, material, given = CASES[law]
    drift = PROTOCOLS[protocol]
    theirs = material_forces(material, given, drift)
    ours = wd.storey_hysteresis(building(law, **parameters), drift).storey_force.values[:, 0]
    assert np.ptp(theirs) > 1.9 * YIELD_FORCE
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * YIELD_FORCE)  # the same rules, rounded otherwise


@pytest.mark.parametrize("law", CASES)
def test_steps(law):
    for drift in PROTOCOLS.values():
        check_steps(building(law, **CASES[law][0]), drift)


# Corners at (1, 2), (3, 4) and (7, 6) with 0.25 beyond. After a turn every segment is twice as long (Masing), until the
# backbone of the other side is reached.
BY_HAND = [(1, 2), (2, 3), (3, 4), (5, 5), (7, 6), (11, 7)]
TURNED = [(9, 3), (7, 1), (5, -1), (1, -3), (-3, -5), (-7, -6)]


def test_a_backbone_and_its_turn_by_hand():
    corners = {"yield_force": 2.0, "ductility_2": 3.0, "force_ratio_2": 2.0, "ductility_3": 7.0, "force_ratio_3": 3.0}
    storey = wd.ShearBuilding(1.0, 2.0, 3.0, law="quadrilinear", hardening_ratio=0.125, **corners)
    drift, force = np.array(BY_HAND + TURNED, float).T
    np.testing.assert_allclose(wd.storey_hysteresis(storey, drift).storey_force[:, 0], force, rtol=0, atol=1e-14)


@pytest.mark.parametrize("law", CASES)
def test_energy_closes_and_never_falls(law):
    storey = building(law, **CASES[law][0])
    closed = np.concatenate([growing(YIELD_DRIFT * np.array([3.0, 7.0]), 50), PROTOCOLS["random"]])
    unit = YIELD_FORCE * YIELD_DRIFT
    # The trapezoidal rule is off by up to an eighth of the stiffness times the step squared where a step has a corner.
    for times in (1, 10):
        path = finer(closed, times)
        bound = STIFFNESS / 8 * np.abs(np.diff(path)).max() ** 2
        assert np.diff(wd.storey_hysteresis(storey, path).dissipated_energy[:, 0]).min() > -bound
    # A whole loop between steady peaks: all the work is dissipated, and the loop's area is known.
    peak = 7 * YIELD_DRIFT
    loops = wd.storey_hysteresis(storey, growing([peak, peak, peak], 7000))
    done = loops.dissipated_energy.values[:, 0]
    area = done[7000 * 5 - 1] - done[7000 * 3 - 1]
    corners = [YIELD_DRIFT] if law == "elastic_perfectly_plastic" else [YIELD_DRIFT, SECOND[0], THIRD[0]]
    slopes = {"elastic_perfectly_plastic": [1, 0], "trilinear": [1, 0.4, 0.05], "quadrilinear": [1, 0.4, 0.1, 0.05]}[
        law
    ]
    losses = -np.diff(slopes) * STIFFNESS  # of each sliding spring, which goes round 4 c (peak - c)
    expected = sum(4 * k * c * max(peak - c, 0) for k, c in zip(losses, corners, strict=False))
    assert area == pytest.approx(expected, abs=1e-3 * unit)


@pytest.mark.parametrize(
    ("law", "changed", "words"),
    [
        ("trilinear", {"force_ratio_2": 0.9}, ["force_ratio_2 is 0.9", "at least 1"]),
        ("trilinear", {"force_ratio_2": 2.3}, ["force_ratio_2 is 2.3", "storey 1", "at most 2.25"]),
        ("trilinear", {"ductility_2": 1.0}, ["ductility_2 is 1", "above 1"]),
        ("trilinear", {"force_ratio_2": [1.5, 1.05]}, ["hardening_ratio is 0.05", "storey 2", "at most 0.04"]),
        ("quadrilinear", {"ductility_3": 2.0}, ["ductility_3 is 2", "above 2.25"]),
        ("quadrilinear", {"force_ratio_3": 1.2}, ["force_ratio_3 is 1.2 at storey 1", "at least 1.5", "corner 2"]),
        ("quadrilinear", {"force_ratio_3": 1.53}, ["hardening_ratio is 0.05", "at most 0.01", "corner 3"]),
        ("quadrilinear", {"force_ratio_3": 2.8}, ["force_ratio_3 is 2.8", "at most 2.7", "corner 2"]),
        ("elastic_perfectly_plastic", {"hardening_ratio": 0.1}, ["unknown parameter 'hardening_ratio'"]),
        ("elastic_perfectly_plastic", {"yield_force": 0.0}, ["yield_force is 0", "above 0"]),
    ],
)
def test_bad_input(law, changed, words):
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        building(law, **(CASES[law][0] | changed))
    for word in words:
        assert word in str(caught.value)
