"""Stability limits against a table made elsewhere, dense scans, and the spectral radius of whole steps."""

from math import factorial
from time import perf_counter

import numpy as np
import pytest
from scipy.linalg import eigh

from warpdyn.stability import stability_limit, stable_step, stable_step_of_eigenvalues, state_eigenvalues

POLYNOMIALS = {
    "Euler": [1, 1],
    "RK2": [1, 1, 1 / 2],
    "RK3": [1, 1, 1 / 2, 1 / 6],
    "RK4": [1, 1, 1 / 2, 1 / 6, 1 / 24],
    "DP5": [1, 1, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 600],
}
# Limits of w h by damping ratio, in the order of POLYNOMIALS.
LIMITS = {
    0.0: [0.0, 0.0, 1.7320508075688772, 2.82842712474619, 0.9971890086325469],
    0.005: [0.010000000000000175, 0.3485947663352812, 1.765560633189886, 2.838770974762946, 1.6955084660571398],
    0.01: [0.019999999999998228, 0.44400333397816505, 1.7964875179955437, 2.8485701134131873, 1.8721300712124531],
    0.02: [0.04000000000000589, 0.5688415632504776, 1.8523146154839, 2.8666285482402665, 2.079076763002298],
    0.05: [0.10000000000000077, 0.8, 1.9879832044016534, 2.9097996854903947, 2.4025608543983497],
    0.1: [0.20000000000000118, 1.0497545964285646, 2.1540485399653275, 2.9508529575261244, 2.6814071086918823],
    0.2: [0.40000000000000013, 1.3939075824393259, 2.36958490626632, 2.940087665230473, 3.0007419469176955],
    0.3: [0.5999999999999995, 1.647330959889798, 2.4891405090968353, 2.835300102593946, 3.216036064057296],
    0.4: [0.7999999999999997, 1.8457894350354667, 2.5362699378891174, 2.700467056027216, 3.351875603667285],
    0.5: [0.9999999999999997, 2.0000000000000004, 2.52165902748985, 2.622542491830483, 3.398991528584633],
    0.6: [1.2000000000000002, 2.112339028201798, 2.4592694761692333, 2.6287510076803873, 3.3648666527528075],
    0.7: [1.4000000000000001, 2.1801487497895193, 2.37979390048801, 2.697957603401413, 3.3001573252250704],
    0.8: [1.6000000000000003, 2.1956720133230303, 2.332847682575104, 2.7914972150806063, 3.284818394637346],
    0.9: [1.8000000000000003, 2.1439436436993637, 2.3667967242884016, 2.8523725377901332, 3.3325836653100835],
    0.99: [1.98, 2.0194023043415883, 2.492740665630788, 2.8023484310608042, 3.3216252590772344],
    1.0: [2.0, 2.0000000000000004, 2.5127453266183286, 2.785293563405282, 3.3065678926349453],
    1.1: [1.2834848610088319, 1.283484861008832, 1.6125352931426582, 1.787441061048011, 2.1219649160474137],
    1.25: [1.0, 0.9999999999999997, 1.2563726633091643, 1.392646781702641, 1.6532839463174727],
    1.5: [0.7639320225002103, 0.7639320225002103, 0.9597833096957458, 1.063887472574507, 1.2629965488774357],
    2.0: [0.5358983848622455, 0.5358983848622455, 0.6732880810524589, 0.7463171609980491, 0.8859921965502127],
    5.0: [0.20204102886728761, 0.20204102886728761, 0.2538388255357179, 0.28137178862391843, 0.33403118952375166],
}
# What stable_step states: never above the limit, at most this far below it (relative).
CONSERVATISM = 2.1e-3


@pytest.mark.parametrize("zeta", LIMITS)
def test_limits_match_the_table(zeta):
    for (name, polynomial), expected in zip(POLYNOMIALS.items(), LIMITS[zeta], strict=True):
        # The table was bisected on |R| - 1, which leaves it up to 6e-15 off for Euler; 1e-10 is the accuracy promised.
        assert stability_limit(polynomial, zeta) == pytest.approx(expected, abs=1e-12), name


def test_coefficients_with_the_rounding_of_a_tableau():
    # Products of a tableau's fractions miss 1/k! by a few ulp, which must not open a false limit near 0.
    for ulps in ([0, 0, 1, -1, 1], [0, 0, -1, 1, -1]):
        rounded = np.array(POLYNOMIALS["RK4"]) * (1 + np.array(ulps) * 4e-16)
        assert stability_limit(rounded, 0.0) == pytest.approx(2.82842712474619, abs=1e-12)
    assert stability_limit([*POLYNOMIALS["RK4"], 0.0], 0.0) == pytest.approx(2.82842712474619, abs=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_limits_of_other_polynomials_match_a_dense_scan(seed):
    rng = np.random.default_rng(seed)
    stages = rng.integers(2, 9)
    order = rng.integers(1, stages + 1)
    polynomial = np.array([1 / factorial(k) for k in range(stages + 1)])
    polynomial[order + 1 :] *= rng.uniform(0.3, 1.7, stages - order)
    for zeta in rng.uniform(0.01, 1, 4):
        x = np.linspace(0, 60, 600_001)[1:]
        growth = np.abs(np.polyval(polynomial[::-1], x * (-zeta + 1j * np.sqrt(1 - zeta**2))))
        first = x[(growth > 1 + 1e-13).argmax()]
        assert stability_limit(polynomial, zeta) == pytest.approx(first, abs=2e-4)  # the scan's spacing is 1e-4


@pytest.mark.parametrize("name", POLYNOMIALS)
def test_stable_step_is_close_to_the_limit_and_never_above(name):
    polynomial = POLYNOMIALS[name]
    rng = np.random.default_rng(3)
    zeta = np.concatenate([rng.uniform(0, 1, 300), 10 ** rng.uniform(-9, 0, 300), rng.uniform(0.99, 3, 100), [1.0]])
    omega = rng.uniform(1, 300, zeta.size)
    exact = np.array([stability_limit(polynomial, z) for z in zeta]) / omega
    ratio = stable_step(polynomial, omega, zeta) / exact
    assert ratio.max() < 1
    assert ratio.min() > 1 - CONSERVATISM


@pytest.mark.parametrize("name", POLYNOMIALS)
def test_no_oscillation_grows_at_its_stable_step(name):
    polynomial = np.array(POLYNOMIALS[name], dtype=float)
    zeta = np.linspace(1e-3, 1.5, 20_001)
    root = -zeta + 1j * np.emath.sqrt(1 - zeta**2)
    reach = stable_step(polynomial, np.ones_like(zeta), zeta)
    for part in np.linspace(0.01, 1, 25):  # at that step and at every shorter one
        assert np.abs(np.polyval(polynomial[::-1], part * reach * root)).max() <= 1 + 1e-14
    undamped = stable_step(polynomial, 1.0, 0.0)
    assert np.abs(np.polyval(polynomial[::-1], 1j * undamped)) <= 1 + 1e-14


def test_stable_step_of_many_structures_is_quick():
    rng = np.random.default_rng(0)
    omega, zeta = rng.uniform(1, 300, 100_000), rng.uniform(0, 0.2, 100_000)
    start = perf_counter()
    step = stable_step(POLYNOMIALS["DP5"], omega, zeta)
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
    masses = np.ones((4, 20)), np.broadcast_to(np.eye(20), (4, 20, 20))
    for mass in masses:
        eigenvalues = state_eigenvalues(mass, damping, np.broadcast_to(stiffness, damping.shape))
        assert eigenvalues.shape == (4, 40)
        step = stable_step_of_eigenvalues(POLYNOMIALS["RK4"], eigenvalues)
        expected = np.array(list(dampings))
        assert (step <= expected).all()
        assert (step >= (1 - CONSERVATISM) * expected).all()


@pytest.mark.parametrize("name", ["RK3", "RK4", "DP5"])
def test_chain_with_one_damped_storey_does_not_grow(name):
    # Dampers in one storey only: the damping is not classical, and the oracle is the spectral radius of whole steps.
    rng = np.random.default_rng(9)
    _, stiffness, _ = uniform_chain(6, 0.8)
    mass = rng.uniform(0.5, 2, 6)
    damping = np.zeros((6, 6))
    damping[2:4, 2:4] = 40 * np.array([[1, -1], [-1, 1]])
    system = np.block([[np.zeros((6, 6)), np.eye(6)], [-stiffness / mass[:, None], -damping / mass[:, None]]])
    step = stable_step_of_eigenvalues(POLYNOMIALS[name], state_eigenvalues(mass[None], damping[None], stiffness[None]))

    def spectral_radius(h):
        one_step = sum(c * np.linalg.matrix_power(h * system, k) for k, c in enumerate(POLYNOMIALS[name]))
        return np.abs(np.linalg.eigvals(one_step)).max()

    assert spectral_radius(step[0]) <= 1 + 1e-13
    assert spectral_radius(step[0] * (1 + 1.5 * CONSERVATISM)) > 1 + 1e-5


def test_state_eigenvalues_of_the_seed_frame():
    stiffness = np.array([[40e3, -20e3, 0], [-20e3, 40e3, -20e3], [0, -20e3, 20e3]])
    eigenvalues = state_eigenvalues(np.array([[200.0, 150, 100]]), 0.0015 * stiffness[None], stiffness[None])[0]
    upper = np.sort_complex(eigenvalues[eigenvalues.imag > 0])[::-1]
    np.testing.assert_allclose(np.abs(upper), [5.52942875199533, 14.142135623731, 20.882817921518], rtol=1e-12)
    zeta = [0.0041470715639965, 0.0106066017177982, 0.0156621134411385]
    np.testing.assert_allclose(-upper.real / np.abs(upper), zeta, rtol=1e-10)  # small parts of large numbers


def test_rounding_and_rest_in_eigenvalues():
    noise = np.array([[1e-14 + 10j, 1e-14 - 10j], [-1e-14 + 10j, -1e-14 - 10j], [-2.0, 0.0]])
    step = stable_step_of_eigenvalues(POLYNOMIALS["RK4"], noise)
    # Undamped twice, and a real root beside a 0 that sets no limit.
    np.testing.assert_allclose(step, [0.282842712474619, 0.282842712474619, 2.785293563405282 / 2], rtol=CONSERVATISM)
    # Damping of the size of rounding must not make an unstable method look stable.
    assert stable_step_of_eigenvalues(POLYNOMIALS["RK2"], noise)[:2].tolist() == [0, 0]
    assert stable_step(POLYNOMIALS["RK2"], 10.0, [9e-10, 1e-8]).astype(bool).tolist() == [False, True]


def test_bad_input_is_named():
    rk4 = POLYNOMIALS["RK4"]
    for polynomial in ([1, 0.9, 0.5], [1], [1, 1, np.nan], [0.0]):
        with pytest.raises(ValueError, match="polynomial_coefficients must be finite and start 1, 1"):
            stability_limit(polynomial, 0.1)
    with pytest.raises(ValueError, match=r"damping_ratio is -0\.1; it must be finite and 0 or above"):
        stability_limit(rk4, -0.1)
    with pytest.raises(ValueError, match=r"damping_ratio\[1\] is nan"):
        stable_step(rk4, [1.0, 2.0], [0.1, np.nan])
    with pytest.raises(ValueError, match=r"frequency\[1\] is 0; it must be above 0"):
        stable_step(rk4, [1.0, 0.0], 0.05)
    with pytest.raises(ValueError, match=r"eigenvalues\[1, 0\] is 0.1\+2j 1/s: a motion that grows by itself"):
        stable_step_of_eigenvalues(rk4, [[-0.1 + 2j], [0.1 + 2j]])
    with pytest.raises(ValueError, match=r"eigenvalues must be finite and of shape \[structure, eigenvalue\]"):
        stable_step_of_eigenvalues(rk4, [1j, -1j])
    one = np.eye(2)[None]
    for mass, damping, stiffness, message in (
        (np.ones((1, 2)), one[0], one, "damping and stiffness must share a shape"),
        (np.ones((1, 3)), one, one, r"mass must have shape \(1, 2\) or \(1, 2, 2\)"),
        (np.array([[1.0, 0]]), one, one, "mass must not be singular"),
        (np.ones((1, 2, 2)), one, one, "mass must not be singular"),
        (np.ones((1, 2)), one, one + np.array([0, np.inf]), r"stiffness\[0, 0, 1\] is not finite"),
    ):
        with pytest.raises(ValueError, match=message):
            state_eigenvalues(mass, damping, stiffness)
