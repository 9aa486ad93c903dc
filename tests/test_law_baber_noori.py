"""Baber-Noori storeys: OpenSees' BoucWen and BWBN force by force, energy, precision, tangents and bad input."""

from itertools import product

import numpy as np
import pytest
from method_sources import thorough_unless
from opensees import finer, growing, material_forces, ratcheting, wandering
from storey_steps import steps

import warpdyn as wd
from warpdyn.engine.laws import LAWS

pytestmark = pytest.mark.fast

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
YIELD_ENERGY = YIELD_FORCE * YIELD_DRIFT
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8]), 50),
    "random": wandering(8 * YIELD_DRIFT, 40, 37, seed=1),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 40),
}
SHAPES = [(0.05, 0.5, 0.5, 1.0), (0.1, 0.7, 0.3, 2.0), (0.02, 0.5, -0.2, 1.5)]  # hardening, beta, gamma, exponent
DEGRADATION = {
    "none": {},
    "A": {"growth_loss": 0.005},
    "nu": {"strength_loss": 0.02},
    "eta": {"stiffness_loss": 0.05},
    "all": {"growth_loss": 0.003, "strength_loss": 0.02, "stiffness_loss": 0.05},
}
PINCHING_NAMES = (
    "pinching_level",
    "total_slip",
    "pinching_rate",
    "pinching_spread",
    "pinching_spread_rate",
    "pinching_coupling",
)
PINCHING = {
    "sharp": (0.1, 0.9, 0.1, 0.1, 0.005, 0.5),
    "late": (0.25, 0.6, 0.02, 0.2, 0.01, 0.3),
    "nearly all slips": (0.0, 0.99, 0.5, 0.3, 0.0, 0.2),
}
RULES = DEGRADATION | {name: dict(zip(PINCHING_NAMES, values, strict=True)) for name, values in PINCHING.items()}


def building(shape, rules, **parameters):
    given = dict(zip(("hardening_ratio", "beta", "gamma", "exponent"), shape, strict=True)) | rules
    given |= {"yield_force": YIELD_FORCE} | parameters
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="baber_noori", **given)


def theirs(shape, rules, drift):
    hardening, beta, gamma, exponent = shape
    scale = YIELD_DRIFT**-exponent
    numbers = [hardening, STIFFNESS, exponent, gamma * scale, beta * scale, 1.0]
    if "total_slip" in rules:
        units = (1.0, 1.0, 1 / YIELD_ENERGY, YIELD_DRIFT, 1 / YIELD_FORCE, 1.0)
        numbers += [rules[name] * unit for name, unit in zip(PINCHING_NAMES, units, strict=True)]
        material = "BWBN"
    else:
        numbers += [rules.get(name, 0.0) / YIELD_ENERGY for name in ("growth_loss", "strength_loss", "stiffness_loss")]
        material = "BoucWen"
    return material_forces(material, [*numbers, 1e-12, 50], drift)


@pytest.mark.parametrize(
    ("rules", "protocol"),
    [
        thorough_unless(i % len(PROTOCOLS) == j, rules, protocol)
        for (i, rules), (j, protocol) in product(enumerate(RULES), enumerate(PROTOCOLS))
    ],
)
def test_opensees(rules, protocol):
    drift = PROTOCOLS[protocol]
    for shape in SHAPES:
        ours = wd.storey_hysteresis(building(shape, RULES[rules]), finer(drift, 8)).storey_force.values[7::8, 0]
        # OpenSees goes along a step by Euler's backward rule, of first order: twice its forces at a step less those at
        # twice the step are of second order.
        expected, coarse = (theirs(shape, RULES[rules], finer(drift, n))[n - 1 :: n] for n in (100, 50))
        assert np.ptp(expected) > 1.8 * YIELD_FORCE
        np.testing.assert_allclose(ours, 2 * expected - coarse, rtol=0, atol=5e-4 * YIELD_FORCE)


def test_order_along_a_step():
    drift = finer(PROTOCOLS["growing"], 2)
    ours = [
        wd.storey_hysteresis(building(SHAPES[1], RULES["sharp"]), finer(drift, n)).storey_force.values[n - 1 :: n, 0]
        for n in (1, 2, 16)
    ]
    coarse, fine = (np.abs(force - ours[2]).max() for force in ours[:2])
    assert 8 < coarse / fine < 40  # RK4: 16, but that it feels the kink of |z|
    assert fine < 1e-4 * YIELD_FORCE


def test_none_of_it_is_bouc_wen():
    drift = PROTOCOLS["random"]
    for hardening, beta, gamma, exponent in SHAPES:
        given = {"yield_force": YIELD_FORCE, "hardening_ratio": hardening, "beta": beta, "gamma": gamma}
        plain = wd.ShearBuilding(1.0, STIFFNESS, 3.0, law="bouc_wen", exponent=exponent, **given)
        ours = wd.storey_hysteresis(building((hardening, beta, gamma, exponent), {}), drift)
        expected = wd.storey_hysteresis(plain, drift)
        np.testing.assert_allclose(ours.storey_force, expected.storey_force, rtol=0, atol=1e-9 * YIELD_FORCE)
        np.testing.assert_allclose(ours.dissipated_energy, expected.dissipated_energy, atol=1e-9 * YIELD_ENERGY)


def test_growth_goes_no_lower_than_zero():
    # Pushed one way with beta + gamma = n = 1: z' = A - z and A' = -z / 2 over the yield drift, a damped oscillation.
    u = np.linspace(0, 20, 4001)[1:]
    shape, rules = (0.0, 0.5, 0.5, 1.0), {"growth_loss": 0.5}
    ours = wd.storey_hysteresis(building(shape, rules), u * YIELD_DRIFT).storey_force.values[:, 0] / YIELD_FORCE
    oscillation = 2 * np.exp(-u / 2) * np.sin(u / 2)
    growth = np.exp(-u / 2) * (np.cos(u / 2) + np.sin(u / 2))
    lost = np.argmax(growth < 0)
    np.testing.assert_allclose(ours[:lost], oscillation[:lost], rtol=0, atol=1e-4)
    # From there nothing drives z, which dies away.
    np.testing.assert_allclose(ours[lost:], ours[lost] * np.exp(u[lost] - u[lost:]), rtol=0, atol=1e-4)
    # OpenSees' z follows the oscillation through 0, and turns against the drift that pushes it.
    expected = theirs(shape, rules, u * YIELD_DRIFT) / YIELD_FORCE
    before = u < 2 * np.pi
    np.testing.assert_allclose(expected[before], oscillation[before], rtol=0, atol=3e-3)  # by Euler's backward rule
    assert expected.min() < -0.05


def test_pinching_is_centred_on_the_bound_that_degrades():
    # One step of the rate by hand, of Foliente's h with the zu that has A and nu in it.
    rules = DEGRADATION["all"] | {"total_slip": 0.9, "pinching_rate": 0.1, "pinching_level": 0.3}
    hardening, beta, gamma, n = shape = SHAPES[1]
    z, e, path = 0.0, 0.0, np.linspace(0, 6, 60001)[1:]
    for u, last in zip(path, np.concatenate([[0], path[:-1]]), strict=True):

        def rate(z, e):
            a, nu, eta = 1 - 0.003 * e, 1 + 0.02 * e, 1 + 0.05 * e
            zeta1 = 0.9 * (1 - np.exp(-0.1 * e))
            zeta2 = 0.1 * (0.5 + zeta1)
            zu = (a / (nu * (beta + gamma))) ** (1 / n)
            h = 1 - zeta1 * np.exp(-(((z - 0.3 * zu) / zeta2) ** 2))
            return h * (a - nu * abs(z) ** n * (gamma + beta * np.sign(z))) / eta, (1 - hardening) * z

        dz, de = rate(z, e)
        middle = rate(z + dz * (u - last) / 2, e + de * (u - last) / 2)
        z, e = z + middle[0] * (u - last), e + middle[1] * (u - last)
    expected = hardening * STIFFNESS * 6 * YIELD_DRIFT + (1 - hardening) * YIELD_FORCE * z
    force = wd.storey_hysteresis(building(shape, rules), path[599::600] * YIELD_DRIFT).storey_force.values[-1, 0]
    assert force == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("rules", RULES)
def test_energy_closes_and_never_falls(rules):
    drift = finer(PROTOCOLS["random"], 20)
    for shape in SHAPES:
        result = wd.storey_hysteresis(building(shape, RULES[rules]), drift)
        force, dissipated = result.storey_force.values[:, 0], result.dissipated_energy.values[:, 0]
        work = np.cumsum((force[1:] + force[:-1]) / 2 * np.diff(drift)) + force[0] * drift[0] / 2
        # Where the hysteretic force is 0 only the hardening spring stores energy.
        hysteretic = force - shape[0] * STIFFNESS * drift
        crossing = np.flatnonzero(hysteretic[:-2] * hysteretic[1:-1] < 0) + 1
        spring = shape[0] * STIFFNESS * drift**2 / 2
        np.testing.assert_allclose(
            dissipated[crossing], work[crossing - 1] - spring[crossing], rtol=0, atol=2e-2 * YIELD_ENERGY
        )
        # What unloads against pinching is summed up by 8 points: 1e-3 of Fy dy where nearly all slips.
        fall = np.maximum.accumulate(dissipated) - dissipated
        assert fall.max() < 2e-3 * YIELD_ENERGY
        assert dissipated[-1] > 10 * YIELD_ENERGY


def test_rows():
    for name, rules in RULES.items():
        row = "baber_noori_pinching" if name in PINCHING else "baber_noori"
        assert LAWS["baber_noori"].spring(building(SHAPES[0], rules | {"exponent": 1.0}).parameters) == f"{row}_1"
        assert LAWS["baber_noori"].spring(building(SHAPES[0], rules | {"exponent": 1.5}).parameters) == row


@pytest.mark.parametrize("rules", RULES)
def test_tangents_and_precision(rules):
    drift = finer(PROTOCOLS["ratcheting"], 4)
    for shape in SHAPES:
        storey = building(shape, RULES[rules])
        double = steps(storey, drift)
        # The chord is across a step of RK4; where one goes through the kink at z = 0 it is less close.
        assert (np.abs(double.tangent - double.chord) < 2e-3 * STIFFNESS).mean() > 0.98
        np.testing.assert_allclose(double.tangent, double.chord, rtol=0, atol=0.05 * STIFFNESS)
        stiffest = LAWS["baber_noori"].stiffest(storey.parameters)[0]
        assert double.tangent.max() < stiffest * (1 + 1e-3)  # z falls back to a bound that falls, a little later
        single = steps(storey, drift.astype(np.float32), "float32")
        double = steps(storey, drift.astype(np.float32).astype(np.float64))
        assert single.force.dtype == np.float32
        np.testing.assert_allclose(single.force, double.force, rtol=0, atol=1e-4 * YIELD_FORCE)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"gamma": 0.6}, r"gamma is 0.6 and beta is 0.5 \(storey 1\)"),
        ({"stiffness_loss": -0.1}, r"stiffness_loss is -0.1 at storey 1; it must be finite and at least 0"),
        ({"total_slip": 1.0}, r"total_slip is 1 at storey 1; it must be finite and at least 0 and below 1"),
        ({"pinching_spread": 0.0}, r"pinching_spread is 0 at storey 1; it must be finite and above 0"),
        ({"pinching_level": [0.1, 1.2]}, r"pinching_level is 1.2 at storey 2"),
        ({"pinching_coupling": 0.0}, r"pinching_coupling is 0 at storey 1"),
    ],
)
def test_bad_input(parameters, message):
    with pytest.raises(ValueError, match=message):
        building(SHAPES[0], {}, **parameters)
