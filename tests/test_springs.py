"""The storey laws' device functions against hand-computed loops, closed forms and 12-digit integrals."""

import functools

import numpy as np
import pytest
import warp as wp
from law_rows import SPRINGS

from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.laws import LAWS

# Storeys of 100 N/m that yield at 1 N and 0.01 m; a tenth of the stiffness is left after yield.
STIFFNESS, YIELD_FORCE, YIELD_DRIFT, HARDENING = 100.0, 1.0, 0.01, 0.1


@functools.cache
def leaves(row: str) -> wp.Kernel:
    """Return a kernel that calls a row's three functions, one point a thread."""
    spring = SPRINGS[row]
    force, recoverable, evolve = (
        spring.force,
        spring.elastic_energy,
        spring.rate or spring.return_mapping or spring.force,
    )
    HAS_MEMORY = spring.memory > 0
    C, M = spring.coefficients, spring.memory
    coefficient_vector = wp.types.vector(length=C, dtype=wp.float64)
    memory_vector = wp.types.vector(length=max(1, M), dtype=wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        drift: wp.array(dtype=wp.float64),
        driver: wp.array(dtype=wp.float64),  # what `evolve` takes: the drift, or its rate
        memory: wp.array2d(dtype=wp.float64),  # [value, point]
        coefficients: wp.array2d(dtype=wp.float64),
        result: wp.array2d(dtype=wp.float64),
    ):
        i = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, i]
        before = memory_vector()
        for m in range(M):
            before[m] = memory[m, i]
        result[0, i] = force(drift[i], before, c)
        result[1, i] = recoverable(drift[i], before, c)
        if HAS_MEMORY:
            evolved = evolve(driver[i], before, c)
            for m in range(M):
                result[2 + m, i] = evolved[m]

    return evaluate


def evaluate(row, coefficients, drift, driver, memory):
    """Force, recoverable energy and evolved memory (or its rate) at each point; NaN where the kernel wrote nothing.

    Of several values of the memory, all start from those given; the results end with each of them.
    """
    drift, driver, memory = np.broadcast_arrays(*(np.atleast_1d(np.float64(x)) for x in (drift, driver, memory)))
    coefficients = np.broadcast_to(coefficients, (SPRINGS[row].coefficients, drift.size))
    values = max(1, SPRINGS[row].memory)
    given = (drift, driver, np.broadcast_to(memory, (values, drift.size)), coefficients)
    arrays = [wp.array(np.ascontiguousarray(a), dtype=wp.float64, device="cpu") for a in given]
    result = wp.full((2 + values, drift.size), np.nan, dtype=wp.float64, device="cpu")
    wp.launch(loaded(leaves(row)), dim=drift.size, inputs=[*arrays, result], device="cpu")
    return result.numpy()


def law(name, **parameters):
    """The row of SPRINGS and its coefficients [coefficient, storey], as a scene with these parameters has them."""
    parameters = {"stiffness": STIFFNESS, "yield_force": YIELD_FORCE, "hardening_ratio": HARDENING} | parameters
    arrays = dict(zip(parameters, np.broadcast_arrays(*map(np.atleast_1d, parameters.values())), strict=True))
    arrays = {key: array[None, :] for key, array in arrays.items()}
    row = LAWS[name].spring(arrays)
    return row, np.array([c[0] for c in LAWS[name].coefficients(arrays, row)])


def bouc_wen(exponent, beta=0.5, gamma=0.5, **parameters):
    return law("bouc_wen", exponent=exponent, beta=beta, gamma=gamma, **parameters)


def push(row, coefficients, targets, step):
    """Drive Bouc-Wen storeys from z = 0 through drifts in units of yield by RK4 in the drift; z and integral z du."""
    count = coefficients.shape[1]
    z, area, at = np.zeros(count), np.zeros(count), 0.0
    at_targets = []
    for target in targets:
        steps = round(abs(target - at) / step)
        direction = np.sign(target - at)
        h = abs(target - at) / steps

        def rate(z, direction=direction):  # the device function takes m/s: one yield drift a second is one unit of u
            return evaluate(row, coefficients, 0.0, direction * YIELD_DRIFT, z)[2]

        for _ in range(steps):
            k1 = rate(z)
            z2 = z + h / 2 * k1
            k2 = rate(z2)
            z3 = z + h / 2 * k2
            k3 = rate(z3)
            z4 = z + h * k3
            area = area + direction * h / 6 * (z + 2 * z2 + 2 * z3 + z4)
            z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(z4))
        at = target
        at_targets.append((z, area))
    return np.array(at_targets)


def test_every_row_writes_all_it_should():
    for row, spring in SPRINGS.items():
        result = evaluate(row, np.full((spring.coefficients, 1), 0.5), [0.3], [0.2], [0.1])
        assert np.isfinite(result[: 2 + spring.memory]).all(), row


def test_elastic():
    drift = np.array([-0.02, 0.0, 0.013])
    row, coefficients = law("elastic")
    force, recoverable, _ = evaluate(row, coefficients, drift, 0, 0)
    np.testing.assert_allclose(force, [-2.0, 0.0, 1.3], rtol=1e-15)
    np.testing.assert_allclose(recoverable, [0.02, 0.0, 0.00845], rtol=1e-15)


# Drift [m], force [N], plastic drift [m] and dissipated energy [J] on a loop, by hand: 100 N/m to yield, 10 N/m after
# it, 2 N of elastic range; each 0.01 m of plastic flow against (1 - 0.1) 1 N dissipates 0.009 J.
LOOP = [
    (0.005, 0.5, 0.0, 0.0),
    (0.010, 1.0, 0.0, 0.0),
    (0.020, 1.1, 0.01, 0.009),
    (0.005, -0.4, 0.01, 0.009),
    (0.000, -0.9, 0.01, 0.009),
    (-0.020, -1.1, -0.01, 0.027),
    (0.000, 0.9, -0.01, 0.027),
    (0.020, 1.1, 0.01, 0.045),
    (0.030, 1.2, 0.02, 0.054),
]


def test_bilinear_return_mapping():
    row, coefficients = law("bilinear")
    plastic = work = before = last = 0.0
    for drift, force, plastic_drift, dissipated in LOOP:
        # The force asked for from the memory of the last accepted step, as a trial stage does.
        trial, _, mapped = evaluate(row, coefficients, drift, drift, plastic)[:, 0]
        plastic = mapped
        committed, recoverable, again = evaluate(row, coefficients, drift, drift, plastic)[:, 0]
        # Rounding of forces of 1 N and drifts of 0.01 m.
        assert trial == pytest.approx(force, abs=1e-14)
        assert committed == pytest.approx(force, abs=1e-14)
        assert mapped == pytest.approx(plastic_drift, abs=1e-16)
        assert again == mapped
        work += (force + before) / 2 * (drift - last)  # exact: the loop lists every corner of the path
        assert recoverable == pytest.approx(work - dissipated, abs=1e-16)
        before, last = force, drift


def test_bilinear_without_hardening_keeps_its_yield_force():
    row, coefficients = law("bilinear", hardening_ratio=0.0)
    force = evaluate(row, coefficients, [-0.5, -0.01, 0.004, 0.01, 0.5], 0, 0)[0]
    np.testing.assert_allclose(force, [-1, -1, 0.4, 1, 1], rtol=1e-15)


# Each bound on Bouc-Wen below is the error constant of RK4 for its integral, measured and rounded up by a half or so,
# times the fourth power of the step: halving the step must take 16 times the error off.
STEPS = pytest.mark.parametrize("step", [0.1, 0.05, 0.025])


@STEPS
def test_bouc_wen_pushed_monotonically(step):
    drift = np.array([0.5, 1.0, 2.0])
    rows = {"bouc_wen_1_elastic_unloading": (1.0, 1 - np.exp(-drift), 0.005), "bouc_wen_2": (2.0, np.tanh(drift), 0.02)}
    for name, (exponent, expected, constant) in rows.items():
        row, coefficients = bouc_wen(exponent)
        assert row == name
        z = push(row, coefficients, drift, step)[:, 0, 0]
        np.testing.assert_allclose(z, expected, rtol=0, atol=constant * step**4)
    row, coefficients = bouc_wen(np.array([3.0, 5.0, 10.0]))
    assert row == "bouc_wen"
    z = push(row, coefficients, [1.0], step)[0, 0]
    constant = np.array([0.05, 0.18, 1.2])  # the bend at yield sharpens with the exponent
    assert (np.abs(z - [0.8230405355016, 0.8830224247924, 0.936596963131]) < constant * step**4).all()


@STEPS
@pytest.mark.parametrize("row", ["bouc_wen_2", "bouc_wen"])
def test_bouc_wen_cycled(step, row):
    coefficients = bouc_wen(2.0)[1]
    if row == "bouc_wen":
        coefficients = np.insert(coefficients, 5, 2.0, axis=0)
    z, area = push(row, coefficients, [2.0, -2.0, 2.0, -2.0], step)[:, :, 0].T
    expected = [0.964027580076, -0.995397251646, 0.995099957222, -0.995102862735]
    np.testing.assert_allclose(z, expected, rtol=0, atol=0.02 * step**4)
    expected = [1.325002747358, 3.205457425557, 5.023958176661, 6.843050647726]
    np.testing.assert_allclose(area, expected, rtol=0, atol=0.7 * step**4)


@pytest.mark.parametrize("beta", [0.5, 0.35, 2.0])
def test_bouc_wen_of_elastic_unloading_is_the_general_law_with_z_over_its_bound(beta):
    random = np.random.default_rng(2)
    velocity, drift, z = random.normal(size=(3, 200))
    z[0] = velocity[1] = 0.0
    row, coefficients = bouc_wen(1.0, beta=beta, gamma=beta)
    assert row == "bouc_wen_1_elastic_unloading"
    force, recoverable, rate = evaluate(row, coefficients, drift, velocity, 2 * beta * z)
    # What the law says, of 10 N/m beside 0.9 N at z = 1, which 90 N/m would reach at 0.01 m.
    flow = velocity - beta * np.abs(z) * (np.abs(velocity) * np.sign(z) + velocity)
    np.testing.assert_allclose(force, 10 * drift + 0.9 * z, rtol=0, atol=1e-13)
    np.testing.assert_allclose(recoverable, 5 * drift**2 + 0.0045 * z**2, rtol=0, atol=1e-13)
    # A few roundings of rates of up to 400 |v| (1 + 4 |z|).
    np.testing.assert_allclose(rate, 2 * beta * flow / YIELD_DRIFT, rtol=0, atol=1e-11)


def test_bouc_wen_of_elastic_unloading_unloads_along_a_straight_line():
    row, coefficients = bouc_wen(1.0, beta=0.8, gamma=0.8)
    rate = evaluate(row, coefficients, 0.0, [-0.02, 0.02, -0.02], [0.3, -0.7, 1.0])[2]
    # At the initial slope, one yield drift over the bound 1 / 1.6 of z, to the last bit.
    np.testing.assert_array_equal(rate, np.array([-0.02, 0.02, -0.02]) * coefficients[2, 0])


@STEPS
def test_bouc_wen_tells_beta_from_gamma(step):
    # n = 1: z' = 1 - (beta + gamma) z going up, and -1 - (beta - gamma) z coming down while z > 0.
    row, coefficients = bouc_wen(1.0, beta=0.7, gamma=0.3)
    up, down = push(row, coefficients, [2.0, 1.5], step)[:, 0, 0]
    assert up == pytest.approx(1 - np.exp(-2), abs=0.004 * step**4)
    assert down == pytest.approx((1 - np.exp(-2) + 2.5) * np.exp(-0.2) - 2.5, abs=0.004 * step**4)


def test_bouc_wen_force_and_recoverable_energy():
    for exponent in (1.0, 2.0, 1.5):
        row, coefficients = bouc_wen(exponent)
        force, recoverable, _ = evaluate(row, coefficients, [0.02, -0.02, 0.02], 0, [0.5, -0.5, 0.0])
        # 10 N/m beside 0.9 N at z = 1, which 90 N/m would reach at 0.01 m.
        np.testing.assert_allclose(force, [0.65, -0.65, 0.2], rtol=1e-15)
        np.testing.assert_allclose(recoverable, [0.002 + 0.001125, 0.002 + 0.001125, 0.002], rtol=1e-15)


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_rows_of_whole_exponents_equal_the_general_row(exponent):
    random = np.random.default_rng(1)
    velocity, memory = random.normal(size=(2, 200))
    memory[0] = velocity[1] = 0.0
    row, coefficients = bouc_wen(exponent, beta=0.6, gamma=-0.2)
    general = np.insert(coefficients, 5, exponent, axis=0)
    whole = evaluate(row, coefficients, velocity, velocity, memory)
    # A few roundings of rates of up to 100 |v| (1 + |z|^3).
    np.testing.assert_allclose(evaluate("bouc_wen", general, velocity, velocity, memory), whole, rtol=0, atol=1e-12)
    sign = np.sign(memory)
    expected = velocity - np.abs(memory) ** exponent * (0.6 * np.abs(velocity) * sign - 0.2 * velocity)
    np.testing.assert_allclose(whole[2], expected / YIELD_DRIFT, rtol=0, atol=1e-12)
