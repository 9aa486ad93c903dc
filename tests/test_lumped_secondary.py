"""Tanks and inerters: reference values, limits, optimality, and responses."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import complex_modes, peak, pulse, response
from printed_digits import half_unit
from scipy.linalg import solve_continuous_lyapunov
from scipy.optimize import minimize

from warpdyn.model.structures.lumped import inerters, tanks

pytestmark = pytest.mark.fast
G = 9.80665


def test_a_cylinder_has_the_reference_values() -> None:
    tank = tanks.housner_cylinder(10.0, 8.0)
    assert tank.liquid_mass == pytest.approx(2513274, rel=2e-7)
    assert tank.impulsive_mass == pytest.approx(1130691, rel=0, abs=half_unit(1130691, 7))
    assert tank.convective_mass == pytest.approx(1300559, rel=0, abs=half_unit(1300559, 7))
    assert tank.impulsive_height == pytest.approx(3, rel=1e-15)
    assert tank.convective_height == pytest.approx(4.5939, abs=5e-5)
    assert tank.impulsive_height_with_base == pytest.approx(7.891105, abs=5.1e-7)
    assert tank.convective_height_with_base == pytest.approx(7.253056, abs=5.1e-7)
    assert tank.convective_period == pytest.approx(4.930596, abs=5.1e-7)
    assert tank.convective_stiffness == pytest.approx(1300559 * (2 * np.pi / 4.930596) ** 2, rel=1e-6)


def test_a_tank_has_the_reference_response() -> None:
    tank = tanks.housner_cylinder(10.0, 8.0)
    masses = np.array([tank.impulsive_mass, tank.convective_mass])
    omega, ratio = np.array([2 * np.pi / 0.15, tank.convective_frequency]), np.array([0.05, 0.005])
    motion = pulse(2.0, 4.0, 0.2, 20.0)
    matrices = (np.diag(masses), np.diag(2 * ratio * omega * masses), np.diag(omega**2 * masses))
    found = response(*matrices, masses, motion, duration=30.0)
    time, u, v = found["time"], found["u"], found["v"]
    assert peak(time, u[:, 0], v[:, 0])[0] == pytest.approx(0.0009459211, rel=2e-7)
    assert peak(time, u[:, 1], v[:, 1]) == pytest.approx((2.578738, 9.0782), rel=1e-5)
    assert peak(time, u[:, 1], v[:, 1])[0] == pytest.approx(2.578738, rel=3e-7)
    forces = masses * (found["a"] + found["ground"])
    shear = forces.sum(axis=1)
    assert peak(time, shear, np.gradient(shear, time))[0] == pytest.approx(5080820, rel=1e-6)
    moment = forces @ [tank.impulsive_height, tank.convective_height]
    assert peak(time, moment, np.gradient(moment, time))[0] == pytest.approx(2.392251e7, rel=1e-6)


@pytest.mark.parametrize("depth", [0.5, 2.0, 6.9, 8.0, 13.326, 20.0])
def test_tanks_have_the_formulas_with_hyperbolic_functions(depth: float) -> None:
    for tank, length, share, slosh in (
        (tanks.housner_cylinder(5.0, depth), 10.0, 0.230, 3.68),
        (tanks.housner_rectangle(10.0, 4.0, depth), 10.0, 0.264, 3.16),
    ):
        base = np.pi * 25 if share == 0.230 else 40.0
        assert tank.liquid_mass == pytest.approx(1000 * base * depth, rel=1e-14)
        x, y = 0.866 * length / depth, slosh * depth / length
        assert tank.impulsive_mass / tank.liquid_mass == pytest.approx(np.tanh(x) / x, rel=1e-14)
        assert tank.convective_mass / tank.liquid_mass == pytest.approx(share * length / depth * np.tanh(y), rel=1e-14)
        assert tank.convective_frequency**2 == pytest.approx(slosh * G / length * np.tanh(y), rel=1e-14)
        height = 1 - (np.cosh(y) - 1) / (y * np.sinh(y))
        assert tank.convective_height / depth == pytest.approx(height, rel=1e-12)
        with_base = 1 - (np.cosh(y) - 2.01) / (y * np.sinh(y))
        assert tank.convective_height_with_base / depth == pytest.approx(with_base, rel=1e-12)
        ratio = length / depth
        expected = 0.375 if ratio >= 1.333 else 0.5 - 0.09375 * ratio
        assert tank.impulsive_height / depth == pytest.approx(expected, rel=1e-12)
        expected = 0.45 if ratio < 0.75 else x / (2 * np.tanh(x)) - 0.125
        assert tank.impulsive_height_with_base / depth == pytest.approx(expected, rel=1e-12)


def test_tanks_have_the_limits_of_shallow_and_deep_water() -> None:
    # Shallow: speed of waves sqrt(g H); half a wave in the length of a rectangle, with pi^2 as 3.16^2 = 9.99.
    shallow = tanks.housner_rectangle(100.0, 10.0, 0.5)
    assert shallow.convective_frequency == pytest.approx(np.pi / 100.0 * np.sqrt(G * 0.5), rel=0.006)
    # Deep: nearly all of the liquid moves with the tank, and sloshing does not depend on the depth.
    deep, deeper = tanks.housner_cylinder(1.0, 1000.0), tanks.housner_cylinder(1.0, 2000.0)
    assert deep.impulsive_mass / deep.liquid_mass == pytest.approx(1, abs=2e-6)
    assert deep.convective_frequency == deeper.convective_frequency
    assert np.isfinite(deeper.convective_height_with_base)
    # The masses of all tanks, as the class states.
    shares = []
    for ratio in np.geomspace(0.01, 100, 200):
        for tank in (tanks.housner_cylinder(ratio, 1.0), tanks.housner_rectangle(2 * ratio, 1.0, 1.0)):
            shares.append((tank.impulsive_mass + tank.convective_mass) / tank.liquid_mass)
    assert min(shares) == pytest.approx(0.84, abs=0.005)
    assert max(shares) == pytest.approx(1.08, abs=0.005)


# mass ratio, inertance ratio: frequency ratio, damping ratio, variance of the displacement.
OPTIMA = {
    (0.02, 0.0): (0.9754779, 0.07019058, 45.65377),
    (0.02, 0.1): (0.9096804, 0.1660116, 18.42783),
    (0.05, 0.2): (0.8257752, 0.2300716, 13.16083),
    (0.01, 0.5): (0.737467, 0.3051537, 8.541233),
    (0.1, 0.3): (0.7398039, 0.2794408, 11.00195),
}


def variance(mu: float, beta: float, f: float, zeta: float) -> float:
    """Return the variance of the structure's displacement for omega_s = 1 and a two-sided spectral density of 1."""
    absorber = inerters.tmdi_absorber(1.0, 2 * np.pi, mu, beta, f, zeta)
    mass = np.diag([1.0, mu]) + inerters.inertance_matrix(2, absorber.inertance, 1)
    k, c = absorber.stiffness, absorber.dashpot
    stiffness, damping = np.array([[1 + k, -k], [-k, k]]), np.array([[c, -c], [-c, c]])
    inverse = np.linalg.inv(mass)
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])
    noise = np.concatenate([np.zeros(2), -inverse @ [1.0, mu]])
    return float(solve_continuous_lyapunov(system, -2 * np.pi * np.outer(noise, noise))[0, 0])


@pytest.mark.parametrize(("mu", "beta"), OPTIMA)
def test_the_optimum_minimises_the_variance(mu: float, beta: float) -> None:
    f, zeta, least = OPTIMA[mu, beta]
    found = inerters.optimum_tmdi(mu, beta)
    assert found.frequency_ratio == pytest.approx(f, rel=0, abs=5.1e-8)
    assert found.damping_ratio == pytest.approx(zeta, rel=0, abs=5.1e-8)
    assert variance(mu, beta, *found) == pytest.approx(least, rel=0, abs=half_unit(least, 7))
    best = minimize(lambda x: variance(mu, beta, *x), [f * 1.1, zeta * 0.8], method="Nelder-Mead", tol=1e-10)
    assert best.x == pytest.approx(found, rel=2e-5)
    assert variance(mu, beta, *found) <= best.fun * (1 + 1e-12)


def test_the_optimum_without_inerter_is_warburtons() -> None:
    mu = 0.05
    f, zeta = inerters.optimum_tmdi(mu)
    assert f == pytest.approx(np.sqrt(1 - mu / 2) / (1 + mu), rel=1e-14)
    assert zeta**2 == pytest.approx(mu * (1 - mu / 4) / (4 * (1 + mu) * (1 - mu / 2)), rel=1e-14)


def test_a_structure_with_an_inerter_has_the_reference_modes_and_response() -> None:
    structure, ratio = 1000e3, 0.02
    omega = 2 * np.pi / 2.0
    f, zeta = inerters.optimum_tmdi(0.02, 0.1)
    assert (f, zeta) == pytest.approx((0.909680442, 0.166011562), rel=2e-9)
    absorber = inerters.tmdi_absorber(structure, 2.0, 0.02, 0.1, f, zeta)
    assert absorber.mass == pytest.approx(20e3)
    assert absorber.inertance == pytest.approx(100e3)
    assert absorber.stiffness == pytest.approx(980073.636, rel=1e-9)
    assert absorber.dashpot == pytest.approx(113864.491, rel=5e-9)
    load = np.array([structure, absorber.mass])
    mass = np.diag(load) + inerters.inertance_matrix(2, absorber.inertance, 1)
    k, c = absorber.stiffness, absorber.dashpot
    stiffness = np.array([[structure * omega**2 + k, -k], [-k, k]])
    damping = np.array([[2 * ratio * omega * structure + c, -c], [-c, c]])
    frequency, found = complex_modes(mass, damping, stiffness)
    assert frequency == pytest.approx([2.571473, 3.491457], rel=2e-7)
    assert found == pytest.approx([0.08830185, 0.105152], rel=6e-7)
    motion = pulse(1.0, 2.0, 0.1, 20.0)
    history = response(mass, damping, stiffness, load, motion, duration=30.0)
    time, u, v, a = (history[name] for name in ("time", "u", "v", "a"))
    assert peak(time, u[:, 0], v[:, 0]) == pytest.approx((0.2707331, 3.0015), rel=5e-5)
    assert peak(time, u[:, 0], v[:, 0])[0] == pytest.approx(0.2707331, rel=3e-7)
    assert peak(time, u[:, 1], v[:, 1])[0] == pytest.approx(0.6747053, rel=3e-7)
    stroke, rate = u[:, 1] - u[:, 0], v[:, 1] - v[:, 0]
    assert peak(time, stroke, rate)[0] == pytest.approx(0.702425, rel=8e-7)
    total = a[:, 0] + history["ground"][:, 0]
    assert peak(time, total, np.gradient(total, time))[0] == pytest.approx(2.676774, rel=1e-6)
    force = absorber.inertance * a[:, 1]
    assert peak(time, force, np.gradient(force, time))[0] == pytest.approx(619038.9, rel=1e-6)
    alone = response(
        np.array([[structure]]), 2 * ratio * omega * np.array([[structure]]), omega**2 * np.array([[structure]]),
        np.array([structure]), motion, duration=30.0,
    )  # fmt: skip
    assert peak(time, alone["u"][:, 0], alone["v"][:, 0])[0] == pytest.approx(0.7252796, rel=3e-7)


def test_an_inerter_does_not_resist_equal_accelerations() -> None:
    matrix = inerters.inertance_matrix(4, 7.0, 1, 3)
    assert matrix @ np.ones(4) == pytest.approx(np.zeros(4))
    assert matrix[1, 1] == matrix[3, 3] == 7
    assert matrix[1, 3] == -7
    assert inerters.inertance_matrix(3, 7.0, 2).tolist() == np.diag([0, 0, 7.0]).tolist()


WRONG = [
    (lambda: tanks.housner_cylinder(0.0, 8.0), "radius"),
    (lambda: tanks.housner_cylinder(10.0, -8.0), "depth"),
    (lambda: tanks.housner_rectangle(10.0, np.nan, 8.0), "width"),
    (lambda: tanks.housner_rectangle(10.0, 4.0, 8.0, 0.0), "density"),
    (lambda: inerters.optimum_tmdi(-0.1), "mass_ratio"),
    (lambda: inerters.optimum_tmdi(0.0), "both 0: give the absorber a mass"),
    (lambda: inerters.optimum_tmdi(1.5, 20.0), "no optimum exists .* at most 1"),
    (lambda: inerters.tmdi_absorber(1e6, 0.0, 0.02, 0.1, 0.9, 0.1), "period"),
    (lambda: inerters.inertance_matrix(2, 5.0, 2), "first must be a whole number of at least 0 and at most 1"),
    (lambda: inerters.inertance_matrix(2, 5.0, 0, 0), "first and second are both 0"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_invalid_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
