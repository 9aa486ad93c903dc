"""Vehicles: the reference case, closed forms, independent integrations, and invalid input."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import complex_modes
from scipy.integrate import solve_ivp

import warpdyn as wd

SETTINGS = {"dtype": "float64", "device": "cpu"}
HALF = (1200.0, 2100.0, 0.9, 1.2, (60.0, 70.0), (28e3, 21e3), (2500.0, 2000.0), (2e5, 1.8e5))


def quarter_car(**changed) -> wd.QuarterCar:
    """L10."""
    return wd.QuarterCar(300.0, 60.0, 16e3, 1e3, 190e3, **changed)


def run_of(vehicle, motion, step, tail=0.0, record_from=0.0, **changed):
    return wd.simulate(wd.Scene(vehicle, motion, tail=tail, record_from=record_from), step=step, **SETTINGS, **changed)


def test_a_quarter_car_has_the_reference_modes():
    car = quarter_car()
    np.testing.assert_allclose(1 / car.modal()["period"], [1.115571, 9.331334], rtol=4e-7)
    matrices = car.central_matrices(car.parameters)
    size, ratio = complex_modes(matrices["mass"], matrices["damping"], matrices["stiffness"])
    np.testing.assert_allclose(size / (2 * np.pi), [1.123739, 9.263503], rtol=4e-7)
    np.testing.assert_allclose(ratio, [0.2027881, 0.1472087], rtol=4e-7)


# Speed; body acceleration, suspension travel and tyre deflection on 0.01 sin(2 pi x / 5 m).
SINE = [
    (5.0, 1.02952, 0.01796773, 0.001744091),
    (10.0, 0.9198319, 0.0135636, 0.00128095),
    (20.0, 1.214726, 0.01223144, 0.002284437),
    (40.0, 4.65574, 0.02647788, 0.02027508),
]


@pytest.mark.parametrize(("speed", "body", "travel", "tyre"), SINE)
def test_a_quarter_car_has_the_steady_state_of_the_closed_form(speed, body, travel, tyre):
    # 400 samples per wave: the linear interpolation takes (pi / 400)^2 / 3 from the sine.
    step = 5.0 / speed / 400
    motion = wd.SineRoad(0.01, 5.0).motion(speed, 12.0, step)
    run = run_of(quarter_car(), motion, step, record_from=10.0)
    found = [
        run["peak_acceleration"].sel(dof="body").item(),
        run["peak_spring_deformation"].sel(spring="suspension").item(),
        run["peak_spring_deformation"].sel(spring="tyre").item(),
    ]
    np.testing.assert_allclose(found, [body, travel, tyre], rtol=5e-5)


def test_a_quarter_car_has_the_reference_response_on_a_bump():
    motion = wd.RoadBump(0.08, 2.0).motion(10.0, 3.0, 0.001)
    run = run_of(quarter_car(), motion, 0.0002)
    assert run["peak_acceleration"].sel(dof="body").item() == pytest.approx(11.86114, rel=2e-5)
    assert run["peak_spring_deformation"].sel(spring="suspension").item() == pytest.approx(0.08803796, rel=2e-5)
    assert run["peak_spring_deformation"].sel(spring="tyre").item() == pytest.approx(0.04429579, rel=2e-5)


def test_a_random_road_has_the_reference_standard_deviations():
    # L10: class C at 20 m/s; the reference is for white noise of the road's velocity, i.e. all spatial frequencies.
    road = wd.RandomRoad("C", 0.005, 3.0, 4000, seed=5)
    motion = road.motion(20.0, 200.0, 0.004)
    run = run_of(quarter_car(), motion, 0.004, histories=wd.Histories([0], every=2))
    late = run.isel(history=0).sel(time=slice(20.0, None))
    body = late["acceleration"].sel(dof="body").std().item()
    travel = late["spring_deformation"].sel(spring="suspension").std().item()
    tyre = late["spring_force"].sel(spring="tyre").std().item()
    # 220 s contain about 250 cycles of the body and 2000 of the wheel: 2 standard errors.
    assert travel == pytest.approx(0.01348764, rel=0.1)
    assert body == pytest.approx(1.258668, rel=0.07)
    assert tyre == pytest.approx(1038.575, rel=0.05)


def integrated_half_car(road, speed: float, duration: float) -> np.ndarray:
    """Return time, absolute displacements and body accelerations of a half car on the road's elevation."""
    m, inertia, a, b, wheels, stiffness, dashpots, tyres = HALF
    rows = np.array([[1.0, a, -1.0, 0.0], [1.0, -b, 0.0, -1.0]])
    mass = np.array([m, inertia, *wheels])
    delay = (a + b) / speed

    def forces(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        ground = np.array([road.elevation(speed * t), road.elevation(speed * (t - delay))])
        of_suspension = np.array(stiffness) * (rows @ q) + np.array(dashpots) * (rows @ v)
        found = -rows.T @ of_suspension
        found[2:] -= np.array(tyres) * (q[2:] - ground)
        return found / mass

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([state[4:], forces(t, state[:4], state[4:])])

    found = solve_ivp(
        rate, (0, duration), np.zeros(8), "DOP853", rtol=1e-9, atol=1e-12, max_step=0.005, dense_output=True
    )
    time = np.linspace(0, duration, 6001)
    states = found.sol(time)
    accelerations = np.array([forces(t, *np.split(state, 2)) for t, state in zip(time, states.T, strict=True)])
    ground = np.array([road.elevation(speed * time), road.elevation(speed * (time - delay))])
    travel = rows @ states[:4]
    return np.vstack([travel, states[2:4] - ground, accelerations.T[:2]])


def test_a_half_car_has_the_response_to_the_elevation_of_the_road():
    road, car = wd.RoadBump(0.05, 1.5), wd.HalfCar(*HALF)
    motion = road.motion_of_axles(car.wheelbase, speed=10.0, duration=3.0, step=0.0005)
    run = run_of(car, motion, 0.0005)
    names = ["front suspension", "rear suspension", "front tyre", "rear tyre"]
    found = run["peak_spring_deformation"].sel(spring=names).values[0]
    due = np.abs(integrated_half_car(road, 10.0, 3.0)).max(axis=1)
    np.testing.assert_allclose(found, due[:4], rtol=2e-4)
    accelerations = run["peak_acceleration"].sel(dof=["bounce", "pitch"]).values[0]
    np.testing.assert_allclose(accelerations, due[4:], rtol=5e-4)


def test_a_slow_half_car_follows_the_road():
    # On a long wave the body is parallel to the line through the points of contact.
    road, car = wd.SineRoad(0.1, 200.0), wd.HalfCar(*HALF)
    motion = road.motion_of_axles(car.wheelbase, speed=10.0, duration=40.0, step=0.005)
    run = run_of(car, motion, 0.0025, record_from=20.0)
    omega = 2 * np.pi * 10 / 200
    assert run["peak_acceleration"].sel(dof="bounce").item() == pytest.approx(0.1 * omega**2, rel=4e-3)
    pitch = 0.1 * (2 * np.pi / 200) * omega**2
    assert run["peak_acceleration"].sel(dof="pitch").item() == pytest.approx(pitch, rel=2e-2)
    # Pitch of the wave, less the part by which the axles are apart.
    assert run["peak_displacement"].sel(dof="bounce").item() < 0.01 * 0.1


def test_a_half_car_with_equal_axles_on_one_bump_is_two_quarter_cars():
    # If I = m a b, bounce and pitch of the body are uncoupled at the two axles.
    a, b, m = 1.1, 1.1, 1000.0
    car = wd.HalfCar(m, m * a * b, a, b, (50.0, 50.0), (2e4, 2e4), (1500.0, 1500.0), (2e5, 2e5))
    quarter = wd.QuarterCar(m / 2, 50.0, 2e4, 1500.0, 2e5)
    road = wd.RoadBump(0.05, 1.5)
    run = run_of(car, road.motion_of_axles(car.wheelbase, 10.0, 3.0, 0.001), 0.001)
    one = run_of(quarter, road.motion(10.0, 3.0, 0.001), 0.001)
    for axle in ("front", "rear"):
        for part in ("suspension", "tyre"):
            found = run["peak_spring_deformation"].sel(spring=f"{axle} {part}").item()
            assert found == pytest.approx(one["peak_spring_deformation"].sel(spring=part).item(), rel=2e-4)


def test_a_suspension_may_yield():
    law = wd.laws.Bilinear(yield_force=300.0, hardening_ratio=0.5)
    motion = wd.RoadBump(0.08, 2.0).motion(10.0, 3.0, 0.001)
    soft = run_of(quarter_car(suspension_law=law), motion, 0.001)
    stiff = run_of(quarter_car(), motion, 0.001)
    assert soft["peak_spring_force"].sel(spring="suspension") < 0.8 * stiff["peak_spring_force"].sel(
        spring="suspension"
    )


WRONG = [
    (lambda: wd.QuarterCar(0.0, 60.0, 16e3, 1e3, 190e3), r"body_mass \[kg\] must be a finite number above 0"),
    (lambda: wd.QuarterCar(300.0, 60.0, 16e3, -1e3, 190e3), r"suspension_dashpot \[N s/m\]"),
    (lambda: wd.HalfCar(*HALF[:4], 60.0, *HALF[5:]), "wheel_mass must be two values in kg, for the front and the rear"),
    (
        lambda: wd.HalfCar(*HALF[:7], (2e5, 0.0)),
        r"tyre_stiffness of the rear axle \[N/m\] must be a finite number above",
    ),
    (lambda: wd.HalfCar(1200.0, 2100.0, -0.9, *HALF[3:]), r"front_distance \[m\]"),
    (
        lambda: wd.SineRoad(0.01, 9.0).motion_of_axles(0.0, 20.0, 1.0, 0.1),
        r"distance \[m\] must be a finite number above",
    ),
    (lambda: wd.SineRoad(0.01, 1.0).motion_of_axles(2.0, 20.0, 1.0, 0.1), "give a step of at most 0.025 s"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_wrong_vehicles_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
