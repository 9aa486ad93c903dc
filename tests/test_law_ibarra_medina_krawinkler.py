"""Storeys after Ibarra, Medina and Krawinkler against OpenSees' IMK materials, backbones by hand, and themselves."""

import numpy as np
import pytest
from law_steps import law_steps
from opensees import finer, growing, material_forces, ratcheting, wandering

import warpdyn as wd
from warpdyn.engine.laws import LAWS

pytestmark = pytest.mark.fast

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
STEPS = ("trial", "committed", "tangent", "behind", "ahead")
MATERIALS = {"bilinear": "IMKBilin", "peak_oriented": "IMKPeakOriented", "pinching": "IMKPinching"}
# No turn lies where a rule changes (yield, no force, capping or residual point): rounding would choose the rule there.
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1.3, 2, 2, 4, 6, 8.3, 8.3]), 50),
    "growing far": growing(YIELD_DRIFT * np.array([1.1, 3, 6, 10, 14.2, 14.2, 18.3, 22]), 51),
    "random": wandering(10 * YIELD_DRIFT, 60, 37, seed=1),
    "partial": ratcheting(12 * YIELD_DRIFT, 30, 1.3 * YIELD_DRIFT, 31),
    "ratcheting": ratcheting(20 * YIELD_DRIFT, 16, 4.01 * YIELD_DRIFT, 40),
}
BACKBONE = {
    "yield_force": YIELD_FORCE,
    "plastic_drift_to_capping": 5 * YIELD_DRIFT,
    "post_capping_drift": 20 * YIELD_DRIFT,
    "capping_force_ratio": 1.15,
    "residual_force_ratio": 0.2,
}


def lasting(strength, post_capping, unloading, reloading):
    """Return the parameters of these cumulative drifts, in yield drifts."""
    names = ("strength", "post_capping", "unloading", "reloading")
    given = (strength, post_capping, unloading, reloading)
    return {f"{name}_deterioration_drift": n * YIELD_DRIFT for name, n in zip(names, given, strict=True)}


STOREYS = {
    "lasting": {},
    "deteriorating": {**lasting(400, 300, 600, 500), "deterioration_rate": 0.7},
    "exhausted early": lasting(80, 80, 120, 100),
    "by a power": {**lasting(500, 400, 600, 500), "deterioration_exponent": 1.3},
    "to no strength": {"residual_force_ratio": 0.0, "post_capping_drift": 12 * YIELD_DRIFT} | lasting(300, 0, 0, 0),
    "to the ultimate drift": {"ultimate_drift": 9 * YIELD_DRIFT} | lasting(0, 0, 300, 0),
    "without hardening": {"capping_force_ratio": 1.0, "residual_force_ratio": 0.43},
    "ductile": {
        "plastic_drift_to_capping": 30 * YIELD_DRIFT,
        "capping_force_ratio": 2.0,
        "residual_force_ratio": 0.3,
        **lasting(300, 0, 500, 0),
    },
}
PINCHING = {
    "strongly": {"pinching_force_ratio": 0.25, "pinching_drift_ratio": 0.3},
    "weakly": {"pinching_force_ratio": 0.8, "pinching_drift_ratio": 0.7},
}
KINDS = {"bilinear": ("bilinear", {}), "peak_oriented": ("peak_oriented", {})}
KINDS |= {f"pinching {how}": ("pinching", values) for how, values in PINCHING.items()}
every_kind = pytest.mark.parametrize("kind", KINDS)


def parameters_of(kind, **changes):
    values = {**BACKBONE, **KINDS[kind][1], **changes}
    return {name: value for name, value in values.items() if name in LAWS[law_of(kind)].parameters}


def law_of(kind):
    return f"ibarra_medina_krawinkler_{KINDS[kind][0]}"


def building(kind, **changes):
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law_of(kind), **parameters_of(kind, **changes))


def hysteresis(kind, drift, **changes):
    run = wd.storey_hysteresis(building(kind, **changes), drift)
    return run.storey_force.values[:, 0], run.dissipated_energy.values[:, 0]


def opensees_forces(kind, drift, **changes):
    """Return what OpenSees' material gives, with drifts that nothing comes to where we say none."""
    p = {**BACKBONE, **KINDS[kind][1], **changes}
    side = [p["plastic_drift_to_capping"], p["post_capping_drift"], p.get("ultimate_drift") or 1e9]
    side += [p["yield_force"], p["capping_force_ratio"], p["residual_force_ratio"]]
    modes = ["strength", "post_capping", "reloading", "unloading"]
    if kind == "bilinear":
        modes.remove("reloading")
    drifts = [p.get(f"{mode}_deterioration_drift") or 1e12 for mode in modes]
    exponents = [p.get("deterioration_exponent", 1.0)] * len(modes)
    rates = [p.get("deterioration_rate", 1.0)] * 2
    pinching = list(KINDS[kind][1].values())
    material = MATERIALS[KINDS[kind][0]]
    return material_forces(material, [STIFFNESS, *side, *side, *drifts, *exponents, *rates, *pinching], drift)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("storey", STOREYS)
@every_kind
def test_forces_against_opensees(kind, storey, protocol):
    drift = PROTOCOLS[protocol]
    ours, _ = hysteresis(kind, drift, **STOREYS[storey])
    theirs = opensees_forces(kind, drift, **STOREYS[storey])
    assert np.ptp(theirs) > 1.1 * YIELD_FORCE
    # The same rules, rounded otherwise: 4e-12 was measured, of forces that go along steps of up to 0.8 yield drifts.
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-10 * YIELD_FORCE)


@every_kind
def test_backbone_by_hand(kind):
    drift = np.linspace(0, 40, 4001)[1:] * YIELD_DRIFT
    for side in (1, -1):
        force, _ = hysteresis(kind, side * drift, ultimate_drift=35.005 * YIELD_DRIFT)
        # 1.15 / 20 a yield drift down from 1.15 at 6 to 0.2.
        expected = np.interp(drift / YIELD_DRIFT, [0, 1, 6, 6 + 0.95 * 20 / 1.15, 35.005], [0, 1, 1.15, 0.2, 0.2])
        expected[drift > 35.005 * YIELD_DRIFT] = 0
        np.testing.assert_allclose(side * force / YIELD_FORCE, expected, rtol=0, atol=1e-12)
    beyond = np.concatenate([drift, np.linspace(40, -10, 5000) * YIELD_DRIFT])
    force, _ = hysteresis(kind, beyond, ultimate_drift=35.005 * YIELD_DRIFT)
    # Bilinear storeys keep the residual force the other way, the others nothing.
    assert force[-1] == pytest.approx(-0.2 * YIELD_FORCE if kind == "bilinear" else 0, abs=1e-9)


@every_kind
def test_defaults_are_no_residual_force_no_ultimate_drift_and_no_deterioration(kind):
    needed = ("yield_force", "plastic_drift_to_capping", "post_capping_drift", "capping_force_ratio")
    values = {name: BACKBONE[name] for name in needed} | KINDS[kind][1]
    storey = wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law_of(kind), **values)
    for drift in (PROTOCOLS["growing"], PROTOCOLS["ratcheting"]):
        force = wd.storey_hysteresis(storey, drift).storey_force.values[:, 0]
        theirs = opensees_forces(kind, drift, residual_force_ratio=0.0)
        np.testing.assert_allclose(force, theirs, rtol=0, atol=1e-10 * YIELD_FORCE)
    residual = wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law_of(kind), **values, residual_force_ratio=0.2)
    assert wd.storey_hysteresis(residual, [0.0, 1.4]).storey_force[-1, 0] == pytest.approx(0.2 * YIELD_FORCE)


def cycle(*turns):
    return finer(YIELD_DRIFT * np.array(turns), 200)


@every_kind
def test_exhausted_storeys_lose_their_force(kind):
    # The first excursion takes about 14 yield drifts' energy, beyond the 10 there are; the residual force is not met.
    drift, change = cycle(16, -16), {"post_capping_drift": 60 * YIELD_DRIFT, **lasting(10, 0, 0, 0)}
    ours, _ = hysteresis(kind, drift, **change)
    theirs = opensees_forces(kind, drift, **change)
    away = np.flatnonzero(np.abs(ours - theirs) > 1e-9 * YIELD_FORCE)
    assert np.all(ours[away[0] :] == 0)
    assert np.abs(ours[away[0] - 1]) < 0.2 * YIELD_FORCE  # where the force changes its sign
    assert theirs[-1] < -0.5 * YIELD_FORCE
    lasts, _ = hysteresis(kind, drift, post_capping_drift=60 * YIELD_DRIFT)
    np.testing.assert_allclose(theirs, lasts, rtol=0, atol=1e-9 * YIELD_FORCE)  # theirs does not deteriorate at all


def chord_slopes(drift, force):
    return np.diff(force, prepend=0) / np.diff(drift, prepend=0) / STIFFNESS


def test_no_storey_reloads_more_steeply_than_at_first():
    # A last peak at 0.2, hardly beyond the pinching point.
    drift = cycle(1.2, -0.5, -1.6, 0.2, -0.5, 0.4, -2)
    ours, _ = hysteresis("pinching strongly", drift)
    theirs = opensees_forces("pinching strongly", drift)
    assert chord_slopes(drift, theirs).max() > 1.1
    assert chord_slopes(drift, ours).max() <= 1 + 1e-9
    # They come together again.
    assert np.abs(ours - theirs).max() < 0.02 * YIELD_FORCE
    assert np.abs(ours - theirs)[-1] < 0.005 * YIELD_FORCE


@pytest.mark.parametrize("kind", ["peak_oriented", "pinching weakly"])
def test_residual_force_bounds_backbones_before_capping(kind):
    change = {"residual_force_ratio": 0.5, "plastic_drift_to_capping": 20 * YIELD_DRIFT, **lasting(32, 0, 0, 0)}
    change["capping_force_ratio"] = 1.05
    drift = cycle(4, -4, 4, -4, 4, -4, 4.4, -4.4, 5, -5, 6, -6)
    ours, _ = hysteresis(kind, drift, **change)
    theirs = opensees_forces(kind, drift, **change)
    assert np.abs(np.diff(theirs)).max() > 0.1 * YIELD_FORCE
    steepest = np.abs(np.diff(drift)).max() * STIFFNESS
    assert np.abs(np.diff(ours)).max() <= steepest * (1 + 1e-9)
    first = np.argmax(np.abs(ours - theirs) > 1e-9 * YIELD_FORCE)
    assert np.abs(ours[first]) == pytest.approx(0.5 * YIELD_FORCE)


def test_energy_given_back_deteriorates_nothing():
    # It turns as soon as the force, 1.06 at 3, has changed its sign.
    drift, change = finer(YIELD_DRIFT * np.array([3, 1.9, 4]), 20), lasting(0, 0, 100, 0)
    theirs = opensees_forces("peak_oriented", drift, **change, deterioration_exponent=1.5)
    ours, _ = hysteresis("peak_oriented", drift, **change, deterioration_exponent=1.5)
    broken = np.isnan(theirs)
    assert broken.any()
    np.testing.assert_allclose(ours[~broken], theirs[~broken], rtol=0, atol=1e-9 * YIELD_FORCE)
    assert np.abs(ours).max() < 1.15 * YIELD_FORCE


@pytest.mark.parametrize("storey", ["deteriorating", "by a power"])
@every_kind
def test_trial_forces_tangents_and_single_precision(kind, storey):
    drift, change = PROTOCOLS["random"], STOREYS[storey]
    found = law_steps(building(kind, **change), drift)
    trial, committed, tangent, left, right = (found[name] for name in STEPS)
    assert np.array_equal(trial, committed)
    np.testing.assert_allclose(trial, hysteresis(kind, drift, **change)[0], rtol=0, atol=1e-12 * YIELD_FORCE)
    smooth = np.abs(left - right) < 1e-6 * STIFFNESS  # all but corners
    assert smooth.mean() > 0.99
    np.testing.assert_allclose(tangent[smooth], left[smooth], rtol=0, atol=1e-6 * STIFFNESS)
    assert tangent.max() <= STIFFNESS * (1 + 1e-12)
    single = law_steps(building(kind, **change), drift, "float32")
    # Sums of energy over 2,000 steps, and drifts of ten times yield, rounded to 6e-8 each.
    for name in ("trial", "committed"):
        np.testing.assert_allclose(single[name], committed, rtol=0, atol=1e-4 * YIELD_FORCE)


@every_kind
def test_row_without_powers_is_that_of_exponent_one(kind):
    drift, change = PROTOCOLS["random"], STOREYS["deteriorating"]
    storey = building(kind, **change)
    plain, general = (law_steps(storey, drift, row=row)["committed"] for row in (None, law_of(kind) + "_power"))
    np.testing.assert_allclose(general, plain, rtol=0, atol=1e-12 * YIELD_FORCE)


@pytest.mark.parametrize("storey", ["lasting", "deteriorating", "to no strength", "to the ultimate drift"])
@every_kind
def test_energy_never_falls_and_closes(kind, storey):
    yield_energy = YIELD_FORCE * YIELD_DRIFT
    drift = finer(PROTOCOLS["random"], 20)
    force, dissipated = hysteresis(kind, drift, **STOREYS[storey])
    # Corners within a step of a hundredth of a yield drift. OpenSees' bilinear storeys unload half as stiffly once they
    # have come to the residual force, which gives back as much again as they then held: 0.2^2 / 2.
    allowed = 1e-4 + (0.02 if kind == "bilinear" else 0)
    assert (np.maximum.accumulate(dissipated) - dissipated).max() < allowed * yield_energy
    work = np.cumsum((force + np.append(0, force[:-1])) / 2 * np.diff(drift, prepend=0))
    free = np.abs(force) < 1e-3 * YIELD_FORCE
    assert free.any()
    np.testing.assert_allclose(dissipated[free], work[free], rtol=0, atol=1e-5 * yield_energy)
    assert dissipated[-1] > 8 * yield_energy


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"post_capping_drift": -0.1}, "post_capping_drift is -0.1 at storey 1; it must be finite and above 0"),
        ({"plastic_drift_to_capping": 0}, "plastic_drift_to_capping is 0 at storey 1"),
        ({"capping_force_ratio": 0.9}, "capping_force_ratio is 0.9 at storey 1; it must be finite and at least 1"),
        (
            {"capping_force_ratio": 6.0},
            r"capping_force_ratio is 6 \(storey 1\); it must be below 6, because the hardening",
        ),
        ({"residual_force_ratio": 1.2}, "residual_force_ratio is 1.2 at storey 1; it must be finite and at least 0"),
        (
            {"ultimate_drift": 0.004},
            r"ultimate_drift is 0.004 \(storey 1\); it must be 0 .*, or above .* 0.005 m",
        ),
        ({"pinching_force_ratio": 1.1}, "pinching_force_ratio is 1.1 at storey 1; .* at most 1"),
        ({"pinching_drift_ratio": -0.1}, "pinching_drift_ratio is -0.1 at storey 1"),
        ({"unloading_deterioration_drift": -1.0}, "unloading_deterioration_drift is -1 at storey 1"),
        (
            {"deterioration_exponent": 0.9},
            "deterioration_exponent is 0.9 at storey 1; it must be finite and at least 1",
        ),
        ({"deterioration_rate": 2.5}, "deterioration_rate is 2.5 at storey 1; .* above 0 and at most 2"),
    ],
)
def test_bad_parameters(changes, message):
    with pytest.raises(ValueError, match=message):
        hysteresis("pinching strongly", [0.0], **changes)
