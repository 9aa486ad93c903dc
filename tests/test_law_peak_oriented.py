"""Peak-oriented and Takeda storeys against OpenSees' Hysteretic and by hand."""

import numpy as np
import pytest
from law_steps import check_steps
from opensees import finer, growing, material_forces, ratcheting, wandering

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("pushed_drift_ratio")]

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm if it does not crack before
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8]), 50),
    "random": wandering(8 * YIELD_DRIFT, 40, 37, seed=1),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 40),
    "small": wandering(1.5 * YIELD_DRIFT, 60, 37, seed=4),
    "partial": ratcheting(-8 * YIELD_DRIFT, 20, 0.6 * YIELD_DRIFT, 23),  # turns before the force is 0
}
# hardening_ratio, cracking_ratio, cracked_stiffness_ratio
BACKBONES = {
    "bilinear": (0.05, 1.0, 1.0),
    "no hardening": (0.0, 1.0, 1.0),
    "cracking": (0.02, 0.4, 0.3),
    "cracking early": (0.001, 0.1, 0.5),
}


def building(law, backbone, **parameters):
    hardening, cracking, cracked = backbone
    given = {"hardening_ratio": hardening, "cracking_ratio": cracking, "cracked_stiffness_ratio": cracked}
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law, **({"yield_force": YIELD_FORCE} | given | parameters))


def hysteretic(backbone, drift, beta=0.0):
    """Return forces of OpenSees' Hysteretic with reloading straight to the peak and no damage."""
    hardening, cracking, cracked = backbone
    first = cracking * YIELD_FORCE, cracking * YIELD_DRIFT
    if cracking < 1:
        points = [first, (YIELD_FORCE, first[1] + (1 - cracking) * YIELD_DRIFT / cracked)]
    else:
        points = [first, (first[0] + hardening * YIELD_FORCE, 2 * YIELD_DRIFT)]
    force, at = points[-1]
    points.append((force + hardening * STIFFNESS * 50 * YIELD_DRIFT, at + 50 * YIELD_DRIFT))
    given = [value for point in points for value in point]
    return material_forces("Hysteretic", [*given, *(-v for v in given), 1.0, 1.0, 0.0, 0.0, beta], drift)


def forces(storey, drift):
    return wd.storey_hysteresis(storey, drift).storey_force.values[:, 0]


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("backbone", BACKBONES)
def test_peak_oriented_forces_are_those_of_opensees(backbone, protocol):
    drift, given = PROTOCOLS[protocol], BACKBONES[backbone]
    theirs = hysteretic(given, drift)
    assert np.ptp(theirs) > 1.2 * YIELD_FORCE
    # The same rules, rounded otherwise.
    np.testing.assert_allclose(forces(building("peak_oriented", given), drift), theirs, rtol=0, atol=1e-9 * YIELD_FORCE)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("exponent", [0.0, 0.2, 0.4])
@pytest.mark.parametrize("backbone", ["bilinear", "no hardening"])
def test_takeda_without_cracking_is_opensees_hysteretic(backbone, exponent, protocol):
    drift, given = PROTOCOLS[protocol], BACKBONES[backbone]
    ours = forces(building("takeda", given, unloading_exponent=exponent), drift)
    # In the one step in which the force changes its sign, OpenSees goes by the unloading slope of the side that it
    # comes to before the change too. That step is made a 100th.
    theirs = hysteretic(given, finer(drift, 100), exponent)[99::100]
    assert np.ptp(theirs) > 1.2 * YIELD_FORCE
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6 * YIELD_FORCE)


def test_takeda_with_cracking_differs_from_hysteretic_where_it_says():
    given = BACKBONES["cracking"]
    for drift in PROTOCOLS.values():
        ours, theirs = forces(building("takeda", given), drift), hysteretic(given, drift, 0.4)
        difference = np.abs(ours - theirs) / YIELD_FORCE
        # Not before it has turned beyond cracking; from there on by the slopes of unloading.
        turns = np.flatnonzero(np.diff(np.sign(np.diff(drift))))
        first = next(turn for turn in turns if abs(drift[turn + 1]) > 0.4 * YIELD_DRIFT) + 1
        assert difference[: first + 1].max() < 1e-12
        assert 0.005 < difference.max() < 0.5


# Takeda, Sozen and Nielsen's rules by hand, in mm and kN: cracks at (1, 40), yields at (7, 100), then 1 kN/mm; exponent
# 0.5. At yield the slope to the opposite cracking point is 140 / 8 = 17.5, at 28 mm half of that.
TAKEDA = {"yield_force": 100.0, "hardening_ratio": 0.025, "cracking_ratio": 0.4, "cracked_stiffness_ratio": 0.25}
CRACKED_ON_BOTH_SIDES = [
    (1, 40),
    (4, 70),  # cracked, not yielded: unloads towards (-1, -40) with 110 / 5 = 22
    (2, 26),
    (-1, -40),
    (-3, -60),  # 100 / 4 = 25; the force is 0 at -0.6
    (-1, -10),
    (1.7, 35),  # half way to the peak (4, 70)
    (4, 70),
    (7, 100),
    (28, 121),  # 8.75; 0 at 28 - 121 / 8.75
    (20, 51),
    (28 - 121 / 8.75, 0),
    (-3, -60),
    (-7, -100),  # 17.5; 0 at -7 + 100 / 17.5
    (-6, -82.5),
    (-7 + 100 / 17.5, 0),
    ((28 - 7 + 100 / 17.5) / 2, 60.5),
    ((28 - 7 + 100 / 17.5) / 2 - 2, 43),  # partial unloading, and back
    ((28 - 7 + 100 / 17.5) / 2, 60.5),
    (28, 121),
]
# A side that has not cracked: with 8.75 until 40, at 9.6; then straight to yield, 60 / 16.6.
YIELDED_ON_ONE_SIDE = [(28, 121), (20, 51), (12, -19), (9.6, -40), (1.3, -70), (-7, -100), (-8, -101)]
# Within the part before cracking the storey comes back as it went.
TURNED_BEFORE_CRACKING = [(28, 121), (12, -19), (20, 121 * (20 - 28 + 121 / 8.75) / (121 / 8.75)), (28, 121)]


@pytest.mark.parametrize("loop", [CRACKED_ON_BOTH_SIDES, YIELDED_ON_ONE_SIDE, TURNED_BEFORE_CRACKING])
@pytest.mark.parametrize("side", [1, -1])
def test_takeda_by_hand(loop, side):
    storey = wd.ShearBuilding(1.0, 40.0, 3.0, law="takeda", unloading_exponent=0.5, **TAKEDA)
    drift, force = side * np.array(loop, float).T
    np.testing.assert_allclose(forces(storey, drift), force, rtol=0, atol=1e-11)
    # And in steps: the path between the corners makes no difference.
    np.testing.assert_allclose(forces(storey, finer(drift, 7))[6::7], force, rtol=0, atol=1e-11)


@pytest.mark.parametrize("backbone", BACKBONES)
@pytest.mark.parametrize("law", ["peak_oriented", "takeda"])
def test_steps(law, backbone):
    for drift in PROTOCOLS.values():
        check_steps(building(law, BACKBONES[backbone]), drift)


@pytest.mark.parametrize("backbone", BACKBONES)
@pytest.mark.parametrize("law", ["peak_oriented", "takeda"])
def test_energy_closes_and_never_falls(law, backbone):
    storey = building(law, BACKBONES[backbone])
    unit = YIELD_FORCE * YIELD_DRIFT
    for drift in PROTOCOLS.values():
        for times in (5, 20):
            path = finer(drift, times)
            found = wd.storey_hysteresis(storey, path)
            done = found.dissipated_energy.values[:, 0]
            # The trapezoidal rule is off by up to an eighth of the stiffness times the step squared at a corner.
            assert np.diff(done).min() > -STIFFNESS / 8 * np.abs(np.diff(path)).max() ** 2
        # Where there is no force nothing is stored: all the work is dissipated.
        force = found.storey_force.values[:, 0]
        work = np.cumsum(np.diff(path, prepend=0) * (force + np.r_[0, force[:-1]]) / 2)
        free = np.abs(force) < 1e-2 * YIELD_FORCE
        assert free.any()
        np.testing.assert_allclose(done[free], work[free], rtol=0, atol=2e-4 * unit)
        assert done[-1] > 0.5 * unit


def test_softest_unloading_ends_at_the_origin():
    # Strong hardening and the largest exponent: from 8 yield drifts the rule alone would lead beyond the origin.
    storey = building("takeda", (0.3, 1.0, 1.0), unloading_exponent=0.5)
    drift = np.array([8.0, 4.0, 0.0, -1.0]) * YIELD_DRIFT
    np.testing.assert_allclose(forces(storey, drift) / YIELD_FORCE, [3.1, 1.55, 0, -1], rtol=0, atol=1e-14)
    path = finer(np.concatenate([PROTOCOLS["random"], PROTOCOLS["small"]]), 20)
    slopes = np.abs(np.diff(forces(storey, path)) / np.diff(path))
    assert slopes.max() < STIFFNESS * (1 + 1e-9)  # the force does not jump
    done = wd.storey_hysteresis(storey, path).dissipated_energy.values[:, 0]
    assert np.diff(done).min() > -STIFFNESS / 8 * np.abs(np.diff(path)).max() ** 2


@pytest.mark.parametrize("law", ["peak_oriented", "takeda"])
@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"cracking_ratio": 0.0}, ["cracking_ratio is 0", "above 0"]),
        ({"cracking_ratio": 1.1}, ["cracking_ratio is 1.1", "at most 1"]),
        ({"cracked_stiffness_ratio": 1.2}, ["cracked_stiffness_ratio is 1.2", "at most 1"]),
        ({"cracked_stiffness_ratio": [0.5, 0.01]}, ["hardening_ratio is 0.05", "storey 2", "cracked_stiffness_ratio"]),
        ({"hardening_ratio": -0.1}, ["hardening_ratio is -0.1", "at least 0"]),
    ],
)
def test_bad_input(law, changed, words):
    given = {"hardening_ratio": 0.05, "yield_force": YIELD_FORCE} | changed
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law, **given)
    for word in words:
        assert word in str(caught.value)


def test_bad_unloading_exponent():
    with pytest.raises(ValueError, match=r"unloading_exponent is 0.6 at storey 1; it must be .* at most 0.5"):
        building("takeda", BACKBONES["bilinear"], unloading_exponent=0.6)
