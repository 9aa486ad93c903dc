"""Laws whose negative side has other parameters: OpenSees' loops, mirrored storeys, and systems under a pulse."""

import functools

import numpy as np
import pytest
from law_cases import cases, loop_error, material_of, pulse_error, run_pulse
from opensees import finer, growing, material_forces, ratcheting, wandering
from storey_steps import steps

import warpdyn as wd
from warpdyn.engine.laws import LAWS

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8, 12]), 50),
    "random": wandering(10 * YIELD_DRIFT, 60, 37, seed=1),
    "partial cycles": wandering(3 * YIELD_DRIFT, 80, 23, seed=3),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 41),  # no step ends exactly at zero force
}


def corners(numbers, count):
    """Return yield force, stiffness, ductilities and force ratios of OpenSees' points (force, drift)."""
    force, drift = np.abs(numbers[::2]), np.abs(numbers[1::2])
    names = [f"{what}_{i}" for i in range(2, count + 1) for what in ("ductility", "force_ratio")]
    ratios = [ratio[i] for i in range(1, count) for ratio in (drift / drift[0], force / force[0])]
    return force[0], force[0] / drift[0], dict(zip(names, ratios, strict=True))


def negative(values):
    return {f"{name}_negative": value for name, value in values.items()}


def hysteretic(*numbers):
    """Return the stiffness and the law of the numbers of OpenSees' Hysteretic."""
    above, below, rules = numbers[:6], numbers[6:12], numbers[12:]
    force, stiffness, side = corners(above, 3)
    other_force, other_stiffness, other = corners(below, 3)
    names = ("pinching_drift", "pinching_force", "damage_by_ductility", "damage_by_energy", "unloading_exponent")
    of_negative = negative({"yield_force": other_force, "stiffness_ratio": other_stiffness / stiffness} | other)
    rules = dict(zip(names, rules, strict=True))
    return stiffness, wd.laws.Hysteretic(yield_force=force, **side, **of_negative, **rules)


def ibarra_medina_krawinkler(material, *numbers):
    """Return the stiffness and the law of the numbers of OpenSees' IMKBilin, IMKPeakOriented or IMKPinching."""
    law = {
        "IMKBilin": wd.laws.IbarraMedinaKrawinklerBilinear,
        "IMKPeakOriented": wd.laws.IbarraMedinaKrawinklerPeakOriented,
        "IMKPinching": wd.laws.IbarraMedinaKrawinklerPinching,
    }[material]
    stiffness, above, below, numbers = numbers[0], numbers[1:7], numbers[7:13], numbers[13:]
    names = ("plastic_drift_to_capping", "post_capping_drift", "ultimate_drift", "yield_force", "capping_force_ratio")
    names += ("residual_force_ratio",)
    modes = ["strength", "post_capping", "reloading", "unloading"]
    if material == "IMKBilin":
        modes.remove("reloading")
    energies, numbers = numbers[: len(modes)], numbers[len(modes) :]
    exponents, (rate, other_rate), pinching = (
        numbers[: len(modes)],
        numbers[len(modes) :][:2],
        numbers[len(modes) :][2:],
    )
    assert set(exponents) == {exponents[0]}
    values = dict(zip(names, above, strict=True)) | negative(dict(zip(names, below, strict=True)))
    values |= {f"{mode}_deterioration_drift": energy for mode, energy in zip(modes, energies, strict=True)}
    values |= {"deterioration_exponent": exponents[0], "deterioration_rate": rate}
    values |= {"deterioration_rate_negative": other_rate}
    values |= dict(zip(("pinching_force_ratio", "pinching_drift_ratio"), pinching, strict=False))
    return stiffness, law(**values)


def pinching4(*numbers):
    """Return the stiffness and the law of the numbers of OpenSees' Pinching4."""
    force, stiffness, side = corners(numbers[:8], 4)
    other_force, other_stiffness, other = corners(numbers[8:16], 4)
    assert other_stiffness == pytest.approx(stiffness, rel=1e-12)
    names = ("reloading_drift", "reloading_force", "unloading_force")
    side |= dict(zip(names, numbers[16:19], strict=True))
    other |= dict(zip(names, numbers[19:22], strict=True)) | {"yield_force": other_force}
    kinds = [
        f"{kind}_damage_{name}"
        for kind in ("stiffness", "reloading", "strength")
        for name in ("by_drift", "by_use", "drift_exponent", "use_exponent", "limit")
    ]
    damage = dict(zip(kinds, numbers[22:37], strict=True))
    damage |= {"energy_factor": numbers[37], "counts_cycles": float(numbers[38] == "cycle")}
    return stiffness, wd.laws.Pinching4(yield_force=force, **side, **negative(other), **damage)


MAKERS = {"Hysteretic": hysteretic, "Pinching4": pinching4}
for _material in ("IMKBilin", "IMKPeakOriented", "IMKPinching"):
    MAKERS[_material] = functools.partial(ibarra_medina_krawinkler, _material)
# OpenSees' Pinching4 uses an old loss of stiffness in the first step after a turn: an error of first order.
LOOPS = [name for name, case in cases("loops").items() if case["opensees"][0][0] in MAKERS]
PULSES = {name: case for name, case in cases("dynamic").items() if case["opensees"][0][0] in MAKERS}


def law_of(case):
    return MAKERS[case["opensees"][0][0]](*material_of(case))


def storey_of(stiffness, law):
    return wd.ShearBuilding(1.0, stiffness, 3.0, law=law)


def forces(building, drift):
    return wd.storey_hysteresis(building, drift)["storey_force"].values[:, 0]


@pytest.mark.fast
@pytest.mark.parametrize("name", LOOPS)
def test_forces_are_those_of_opensees_loops(name, measured):
    case = cases("loops")[name]
    law = law_of(case)
    # Where an unloading line crosses zero force in a step, OpenSees sets the force of that step to 0, and so do we.
    measured(
        f"forces of asymmetric storeys of law `{law[1].name}` along growing cycles, over the largest force",
        truth=f"OpenSees' {case['opensees'][0][0]}, 20,000 steps for each segment",
        value=loop_error(case, storey_of(*law), 20_000),
        bound=3e-5,
    )


@pytest.mark.parametrize("name", PULSES)
def test_a_system_under_a_pulse(name, measured):
    case = PULSES[name]
    stiffness, law = law_of(case)
    measured(
        f"peak and last drifts of an asymmetric `{law.name}` storey under a pulse, over the largest drift",
        truth=f"OpenSees' {case['opensees'][0][0]}, Newmark's average acceleration, step 0.25 ms",
        value=pulse_error(case, run_pulse(case, stiffness, law=law)),
        bound=2e-3,
    )


# Drifts and forces of three corners over those of yield, on each side; yield force and stiffness of the other side.
SIDES = {
    "stronger behind": ((4, 1.2, 10, 0.4), (3, 1.3, 9, 0.5), 1.5, 1.0),
    "softer behind": ((3, 1.2, 9, 0.3), (4, 1.1, 8, 1.2), 0.8, 0.6),
    "falls to zero behind": ((4, 1.2, 10, 1.3), (2, 1.1, 6, 0.0), 1.0, 1.0),
    "stiffer behind": ((3, 0.8, 8, 0.2), (2.5, 1.0, 7, 1.0), 0.7, 1.4),
}
RULES = {  # pinching of drift and force, damage by ductility and energy, unloading exponent
    "plain": (1.0, 1.0, 0.0, 0.0, 0.0),
    "pinched and damaged": (0.8, 0.2, 0.01, 0.02, 0.0),
    "softer unloading": (0.3, 0.7, 0.0, 0.03, 0.4),
}


def points(side, force, drift):
    d2, f2, d3, f3 = side
    return (np.array([1, 1, f2, d2, f3, d3]) * np.tile([force, drift], 3)).tolist()


def numbers_of(sides, rules):
    above, below, strength, stiffness = SIDES[sides]
    own = points(above, YIELD_FORCE, YIELD_DRIFT)
    other = points(below, strength * YIELD_FORCE, strength / stiffness * YIELD_DRIFT)
    return [*own, *(-value for value in other), *RULES[rules]]


@pytest.mark.fast
@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("rules", RULES)
@pytest.mark.parametrize("sides", SIDES)
def test_hysteretic_along_protocols(sides, rules, protocol):
    numbers, drift = numbers_of(sides, rules), PROTOCOLS[protocol]
    ours, theirs = forces(storey_of(*hysteretic(*numbers)), drift), material_forces("Hysteretic", numbers, drift)
    assert np.ptp(theirs) > 1.2 * YIELD_FORCE
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * YIELD_FORCE)


@pytest.mark.fast
@pytest.mark.parametrize("sides", SIDES)
def test_a_mirrored_hysteretic_storey_has_mirrored_forces(sides):
    numbers, drift = numbers_of(sides, "pinched and damaged"), PROTOCOLS["random"]
    mirrored = [-value for value in (*numbers[6:12], *numbers[:6])] + numbers[12:]
    ours, mirror = (
        forces(storey_of(*hysteretic(*each)), path) for each, path in ((numbers, drift), (mirrored, -drift))
    )
    np.testing.assert_allclose(ours, -mirror, rtol=0, atol=1e-9 * YIELD_FORCE)


@pytest.mark.fast
@pytest.mark.parametrize("rules", RULES)
def test_hysteretic_energy_trials_and_tangents(rules):
    drift = wandering(10 * YIELD_DRIFT, 30, 400, seed=2)
    for sides in SIDES:
        stiffness, law = hysteretic(*numbers_of(sides, rules))
        building = storey_of(stiffness, law)
        dissipated = wd.storey_hysteresis(building, drift)["dissipated_energy"].values[:, 0]
        # The trapezoidal rule cuts corners of the size of a step.
        assert (np.maximum.accumulate(dissipated) - dissipated).max() < 2e-3 * YIELD_FORCE * YIELD_DRIFT
        double = steps(building, PROTOCOLS["partial cycles"])
        np.testing.assert_allclose(double.trial_force, double.force, rtol=0, atol=1e-12 * YIELD_FORCE)
        assert (np.abs(double.tangent - double.chord) < 1e-5 * STIFFNESS).mean() > 0.98


@pytest.mark.fast
def test_without_parameters_of_the_negative_side_a_storey_is_symmetric():
    values = {"yield_force": 1e5, "ductility_2": 4, "force_ratio_2": 1.2, "ductility_3": 10, "force_ratio_3": 0.6}
    plain = wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="hysteretic", **values)
    assert not any(name.endswith("_negative") for name in plain.parameters)
    assert LAWS["hysteretic"].spring(plain.parameters) == "hysteretic"
    same = wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="hysteretic", **values, yield_force_negative=1e5)
    assert LAWS["hysteretic"].spring(same.parameters) == "hysteretic_asymmetric"
    for drift in PROTOCOLS.values():
        np.testing.assert_allclose(forces(same, drift), forces(plain, drift), rtol=0, atol=1e-9 * 1e5)
    # Scatter of the positive side carries over to the negative side.
    scaled = wd.ShearBuilding(
        1.0, STIFFNESS, 3.0, law="hysteretic", **values | {"yield_force": 2e5, "force_ratio_2_negative": 1.2}
    )
    np.testing.assert_allclose(forces(scaled, 2 * drift), 2 * forces(plain, drift), rtol=0, atol=1e-9 * 1e5)


@pytest.mark.fast
def test_bad_input_of_the_negative_side_is_named():
    values = {"yield_force": 1e5, "ductility_2": 4, "force_ratio_2": 1.2, "ductility_3": 10, "force_ratio_3": 0.6}
    with pytest.raises(ValueError, match=r"ductility_2_negative is 0\.5 .*; it must be above 1, that of yield"):
        wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="hysteretic", **values, ductility_2_negative=0.5)
    with pytest.raises(ValueError, match="did you mean 'yield_force_negative'"):
        wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="hysteretic", **values, yield_force_negativ=1.0)
    laws = [wd.laws.Hysteretic(**values), wd.laws.Hysteretic(**values, yield_force_negative=2e5)]
    with pytest.raises(ValueError, match="yield_force_negative is missing at storey 1, whose law is 'hysteretic'"):
        wd.ShearBuilding([1.0, 1.0], STIFFNESS, 3.0, law=laws)


IMK = {  # numbers of OpenSees' materials, over yield drift and yield force: sides, energies, exponents, rates, pinching
    "IMKBilin": [4, 15, 40, 1, 1.15, 0.2, 3, 20, 40, 0.8, 1.1, 0.3, *[150] * 3, *[1] * 3, 1, 0.9],
    "IMKPeakOriented": [4, 15, 40, 1, 1.15, 0.2, 3, 20, 40, 1.2, 1.1, 0.3, *[150] * 4, *[1] * 4, 1, 0.9],
    "IMKPinching": [4, 15, 40, 1, 1.15, 0.2, 3, 20, 40, 1.2, 1.1, 0.3, *[150] * 4, *[1] * 4, 1, 0.9, 0.3, 0.5],
}


def imk_numbers(material):
    modes = 3 if material == "IMKBilin" else 4
    units = [YIELD_DRIFT, YIELD_DRIFT, YIELD_DRIFT, YIELD_FORCE, 1, 1] * 2 + [YIELD_DRIFT] * modes
    values = np.array(IMK[material], float)
    values[: len(units)] *= units
    return [STIFFNESS, *values.tolist()]


@pytest.mark.fast
@pytest.mark.parametrize("protocol", ["growing", "ratcheting"])
@pytest.mark.parametrize("material", IMK)
def test_ibarra_medina_krawinkler_along_protocols(material, protocol):
    numbers, drift = imk_numbers(material), PROTOCOLS[protocol]
    ours = forces(storey_of(*MAKERS[material](*numbers)), drift)
    theirs = material_forces(material, numbers, drift)
    assert np.ptp(theirs) > 1.5 * YIELD_FORCE
    # OpenSees' IMKBilin works with single precision.
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6 * YIELD_FORCE)


@pytest.mark.fast
@pytest.mark.parametrize("material", IMK)
def test_a_mirrored_ibarra_medina_krawinkler_storey_has_mirrored_forces(material):
    numbers, drift = imk_numbers(material), PROTOCOLS["random"]
    stiffness, *sides = numbers[:13]
    modes = 3 if material == "IMKBilin" else 4
    energies, exponents, rest = (
        numbers[13 : 13 + modes],
        numbers[13 + modes : 13 + 2 * modes],
        numbers[13 + 2 * modes :],
    )
    # Lambda is over the positive yield force.
    energies = [value * numbers[4] / numbers[10] for value in energies]
    mirrored = [stiffness, *sides[6:], *sides[:6], *energies, *exponents, rest[1], rest[0], *rest[2:]]
    ours, mirror = (
        forces(storey_of(*MAKERS[material](*each)), path) for each, path in ((numbers, drift), (mirrored, -drift))
    )
    np.testing.assert_allclose(ours, -mirror, rtol=0, atol=1e-9 * YIELD_FORCE)


@pytest.mark.fast
@pytest.mark.parametrize("material", IMK)
def test_a_rate_above_1_leaves_no_negative_strength(material):
    # A rate is the same on both sides unless it is given; each excursion takes a third of the capacity.
    stiffness, law = MAKERS[material](*imk_numbers(material))
    values = law.values() | {"strength_deterioration_drift": 15 * YIELD_DRIFT, "deterioration_rate": 2.0}
    values.pop("deterioration_rate_negative")
    drift = growing(YIELD_DRIFT * np.array([4, 6, 6, 6]), 100)
    found = wd.storey_hysteresis(storey_of(stiffness, type(law)(**values)), drift)
    force = found["storey_force"].values[:, 0]
    assert np.all(force[np.abs(drift) > 5.9 * YIELD_DRIFT] * drift[np.abs(drift) > 5.9 * YIELD_DRIFT] >= 0)
    work = np.cumsum((force + np.append(0, force[:-1])) / 2 * np.diff(drift, prepend=0.0))
    assert work.min() >= 0


PINCHING4 = {  # drifts and forces of four corners over those of yield, reloading drift and force, unloading force
    "weaker behind": ([4, 1.2, 7, 1.3, 10, 0.4, 0.5, 0.25, 0.05], [3, 1.1, 6, 0.9, 11, 0.3, 0.4, 0.3, -0.05], 0.7),
    "stronger behind": ([3, 1.05, 6, 1.1, 10, 1.2, 0.3, 0.3, 0.0], [4, 1.2, 7, 1.3, 10, 0.4, 0.5, 0.25, 0.05], 1.3),
}
NO_DAMAGE = [0.0, 0.0, 1.0, 1.0, 0.0] * 3 + [10.0, "energy"]
DAMAGE = {
    "none": NO_DAMAGE,
    "energy": [0.2, 0.1, 0.8, 0.5, 0.6, 0.1, 0.1, 0.7, 0.6, 0.3, 0.1, 0.15, 1.0, 0.4, 0.4, 4.0, "energy"],
    "cycles": [0.2, 0.01, 0.8, 0.5, 0.6, 0.1, 0.01, 0.7, 0.6, 0.3, 0.1, 0.015, 1.0, 0.4, 0.4, 10.0, "cycle"],
}


def pinching4_numbers(sides, damage):
    above, below, strength = PINCHING4[sides]
    numbers = []
    for side, force in ((above, YIELD_FORCE), (below, -strength * YIELD_FORCE)):
        points = np.array([1, 1, *np.ravel([(f, d) for d, f in zip(side[:6:2], side[1:6:2], strict=True)])])
        numbers += (points * np.tile([force, force / STIFFNESS], 4)).tolist()
    return [*numbers, *above[6:], *below[6:], *DAMAGE[damage]]


@pytest.mark.fast
@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("damage", DAMAGE)
@pytest.mark.parametrize("sides", PINCHING4)
def test_pinching4_along_protocols(sides, damage, protocol):
    # With damage, OpenSees' error is of first order in the step: a turn takes one step there to take effect.
    drift = PROTOCOLS[protocol] if damage == "none" else finer(PROTOCOLS[protocol], 20)
    numbers = pinching4_numbers(sides, damage)
    ours, theirs = forces(storey_of(*pinching4(*numbers)), drift), material_forces("Pinching4", numbers, drift)
    assert np.ptp(theirs) > 1.2 * YIELD_FORCE
    # Paths of OpenSees may be stiffer than the first part of the backbone; ours are not.
    way = np.sign(np.diff(drift, prepend=0.0))
    same = way * np.concatenate([[0], way[:-1]]) >= 0 if damage != "none" else np.full(drift.size, True)
    rise = np.diff(theirs, prepend=0.0) * way
    steep = np.flatnonzero(rise > STIFFNESS * np.abs(np.diff(drift, prepend=0.0)) + 1e-6 * YIELD_FORCE)
    if steep.size:
        same[steep[0] :] = False
    assert same.sum() > 40
    np.testing.assert_allclose(
        ours[same], theirs[same], rtol=0, atol=(1e-7 if damage == "none" else 1e-5) * YIELD_FORCE
    )


@pytest.mark.fast
@pytest.mark.parametrize("damage", DAMAGE)
@pytest.mark.parametrize("sides", PINCHING4)
def test_a_mirrored_pinching4_storey_has_mirrored_forces(sides, damage):
    numbers, drift = pinching4_numbers(sides, damage), PROTOCOLS["random"]
    mirrored = [-value for value in (*numbers[8:16], *numbers[:8])]
    mirrored += [*numbers[19:22], *numbers[16:19], *numbers[22:]]
    ours, mirror = (forces(storey_of(*pinching4(*each)), path) for each, path in ((numbers, drift), (mirrored, -drift)))
    np.testing.assert_allclose(ours, -mirror, rtol=0, atol=1e-9 * YIELD_FORCE)


IMK_VALUES = {"plastic_drift_to_capping": 0.04, "post_capping_drift": 0.2, "capping_force_ratio": 1.1}
IMK_VALUES |= {"strength_deterioration_drift": 1.0, "residual_force_ratio": 0.2}
FOUR = {"ductility_2": 3, "force_ratio_2": 1.2, "ductility_3": 6, "force_ratio_3": 1.3, "ductility_4": 12}
EVERY_LAW = {
    "trilinear": {"ductility_2": 3, "force_ratio_2": 1.5, "hardening_ratio": 0.02},
    "hysteretic": {"ductility_2": 4, "force_ratio_2": 1.2, "ductility_3": 10, "force_ratio_3": 0.6},
    "pinching4": FOUR | {"force_ratio_4": 0.4, "strength_damage_limit": 0.3, "strength_damage_by_use": 0.3},
    "ibarra_medina_krawinkler_bilinear": IMK_VALUES,
    "ibarra_medina_krawinkler_peak_oriented": IMK_VALUES,
    "ibarra_medina_krawinkler_pinching": IMK_VALUES | {"pinching_force_ratio": 0.3, "pinching_drift_ratio": 0.5},
}


@pytest.mark.parametrize("law", EVERY_LAW)
def test_a_run_with_two_equal_sides_is_that_of_a_symmetric_building(law):
    frame = {"mass": [2e5] * 2, "stiffness": [2e8, 1.6e8], "height": 3.0, "damping": "rayleigh", "damping_ratio": 0.05}
    time = 0.02 * np.arange(300)
    motion = wd.GroundMotion(6 * np.sin(12 * time) * np.exp(-0.2 * time), 0.02)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
    strength = {"yield_force": [1.2e6, 0.9e6]}
    sides = ({}, {"yield_force_negative": strength["yield_force"]})
    symmetric, equal = (
        wd.simulate(
            wd.Scene(wd.ShearBuilding(law=law, **frame, **EVERY_LAW[law], **strength, **side), motion, scatter),
            structures=3, seed=1, step=0.002, method="rk4", dtype="float64", device="cpu",
        )
        for side in sides
    )  # fmt: skip
    assert symmetric["peak_storey_drift_ratio"].max() > 3 * 1.2e6 / 2e8 / 3.0
    for name in ("peak_storey_drift_ratio", "hysteretic_energy"):
        np.testing.assert_allclose(equal[name], symmetric[name], rtol=1e-7, atol=1e-9)
