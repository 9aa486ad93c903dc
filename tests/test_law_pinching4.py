"""Pinching4 storeys: OpenSees' Pinching4 force by force, energy, precision, tangents and bad input."""

import warnings

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
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8, 12.3]), 50),
    "shrinking": growing(YIELD_DRIFT * np.array([12.3, 8, 6, 3, 1, 0.4]), 41),
    "random": wandering(10 * YIELD_DRIFT, 60, 37, seed=1),
    "partial cycles": wandering(3 * YIELD_DRIFT, 80, 23, seed=3),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 40),
}
BACKBONES = {  # ductility and force over yield at the second, third and fourth corner
    "falling to a residual": (4, 1.2, 7, 1.3, 10, 0.4),
    "hardening": (3, 1.05, 6, 1.1, 10, 1.2),
    "falling at once": (4, 0.9, 7, 0.6, 10, 0.2),
    "rising by 1 % at its end": (4, 1.5, 7, 0.9, 10, 0.909),
}
TO_ZERO = (2, 1.1, 5, 1.15, 9, 0.0)
PINCHING = {  # reloading drift and force, unloading force
    "GEM": (0.5, 0.25, 0.05),
    "weak": (0.9, 0.6, 0.1),
    "strong, unloading short of zero": (0.2, 0.1, -0.07),
    "reloading above unloading": (0.3, 0.9, 0.5),
    "joints": (0.15, 0.35, 0.2),
    "reloading at the middle": (0.0, 0.3, -0.2),
    "late": (0.8, 0.2, -0.05),
}
# Of each kind the factors of drift and use, their exponents and the limit; the energy factor; the type.
NONE = (0.0, 0.0, 1.0, 1.0, 0.0)
DAMAGE = {
    "none": (NONE, NONE, NONE, 10.0, "energy"),
    "stiffness": ((0.3, 0.2, 0.8, 0.5, 0.6), NONE, NONE, 5.0, "energy"),
    "reloading": (NONE, (0.2, 0.3, 0.7, 0.6, 0.4), NONE, 5.0, "energy"),
    "strength": (NONE, NONE, (0.2, 0.3, 1.0, 0.4, 0.5), 5.0, "energy"),
    "all": ((0.2, 0.1, 0.8, 0.5, 0.6), (0.1, 0.1, 0.7, 0.6, 0.3), (0.1, 0.15, 1.0, 0.4, 0.4), 4.0, "energy"),
    "limits": ((1.0, 0.2, 0.3, 0.2, 0.9), (0.5, 0.5, 2.0, 2.0, 0.5), (1.0, 0.0, 1.0, 1.0, 0.9), 10.0, "energy"),
    "cycles": ((0.2, 0.01, 0.8, 0.5, 0.6), (0.1, 0.01, 0.7, 0.6, 0.3), (0.1, 0.015, 1.0, 0.4, 0.4), 10.0, "cycle"),
}
CORNER = ("ductility", "force_ratio")


def building(backbone, pinching=PINCHING["GEM"], damage=DAMAGE["none"], **parameters):
    *kinds, energy_factor, counted = damage
    given = {f"{what}_{i}": backbone[2 * i - 4 + k] for i in (2, 3, 4) for k, what in enumerate(CORNER)}
    given |= dict(zip(("reloading_drift", "reloading_force", "unloading_force"), pinching, strict=True))
    for kind, values in zip(("stiffness", "reloading", "strength"), kinds, strict=True):
        names = ("by_drift", "by_use", "drift_exponent", "use_exponent", "limit")
        given |= {f"{kind}_damage_{name}": value for name, value in zip(names, values, strict=True)}
    given |= {"energy_factor": energy_factor, "counts_cycles": float(counted == "cycle"), "yield_force": YIELD_FORCE}
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="pinching4", **(given | parameters))


def theirs(backbone, drift, pinching=PINCHING["GEM"], damage=DAMAGE["none"]):
    d2, f2, d3, f3, d4, f4 = backbone
    side = [1, 1, f2, d2, f3, d3, f4, d4] * np.tile([YIELD_FORCE, YIELD_DRIFT], 4)
    *kinds, energy_factor, counted = damage
    numbers = [*side, *-side, *pinching, *pinching, *np.ravel(kinds), energy_factor]
    return material_forces("Pinching4", [*map(float, numbers), counted], drift)


def forces(storey, drift):
    return wd.storey_hysteresis(storey, drift).storey_force.values[:, 0]


def before_opensees_is_stiffer_than_at_first(expected, drift):
    """Return how many steps there are before one of OpenSees' that is: ours never are."""
    rise = np.diff(expected, prepend=0.0) * np.sign(np.diff(drift, prepend=0.0))
    steep = np.flatnonzero(rise > STIFFNESS * np.abs(np.diff(drift, prepend=0.0)) + 1e-6 * YIELD_FORCE)
    return steep[0] if steep.size else drift.size


def first_steps_after_turns(drift):
    way = np.sign(np.diff(drift, prepend=0.0))
    return way * np.concatenate([[0], way[:-1]]) < 0


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("damage", DAMAGE)
def test_opensees(protocol, damage):
    drift = PROTOCOLS[protocol]
    for name, backbone in BACKBONES.items():
        for pinching in PINCHING.values():
            ours = forces(building(backbone, pinching, DAMAGE[damage]), drift)
            expected = theirs(backbone, drift, pinching, DAMAGE[damage])
            assert np.ptp(expected) > 1.2 * YIELD_FORCE
            # The same rules but that their level backbone rises by 1e-7 of its force a last drift, and that a turn
            # takes a step there to take effect, which leaves a little other energy behind.
            same = ~first_steps_after_turns(drift) if damage != "none" else np.full(drift.size, True)
            same[before_opensees_is_stiffer_than_at_first(expected, drift) :] = False
            assert same.sum() > 40  # one of the first cycles, with three kinds of pinching; else all
            atol = 1e-7 if damage == "none" else 1e-5
            np.testing.assert_allclose(ours[same], expected[same], rtol=0, atol=atol * YIELD_FORCE, err_msg=name)
            # What turns along the unloading stiffness, as with GEM's pinching, is the same there too.
            if pinching == PINCHING["GEM"]:
                np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-7 * YIELD_FORCE, err_msg=name)


@pytest.mark.parametrize("damage", DAMAGE)
def test_no_path_is_stiffer_than_at_first(damage):
    # The first turns are before yield: OpenSees' paths go up to 2.3 times as steeply there.
    backbone, drift = BACKBONES["hardening"], PROTOCOLS["growing"]
    for pinching in PINCHING.values():
        storey = building(backbone, pinching, DAMAGE[damage])
        rise = np.diff(forces(storey, drift)) * np.sign(np.diff(drift))
        assert (rise - STIFFNESS * np.abs(np.diff(drift))).max() < 1e-9 * YIELD_FORCE
        assert steps(storey, drift).tangent.max() < STIFFNESS * (1 + 1e-9)
    steep = theirs(backbone, drift, (0.3, 0.9, 0.5), DAMAGE[damage])
    assert before_opensees_is_stiffer_than_at_first(steep, drift) < drift.size


@pytest.mark.parametrize("backbone", [(4, 1.2, 7, 1.3, 10, 0.4), (3, 0.9, 6, 0.6, 10, 0.3), (3, 1.0, 5, 1.0, 8, 1.6)])
def test_no_cycle_gives_energy_at_the_least_unloading_ratio(backbone):
    least = -0.3 / max(1, backbone[3], backbone[5] / min(1, backbone[3]))
    with pytest.raises(ValueError, match=f"at least {least:g}"):
        building(backbone, (0.95, 0.3, least * 1.001))
    storey = building(backbone, (0.95, 0.3, least))
    for peak in np.arange(1.25, 12, 0.25):
        drift = growing(YIELD_DRIFT * np.full(4, peak), 200)
        force, tops = forces(storey, drift), np.flatnonzero(drift > peak * YIELD_DRIFT * (1 - 1e-9))
        work = np.append(0, np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(drift)))
        assert tops.size == 4
        assert np.diff(work[tops]).min() > -1e-3 * YIELD_FORCE * YIELD_DRIFT, peak  # the trapezoidal rule's


def test_first_step_after_a_turn_has_the_new_stiffness():
    backbone, pinching = BACKBONES["falling to a residual"], PINCHING["joints"]
    drift = np.append(growing([3 * YIELD_DRIFT], 40), wandering(4 * YIELD_DRIFT, 80, 23, seed=2))
    ours = forces(building(backbone, pinching, DAMAGE["all"]), drift)
    difference = np.abs(ours - theirs(backbone, drift, pinching, DAMAGE["all"]))
    # OpenSees' first step is on a path of the old stiffness, its second on the path that ours is on from the first.
    assert difference[first_steps_after_turns(drift)].max() > 1e-2 * YIELD_FORCE
    assert difference[~first_steps_after_turns(drift)].max() < 1e-5 * YIELD_FORCE


def test_level_part_is_level():
    drift = YIELD_DRIFT * np.arange(0.1, 8, 0.1)
    backbone = (3, 1.2, 6, 1.2, 10, 0.4)
    expected = np.interp(drift / YIELD_DRIFT, [0, 1, 3, 6, 10], [0, 1, 1.2, 1.2, 0.4]) * YIELD_FORCE
    np.testing.assert_allclose(forces(building(backbone), drift), expected, rtol=0, atol=1e-9 * YIELD_FORCE)
    # OpenSees extends the next part, which falls by 0.2 of yield a drift, back over the level one.
    on_level = (drift > 3.05 * YIELD_DRIFT) & (drift < 5.95 * YIELD_DRIFT)
    steep = (1.2 + 0.2 * (6 - drift / YIELD_DRIFT)) * YIELD_FORCE
    np.testing.assert_allclose(theirs(backbone, drift)[on_level], steep[on_level], rtol=1e-9)


def test_backbone_to_zero():
    for name, drift in PROTOCOLS.items():
        ours, expected = forces(building(TO_ZERO), drift), theirs(TO_ZERO, drift)
        assert np.isfinite(ours).all()
        # OpenSees divides by the force aimed at, where there is none left.
        lasts = np.flatnonzero(np.isnan(expected))[0] if name in ("shrinking", "random") else drift.size
        np.testing.assert_allclose(ours[:lasts], expected[:lasts], rtol=0, atol=1e-9 * YIELD_FORCE, err_msg=name)
    both_ways = growing(YIELD_DRIFT * np.array([10.0, 10.0]), 20)
    np.testing.assert_allclose(forces(building(TO_ZERO), both_ways)[60:], 0, rtol=0, atol=1e-12 * YIELD_FORCE)


@pytest.mark.parametrize("damage", DAMAGE)
def test_same_both_ways(damage):
    # But for paths by way of the origin, which OpenSees takes by other secants up than down, and so do we.
    drift = PROTOCOLS["random"]
    for backbone in BACKBONES.values():
        storey = building(backbone, damage=DAMAGE[damage])
        np.testing.assert_allclose(forces(storey, drift), -forces(storey, -drift), rtol=0, atol=1e-9 * YIELD_FORCE)


@pytest.mark.parametrize("damage", DAMAGE)
@pytest.mark.parametrize("backbone", BACKBONES)
def test_energy_closes_and_never_falls_with_pinching_as_of_gem(backbone, damage):
    drift = wandering(9 * YIELD_DRIFT, 30, 400, seed=2)
    result = wd.storey_hysteresis(building(BACKBONES[backbone], damage=DAMAGE[damage]), drift)
    force, dissipated = result.storey_force.values[:, 0], result.dissipated_energy.values[:, 0]
    work = np.concatenate([[0], np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(drift))]) + force[0] * drift[0] / 2
    # What a storey gives back as it unloads is what the work falls by until the force changes its sign.
    falling = np.flatnonzero((force[:-1] * force[1:] < 0) & (np.diff(work) < 0))
    np.testing.assert_allclose(dissipated[falling], work[falling], rtol=0, atol=1e-3 * work[-1])
    # Where a path changes from three parts to a line it gives back more than it was seen to store: a little, but where
    # damage takes 0.9 of the stiffness and most paths are lines.
    fall = np.maximum.accumulate(dissipated) - dissipated
    allowed = {"none": 0.02, "limits": 0.5}.get(damage, 0.1)
    assert fall.max() < allowed * YIELD_FORCE * YIELD_DRIFT
    assert dissipated[-1] > 10 * YIELD_FORCE * YIELD_DRIFT


def test_rows():
    rows = {name: spring_of(building(BACKBONES["hardening"], damage=damage)) for name, damage in DAMAGE.items()}
    assert rows.pop("none") == "pinching4"
    assert rows.pop("cycles") == "pinching4_cycle_damage"
    assert set(rows.values()) == {"pinching4_energy_damage"}


def spring_of(storey):
    return LAWS[storey.law].spring(storey.parameters)


@pytest.mark.parametrize("damage", DAMAGE)
def test_trials_tangents_and_precision(damage):
    drift = PROTOCOLS["partial cycles"]
    for backbone in (*BACKBONES.values(), TO_ZERO):
        storey = building(backbone, damage=DAMAGE[damage])
        double = steps(storey, drift)
        np.testing.assert_allclose(double.trial_force, double.force, rtol=0, atol=1e-12 * YIELD_FORCE)
        close = np.abs(double.tangent - double.chord) < 1e-5 * STIFFNESS
        assert close.mean() > 0.99  # a chord of 1e-7 of the drifts straddles a corner at most where a step ends on one
        assert double.tangent.max() < STIFFNESS * (1 + 1e-9)
        single = steps(storey, drift.astype(np.float32), "float32")
        double = steps(storey, drift.astype(np.float32).astype(np.float64))
        assert single.trial_force.dtype == np.float32
        np.testing.assert_allclose(single.force, double.force, rtol=0, atol=1e-4 * YIELD_FORCE)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"ductility_2": 0.5}, r"ductility_2 is 0.5 \(storey 1\); it must be above 1, that of yield"),
        ({"ductility_4": [12.0, 7.0]}, r"ductility_4 is 7 \(storey 2\); it must be above ductility_3, 7"),
        ({"force_ratio_3": 4.5}, r"force_ratio_3 is 4.5 \(storey 1\); it must be at most 4.2: no segment"),
        (
            {"force_ratio_4": 1.4, "force_ratio_3": 1.1},
            r"force_ratio_4 is 1.4 \(storey 1\); .* at most force_ratio_3, 1.1",
        ),
        ({"unloading_force": -0.2}, r"unloading_force is -0.2 at storey 1; it must be at least -0.192308, or cycles"),
        ({"force_ratio_4": -0.1}, r"force_ratio_4 is -0.1 at storey 1; it must be finite and at least 0"),
        ({"reloading_drift": 1.0}, r"reloading_drift is 1 at storey 1; it must be finite and at least 0 and below 1"),
        ({"reloading_force": -0.1}, r"reloading_force is -0.1 at storey 1"),
        ({"unloading_force": 0.25}, r"unloading_force is 0.25 \(storey 1\); it must be below reloading_force, 0.25"),
        ({"strength_damage_limit": 1.0}, r"strength_damage_limit is 1 at storey 1; .* at least 0 and below 1"),
        ({"stiffness_damage_by_use": 0.1}, r"stiffness_damage_by_use is 0.1 where stiffness_damage_limit is 0"),
        ({"energy_factor": 0.0}, r"energy_factor is 0 at storey 1; it must be finite and above 0"),
        ({"counts_cycles": 0.5}, r"counts_cycles is 0.5 \(storey 1\); give 0 in all storeys or 1 in all storeys"),
        ({"counts_cycles": [0.0, 1.0]}, r"counts_cycles is 1 \(storey 2\); give 0 in all storeys"),
    ],
)
def test_bad_input(parameters, message):
    with pytest.raises(ValueError, match=message):
        building(BACKBONES["falling to a residual"], **parameters)


def test_gem_damage_is_that_of_its_toolkit():
    # Of the stiffness (gK), reloading (gD) and strength (gF), in the order of OpenSees' Pinching4, from the modeller
    # of oq-vmtk, with gE = 10 and the damage type "energy".
    theirs = {
        "stiffness": (0, 0.1, 0, 0, 0.2),
        "reloading": (0, 0.1, 0, 0, 0.2),
        "strength": (0, 0.4, 0, 0.4, 0.9),
    }
    law = wd.laws.Pinching4(yield_force=YIELD_FORCE, force_ratio_4=0.4, **BACKBONE, **wd.laws.GEM_DAMAGE)
    with pytest.warns(UserWarning, match="^with .*=0 and .*=0, Pinching4's damage starts with a jump"):
        wd.ShearBuilding(1e4, 1e6, 3.0, law=law)
    for kind, numbers in theirs.items():
        names = ("by_drift", "by_use", "drift_exponent", "use_exponent", "limit")
        assert tuple(getattr(law, f"{kind}_damage_{name}") for name in names) == numbers
    assert (law.energy_factor, law.counts_cycles) == (10, 0)


GROWING = {"strength_damage_by_use": 0.3, "strength_damage_limit": 0.3}
BACKBONE = {"ductility_2": 3, "force_ratio_2": 1.3, "ductility_3": 6, "force_ratio_3": 1.4, "ductility_4": 12}


def test_exponents_of_0_are_told():
    def building(**damage):
        return wd.ShearBuilding(
            1e4, 1e6, 3.0, law="pinching4", yield_force=1e4, force_ratio_4=0.4, **BACKBONE, **damage
        )

    with pytest.warns(
        UserWarning,
        match="^with strength_damage_use_exponent=0, .* or give strength_damage_use_exponent=1",
    ):
        building(**GROWING, strength_damage_use_exponent=0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        building(**GROWING)  # it grows
        building(strength_damage_use_exponent=0.0)  # there is none
