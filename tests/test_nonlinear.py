"""Yielding response against closed forms, published integrals, and scipy with events where the law has corners."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import eigh

import warpdyn as wd

pytestmark = [
    pytest.mark.as_shipped,
    pytest.mark.meant_as_given(
        "first_period", "initial_velocity", "record_step", "storey_height", "yield_base_shear_coefficient"
    ),
]


def simulate(structure, excitation, step, **scene):
    """Return a run of one sample with its whole history."""
    scene = wd.Scene(structure, excitation, **scene)
    run = wd.simulate(scene, step=step, dtype="float64", device="cpu", histories=wd.Histories((0,)))
    assert run.status.item() == 0
    return run


def oscillator(law="bilinear", hardening_ratio=0.0, **parameters):
    """1 kg on 100 N/m that yields at 1 N and 0.01 m."""
    return wd.ShearBuilding([1.0], 100.0, 1.0, law=law, yield_force=1.0, hardening_ratio=hardening_ratio, **parameters)


# Return mapping is exact at the end of each step, but an oscillator that yields or turns inside a step is carried past
# that instant by at most a step: order 2, with a constant that depends on where in the step it falls.
STEPS = pytest.mark.parametrize("step", [0.01, 0.005, 0.0025, 0.00125])


@STEPS
def test_elastic_perfectly_plastic_under_a_step_force(step, measured):
    run = simulate(oscillator(), wd.ForceHistory(np.full((11, 1), 0.75), 0.1), step, tail=0.0)
    displacement = run.displacement.values[0, :, 0]
    expected = {
        0.1: 0.00344773270598895,  # still elastic: order 4
        0.2: 0.010621935423531,
        0.3: 0.016219586326019,
        0.5: 0.0199153699715823,
        1.0: 0.0188036277033006,
    }
    for instant, value in expected.items():
        tolerance = step**4 if instant == 0.1 else 0.1 * step**2
        assert displacement[round(instant / step)] == pytest.approx(value, abs=tolerance)
    # Ductility 1 / (2 (1 - 0.75)) = 2, reached at 0.4739 s; 1 N over 0.01 m of plastic drift.
    measured(
        "ductility 2 of an elastic-perfectly-plastic oscillator under a step force, RK4: error over the step squared",
        truth="closed form, 1 / (2 (1 - force / yield force)) (Chopra, Dynamics of Structures)",
        value=abs(run.peak_storey_drift.item() - 0.02) / step**2,
        bound=0.1,
        units="m s-2",
    )
    assert run.time_of_peak_drift.item() == pytest.approx(0.473906036099521, abs=0.6 * step)
    assert run.hysteretic_energy.item() == pytest.approx(0.01, abs=0.1 * step**2)
    assert run.peak_base_shear.item() == pytest.approx(1.0, abs=1e-14)
    # u'' = 0.75 N - f: largest at the start, where nothing resists.
    assert run.peak_floor_acceleration.item() == pytest.approx(0.75, abs=1e-14)


@STEPS
@pytest.mark.parametrize(
    ("hardening_ratio", "instant", "peak"),
    [(0.0, 0.316826403420031, 0.05), (0.1, 0.264743837474769, 0.0441640786499874)],
)
def test_free_vibration_beyond_yield(step, hardening_ratio, instant, peak):
    run = simulate(oscillator(hardening_ratio=hardening_ratio), wd.FreeVibration(0.4, velocity=0.3), step)
    assert run.peak_storey_drift.item() == pytest.approx(peak, abs=0.3 * step**2)
    assert run.time_of_peak_drift.item() == pytest.approx(instant, abs=0.6 * step)
    dissipated = (1 - hardening_ratio) * (peak - 0.01)
    assert run.hysteretic_energy.item() == pytest.approx(dissipated, abs=0.3 * step**2)


@pytest.mark.parametrize("steps_a_period", [50, 100, 200, 400])
def test_residual_drift_and_energy_of_one_yield_excursion(steps_a_period):
    # The elastic energy of 0.045 J that is left beyond yield goes into 0.04 m of plastic drift at 1 N; what follows is
    # free vibration of one yield drift about it, whose mean over its last period is the plastic drift.
    period = 2 * np.pi / 10
    step = period / steps_a_period
    run = simulate(oscillator(), wd.FreeVibration(4 * period, velocity=0.3), step)
    assert run.residual_drift_ratio.item() == pytest.approx(0.04, abs=0.3 * step**2)
    assert run.hysteretic_energy.item() == pytest.approx(0.04, abs=0.3 * step**2)
    last = run.displacement.values[0, -steps_a_period:, 0]
    assert np.ptp(last) == pytest.approx(0.02, rel=3e-3)


def test_bouc_wen_free_vibration():
    peaks = [
        0.0519311632668102,
        0.0310821714329424,
        0.0474074291337121,
        0.0334477333716394,
        0.0458722556099268,
        0.0345532763737686,
    ]
    for step in (0.01, 0.005, 0.0025, 0.00125):
        run = simulate(oscillator("bouc_wen", exponent=2.0), wd.FreeVibration(4.0, velocity=0.3), step)
        time, displacement, velocity = run.time.values, run.displacement.values[0, :, 0], run.velocity.values[0, :, 0]
        turns = np.flatnonzero(velocity[:-1] * velocity[1:] < 0)[:6]
        spline = CubicHermiteSpline(time, displacement, velocity)  # order 4 between the steps
        roots = spline.derivative().roots(extrapolate=False)
        instants = np.array([roots[(roots >= time[i]) & (roots <= time[i + 1])][0] for i in turns])
        found = spline(instants)
        # Up to the first turn the law is smooth: order 4. Its rate has a corner at each turn: order 2 from there on.
        assert found[0] == pytest.approx(peaks[0], abs=120 * step**4)
        assert instants[0] == pytest.approx(0.3238675337677, abs=500 * step**4)
        np.testing.assert_allclose(found, peaks, rtol=0, atol=0.1 * step**2)


# Three unequal storeys that yield to ductilities of 8, 4 and 3; the first drifts most, the second for its height.
MASS, STIFFNESS = np.array([2000.0, 1500.0, 1000.0]), np.array([1.2e6, 9e5, 5e5])
HEIGHT = np.array([10.0, 3.0, 3.5])
STRENGTH, HARDENING, RATIO = np.array([8e3, 5e3, 2.4e3]), np.array([0.05, 0.1, 0.15]), 0.03
BETA, GAMMA, EXPONENT = 0.6, 0.3, 1.5
RECORD_STEP, FINEST, TAIL = 0.05, 40, 10
RECORD = 3.0 * np.sin(np.linspace(0, 3, 61) ** 2 * 3) * np.hanning(61) + 0.5 * np.cos(np.arange(61))


def matrices(damping):
    """Stiffness and damping matrix of the chain, by textbook formulas."""
    stiffness = (
        np.diag(STIFFNESS + np.append(STIFFNESS[1:], 0)) - np.diag(STIFFNESS[1:], 1) - np.diag(STIFFNESS[1:], -1)
    )
    eigenvalue, shapes = eigh(stiffness, np.diag(MASS))
    omega = np.sqrt(eigenvalue)
    if damping == "rayleigh":
        first, second = omega[:2]
        of_mass, of_stiffness = 2 * RATIO * first * second / (first + second), 2 * RATIO / (first + second)
        return omega, of_mass * np.diag(MASS) + of_stiffness * stiffness
    return omega, (MASS[:, None] * shapes * (2 * RATIO * omega)) @ (shapes.T * MASS)


def reference(law, damping):
    """Response at instants a fortieth of the record's step apart, by scipy's eighth-order method near rounding.

    Each interval of the record is integrated on its own, and with the bilinear law each stretch between instants at
    which a storey yields or unloads, so that the method never meets a corner of load or law unawares.
    """
    _, viscous = matrices(damping)
    yield_drift = STRENGTH / STIFFNESS

    def forces(y, flow):
        drift, rate, z = np.diff(y[0:3], prepend=0), np.diff(y[3:6], prepend=0), y[6:9]
        if law == "bilinear":  # z is the plastic drift
            return HARDENING * STIFFNESS * drift + (1 - HARDENING) * STIFFNESS * (drift - z), flow**2 * rate, rate
        bend = np.abs(z) ** EXPONENT * (BETA * np.abs(rate) * np.sign(z) + GAMMA * rate)
        return HARDENING * STIFFNESS * drift + (1 - HARDENING) * STRENGTH * z, (rate - bend) / yield_drift, rate

    def absolute_acceleration(y, flow):
        force = forces(y, flow)[0]
        return (np.append(force[1:], 0) - force - viscous @ y[3:6]) / MASS

    def slope(t, y, flow, base):
        force, z_rate, rate = forces(y, flow)
        ground, v = base(t), y[3:6]
        energies = [-ground * (MASS @ v), v @ viscous @ v, *(force * rate)]
        return np.concatenate([v, absolute_acceleration(y, flow) - ground, z_rate, energies])

    def event(storey):
        def gap(t, y, flow, base):
            drift, rate = (np.diff(part, prepend=0)[storey] for part in (y[0:3], y[3:6]))
            return flow[storey] * rate if flow[storey] else yield_drift[storey] - abs(drift - y[6 + storey])

        gap.terminal, gap.direction = True, -1
        return gap

    events = [event(storey) for storey in range(3)] if law == "bilinear" else None
    record = np.append(RECORD, np.zeros(TAIL))
    state, flow, rows = np.zeros(14), np.zeros(3), []
    for i in range(len(record) - 1):
        start, end = i * RECORD_STEP, (i + 1) * RECORD_STEP
        ends = record[i : i + 2] if i != len(RECORD) - 1 else (0, 0)  # the motion ends with its last sample
        instants = start + RECORD_STEP / FINEST * np.arange(FINEST)
        time = start
        while time < end:
            part = solve_ivp(
                slope, (time, end), state, "DOP853", rtol=1e-10, atol=1e-12, events=events, dense_output=True,
                args=(flow, lambda t, ends=ends, start=start: np.interp(t, [start, start + RECORD_STEP], ends)),
            )  # fmt: skip
            here = instants[(instants >= time) & (instants < (part.t[-1] if part.t[-1] < end else np.inf))]
            rows += [
                np.concatenate([y, absolute_acceleration(y, flow), forces(y, flow)[0]]) for y in map(part.sol, here)
            ]
            time, state = part.t[-1], part.y[:, -1]
            for storey, times in enumerate(part.t_events or []):
                if times.size:
                    elastic = np.diff(state[0:3], prepend=0)[storey] - state[6 + storey]
                    flow[storey] = 0 if flow[storey] else np.sign(elastic)
    rows.append(np.concatenate([state, absolute_acceleration(state, flow), forces(state, flow)[0]]))
    columns = np.split(np.array(rows), [3, 6, 9, 10, 11, 14, 17], axis=1)
    names = ("displacement", "velocity", "memory", "input_energy", "viscous_energy", "work", "acceleration", "force")
    return SimpleNamespace(**dict(zip(names, columns, strict=True)))


@pytest.mark.parametrize(
    ("law", "damping"), [("bouc_wen", "rayleigh"), pytest.param("bilinear", "modal", marks=pytest.mark.thorough)]
)
def test_three_yielding_storeys(law, damping):
    omega, _ = matrices(damping)
    exact = reference(law, damping)
    own = {"beta": BETA, "gamma": GAMMA, "exponent": EXPONENT} if law == "bouc_wen" else {}
    building = wd.ShearBuilding(
        MASS, STIFFNESS, HEIGHT, law=law, damping=damping, damping_ratio=RATIO,
        yield_force=STRENGTH, hardening_ratio=HARDENING, **own,
    )  # fmt: skip
    drift = np.diff(exact.displacement, prepend=0, axis=1)
    assert (np.abs(drift).max(axis=0) > 2.5 * STRENGTH / STIFFNESS).all()
    elastic = drift - exact.memory if law == "bilinear" else STRENGTH / STIFFNESS * exact.memory
    recoverable = 0.5 * STIFFNESS * (HARDENING * drift**2 + (1 - HARDENING) * elastic**2)
    period = 2 * np.pi / omega[0]
    window = min(3 * period, max(TAIL * RECORD_STEP, period))
    for substeps in (10, 20, 40):
        step, every = RECORD_STEP / substeps, FINEST // substeps
        run = simulate(building, wd.GroundMotion(RECORD, RECORD_STEP), step, tail=TAIL * RECORD_STEP)

        def check(found, expected, constant, step=step):
            # Corners of the laws within a step: order 2, its constants measured with bilinear storeys and doubled.
            difference = np.abs(found.values[0] - expected).max()
            assert difference < constant * step**2 * np.abs(expected).max(), found.name

        check(run.displacement, exact.displacement[::every], 40)
        check(run.velocity, exact.velocity[::every], 40)
        check(run.acceleration, exact.acceleration[::every], 120)
        check(run.storey_force, exact.force[::every], 80)
        # Demands are those of the steps.
        check(run.peak_storey_drift, np.abs(drift[::every]).max(axis=0), 40)
        check(run.peak_storey_drift_ratio, np.abs(drift[::every]).max(axis=0) / HEIGHT, 40)
        check(run.peak_floor_acceleration, np.abs(exact.acceleration[::every]).max(axis=0), 120)
        check(run.peak_base_shear, np.abs(exact.force[::every, 0]).max(), 80)
        count = round(window / step)
        hann = (1 - np.cos(2 * np.pi * (np.arange(count) + 0.5) / count)) / count
        check(run.residual_drift_ratio, hann @ drift[::every][-count:] / HEIGHT, 200)
        check(run.input_energy, exact.input_energy[-1, 0], 40)
        check(run.viscous_energy, exact.viscous_energy[-1, 0], 40)
        check(run.hysteretic_energy, (exact.work - recoverable)[-1], 40)
        ratio = np.abs(drift[::every]) / HEIGHT
        assert run.storey_of_peak_drift.item() == 2 == np.argmax(ratio.max(axis=0)) + 1
        assert run.time_of_peak_drift.item() == pytest.approx(step * np.argmax(ratio.max(axis=1)), abs=1.01 * step)
        # The recorders against the run's own history: the same numbers from another kernel.
        own_drift = np.abs(np.diff(run.displacement.values[0], prepend=0, axis=1))
        np.testing.assert_allclose(run.peak_storey_drift[0], own_drift.max(axis=0), rtol=1e-11)
        assert run.time_of_peak_drift.item() == pytest.approx(step * own_drift[:, 1].argmax(), abs=1e-12)
        own_acceleration = np.abs(run.acceleration.values[0]).max(axis=0)
        np.testing.assert_allclose(run.peak_floor_acceleration[0], own_acceleration, rtol=1e-11)


# From rest z falls into a wrong orbit up to 2 % below the limit already, and the watch is there before it.
@pytest.mark.parametrize("share", [0.5, 0.85, 1.02, 1.1, 1.5])
@pytest.mark.parametrize("exponent", [1.0, 2.0, 10.0])
def test_step_too_long_for_bouc_wen_is_flagged(exponent, share):
    """A mass too heavy to be slowed slides at 1 m/s over a yield drift of 10 mm: h < 2.785 uy / (n |v|) (TRUTHS, 2)."""
    limit = 2.785293563405282 * 0.01 / exponent
    building = wd.ShearBuilding(
        1e9, 1e3, 1.0, law="bouc_wen", yield_force=10.0, hardening_ratio=0.0, exponent=exponent, damping="none"
    )
    steps = 200
    scene = wd.Scene(building, wd.FreeVibration(steps * share * limit, velocity=1.0))
    if share < 1:
        run = wd.simulate(scene, step=share * limit, dtype="float64", device="cpu", on_unstable="flag")
        assert run.status.item() == 0
        # The work done against the yield force; z comes to it from below within some yield drifts.
        path = steps * share * limit
        assert run.hysteretic_energy.item() == pytest.approx(10 * path, rel=0.05)
    else:
        # Beyond the limit z settles away from 1, also inside its bound, where nothing else would tell.
        with pytest.warns(UserWarning, match=r"1 of 1 samples is flagged (diverged|unstable_step)"):
            run = wd.simulate(scene, step=share * limit, dtype="float64", device="cpu", on_unstable="flag")
        assert run.status.item() in (2, 3)
        assert np.isnan(run.peak_storey_drift.item())
        assert run.storey_of_peak_drift.item() == -1
        # What is left to the engine is run again at half the step, which holds.
        run = wd.simulate(scene, step=share * limit, dtype="float64", device="cpu")
        assert run.status.item() == 0
        assert run.integration_step.item() == pytest.approx(share * limit / 2)
        assert run.hysteretic_energy.item() == pytest.approx(10 * steps * share * limit, rel=0.05)
