"""Steps that hold: tables against exact limits, and systems against the spectral radius of their whole steps."""

from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest
from matrices import chain_matrix
from scipy.linalg import eigh

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.engine.methods.amplification import _conditions
from warpdyn.engine.methods.kinds import ExplicitMethod
from warpdyn.engine.methods.stability_limits import (
    stability_limit,
    stable_step,
    stable_step_of_eigenvalues,
)
from warpdyn.engine.methods.state_matrices import highest_damping_rate, state_eigenvalues
from warpdyn.engine.methods.table import METHODS

EULER = ExplicitMethod("euler", 1, ((0,),), (1,), (0,))
LIMITED = [EULER, *(method for method in METHODS.values() if stability_limit(method, 0.5) < np.inf)]
# What stable_step states: never above the limit, at most this far below it (relative).
CONSERVATISM = 2.1e-3


@pytest.mark.parametrize("method", LIMITED, ids=lambda method: method.name)
def test_stable_step_is_close_to_the_limit_and_never_above(method):
    rng = np.random.default_rng(3)
    zeta = [rng.uniform(0, 1, 60), 10 ** rng.uniform(-9, 0, 60), rng.uniform(0.99, 3, 40), 10 ** rng.uniform(0, 7, 20)]
    zeta = np.concatenate([*zeta, [1.0]])
    omega = rng.uniform(1, 300, zeta.size)
    exact = np.array([stability_limit(method, z) for z in zeta]) / omega
    ratio = stable_step(method, omega, zeta) / exact
    assert ratio.max() < 1
    assert ratio.min() > 1 - CONSERVATISM


def growth(method, x, zeta):
    return np.abs(np.linalg.eigvals(method.amplification(x, np.asarray(zeta)))).max(axis=-1)


@pytest.mark.parametrize("method", LIMITED, ids=lambda method: method.name)
def test_no_oscillation_grows_at_its_stable_step(method):
    zeta = np.linspace(1e-3, 1.5, 5001)
    reach = stable_step(method, np.ones_like(zeta), zeta)
    for part in np.linspace(0.01, 1, 25):  # at that step and at every shorter one
        assert growth(method, part * reach, zeta).max() <= 1 + 1e-13
    undamped = stable_step(method, 1.0, 0.0)
    assert growth(method, undamped, 0.0) <= 1 + 1e-13


def test_stable_step_of_many_structures_is_quick():
    rng = np.random.default_rng(0)
    omega, zeta = rng.uniform(1, 300, 100_000), rng.uniform(0, 0.2, 100_000)
    start = perf_counter()
    step = stable_step(METHODS["dormand_prince5"], omega, zeta)
    assert perf_counter() - start < 1  # promised; about 0.03 s, the table included
    assert step.shape == (100_000,)


def uniform_chain(storeys=20, period=2.0):
    """Stiffness over mass of a uniform chain of unit masses, and its frequencies, in closed form."""
    sines = 2 * np.sin((2 * np.arange(1, storeys + 1) - 1) * np.pi / (4 * storeys + 2))
    ratio = (2 * np.pi / period / sines[0]) ** 2
    matrix = ratio * (2 * np.eye(storeys) - np.eye(storeys, k=1) - np.eye(storeys, k=-1))
    matrix[-1, -1] = ratio
    return ratio, matrix, np.sqrt(ratio) * sines


def test_uniform_chain_under_four_dampings():
    ratio, stiffness, omega = uniform_chain()
    assert ratio == pytest.approx(1681.82270854, abs=1e-8)
    _, phi = eigh(stiffness)
    a1 = 2 * 0.05 / (omega[0] + omega[2])
    dampings = {
        0.0345860585: np.zeros((20, 20)),
        0.0355810836: phi @ np.diag(2 * 0.05 * omega) @ phi.T,  # 5 % in all modes
        0.0357753037: a1 * omega[0] * omega[2] * np.eye(20) + a1 * stiffness,  # Rayleigh, modes 1 and 3
        0.0159550516: 2 * 0.05 / omega[0] * stiffness,  # stiffness-proportional, mode 1
    }
    damping = np.array(list(dampings.values()))
    stiffness = np.broadcast_to(stiffness, damping.shape)
    highest = np.full(4, omega[-1])
    for mass in (np.ones((4, 20)), np.broadcast_to(np.eye(20), (4, 20, 20))):
        eigenvalues = state_eigenvalues(mass, damping, stiffness)
        assert eigenvalues.shape == (4, 40)
        rate = highest_damping_rate(mass, damping)
        # The highest mode's 2 zeta w, in closed form.
        due = [0, 0.1 * omega[-1], a1 * (omega[0] * omega[2] + omega[-1] ** 2), 0.1 / omega[0] * omega[-1] ** 2]
        np.testing.assert_allclose(rate, due, rtol=1e-12, atol=1e-15)
        step = stable_step_of_eigenvalues(METHODS["rk4"], eigenvalues, highest, rate)
        expected = np.array(list(dampings))
        assert (step <= expected).all()
        assert (step >= (1 - CONSERVATISM) * expected).all()
        # Others are held by the highest mode: 2, 2 sqrt 3, and 2 (sqrt(1 + zeta^2) - zeta) at its damping.
        zeta = np.array(due) / (2 * omega[-1])
        limits = {
            "central_difference": 2,
            "newmark_linear": 2 * np.sqrt(3),
            "newmark_average": np.inf,
            "central_difference_lagged": 2 * (np.sqrt(1 + zeta**2) - zeta),
        }
        for name, limit in limits.items():
            step = stable_step_of_eigenvalues(METHODS[name], eigenvalues, highest, rate)
            assert (step <= limit / omega[-1]).all(), name
            assert (step >= (1 - CONSERVATISM) * limit / omega[-1]).all(), name


def systems(count, seed):
    """Random systems scaled to unit masses, M^-1 K and M^-1 C: chains with dampers in some storeys, and full matrices.

    Damping goes from hardly any to far beyond critical, and is not classical.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        dof = rng.integers(2, 7)
        root = 10 ** rng.uniform(-0.3, 0.3, dof)
        stiffness = chain_matrix(10 ** rng.uniform(0, 1, dof)) * root * root[:, None]
        dampers = 10 ** rng.uniform(-3, 1.5, dof) * (rng.random(dof) < rng.choice([0.3, 0.6, 1]))
        yield stiffness, chain_matrix(dampers) * root * root[:, None]
        axes = np.linalg.qr(rng.standard_normal((dof, dof)))[0]
        factor = rng.standard_normal((dof, rng.integers(1, dof + 1)))
        yield axes @ np.diag(10 ** rng.uniform(-2, 1, dof)) @ axes.T, factor @ factor.T * 10 ** rng.uniform(-2, 1)


def step_of(method, stiffness, damping):
    eigenvalues = state_eigenvalues(np.ones((1, len(stiffness))), damping[None], stiffness[None])
    highest = np.sqrt(np.linalg.eigvalsh(stiffness)[-1:])
    return stable_step_of_eigenvalues(method, eigenvalues, highest, np.linalg.eigvalsh(damping)[-1:])[0]


def system_growth(method, stiffness, damping, h):
    """Spectral radius of what a step makes of a system's state (u, h v), or (u, h v, h^2 a) of an implicit method."""
    dof = len(stiffness)
    stiff, viscous, one = h**2 * stiffness, h * damping, np.eye(dof)
    if method.kind == "explicit":
        u, w = np.hsplit(np.eye(2 * dof), 2)
        u, w = u.T, w.T
        velocities, slopes = [], []
        for stage, node in enumerate(method.c):
            ws = w + sum((a * slope for a, slope in zip(method.a[stage], slopes, strict=False)), 0 * w)
            if method.is_nystroem:
                us = u + node * w
                us = us + sum(a * slope for a, slope in zip(method.a_displacement[stage], slopes, strict=False))
            else:
                us = u + sum(a * velocity for a, velocity in zip(method.a[stage], velocities, strict=False))
            velocities.append(ws)
            slopes.append(-stiff @ us - viscous @ ws)
        w1 = w + sum(b * slope for b, slope in zip(method.b, slopes, strict=True))
        if method.is_nystroem:
            u1 = u + w + sum(b * slope for b, slope in zip(method.b_displacement, slopes, strict=True))
        else:
            u1 = u + sum(b * velocity for b, velocity in zip(method.b, velocities, strict=True))
        step = np.vstack([u1, w1])
    else:  # Newmark's two lines, and the equation of motion at the end
        zero, beta, gamma = 0 * one, method.beta, method.gamma
        end = np.block([[one, zero, -beta * one], [zero, one, -gamma * one], [stiff, viscous, one]])
        start = np.block([[one, one, (0.5 - beta) * one], [zero, one, (1 - gamma) * one], [zero, zero, zero]])
        step = np.linalg.solve(end, start)
    return np.abs(np.linalg.eigvals(step)).max()


@pytest.mark.parametrize("name", ["kutta3", "rk4", "dormand_prince5", "central_difference", "newmark_linear"])
def test_systems_with_any_damping_grow_just_beyond_their_step(name):
    method = METHODS[name]
    for stiffness, damping in systems(40, seed=9):
        h = step_of(method, stiffness, damping)
        assert system_growth(method, stiffness, damping, h) <= 1 + 1e-12
        # It is the limit, not a bound; beyond it an implicit step grows slowly where damping is far beyond critical.
        assert system_growth(method, stiffness, damping, h * (1 + 1.5 * CONSERVATISM)) > 1 + 1e-7


@pytest.mark.parametrize("name", ["central_difference_lagged", "velocity_verlet", "nystroem4"])
def test_systems_with_any_damping_do_not_grow_up_to_a_nystroem_step(name):
    method, ratios = METHODS[name], []
    for stiffness, damping in systems(60, seed=4):
        h = step_of(method, stiffness, damping)
        for part in (0.3, 0.6, 0.8, 0.9, 1.0):
            assert system_growth(method, stiffness, damping, part * h) <= 1 + 1e-12
        scanned = h * np.geomspace(1, 4, 40)
        grows = [system_growth(method, stiffness, damping, x) > 1 + 1e-9 for x in scanned]
        assert any(grows)
        ratios.append(h / scanned[np.argmax(grows)])
    # A bound, not the limit; but a close one for most, and never far from it.
    assert np.median(ratios) > 0.9
    assert min(ratios) > 0.5


def as_nystroem(method):
    """A Runge-Kutta method with its weights of displacements written out, as for a Nystroem method."""
    a, b = np.array(method.a), np.array(method.b)
    return replace(method, a_displacement=tuple(map(tuple, a @ a)), b_displacement=tuple(b @ a))


def test_a_slow_motion_can_hold_the_step():
    # Dampers in proportion to mass: the fast motion, at zeta = 0.6, could go on to w h = 2.6288, that is to 3.15 of the
    # damping rate; the slow one, whose eigenvalue the rate is, only to 2.785.
    method, rate = as_nystroem(METHODS["rk4"]), 1.2
    h = step_of(method, np.diag([1e-6, 1.0]), rate * np.eye(2))
    assert h <= 2.7852935634 / rate
    assert h >= 0.995 * 2.7852935634 / rate  # cells of 0.002 in zeta, over which a limit of the rate falls by 0.33 %


@pytest.mark.parametrize("name", ["midpoint", "ssprk3", "rk4", "dormand_prince5"])
def test_amplification_matrices_and_polynomials_agree_on_limits(name):
    for zeta in (0.0, 0.03, 0.4, 0.97, 1.0, 1.6, 20.0):
        expected = stability_limit(METHODS[name], zeta)
        assert stability_limit(as_nystroem(METHODS[name]), zeta) == pytest.approx(expected, abs=1e-12), zeta


def test_state_eigenvalues_of_the_seed_frame():
    stiffness = np.array([[40e3, -20e3, 0], [-20e3, 40e3, -20e3], [0, -20e3, 20e3]])
    eigenvalues = state_eigenvalues(np.array([[200.0, 150, 100]]), 0.0015 * stiffness[None], stiffness[None])[0]
    upper = np.sort_complex(eigenvalues[eigenvalues.imag > 0])[::-1]
    np.testing.assert_allclose(np.abs(upper), [5.52942875199533, 14.142135623731, 20.882817921518], rtol=1e-12)
    zeta = [0.0041470715639965, 0.0106066017177982, 0.0156621134411385]
    np.testing.assert_allclose(-upper.real / np.abs(upper), zeta, rtol=1e-10)  # small parts of large numbers


def test_rounding_and_rest_in_eigenvalues():
    noise = np.array([[1e-14 + 10j, 1e-14 - 10j], [-1e-14 + 10j, -1e-14 - 10j], [-2.0, 0.0]])
    others = np.full(3, 10.0), np.zeros(3)  # the highest frequency and damping rate, which Runge-Kutta does not need
    step = stable_step_of_eigenvalues(METHODS["rk4"], noise, *others)
    # Undamped twice, and a real root beside a 0 that sets no limit.
    np.testing.assert_allclose(step, [0.282842712474619, 0.282842712474619, 2.785293563405282 / 2], rtol=CONSERVATISM)
    # Damping of the size of rounding must not make an unstable method look stable.
    heun = METHODS["heun"]
    assert stable_step_of_eigenvalues(heun, noise, *others)[:2].tolist() == [0, 0]
    assert stable_step(heun, 10.0, [9e-10, 1e-8]).astype(bool).tolist() == [False, True]


def test_bad_input_is_named():
    rk4, verlet = METHODS["rk4"], METHODS["velocity_verlet"]
    with pytest.raises(ValueError, match=r"damping_ratio is -0\.1; it must be finite and 0 or above"):
        stability_limit(rk4, -0.1)
    with pytest.raises(ValueError, match=r"damping_ratio\[1\] is nan"):
        stable_step(rk4, [1.0, 2.0], [0.1, np.nan])
    with pytest.raises(ValueError, match=r"frequency\[1\] is 0; it must be above 0"):
        stable_step(rk4, [1.0, 0.0], 0.05)
    with pytest.raises(ValueError, match=r"eigenvalues\[1, 0\] is 0.1\+2j 1/s: a motion that grows freely"):
        stable_step_of_eigenvalues(rk4, [[-0.1 + 2j], [0.1 + 2j]], [2.0, 2.0], [0.2, 0.2])
    with pytest.raises(ValueError, match=r"eigenvalues must be finite and of shape \[structure, eigenvalue\]"):
        stable_step_of_eigenvalues(rk4, [1j, -1j], [1.0], [0.0])
    with pytest.raises(ValueError, match=r"highest_frequency\[0\] is 0; it must be above 0"):
        stable_step_of_eigenvalues(verlet, [[1j, -1j]], [0.0], [0.0])
    with pytest.raises(ValueError, match=r"damping_rate\[0\] is -2; it must be finite and 0 or above"):
        stable_step_of_eigenvalues(verlet, [[1j, -1j]], [1.0], [-2.0])
    one = np.eye(2)[None]
    for mass, damping, stiffness, message in (
        (np.ones((1, 2)), one[0], one, "damping and stiffness must share a shape"),
        (np.ones((1, 2)), one[0], one[0], r"stiffness must have shape \[structure, dof, dof\], got \(2, 2\)"),
        (np.ones((1, 3)), one, one, r"mass must have shape \(1, 2\) or \(1, 2, 2\)"),
        (np.array([[1.0, 0]]), one, one, "mass is singular: give every degree"),
        (np.ones((1, 2, 2)), one, one, "mass is singular: give every degree"),
        (np.ones((1, 2)), one, one + np.array([0, np.inf]), r"stiffness\[0, 0, 1\] is not finite"),
        (np.ones((1, 2)), one + np.array([0, np.nan]), one, r"damping\[0, 0, 1\] is not finite"),
    ):
        with pytest.raises(ValueError, match=message):
            state_eigenvalues(mass, damping, stiffness)


@pytest.mark.fast
@pytest.mark.meant_as_given("damper_damping_ratio", "first_period")
def test_stable_step_of_power_law_dampers_follows_from_their_steepest_slope():
    # Below `linear_velocity` the force of a damper of exponent alpha is linear in the velocity, with the slope
    # c v^(alpha - 1) = 7.5e7 N s/m: 25 times the coefficient c. RK4's limit on the negative real axis is 2.785293563.
    coefficient, exponent, velocity, mass, stiffness = 3e6, 0.3, 0.01, 7.5e4, 3e8
    storey = wd.ShearBuilding(
        mass, stiffness, 3.0, damping="none", devices=("viscous_damper",), damper_coefficient=coefficient,
        velocity_exponent=exponent, linear_velocity=velocity,
    )  # fmt: skip
    slope = coefficient * velocity ** (exponent - 1)
    # The storey decays at up to slope / mass, and a little more slowly for its stiffness: by 0.4 %.
    due = 2.785293563405282 / (slope / mass)
    assert due == pytest.approx(2.8e-3, rel=0.02)
    found = dynamics_of(wd.Scene(storey, wd.FreeVibration(1.0, velocity=0.1))).vibration_of({}, METHODS["rk4"])
    assert (1 - CONSERVATISM) * due < found.stable_step[0] <= due
    scene = wd.Scene(storey, wd.FreeVibration(1.0, velocity=0.1))
    with pytest.raises(ValueError, match="beyond the stability limit of 1 of 1 samples"):
        wd.simulate(scene, step=1 / 355, method="rk4", on_unstable="raise", device="cpu")


@pytest.mark.fast
@pytest.mark.meant_as_given("damper_damping_ratio", "first_period")
@pytest.mark.parametrize(("ratio", "limit"), [(0.2, np.sqrt(8)), (0.8, 2.785293563405282 / 1.6)])
def test_stable_step_with_a_power_law_damper_holds_at_every_slope_of_its_force(ratio, limit):
    # At high velocities the force has no slope: RK4 is then stable up to sqrt(8) over the frequency. A linear damper of
    # the steepest slope, with 20 % of critical damping, would allow a longer step (2.94), and with 80 % as well (2.79):
    # there the damping rate alone bounds the step, at RK4's limit on the negative real axis.
    mass, stiffness, exponent, velocity = 7.5e4, 3e8, 0.3, 0.01
    frequency = np.sqrt(stiffness / mass)
    slope = 2 * ratio * mass * frequency
    given = {"damping": "none", "devices": ("viscous_damper",)}
    power = {"velocity_exponent": exponent, "linear_velocity": velocity}
    coefficient = slope / velocity ** (exponent - 1)
    storeys = (
        wd.ShearBuilding(mass, stiffness, 3.0, damper_coefficient=slope, **given),
        wd.ShearBuilding(mass, stiffness, 3.0, damper_coefficient=coefficient, **power, **given),
    )
    load = wd.FreeVibration(1.0, velocity=0.1)
    linear, power_law = (
        dynamics_of(wd.Scene(each, load)).vibration_of({}, METHODS["rk4"]).stable_step[0] * frequency
        for each in storeys
    )
    assert linear > 1.02 * limit
    assert 0.997 * limit < power_law <= limit  # the limits are looked up in a table, on the safe side


@pytest.mark.fast
def test_conditions_of_a_multistep_method_are_those_of_its_eigenvalues():
    """The conditions on the characteristic polynomial hold exactly if no eigenvalue is outside of the unit circle."""
    random = np.random.default_rng(1)
    steps, ratios = 10 ** random.uniform(-2, 1, 20_000), 10 ** random.uniform(-4, 2, 20_000)
    matrices = METHODS["stoermer"].amplification(steps, ratios)
    radius = np.abs(np.linalg.eigvals(matrices)).max(axis=-1)
    is_clear = np.abs(radius - 1) > 1e-9  # eigenvalues have rounding errors of about 1e-14 times the largest entry
    meets = (_conditions(METHODS["stoermer"], steps, ratios) >= 0).all(axis=0)
    assert is_clear.mean() > 0.99
    assert 0.1 < meets.mean() < 0.9
    np.testing.assert_array_equal(meets[is_clear], (radius < 1)[is_clear])
