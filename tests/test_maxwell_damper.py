"""Maxwell dampers: imposed motions, a closed form, stable steps, energies, and a yielding system under a pulse."""

import numpy as np
import pytest
from law_cases import cases, material_of, pulse_error, run_pulse
from validation import difference

import warpdyn as wd
from warpdyn.engine.laws import DEVICES

pytestmark = pytest.mark.meant_as_given(
    "first_period",
    "damper_damping_ratio",
    "damper_force_over_weight",
    "drift_ratio_of_force",
    "initial_velocity",
    "record_step",
)
HEAVY, SOFT = 1e12, 1e-3  # kg, N/m: a mass that a damper does not hold up, a spring without force


def history(building, load, step, method="rk4", dtype="float64"):
    scene = wd.Scene(building, load, tail=0.0, recorders=("drift", "energy"))
    run = wd.simulate(scene, method=method, dtype=dtype, step=step, histories=wd.Histories(), device="cpu")
    assert run["status"].item() == 0
    return run


def damper(**values):
    return wd.laws.MaxwellDamper(**values)


def sine_run(case, interval, method="rk4"):
    """Return times, and forces of the damper of a case while a force moves a heavy mass as the case has it."""
    omega, amplitude = 2 * np.pi / case["T"], case["U"]
    time = interval * np.arange(round(case["times"][-1] / interval) + 2)
    fading = np.exp(-2 * time)
    wave, cross = np.sin(omega * time), np.cos(omega * time)
    acceleration = amplitude * (-(omega**2) * wave * (1 - fading) + 4 * omega * cross * fading - 4 * wave * fading)
    device = damper(damper_coefficient=case["C"], velocity_exponent=case["alpha"], brace_stiffness=case["K"])
    building = wd.ShearBuilding(HEAVY, SOFT, 3.0, devices=(device,))
    load = wd.ForceHistory(HEAVY * acceleration[:, None], interval)
    run = history(building, load, interval, method)
    # The imposed motion starts from rest: its velocity and displacement are 0 at the start.
    displacement = amplitude * wave * (1 - fading)
    np.testing.assert_allclose(run["displacement"].values[0, : time.size, 0], displacement, atol=1e-6 * amplitude)
    return time, run["storey_force"].values[0, : time.size, 0]


@pytest.mark.parametrize("name", ["maxwell_1", "maxwell_2", "maxwell_3"])
def test_forces_under_an_imposed_motion(name, measured):
    case = cases("maxwell")[name]
    time, force = sine_run(case, 1e-4)
    at = np.round(np.array(case["times"]) / 1e-4).astype(int)
    np.testing.assert_allclose(time[at], case["times"], rtol=1e-12)
    measured(
        "forces of `maxwell_damper` under an imposed motion, over the largest force",
        truth="an ODE solver with a relative tolerance of 1e-10",
        value=difference(force[at], case["force"]) / case["largest_force"],
        bound=1e-5,
    )


@pytest.mark.fast
@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("velocity_verlet", 2)])
def test_a_constant_velocity_has_a_closed_form(method, order):
    # F = C v (1 - exp(-K t / C)).
    coefficient, brace, velocity, step = 4e5, 5e7, 0.2, 0.002
    building = wd.ShearBuilding(
        HEAVY, SOFT, 3.0, devices=(damper(damper_coefficient=coefficient, brace_stiffness=brace),)
    )
    errors = []
    for halves in (1, 2):
        run = history(building, wd.FreeVibration(0.1, velocity=velocity), step / halves, method)
        force, time = run["storey_force"].values[0, :, 0], run["time"].values
        expected = coefficient * velocity * (1 - np.exp(-brace / coefficient * time))
        errors.append(np.abs(force - expected).max() / (coefficient * velocity))
    assert errors[0] < 0.01
    assert errors[0] / errors[1] > 0.8 * 2**order


@pytest.mark.fast
@pytest.mark.parametrize("exponent", [1.0, 0.5])
def test_energy_is_dissipated_in_the_damper_and_stored_in_the_brace(exponent):
    device = damper(damper_coefficient=4e5, velocity_exponent=exponent, brace_stiffness=2e7)
    building = wd.ShearBuilding(1e5, 4e6, 3.0, devices=(device,))
    run = history(building, wd.FreeVibration(6.0, velocity=0.5), 1e-3)
    assert abs(run["energy_balance_error"].item()) < 1e-6
    u, v, force = (run[name].values[0, :, 0] for name in ("displacement", "velocity", "storey_force"))
    of_damper = force - 4e6 * u
    left = 0.5 * 1e5 * v[-1] ** 2 + 0.5 * 4e6 * u[-1] ** 2 + 0.5 * of_damper[-1] ** 2 / 2e7
    assert run["hysteretic_energy"].sum().item() == pytest.approx(0.5 * 1e5 * 0.5**2 - left, rel=1e-5)
    assert left < 0.2 * 0.5 * 1e5 * 0.5**2


@pytest.mark.fast
def test_free_vibration_decays_as_the_eigenvalues_say():
    mass, stiffness, coefficient, brace = 1e5, 4e6, 2e5, 1.2e7
    building = wd.ShearBuilding(
        mass, stiffness, 3.0, devices=(damper(damper_coefficient=coefficient, brace_stiffness=brace),)
    )
    run = history(building, wd.FreeVibration(4.0, velocity=0.3), 5e-4)
    state = np.array([[0, 1, 0], [-stiffness / mass, 0, -1 / mass], [0, brace, -brace / coefficient]])
    rates, shapes = np.linalg.eig(state)
    start = np.linalg.solve(shapes, [0, 0.3, 0])
    time = run["time"].values
    expected = np.real((shapes[0] * start) @ np.exp(rates[:, None] * time))
    np.testing.assert_allclose(run["displacement"].values[0, :, 0], expected, atol=1e-9)


@pytest.mark.fast
@pytest.mark.filterwarnings("ignore:the step is beyond the stability limit")
@pytest.mark.parametrize("brace", [1e6, 1e8, 1e10])
@pytest.mark.parametrize("law", [{}, {"law": "bilinear", "yield_force": 1e5, "hardening_ratio": 0.05}])
def test_the_stable_step_counts_stiffness_and_relaxation(brace, law):
    # The fastest eigenvalue of the element: 3.7 to 25,000 1/s.
    device = damper(damper_coefficient=4e5, brace_stiffness=brace)
    building = wd.ShearBuilding([1e5, 1e5], 4e6, 3.0, devices=(device,), **law)
    motion = wd.GroundMotion(2 * np.sin(np.arange(40) * 0.4), 0.02)
    scene = wd.Scene(building, motion, recorders=("drift",))
    run = wd.simulate(scene, method="rk4", longest_step=1.0, dtype="float64", device="cpu")
    assert run["status"].item() == 0
    fine = wd.simulate(scene, method="rk4", step=run.attrs["step"] / 4, dtype="float64", device="cpu")
    assert run["peak_storey_drift"].values == pytest.approx(fine["peak_storey_drift"].values, rel=0.02)


def test_a_stiff_brace_is_a_viscous_damper():
    frame = {"law": "bilinear", "yield_force": 4e4, "hardening_ratio": 0.1, "mass": [2e3, 1e3]}
    frame |= {"stiffness": [6e5, 4e5], "height": 3.0}
    motion = wd.GroundMotion(8 * np.sin(0.3 * np.arange(100)), 0.02)
    values = {"damper_coefficient": [2e4, 0.0]}
    devices = (wd.laws.ViscousDamper(**values), damper(brace_stiffness=2e8, **values))
    plain, braced = (
        wd.simulate(
            wd.Scene(wd.ShearBuilding(devices=(device,), **frame), motion, recorders=("drift",)),
            step=1e-4, method="rk4", dtype="float64", device="cpu",
        )
        for device in devices
    )  # fmt: skip
    np.testing.assert_allclose(braced["peak_storey_drift"], plain["peak_storey_drift"], rtol=2e-3)


@pytest.mark.fast
def test_methods_rows_and_bad_input():
    device = damper(damper_coefficient=[1e5, 0.0], brace_stiffness=[1e7, 0.0])
    building = wd.ShearBuilding([1e5, 1e5], 4e6, 3.0, devices=(device,))
    kind = DEVICES["maxwell_damper"]
    values = {name: np.atleast_2d(value) for name, value in building.parameters.items()}
    assert kind.spring(values) == "maxwell_damper"
    assert kind.spring(values | {"velocity_exponent": np.array([[1.0, 0.4]])}) == "maxwell_damper_power"
    np.testing.assert_array_equal(kind.stiffest(values), [[1e7, 0.0]])
    np.testing.assert_array_equal(kind.relaxation_rate(values), [[100.0, 0.0]])
    scene = wd.Scene(building, wd.FreeVibration(0.1, velocity=0.1))
    for method in ("newmark_average", "central_difference", "exact"):
        with pytest.raises(ValueError, match=f"method '{method}' does not fit .*maxwell_damper"):
            wd.simulate(scene, method=method, device="cpu")
    with pytest.raises(ValueError, match=r"brace_stiffness is 0 and damper_coefficient is 100000 \(storey 2\)"):
        wd.ShearBuilding([1e5, 1e5], 4e6, 3.0, devices=(damper(damper_coefficient=1e5, brace_stiffness=[1e7, 0.0]),))
    # Quasi-static paths leave the damper without force.
    push = wd.storey_hysteresis(building, np.linspace(0, 0.1, 5))
    np.testing.assert_allclose(push["storey_force"], 4e6 * push["storey_drift"], rtol=1e-12)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_methods_agree_beside_laws_of_every_kind(dtype):
    building = wd.ShearBuilding(
        [2e5] * 3, [2e8, 1.6e8, 1.2e8], 3.0, damping="rayleigh", damping_ratio=0.03, gravity_load=2e6,
        law=["bilinear", "bouc_wen", "takeda"], yield_force=[2e6, 1.6e6, 1e6], hardening_ratio=0.05,
        devices=(damper(damper_coefficient=[1e6, 5e5, 0], velocity_exponent=0.4, brace_stiffness=[1e8, 1e8, 0]),),
    )  # fmt: skip
    time = 0.02 * np.arange(150)
    scene = wd.Scene(building, wd.GroundMotion(6 * np.sin(12 * time) * np.exp(-0.2 * time), 0.02), tail=0.2)
    runs = [
        wd.simulate(scene, method=method, dtype=dtype, device="cpu")
        for method in ("rk4", "velocity_verlet", "dormand_prince54")
    ]
    for run in runs:
        assert run["status"].item() == 0
        assert abs(run["energy_balance_error"].item()) < 1e-4
        np.testing.assert_allclose(run["peak_storey_drift_ratio"], runs[0]["peak_storey_drift_ratio"], rtol=1e-3)


def test_a_yielding_system_under_a_pulse(measured):
    case = cases("dynamic")["dynamic_bilinear_maxwell_damper"]
    force, stiffness, hardening = material_of(case)
    brace, coefficient, exponent = case["opensees"][1][1:4]
    device = damper(damper_coefficient=coefficient, velocity_exponent=exponent, brace_stiffness=brace)
    law = wd.laws.Bilinear(yield_force=force, hardening_ratio=hardening)
    run = run_pulse(case, stiffness, law=law, devices=(device,))
    assert np.abs(run["storey_force"]).max() == pytest.approx(case["largest_force"], rel=2e-3)
    measured(
        "peak and last drifts of a bilinear storey with a `maxwell_damper` under a pulse, over the largest drift",
        truth="OpenSees' Steel01 and ViscousDamper, Newmark's average acceleration, step 0.25 ms",
        value=pulse_error(case, run),
        bound=2e-3,
    )
