"""Stability limits of oscillators against a table made elsewhere, closed forms and dense scans."""

from math import factorial

import numpy as np
import pytest

from warpdyn.engine.methods.amplification import polynomial_limits
from warpdyn.engine.methods.kinds import ExplicitMethod, ImplicitMethod
from warpdyn.engine.methods.stability_limits import (
    relaxation_limit,
    stability_limit,
    stable_step,
    stable_step_of_eigenvalues,
)
from warpdyn.engine.methods.table import METHODS

pytestmark = pytest.mark.fast

EULER = ExplicitMethod("euler", 1, ((0,),), (1,), (0,))
# The methods of each column of LIMITS: Runge-Kutta methods of one order and as many stages share their limits.
COLUMNS = [
    (EULER,),
    (METHODS["heun"], METHODS["midpoint"]),
    (METHODS["kutta3"], METHODS["ssprk3"]),
    (METHODS["rk4"], METHODS["three_eighths"]),
    (METHODS["dormand_prince5"],),
]
RUNGE_KUTTA = {method.name: method for column in COLUMNS for method in column}
NYSTROEM = {name: METHODS[name] for name in ("nystroem4", "velocity_verlet", "central_difference_lagged")}
CONDITIONAL = NYSTROEM | {name: METHODS[name] for name in ("central_difference", "newmark_linear")}
UNLIMITED = ["newmark_average", "hht_alpha", "generalised_alpha", "wilson_theta", "exact", "dormand_prince54"]
# Limits of w h by damping ratio.
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
# Limits on the negative real axis, of the same columns.
REAL_AXIS = [2, 2, 2.5127453266183, 2.7852935634053, 3.3065678926349]


def test_every_method_is_in_one_of_the_lists():
    assert sorted([*RUNGE_KUTTA, *CONDITIONAL, *UNLIMITED, "stoermer", "leapfrog"]) == sorted([*METHODS, "euler"])


@pytest.mark.parametrize("zeta", LIMITS)
def test_limits_match_the_table(zeta, measured):
    for methods, expected in zip(COLUMNS, LIMITS[zeta], strict=True):
        for method in methods:
            # The table was bisected on |R| - 1, which leaves it up to 6e-15 off for Euler.
            measured(
                "stability limits of Runge-Kutta methods by damping ratio",
                truth="bisection of |R(z)| = 1, independent of warpdyn",
                value=abs(stability_limit(method, zeta) - expected),
                bound=1e-12,
            )


@pytest.mark.parametrize("zeta", [*LIMITS, 100.0])
def test_limits_in_closed_form(zeta, measured):
    # Newmark's methods with gamma = 1/2: 1 / sqrt(1/4 - beta), whatever the damping. Velocity Verlet: an eigenvalue is
    # 1 where V = 2 zeta x is 2, and -1 where 4 - x^2 - 2 V + V^2 = 0. Lagged: it is -1 where 4 - x^2 - 2 V = 0.
    verlet = 2 * (np.sqrt(1 - 3 * zeta**2) - zeta) / (1 - 4 * zeta**2) if zeta < 0.5 else 1 / zeta
    limits = {
        METHODS["central_difference"]: 2.0,
        METHODS["newmark_linear"]: 2 * np.sqrt(3),
        ImplicitMethod("fox_goodwin", 2, beta=1 / 12): np.sqrt(6),
        METHODS["central_difference_lagged"]: 2 / (np.sqrt(1 + zeta**2) + zeta),
        METHODS["velocity_verlet"]: verlet,
        # An eigenvalue is -1 where x^2 + 4 V - 4 = 0.
        METHODS["leapfrog"]: 2 / (np.sqrt(1 + 4 * zeta**2) + 2 * zeta),
    }
    # Newmark's methods with gamma above 1/2 (Hughes, The Finite Element Method, 9.1).
    for beta, gamma in ((0.2, 0.6), (0.0, 0.75), (1 / 6, 0.52)):
        over = zeta * (gamma - 0.5)
        limits[ImplicitMethod("newmark", 1, beta, gamma)] = (over + np.sqrt(gamma / 2 - beta + over**2)) / (
            gamma / 2 - beta
        )
    for method, expected in limits.items():
        measured(
            "stability limits of Newmark's methods, velocity Verlet and central difference by damping ratio",
            truth="closed forms (Hughes, The Finite Element Method, 9.1)",
            value=abs(stability_limit(method, zeta) / expected - 1),
            bound=1e-12,
        )


@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.05, 0.1, 0.5, 1.0, 2.0])
def test_limit_of_stoermer_is_that_of_the_printed_formulas(zeta):
    # A motion z^n, put into both formulas of Hairer, Norsett and Wanner (III.1 and III.10), gives a polynomial in z.
    def largest_root(x):
        displacement = np.polymul([1, 0], [13 / 12, -1 / 6, 1 / 12])
        velocity = np.polymul([1, -1], [23 / 12, -4 / 3, 5 / 12])
        free = np.polymul([1, 0, 0], [1, -2, 1])
        return np.abs(np.roots(np.polyadd(free, np.polyadd(x**2 * displacement, 2 * zeta * x * velocity)))).max()

    limit = stability_limit(METHODS["stoermer"], zeta)
    if zeta == 0:
        assert limit == pytest.approx(3**0.5, abs=1e-9)  # z = -1 is a root at x^2 = 3
    assert largest_root(0.9999 * limit) < 1 + 1e-12
    assert largest_root(1.0001 * limit) > 1 + 1e-6


def test_limit_of_nystroem_without_damping():
    assert stability_limit(METHODS["nystroem4"], 0.0) == pytest.approx(2.586518894520, abs=6e-13)  # digits given


def radius(method, x, zeta):
    return np.abs(np.linalg.eigvals(method.amplification(x, np.asarray(zeta)))).max(axis=-1)


@pytest.mark.parametrize("zeta", [0.01, 0.08, 0.09825, 0.098285, 0.09829, 0.13, 0.3, 0.7, 1.0, 1.3, 30.0])
def test_limit_of_nystroem_matches_a_dense_scan(zeta):
    # Up to zeta = .0982857 the radius passes 1 near x = 3.04, at last for a few thousandths only, and then not again
    # before x = 3.157.
    x = np.linspace(0, 4, 400_001)[1:]
    grows = radius(METHODS["nystroem4"], x, zeta) > 1 + 1e-12
    # Scanned every 1e-5.
    assert stability_limit(METHODS["nystroem4"], zeta) == pytest.approx(x[grows.argmax()], abs=1.1e-5)


@pytest.mark.parametrize("name", UNLIMITED)
def test_methods_without_a_limit(name):
    method = METHODS[name]
    for zeta in [*LIMITS, 1e3, 1e6]:
        assert stability_limit(method, zeta) == np.inf
    assert (stable_step(method, [1.0, 300], [0.0, 2.5]) == np.inf).all()
    assert stable_step_of_eigenvalues(method, [[-1.0, -3j]], [3.0], [1.0]).tolist() == [np.inf]


def test_wilson_needs_its_theta():
    # No limit from theta = (1 + sqrt 3) / 2 = 1.36603 on (Bathe, Finite Element Procedures, 9.4).
    assert stability_limit(ImplicitMethod("wilson", 2, beta=1 / 6, extension=1.367), 0.0) == np.inf
    limit = stability_limit(below := ImplicitMethod("wilson", 2, beta=1 / 6, extension=1.36), 0.0)
    assert radius(below, limit * 0.999, 0.0) <= 1 < radius(below, limit * 1.001, 0.0)


def test_a_nystroem_method_that_always_grows_has_no_step():
    # Verlet's displacements with a velocity of Euler's: the determinant is 1 + x^2 / 2 without damping.
    method = ExplicitMethod("mine", 1, ((0,),), (1,), (0,), ((0,),), (0.5,))
    assert stability_limit(method, 0.0) == 0
    assert stable_step(method, 3.0, 0.0) == 0
    assert stability_limit(method, 0.5) > 0.5


@pytest.mark.parametrize("ulps", [[0, 0, 1, -1, 1], [0, 0, -1, 1, -1]])
def test_coefficients_with_the_rounding_of_a_tableau(ulps):
    # Products of a tableau's fractions miss 1/k! by a few ulp, which must not open a false limit near 0.
    rounded = np.array(METHODS["rk4"].stability_polynomial) * (1 + np.array(ulps) * 4e-16)
    for polynomial in (tuple(rounded), (*rounded, 0.0)):
        assert polynomial_limits(polynomial, np.zeros(1))[0] == pytest.approx(2.82842712474619, abs=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_limits_of_other_polynomials_match_a_dense_scan(seed):
    rng = np.random.default_rng(seed)
    stages = rng.integers(2, 9)
    order = rng.integers(1, stages + 1)
    polynomial = np.array([1 / factorial(k) for k in range(stages + 1)])
    polynomial[order + 1 :] *= rng.uniform(0.3, 1.7, stages - order)
    zeta = rng.uniform(0.01, 1, 4)
    for ratio, limit in zip(zeta, polynomial_limits(tuple(polynomial), zeta), strict=True):
        x = np.linspace(0, 60, 600_001)[1:]
        growth = np.abs(np.polyval(polynomial[::-1], x * (-ratio + 1j * np.sqrt(1 - ratio**2))))
        assert limit == pytest.approx(x[(growth > 1 + 1e-13).argmax()], abs=2e-4)  # the scan's spacing is 1e-4


def test_relaxation_limits():
    for methods, expected in zip(COLUMNS, REAL_AXIS, strict=True):
        for method in methods:
            assert relaxation_limit(method) == pytest.approx(expected, abs=1e-12), method.name
    rk4 = REAL_AXIS[3]  # of nystroem4's velocities too; implicit methods carry a memory by classical Runge-Kutta
    due = {"nystroem4": rk4, "velocity_verlet": 2, "central_difference_lagged": 2, "exact": np.inf}
    due |= {name: rk4 for name, method in METHODS.items() if isinstance(method, ImplicitMethod)}
    due["dormand_prince54"] = np.inf  # watches its error
    for name, expected in due.items():
        assert relaxation_limit(METHODS[name]) == pytest.approx(expected, abs=1e-12), name
