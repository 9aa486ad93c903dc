"""Hysteretic storeys: OpenSees' Hysteretic force by force, energy, precision, tangents and bad input."""

import numpy as np
import pytest
from opensees import growing, material_forces, ratcheting, wandering
from storey_steps import steps

import warpdyn as wd
from warpdyn.engine.laws import LAWS

pytestmark = pytest.mark.fast

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8, 12]), 50),
    "shrinking": growing(YIELD_DRIFT * np.array([12, 8, 6, 3, 1, 0.4]), 41),
    "random": wandering(10 * YIELD_DRIFT, 60, 37, seed=1),
    "partial cycles": wandering(3 * YIELD_DRIFT, 80, 23, seed=3),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 40),
}
BACKBONES = {  # ductility and force over yield at the second and third corner
    "hardening": (4, 1.2, 10, 1.3),
    "falling to a residual": (3, 1.2, 9, 0.3),
    "falling to zero": (2, 1.1, 6, 0.0),
    "falling at once": (3, 0.6, 8, 0.2),
    "gone at the second corner": (3, 0.0, 6, 0.0),
    "level": (4, 1.0, 8, 1.0),
    "rising by 1 % at its end": (4, 0.8, 8, 0.808),
}
RULES = {  # pinching of drift and force, damage by ductility and energy, unloading exponent
    "plain": (1.0, 1.0, 0.0, 0.0, 0.0),
    "pinched": (0.5, 0.5, 0.0, 0.0, 0.0),
    "strongly pinched, damaged by both": (0.8, 0.2, 0.01, 0.02, 0.0),
    "softer unloading": (0.3, 0.7, 0.0, 0.03, 0.5),
    "damaged by ductility, softer unloading": (0.2, 0.1, 0.004, 0.0, 0.3),
    "no drift before the bend": (0.0, 0.3, 0.0, 0.02, 0.8),
    "no force before the bend": (0.6, 0.0, 0.005, 0.01, 0.2),
    "damage that runs away": (0.6, 0.2, 0.1, 0.1, 0.0),
}


def building(backbone, rules, **parameters):
    names = ("ductility_2", "force_ratio_2", "ductility_3", "force_ratio_3")
    rule_names = (
        "pinching_drift",
        "pinching_force",
        "damage_by_ductility",
        "damage_by_energy",
        "unloading_exponent",
    )
    given = dict(zip((*names, *rule_names), (*backbone, *rules), strict=True)) | {"yield_force": YIELD_FORCE}
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="hysteretic", **(given | parameters))


def theirs(backbone, rules, drift):
    d2, f2, d3, f3 = backbone
    side = [1, 1, f2, d2, f3, d3] * np.tile([YIELD_FORCE, YIELD_DRIFT], 3)
    return material_forces("Hysteretic", [*map(float, [*side, *-side, *rules])], drift)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("rules", RULES)
def test_opensees(protocol, rules):
    drift = PROTOCOLS[protocol]
    for name, backbone in BACKBONES.items():
        ours = wd.storey_hysteresis(building(backbone, RULES[rules]), drift).storey_force.values[:, 0]
        expected = theirs(backbone, RULES[rules], drift)
        assert np.ptp(expected) > 1.2 * YIELD_FORCE
        # The same rules, rounded otherwise.
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-9 * YIELD_FORCE, err_msg=name)


def test_backbone_that_comes_to_no_force_where_opensees_rounds_it_above():
    # The line of this backbone's third part is 1e-11 N where it crosses zero in OpenSees, which takes the storey for
    # one that never lost its strength: coming back from 9 dy it pushes at once, where ours waits for 8 dy.
    backbone, drift = (2, 1.3, 8, 0.0), YIELD_DRIFT / 10 * np.concatenate([np.arange(1, 91), np.arange(89, -11, -1)])
    ours = wd.storey_hysteresis(building(backbone, RULES["plain"]), drift).storey_force.values[:, 0]
    expected = theirs(backbone, RULES["plain"], drift)
    coming_back = np.arange(drift.size) >= 90
    np.testing.assert_allclose(ours[:90], expected[:90], rtol=0, atol=1e-9 * YIELD_FORCE)
    lines = [np.minimum(drift / YIELD_DRIFT - gone, 0) / (gone + 1) * YIELD_FORCE for gone in (8, 9)]  # to yield
    np.testing.assert_allclose(ours[coming_back], lines[0][coming_back], rtol=0, atol=1e-9 * YIELD_FORCE)
    np.testing.assert_allclose(expected[coming_back], lines[1][coming_back], rtol=0, atol=1e-9 * YIELD_FORCE)


def test_unloading_is_no_softer_than_towards_the_origin():
    # f = 1.22 at 5 dy: by 1 / 5 of the first stiffness unloading would come to no force at -1.1 dy.
    backbone, rules = (3, 1.2, 8, 1.25), (1.0, 1.0, 0.0, 0.0, 1.0)
    drift = growing(YIELD_DRIFT * np.full(4, 5.0), 500)
    result = wd.storey_hysteresis(building(backbone, rules), drift)
    force = result.storey_force.values[:, 0]
    top = np.argmax(drift > 5 * YIELD_DRIFT * (1 - 1e-12))
    down = slice(top, top + 250)  # to the origin
    np.testing.assert_allclose(
        force[down], 1.22 * YIELD_FORCE * drift[down] / drift[top], rtol=0, atol=1e-9 * YIELD_FORCE
    )
    # Once both sides have been there the storey goes to and fro through the origin, and nothing is dissipated.
    there = slice(np.argmin(drift), None)
    np.testing.assert_allclose(force[there], 1.22 * YIELD_FORCE * drift[there] / drift[top], rtol=0, atol=1e-3)
    assert np.ptp(result.dissipated_energy.values[there, 0]) < 1e-9 * YIELD_FORCE * YIELD_DRIFT
    # OpenSees pushes on beyond the origin and jumps where it comes back to the backbone.
    expected = theirs(backbone, rules, drift)
    assert np.abs(np.diff(expected)).max() > 0.5 * YIELD_FORCE
    assert np.abs(np.diff(force)).max() < STIFFNESS * np.abs(np.diff(drift)).max() * (1 + 1e-9)


@pytest.mark.parametrize("rules", RULES)
@pytest.mark.parametrize("backbone", BACKBONES)
def test_energy_closes_and_never_falls(backbone, rules):
    drift = wandering(10 * YIELD_DRIFT, 30, 400, seed=2)
    result = wd.storey_hysteresis(building(BACKBONES[backbone], RULES[rules]), drift)
    force, dissipated = result.storey_force.values[:, 0], result.dissipated_energy.values[:, 0]
    work = np.concatenate([[0], np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(drift))]) + force[0] * drift[0] / 2
    # Unloading is along stiffness / ductility^exponent, or stiffer: what is stored cannot be less than with the first.
    assert np.all(work - dissipated >= force**2 / 2 / STIFFNESS - 1e-9 * work[-1])
    np.testing.assert_allclose(dissipated[force == 0], work[force == 0], rtol=1e-9)
    # The trapezoidal rule cuts corners of a step's size: 1e-3 of Fy dy, of which tens are dissipated.
    fall = np.maximum.accumulate(dissipated) - dissipated
    assert fall.max() < 2e-3 * YIELD_FORCE * YIELD_DRIFT
    assert dissipated[-1] > YIELD_FORCE * YIELD_DRIFT


def test_rows():
    for rules in RULES.values():
        row = "hysteretic_softer_unloading" if rules[4] > 0 else "hysteretic"
        assert LAWS["hysteretic"].spring(building(BACKBONES["level"], rules).parameters) == row


def test_a_storey_that_has_not_moved_has_the_stiffness_of_its_positive_side():
    # Searches of implicit methods measure their imbalance by it.
    for rules in ("plain", "softer unloading"):
        storey = building(BACKBONES["hardening"], RULES[rules], stiffness_ratio_negative=0.5)
        np.testing.assert_allclose(steps(storey, np.zeros(1)).tangent, STIFFNESS, rtol=1e-12)


@pytest.mark.parametrize("rules", RULES)
def test_trials_tangents_and_precision(rules):
    drift = PROTOCOLS["partial cycles"]
    for backbone in BACKBONES.values():
        double = steps(building(backbone, RULES[rules]), drift)
        np.testing.assert_allclose(double.trial_force, double.force, rtol=0, atol=1e-12 * YIELD_FORCE)
        # A chord of 1e-7 of the drifts straddles a corner at most where a step ends on one.
        close = np.abs(double.tangent - double.chord) < 1e-5 * STIFFNESS
        assert close.mean() > 0.99
        # Only the step that ends a gap may go up a steeper line: the next is held to the unloading stiffness.
        assert (double.tangent > STIFFNESS * (1 + 1e-9)).mean() < 2e-3
        single = steps(building(backbone, RULES[rules]), drift.astype(np.float32), "float32")
        double = steps(building(backbone, RULES[rules]), drift.astype(np.float32).astype(np.float64))
        assert single.trial_force.dtype == np.float32
        np.testing.assert_allclose(single.force, double.force, rtol=0, atol=1e-4 * YIELD_FORCE)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"ductility_2": 1.0}, r"ductility_2 is 1 \(storey 1\); it must be above 1, that of yield"),
        ({"ductility_3": [5.0, 3.0]}, r"ductility_3 is 3 \(storey 2\); it must be above ductility_2, 4"),
        ({"force_ratio_2": 4.5}, r"force_ratio_2 is 4.5 \(storey 1\); it must be at most 4: no segment"),
        ({"force_ratio_2": 0.5}, r"force_ratio_3 is 1.3 \(storey 1\); .* at most force_ratio_2, 0.5"),
        ({"force_ratio_3": -0.1}, r"force_ratio_3 is -0.1 at storey 1; it must be finite and at least 0"),
        ({"pinching_drift": 1.1}, r"pinching_drift is 1.1 at storey 1; it must be finite and at least 0 and at most 1"),
        ({"pinching_force": -0.1}, r"pinching_force is -0.1 at storey 1"),
        ({"damage_by_energy": -1.0}, r"damage_by_energy is -1 at storey 1"),
        ({"unloading_exponent": 2.0}, r"unloading_exponent is 2 at storey 1"),
    ],
)
def test_bad_input(parameters, message):
    with pytest.raises(ValueError, match=message):
        building(BACKBONES["hardening"], RULES["plain"], **parameters)
