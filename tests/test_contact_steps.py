"""Steps of Hertz-damp contacts: longer than a worst case without a mass would need, and still accurate and stable."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
LEFT, RIGHT, CLEARANCE, HERTZ, LEAST = 200e3, 350e3, 0.02, 2.75e9, 0.01
STIFFNESS, DASHPOT = np.array([1.2e7, 6.8e7]), np.array([1.6e5, 4.9e5])
SETTINGS = {"device": "cpu", "dtype": "float64"}


def oscillators(restitution: float) -> wd.LumpedStructure:
    contact = wd.laws.YeLiZhuContact(clearance=CLEARANCE, hertz_stiffness=HERTZ, restitution=restitution)
    springs = [
        wd.Spring(name, {name: 1.0}, stiffness=k, damping_coefficient=c)
        for name, k, c in zip(("left", "right"), STIFFNESS, DASHPOT, strict=True)
    ]
    springs.append(wd.Spring("contact", {"left": 1.0, "right": -1.0}, law=contact))
    return wd.LumpedStructure({"left": LEFT, "right": RIGHT}, springs)


TIME = np.arange(0, 4, 0.01)
# The left building is pressed on the right one slowly, and more and less by turns.
PRESSING = (
    -14 * np.minimum(TIME / 2, 1) * np.clip((3.9 - TIME) / 1.5, 0, 1) * (1 + 0.3 * np.sin(2 * np.pi * TIME / 1.3))
)
QUAKE = 4 * np.sin(2 * np.pi * TIME / 0.7) * np.exp(-0.4 * TIME)


def reference(acceleration: np.ndarray, restitution: float) -> tuple[float, np.ndarray]:
    """Return the peak contact force [N] and the peak displacements [m], integrated by SciPy from event to event."""
    factor, mass = 8 * (1 - restitution) / (5 * restitution), np.array([LEFT, RIGHT])

    def force(state: np.ndarray, speed: float) -> float:
        depth = max(state[0] - state[1] - CLEARANCE, 0.0)
        return HERTZ * depth**1.5 * max(1 + factor * (state[2] - state[3]) / speed, 0.0) if speed else 0.0

    def slope(time: float, state: np.ndarray, speed: float) -> np.ndarray:
        own = -STIFFNESS * state[:2] - DASHPOT * state[2:] - force(state, speed) * np.array([1.0, -1.0])
        return np.concatenate([state[2:], own / mass - np.interp(time, TIME, acceleration)])

    def gap(time: float, state: np.ndarray, speed: float) -> float:
        return state[0] - state[1] - CLEARANCE

    gap.terminal = True  # type: ignore[attr-defined]
    time, state, speed = 0.0, np.zeros(4), 0.0
    most, peaks = 0.0, np.zeros(2)
    while time < TIME[-1] - 1e-12:
        gap.direction = -1.0 if speed else 1.0  # type: ignore[attr-defined]
        found = solve_ivp(
            slope, (time, TIME[-1]), state, "Radau", events=gap, args=(speed,), rtol=1e-8, atol=1e-11, max_step=2e-3
        )
        most = max(most, *(force(each, speed) for each in found.y.T))
        peaks = np.maximum(peaks, np.abs(found.y[:2]).max(axis=1))
        time, state = found.t[-1], found.y[:, -1]
        if found.status == 1:
            speed = 0.0 if speed else max(state[2] - state[3], LEAST)
    return most, peaks


@pytest.mark.parametrize("restitution", [0.65, 0.4])
@pytest.mark.parametrize("acceleration", [PRESSING, QUAKE], ids=["pressing", "quake"])
def test_peaks_at_the_default_step_are_those_of_an_event_exact_integration(acceleration, restitution):
    run = wd.simulate(wd.Scene(oscillators(restitution), wd.GroundMotion(acceleration, 0.01)), **SETTINGS)
    step = float(run["integration_step"][0])
    assert step > {0.65: 5e-4, 0.4: 2e-4}[restitution]  # was 2.7e-5 and 9.6e-6
    force, peaks = reference(acceleration, restitution)
    assert run["peak_spring_force"].sel(spring="contact").item() == pytest.approx(force, rel=1e-3)
    np.testing.assert_allclose(run["peak_displacement"][0], peaks, rtol=1e-4)


def test_a_step_of_1_ms_is_accepted():
    scene = wd.Scene(oscillators(0.65), wd.GroundMotion(QUAKE, 0.01))
    run = wd.simulate(scene, step=0.001, on_unstable="raise", **SETTINGS)
    force, _ = reference(QUAKE, 0.65)
    assert float(run["integration_step"][0]) == 0.001
    assert run["peak_spring_force"].sel(spring="contact").item() == pytest.approx(force, rel=2e-3)


def test_a_lower_least_approach_speed_needs_shorter_steps():
    law = wd.laws.YeLiZhuContact
    given = {"clearance": [[CLEARANCE]], "hertz_stiffness": HERTZ, "restitution": 0.65, "expected_penetration": 0.05}
    values = {name: np.array(value, dtype=float).reshape(1, 1) for name, value in given.items()}
    mass = np.array([[LEFT * RIGHT / (LEFT + RIGHT)]])

    def steepest(speed: float, **other: np.ndarray) -> float:
        return law.steepest_damping({**values, "least_approach_speed": np.array([[speed]]), **other}).item()

    factor = 8 * 0.35 / (5 * 0.65)
    assert steepest(0.01) == pytest.approx(factor * HERTZ * 0.05**1.5 / 0.01, rel=1e-12)
    assert steepest(0.01, mass=mass) == pytest.approx(factor * mass.item() * 9.81 / 0.01, rel=1e-12)
    assert steepest(0.001, mass=mass) == pytest.approx(10 * steepest(0.01, mass=mass), rel=1e-12)
    # A free impact that reaches the expected penetration, whose speed follows from the energy.
    speed = np.sqrt(4 * HERTZ * 0.05**2.5 / (5 * mass.item()))
    assert steepest(1.0, mass=mass) == pytest.approx(factor * HERTZ * 0.05**1.5 / speed, rel=1e-12)
