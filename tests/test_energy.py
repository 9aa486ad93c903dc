"""The energy balance closes at the method's order in every model, and its terms are those of exact responses."""

from itertools import pairwise

import numpy as np
import pytest
from matrices import chain_matrix
from scipy.integrate import simpson
from scipy.linalg import eigh

import warpdyn as wd
from warpdyn.truth import harmonic_response, piecewise_linear_response

pytestmark = pytest.mark.meant_as_given("yield_base_shear_coefficient", "yield_drift_ratio")

# Three storeys of 9, 29 and 45 rad/s.
MASS, STIFFNESS = np.array([2000.0, 1500.0, 1000.0]), np.array([1.2e6, 9e5, 5e5])
STRENGTH = [8e3, 5e3, 2.4e3]
RATIO, COEFFICIENT = 0.05, np.array([4e3, 3e3, 2e3])
DAMPING = {
    "none": {},
    "storey": {"damping_coefficient": COEFFICIENT},
    "rayleigh": {"damping_ratio": RATIO},
    "modal": {"damping_ratio": RATIO},
}
# From rest to rest, so that the free vibration after it begins without a jump of the load.
PULSE = 3.0 * np.sin(np.linspace(0, 3, 41) ** 2 * 3) * np.hanning(41)
FORCE = 1e3 * np.stack([PULSE, PULSE[::-1], PULSE**2], axis=1)
INTERVAL, TAIL = 0.05, 0.5
START = np.array([0.01, 0.02, 0.04]), np.array([0.5, -0.2, 0.3])
AMPLITUDE, FREQUENCY, DURATION = np.array([3e3, 0, 2e3]), 12.0, 2.0
LOADS = {
    "base": wd.GroundMotion(PULSE, INTERVAL),
    "force": wd.ForceHistory(FORCE, INTERVAL),
    "harmonic": wd.HarmonicForce(AMPLITUDE, FREQUENCY, DURATION),
    "free": wd.FreeVibration(DURATION, *START),
    # Over before any storey turns back.
    "push": wd.FreeVibration(0.1, velocity=[0.3, 0.6, 0.9]),
}
STEPS = (0.0025, 0.00125, 0.000625)


def damping_matrix(damping):
    """Damping matrix of the chain, by textbook formulas."""
    stiffness = chain_matrix(STIFFNESS)
    eigenvalue, shapes = eigh(stiffness, np.diag(MASS))
    omega = np.sqrt(eigenvalue)
    if damping == "storey":
        return chain_matrix(COEFFICIENT)
    if damping == "rayleigh":
        return 2 * RATIO / (omega[0] + omega[1]) * (omega[0] * omega[1] * np.diag(MASS) + stiffness)
    if damping == "modal":
        return (MASS[:, None] * shapes * (2 * RATIO * omega)) @ (shapes.T * MASS)
    return np.zeros((3, 3))


def balance_errors(structure, load):
    """Return the run at each step, and the order at which the balance's error falls from the first to the last."""
    runs = []
    for step in STEPS:
        # What test_linear.py records too, so that a kernel serves both.
        recorders = None if structure.family == "dense" else ("energy",)
        scene = wd.Scene(structure, LOADS[load], recorders=recorders, tail=TAIL)
        runs.append(wd.simulate(scene, step=step, dtype="float64", device="cpu"))
    errors = np.abs([run.energy_balance_error.item() for run in runs])
    assert errors[-1] < 1e-8  # of the energy supplied: closed, not only closing
    return runs, np.log2(errors[0] / errors[-1]) / 2


def exact_energies(damping, load):
    """Return input and viscous energy by Simpson's rule over the exact response, and the largest energy supplied."""
    step = STEPS[-1]
    stiffness = chain_matrix(STIFFNESS)
    if load == "harmonic":
        time = step * np.arange(round(DURATION / step) + 1)
        velocity = harmonic_response(MASS, damping, stiffness, AMPLITUDE, FREQUENCY, 0.0, time)[1]
        force = np.outer(np.sin(FREQUENCY * time), AMPLITUDE)
        start = 0.0
    else:
        nodes = INTERVAL * np.arange(41)
        end = DURATION if load == "free" else DURATION + TAIL
        time = step * np.arange(round(end / step) + 1)
        sampled = {"base": -np.outer(PULSE, MASS), "force": FORCE, "free": np.zeros((41, 3))}[load]
        force = np.stack([np.interp(time, nodes, column) for column in sampled.T], axis=1)
        state = START if load == "free" else ()
        velocity = piecewise_linear_response(MASS, damping, stiffness, force, step, *state)[1]
        start = 0.5 * (START[0] @ stiffness @ START[0] + MASS @ START[1] ** 2) if load == "free" else 0.0
    power, viscous = (force * velocity).sum(axis=1), np.einsum("ti,ij,tj->t", velocity, damping, velocity)
    return simpson(power, dx=step), simpson(viscous, dx=step), start + abs(simpson(power, dx=step))


def check_energies(run, damping, load):
    # The phase of 45 rad/s is off by (w h)^4 / 120 = 5e-9 a radian at the finest step, for 110 radians.
    input_energy, viscous_energy, supplied = exact_energies(damping, load)
    assert run.input_energy.item() == pytest.approx(input_energy, abs=1e-6 * supplied)
    assert run.viscous_energy.item() == pytest.approx(viscous_energy, abs=1e-6 * supplied)


# Each kind of damping and of load, twice at least in all, with different partners.
@pytest.mark.parametrize(
    ("damping", "load"),
    [
        pytest.param("none", "harmonic", marks=pytest.mark.thorough),
        ("storey", "base"),
        pytest.param("rayleigh", "force", marks=pytest.mark.thorough),
        ("modal", "free"),
        pytest.param("none", "base", marks=[pytest.mark.thorough, pytest.mark.meant_as_given("no_damping")]),
        pytest.param("storey", "free", marks=pytest.mark.thorough),
        pytest.param("rayleigh", "harmonic", marks=pytest.mark.thorough),
        pytest.param("modal", "force", marks=pytest.mark.thorough),
    ],
)
def test_elastic_chain(damping, load, measured):
    building = wd.ShearBuilding(MASS, STIFFNESS, 3.0, damping=damping, **DAMPING[damping])
    runs, order = balance_errors(building, load)
    assert 3.6 < order < 4.4  # the method's own
    measured(
        "error of the energy balance of elastic chains, RK4 at 0.6 ms, over the energy supplied",
        truth="conservation of energy",
        value=abs(runs[-1].energy_balance_error.item()),
        bound=1e-8,
    )
    check_energies(runs[-1], damping_matrix(damping), load)
    for run, step in zip(runs, STEPS, strict=True):
        # An elastic storey gives back all it took: what seems lost of a thousand joules is the method's error.
        assert np.abs(run.hysteretic_energy).max() < 5e6 * step**4


def test_energies_of_velocity_verlet_where_the_motion_jumps_from_step_to_step():
    noise = wd.GroundMotion(3 * np.random.default_rng(1).normal(size=1001) * np.hanning(1001), 0.01)
    building = wd.ShearBuilding(MASS, STIFFNESS, 3.0, damping="rayleigh", damping_ratio=RATIO)
    damping, fine = damping_matrix("rayleigh"), 0.0005
    time = fine * np.arange(20001)
    force = -np.outer(np.interp(time, 0.01 * np.arange(1001), noise.acceleration), MASS)
    velocity = piecewise_linear_response(MASS, damping, chain_matrix(STIFFNESS), force, fine)[1]
    given = simpson((force * velocity).sum(axis=1), dx=fine)
    lost = simpson(np.einsum("ti,ij,tj->t", velocity, damping, velocity), dx=fine)
    errors = []
    for step in (0.01, 0.005, 0.0025):
        scene = wd.Scene(building, noise, recorders=("energy",), tail=0.0)
        found = wd.simulate(scene, method="velocity_verlet", step=step, dtype="float64", device="cpu")
        errors.append(np.array([found.input_energy.item() / given - 1, found.viscous_energy.item() / lost - 1]))
        assert abs(found.energy_balance_error.item()) < 1.5 * np.abs(errors[-1]).max()
    assert np.abs(errors[0]).max() < 0.2  # a step of 0.45 rad of the third mode
    # Second order: a quarter with every half of the step, about.
    assert np.abs(errors[1]).max() < np.abs(errors[0]).max() / 3
    assert np.abs(errors[2]).max() < np.abs(errors[1]).max() / 3


@pytest.mark.meant_as_given("no_damping", "initial_velocity", "first_period")
def test_an_undamped_elastic_storey_loses_nothing_by_lagged_central_difference():
    # 1 kg on 100 N/m from 1 m/s: 0.5 J for 20 s. The method's states conserve m v^2 / 2 + k u^2 / 2 to (w h)^2 / 8 =
    # 1.25e-5 of the energy, 10 rad/s at 1 ms; what the springs give back is what they took, but for rounding.
    storey = wd.ShearBuilding(1.0, 100.0, 3.0, damping="none")
    scene = wd.Scene(storey, wd.FreeVibration(20.0, velocity=1.0), recorders=("energy",))
    found = wd.simulate(scene, method="central_difference_lagged", step=1e-3, dtype="float64", device="cpu")
    assert abs(found.hysteretic_energy.item()) < 1e-12
    assert abs(found.energy_balance_error.item()) < 2 * 1.25e-5


@pytest.mark.parametrize("damping", ["storey", "rayleigh", "modal"])
@pytest.mark.parametrize("load", ["base", "free"])
def test_energies_of_lagged_central_difference(damping, load):
    input_energy, viscous_energy, supplied = exact_energies(damping_matrix(damping), load)
    frame = wd.ShearBuilding(MASS, STIFFNESS, 3.0, damping=damping, **DAMPING[damping])
    scene = wd.Scene(frame, LOADS[load], recorders=("energy",), tail=TAIL)
    for step in STEPS[:2]:
        found = wd.simulate(scene, method="central_difference_lagged", step=step, dtype="float64", device="cpu")
        off = found.input_energy.item() - input_energy, found.viscous_energy.item() - viscous_energy
        # The damping force lags by half a step, w h / 2 of a radian in the third mode: of first order.
        assert np.abs(off).max() < 45 * step / 2 * supplied
        # The sums are those of the method's own states and forces: they balance at second order, (w h)^2 / 8 = 0.16 %.
        assert abs(found.energy_balance_error.item()) < (45 * step) ** 2 / 8
        assert np.abs(found.hysteretic_energy).max() < 1e-12 * supplied


@pytest.mark.parametrize("load", ["base", "force", "harmonic", "free"])
def test_dense(load):
    damping = damping_matrix("storey") + np.diag([0, 500.0, 0])
    runs, order = balance_errors(wd.LinearSystem(MASS, damping, chain_matrix(STIFFNESS)), load)
    assert 3.6 < order < 4.4
    check_energies(runs[-1], damping, load)


LAWS = {
    "bilinear": ("bilinear", {}),
    "bouc_wen 1": ("bouc_wen", {"exponent": 1.0}),
    "bouc_wen 2": ("bouc_wen", {"exponent": 2.0}),
    "bouc_wen 1.5": ("bouc_wen", {"exponent": 1.5}),
}


def yielding(law, damping):
    name, parameters = LAWS[law]
    return wd.ShearBuilding(
        MASS, STIFFNESS, 3.0, law=name, yield_force=STRENGTH, hardening_ratio=0.1,
        damping=damping, **parameters, **DAMPING[damping],
    )  # fmt: skip


@pytest.mark.parametrize(
    "law", [*(pytest.param(f"bouc_wen {n}", marks=pytest.mark.thorough) for n in (1, 2)), "bouc_wen 1.5"]
)
def test_smooth_yielding(law, measured):
    runs, order = balance_errors(yielding(law, "none"), "push")
    assert 3.6 < order < 4.4
    measured(
        "error of the energy balance of yielding Bouc-Wen chains, RK4 at 0.6 ms, over the energy supplied",
        truth="conservation of energy",
        value=abs(runs[-1].energy_balance_error.item()),
        bound=1e-8,
    )
    assert (runs[-1].hysteretic_energy > 0).all()


@pytest.mark.parametrize(
    ("law", "damping", "load"),
    [
        ("bilinear", "storey", "base"),
        ("bilinear", "rayleigh", "harmonic"),
        ("bilinear", "modal", "force"),
        pytest.param("bouc_wen 1", "storey", "base", marks=pytest.mark.thorough),
        ("bouc_wen 2", "modal", "force"),
        pytest.param("bouc_wen 1.5", "rayleigh", "harmonic", marks=pytest.mark.thorough),
    ],
)
def test_yielding_back_and_forth(law, damping, load):
    runs, order = balance_errors(yielding(law, damping), load)
    # Corners at yield and at turns leave the state at order 2; the balance sees them on both its sides and does better.
    assert order > 2
    for run in runs:
        assert (run.hysteretic_energy > 10).all()  # each storey yields
        spent = run.viscous_energy + run.hysteretic_energy.sum("storey")
        assert (spent <= run.input_energy).all()


def test_bilinear_storeys_that_do_not_yield_dissipate_nothing():
    strong = wd.ShearBuilding(
        MASS,
        STIFFNESS,
        3.0,
        law="bilinear",
        yield_force=1e9,
        hardening_ratio=0.1,
        damping="storey",
        **DAMPING["storey"],
    )
    runs, order = balance_errors(strong, "base")
    assert 3.6 < order < 4.4
    check_energies(runs[-1], damping_matrix("storey"), "base")
    for run, step in zip(runs, STEPS, strict=True):
        assert np.abs(run.hysteretic_energy).max() < 5e6 * step**4


def test_the_error_of_the_balance_is_relative_to_the_largest_energy_that_was_supplied():
    # An oscillator of 10 rad/s under a force of 8 rad/s beats: at pi s the force has taken nearly all energy back that
    # it had put in by pi / 2 s. The steps are long, so that the error is large enough to be compared.
    mass, stiffness, step, steps = 1000.0, 1e5, 0.05, 63
    force = 500.0 * np.sin(8.0 * step * np.arange(steps + 1))
    rate = np.array([[0.0, 1.0], [-stiffness / mass, 0.0]])
    state, supplied = np.zeros(2), [0.0]
    for before, after in pairwise(force):  # RK4 with the force on a line between its values
        loads = [np.array([0.0, each / mass]) for each in (before, (before + after) / 2, after)]
        k1 = rate @ state + loads[0]
        k2 = rate @ (state + step / 2 * k1) + loads[1]
        k3 = rate @ (state + step / 2 * k2) + loads[1]
        k4 = rate @ (state + step * k3) + loads[2]
        change = step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        # Work of the force by Simpson's rule, with the velocity in the middle of a cubic.
        middle = state[1] / 2 + (state + change)[1] / 2 + step / 8 * (k1[1] - (rate @ (state + change) + loads[2])[1])
        work = step / 6 * (before * state[1] + 2 * (before + after) * middle + after * (state + change)[1])
        state = state + change
        supplied.append(supplied[-1] + work)
    assert supplied[-1] < 0.1 * max(supplied)
    building = wd.ShearBuilding(mass, stiffness, 3.0, damping="none")
    scene = wd.Scene(building, wd.ForceHistory(force[:, None], step), recorders=("energy",), tail=0.0)
    run = wd.simulate(scene, method="rk4", step=step, dtype="float64", device="cpu")
    kept = mass * state[1] ** 2 / 2 + stiffness * state[0] ** 2 / 2
    unaccounted = run["input_energy"].item() - kept - run["hysteretic_energy"].item()
    assert run["input_energy"].item() == pytest.approx(supplied[-1], abs=0.01 * max(supplied))
    assert abs(unaccounted) > 1e-3 * max(supplied)
    assert run["energy_balance_error"].item() == pytest.approx(unaccounted / max(supplied), rel=0.01)
