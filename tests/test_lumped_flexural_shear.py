"""Flexural-shear cantilever and sticks: reference values, closed forms, and independent integration."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import peak, pulse, response
from printed_digits import half_unit
from scipy.integrate import quad
from scipy.linalg import eigh

from warpdyn.model.structures.lumped import flexural_shear as fs, sticks
from warpdyn.model.structures.modal import modal_damping_matrix

pytestmark = pytest.mark.fast
# alpha0: gamma 1 to 3, f2 / f1, f3 / f1, participation factors 1 and 2 (computed independently, 7 printed digits).
TABLE = {
    1: (1.90802, 4.718269, 7.862726, 5.536552, 15.16223, 1.55236, -0.852991),
    2: (1.943708, 4.780851, 7.885671, 4.570514, 11.83449, 1.51644, -0.813154),
    3: (1.937759, 4.859037, 7.920777, 4.009486, 9.694065, 1.47117, -0.7611),
    5: (1.866703, 4.987312, 8.009587, 3.535251, 7.591001, 1.39428, -0.663397),
    8: (1.773891, 5.05168, 8.125928, 3.288178, 6.374654, 1.33404, -0.567727),
    10: (1.735126, 5.044447, 8.170046, 3.208269, 5.990802, 1.3147, -0.529455),
    20: (1.652392, 4.933729, 8.161342, 3.064876, 5.316394, 1.28455, -0.456883),
}
HEIGHT, STOREYS, MASS, PERIOD, ALPHA0 = 60.0, 20, 400e3, 2.0, 4.0
BENDING, SHEAR = 2.39250923e11, 1.06333744e9
STOREY_HEIGHT = np.full(STOREYS, HEIGHT / STOREYS)


@pytest.mark.parametrize("alpha0", TABLE)
def test_eigenvalues_frequencies_and_participation_have_the_values_of_the_table(alpha0: int) -> None:
    *gamma, f2, f3, first, second = TABLE[alpha0]
    found = fs.flexural_shear_eigenvalues(alpha0, 3)
    for value, printed in zip(found, gamma, strict=True):
        assert value == pytest.approx(printed, rel=0, abs=half_unit(printed, 7))
    ratios = 1 / fs.flexural_shear_period_ratios(alpha0, 3)
    assert ratios[0] == 1
    for value, printed in zip(ratios[1:], (f2, f3), strict=True):
        assert value == pytest.approx(printed, rel=0, abs=half_unit(printed, 7))
    for value, printed in zip(fs.flexural_shear_participation(alpha0, 2), (first, second), strict=True):
        assert value == pytest.approx(printed, rel=0, abs=half_unit(printed, 6))


def test_the_limits_are_a_flexural_beam_and_a_shear_beam() -> None:
    # cos(g) cosh(g) = -1
    flexural = fs.flexural_shear_eigenvalues(0.0, 5)
    assert np.cos(flexural) + 1 / np.cosh(flexural) == pytest.approx(np.zeros(5), abs=1e-13)
    assert flexural[0] == pytest.approx(1.8751040687119611, rel=1e-14)
    shear = fs.flexural_shear_eigenvalues(1e6, 4)
    assert shear == pytest.approx(np.pi * (np.arange(1, 5) - 0.5), rel=3e-6)
    assert 1 / fs.flexural_shear_period_ratios(1e6, 4) == pytest.approx([1, 3, 5, 7], rel=1e-5)
    x = np.linspace(0, 1, 11)
    sines = np.sin(np.outer(np.pi * (np.arange(1, 5) - 0.5), x)) * np.array([[1], [-1], [1], [-1]])
    assert fs.flexural_shear_mode_shapes(1e6, 4, x) == pytest.approx(sines, abs=2e-5)
    numbers = 4 / np.pi / (2 * np.arange(1, 5) - 1) * [1, -1, 1, -1]
    assert fs.flexural_shear_participation(1e6, 4) == pytest.approx(numbers, rel=1e-5)


@pytest.mark.parametrize("alpha0", [0.0, 1.0, 4.0, 10.0])
def test_shapes_are_those_of_the_formula_with_hyperbolic_functions(alpha0: float) -> None:
    x = np.linspace(0, 1, 9)
    gamma = fs.flexural_shear_eigenvalues(alpha0, 3)
    for g, shape in zip(gamma, fs.flexural_shear_mode_shapes(alpha0, 3, x), strict=True):
        b = np.hypot(g, alpha0)
        eta = (g**2 * np.sin(g) + g * b * np.sinh(b)) / (g**2 * np.cos(g) + b**2 * np.cosh(b))
        of_source = np.sin(g * x) - g / b * np.sinh(b * x) + eta * (np.cosh(b * x) - np.cos(g * x))
        assert shape == pytest.approx(of_source / of_source[-1], abs=1e-10)
        assert shape[0] == pytest.approx(0, abs=1e-15)
        # Characteristic equation, not divided by cosh(b).
        residual = 2 + (2 + alpha0**4 / (g * b) ** 2) * np.cos(g) * np.cosh(b)
        residual += alpha0**2 / (g * b) * np.sin(g) * np.sinh(b)
        assert residual / np.cosh(b) == pytest.approx(0, abs=1e-13)


@pytest.mark.parametrize("alpha0", [0.0, 4.0, 30.0, 1000.0])
def test_shapes_and_frequencies_are_those_of_finite_elements(alpha0: float) -> None:
    nodes = np.linspace(0, 1, 61)
    if alpha0 > 10:  # shorter elements at the ends resolve boundary layers, whose thickness is 1 / alpha0
        nodes = (1 - np.cos(np.pi * np.arange(101) / 100)) / 2
    mass, stiffness = sticks.consistent_stick(np.diff(nodes), 1.0, alpha0**2, 1.0)
    inverse, vectors = eigh(mass, stiffness)  # the largest eigenvalues are the most precise ones
    inverse, vectors = inverse[:-4:-1], vectors[:, :-4:-1]
    gamma = fs.flexural_shear_eigenvalues(alpha0, 3)
    assert gamma * np.hypot(gamma, alpha0) == pytest.approx(1 / np.sqrt(inverse), rel=1e-6)
    shapes = vectors[::2] / vectors[-2]
    assert fs.flexural_shear_mode_shapes(alpha0, 3, nodes[1:]) == pytest.approx(shapes.T, abs=1e-5)


@pytest.mark.parametrize("alpha0", [0.0, 2.0, 25.0])
def test_participation_is_that_of_the_integrals(alpha0: float) -> None:
    for i, value in enumerate(fs.flexural_shear_participation(alpha0, 4)):

        def phi(z: float, i: int = i) -> float:
            return float(fs.flexural_shear_mode_shapes(alpha0, i + 1, z)[i, 0])

        above = quad(phi, 0, 1, epsabs=1e-12)[0]
        assert value == pytest.approx(above / quad(lambda z: phi(z) ** 2, 0, 1, epsabs=1e-12)[0], rel=1e-9)


@pytest.mark.parametrize("alpha0", [0.0, 3.0, 100.0])
def test_effective_masses_add_up_to_the_whole_mass(alpha0: float) -> None:
    # Effective mass of a mode: Gamma^2 int phi^2 = Gamma int phi; here from shapes at many heights.
    x, weights = np.polynomial.legendre.leggauss(400)
    shapes = fs.flexural_shear_mode_shapes(alpha0, 60, (x + 1) / 2)
    integrals = shapes @ weights / 2
    masses = fs.flexural_shear_participation(alpha0, 60) * integrals
    assert 1 - 1.1 / 60 < masses.sum() < 1
    assert (masses > 0).all()


def test_stiffness_has_the_given_period() -> None:
    bending, shear = fs.flexural_shear_stiffness(PERIOD, HEIGHT, STOREYS * MASS / HEIGHT, ALPHA0)
    assert bending == pytest.approx(BENDING, rel=1e-8)
    assert shear == pytest.approx(SHEAR, rel=1e-8)
    gamma = fs.flexural_shear_eigenvalues(ALPHA0, 5)
    assert gamma == pytest.approx([1.90555753, 4.93161282, 7.96373105, 11.0565582, 14.1753535], rel=4e-9)
    factors = fs.flexural_shear_participation(ALPHA0, 5)
    assert factors == pytest.approx([1.428708, -0.7091753, 0.4817296, -0.3561144, 0.2801176], abs=5.1e-7)
    periods = fs.flexural_shear_periods(bending, shear, HEIGHT, STOREYS * MASS / HEIGHT, 5)
    assert 1 / periods == pytest.approx([0.5, 1.854508, 4.203, 7.698811, 12.36458], rel=3e-7)


def test_stiffness_and_periods_are_inverse_for_small_numbers_too() -> None:
    bending, shear = fs.flexural_shear_stiffness(0.5, 0.9, 0.4, 0.3)
    assert fs.flexural_shear_periods(bending, shear, 0.9, 0.4, 1)[0] == pytest.approx(0.5, rel=1e-12)
    assert fs.flexural_shear_periods(0.5, 0.1, 0.9, 0.4, 1)[0] > fs.flexural_shear_periods(0.5, 0.2, 0.9, 0.4, 1)[0]


@pytest.mark.parametrize("alpha0", [0.0, 0.5, 4.0, 20.0, 1e3])
def test_alpha0_is_found_from_two_periods(alpha0: float) -> None:
    ratio = fs.flexural_shear_period_ratios(alpha0, 2)[1]
    assert fs.alpha0_of_period_ratio(ratio) == pytest.approx(alpha0, rel=1e-8, abs=1e-5)


def stick_frequencies(**changes) -> np.ndarray:
    stick = sticks.lumped_stick(STOREY_HEIGHT, BENDING, SHEAR, changes.get("mass", MASS))
    return 1 / stick.periods[:5]


def test_sticks_have_the_frequencies_of_the_table() -> None:
    mass, stiffness = sticks.consistent_stick(STOREY_HEIGHT, BENDING, SHEAR, MASS * STOREYS / HEIGHT)
    frequencies = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:5]) / (2 * np.pi)
    assert frequencies == pytest.approx([0.5000002, 1.854513, 4.203067, 7.69927, 12.36659], rel=5e-7)
    half = np.full(STOREYS, MASS)
    half[-1] /= 2
    assert stick_frequencies(mass=half) == pytest.approx([0.4995286, 1.84697, 4.171661, 7.618575, 12.2011], rel=5e-7)
    full = stick_frequencies()
    assert full == pytest.approx([0.4818632, 1.765076, 3.996459, 7.333397, 11.79809], rel=5e-7)
    assert 1 - full[0] / 0.5 == pytest.approx(0.036, abs=5e-4)  # the first frequency is 3.6 % too low


def test_a_consistent_stick_approaches_the_continuum_with_the_fourth_power_of_the_storey_height() -> None:
    errors = []
    for storeys in (4, 8):
        mass, stiffness = sticks.consistent_stick([HEIGHT / storeys] * storeys, BENDING, SHEAR, MASS * STOREYS / HEIGHT)
        omega = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[1])
        exact = fs.flexural_shear_periods(BENDING, SHEAR, HEIGHT, MASS * STOREYS / HEIGHT, 2)[1]
        errors.append(omega * exact / (2 * np.pi) - 1)
    assert errors[1] > 0
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.1)


def test_a_stick_of_a_period_has_the_period() -> None:
    stick = sticks.stick_of_period(PERIOD, STOREY_HEIGHT, MASS, ALPHA0)
    assert stick.periods[0] == pytest.approx(PERIOD, rel=1e-10)
    ratio = HEIGHT * np.sqrt(stick.shear_stiffness / stick.bending_stiffness)
    assert ratio == pytest.approx(np.full(STOREYS, ALPHA0), rel=1e-12)
    uneven = sticks.stick_of_period(1.3, [4.5, *[3.2] * 7], np.linspace(5e5, 3e5, 8), 2.0)
    assert uneven.periods[0] == pytest.approx(1.3, rel=1e-10)


def test_the_response_of_a_stick_has_the_reference_values() -> None:
    stick = sticks.lumped_stick(STOREY_HEIGHT, BENDING, SHEAR, MASS)
    damping = modal_damping_matrix(stick.mass, stick.stiffness, 0.03)
    motion = pulse(2.0, 1.2, 0.4, 12.0)
    found = response(np.diag(stick.mass), damping, stick.stiffness, stick.mass, motion)
    time, u, v = found["time"], found["u"], found["v"]
    assert peak(time, u[:, -1], v[:, -1]) == pytest.approx((0.3196972, 1.5473), rel=1e-4)
    assert peak(time, u[:, -1], v[:, -1])[0] == pytest.approx(0.3196972, rel=3e-7)
    drift, rate = (np.diff(each, axis=1, prepend=0) / 3.0 for each in (u, v))
    peaks = [peak(time, drift[:, i], rate[:, i])[0] for i in range(STOREYS)]
    assert max(peaks) == pytest.approx(0.006811623, rel=3e-7)
    total = found["a"] + found["ground"]
    jerk = np.gradient(total[:, 9], time)
    assert peak(time, total[:, 9], jerk)[0] == pytest.approx(1.710967, rel=1e-6)
    # The base shear is the sum of shear spring and beam in the first storey: the sum of the floors' elastic forces.
    shear, rate = (each @ stick.stiffness.sum(axis=0) for each in (u, v))
    assert peak(time, shear, rate)[0] == pytest.approx(9321352, rel=3e-7)


def test_one_storey_has_the_closed_form() -> None:
    stick = sticks.lumped_stick([3.0], 2e8, 5e7, 1e4)
    assert stick.stiffness[0, 0] == pytest.approx(3 * 2e8 / 27 + 5e7 / 3, rel=1e-14)
    assert stick.rotations[0, 0] == pytest.approx(1.5 / 3.0, rel=1e-14)  # of a cantilever under a load at its end


def test_a_stick_whose_base_rotates_resists_only_bending() -> None:
    heights, bending = [4.0, 3.0, 3.5], [3e9, 2e9, 1e9]
    matrix = sticks.bending_matrix_with_base_rotation(heights, bending)
    scale = np.abs(matrix).max()
    assert matrix @ [1.0, *np.cumsum(heights)] == pytest.approx(np.zeros(4), abs=1e-12 * scale)
    fixed = sticks.lumped_stick(heights, bending, 0.0, 1e5).bending_matrix
    assert matrix[1:, 1:] == pytest.approx(fixed, rel=1e-12)
    one = sticks.bending_matrix_with_base_rotation([3.0], 2e8)
    assert one == pytest.approx(3 * 2e8 / 27 * np.array([[9.0, -3.0], [-3.0, 1.0]]), rel=1e-12)


def test_many_modes_have_finite_values() -> None:
    for alpha0 in (0.0, 50.0):
        gamma = fs.flexural_shear_eigenvalues(alpha0, 300)
        assert np.diff(gamma)[100:] == pytest.approx(np.full(199, np.pi), rel=1e-3)
        assert np.abs(fs.flexural_shear_participation(alpha0, 300)).max() == pytest.approx(1.4, abs=0.2)
        assert np.isfinite(fs.flexural_shear_mode_shapes(alpha0, 300, [0.0, 0.3, 1.0])).all()


def test_a_cantilever_under_a_load_at_the_top_has_the_closed_form() -> None:
    heights = np.array([4.0, 3.0, 3.5])
    z, total, bending, load = np.cumsum(heights), heights.sum(), 2e9, 1e6
    stick = sticks.lumped_stick(heights, bending, 0.0, 1e5)
    u = np.linalg.solve(stick.stiffness, [0, 0, load])
    assert u == pytest.approx(load * z**2 * (3 * total - z) / (6 * bending), rel=1e-10)
    assert stick.rotations @ u == pytest.approx(load * z * (2 * total - z) / (2 * bending), rel=1e-10)


def test_condensation_is_exact_and_recovers_the_removed_displacements() -> None:
    random = np.random.default_rng(1)
    root = random.normal(size=(6, 6))
    stiffness = root @ root.T
    condensed, recovery = sticks.static_condensation(stiffness, [4, 0])
    force = np.zeros(6)
    force[[4, 0]] = 1.0, -2.0
    full = np.linalg.solve(stiffness, force)
    kept = np.linalg.solve(condensed, [1.0, -2.0])
    assert full[[4, 0]] == pytest.approx(kept, rel=1e-10)
    assert recovery @ kept == pytest.approx(full, rel=1e-9)
    everything, identity = sticks.static_condensation(stiffness, np.arange(6))
    assert everything == pytest.approx(stiffness)
    assert identity == pytest.approx(np.eye(6))


WRONG = [
    (lambda: fs.flexural_shear_eigenvalues(-1.0, 2), "alpha0 must be a finite number of at least 0"),
    (lambda: fs.flexural_shear_eigenvalues(1e7, 2), "alpha0 is 1e\\+07; it must be at most 1e\\+06"),
    (lambda: fs.flexural_shear_eigenvalues(1.0, 0), "modes must be a whole number of at least 1"),
    (lambda: fs.flexural_shear_mode_shapes(1.0, 1, [0.0, 30.0]), "from 0 to 1, .*divide heights"),
    (lambda: fs.flexural_shear_stiffness(0.0, 60.0, 1e5, 4.0), "period"),
    (lambda: fs.flexural_shear_stiffness(2.0, 60.0, -1e5, 4.0), "mass_per_height"),
    (lambda: fs.alpha0_of_period_ratio(0.4), "0.159569 .flexural beam. to 0.333333"),
    (lambda: fs.alpha0_of_period_ratio(0.1), "0.159569 .flexural beam. to 0.333333"),
    (
        lambda: sticks.lumped_stick([3.0, 3.0], 1e9, 1e8, [1e5] * 3),
        r"floor_mass must be one value or one per storey \(2\), .* got shape \[3\]",
    ),
    (lambda: sticks.lumped_stick([3.0, -3.0], 1e9, 1e8, 1e5), "storey_height of storey 2 is -3 m; it must be above 0"),
    (
        lambda: sticks.lumped_stick([3.0, 3.0], 1e9, [1e8, -1], 1e5),
        "shear_stiffness of storey 2 is -1 N; .* at least 0",
    ),
    (lambda: sticks.lumped_stick(3.0, 1e9, 1e8, 1e5), "storey_height must be a list with one value per storey"),
    (lambda: sticks.static_condensation([[1.0, 2.0]], [0]), "square"),
    (lambda: sticks.static_condensation([[1.0, 2.0], [0.0, 1.0]], [0]), "not symmetric"),
    (lambda: sticks.static_condensation(np.eye(2), [2]), "indices from 0 to 1"),
    (lambda: sticks.static_condensation(np.eye(2), [0, 0]), "index twice"),
    (lambda: sticks.static_condensation(np.diag([1.0, 0.0]), [0]), r"\[1\] can move although the kept ones are fixed"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_invalid_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
