"""Road profiles: ISO 8608, statistics of random roads, and the response of a quarter car."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import complex_modes, peak, response
from printed_digits import half_unit
from public_names import problems
from scipy.linalg import solve_continuous_lyapunov

from warpdyn.model.ground_motions.roads import profiles as roads

pytestmark = pytest.mark.fast
# A quarter car: masses of body and wheel, springs of suspension and tyre, damper of the suspension.
BODY, WHEEL, SPRING, TYRE, DAMPER = 300.0, 60.0, 16000.0, 190000.0, 1000.0
MASS = np.diag([BODY, WHEEL])
STIFFNESS = np.array([[SPRING, -SPRING], [-SPRING, SPRING + TYRE]])
DAMPING = np.array([[DAMPER, -DAMPER], [-DAMPER, DAMPER]])
LOAD = np.diag(MASS)


def test_classes_have_the_means_and_limits_of_iso_8608() -> None:
    means = dict(zip("ABCDEFGH", (16, 64, 256, 1024, 4096, 16384, 65536, 262144), strict=True))
    assert pytest.approx({name: 1e-6 * mean for name, mean in means.items()}) == roads.ROAD_CLASSES
    limits = (32, 128, 512, 2048, 8192, 32768, 131072)
    assert pytest.approx(1e-6 * np.array(limits), rel=1e-12) == roads.ROAD_CLASS_LIMITS
    # In angular spatial frequency, class A has about 1e-6 m3 at 1 rad/m.
    angular = roads.road_spectral_density(1 / (2 * np.pi), "A") / (2 * np.pi)
    assert angular == pytest.approx(1.005e-6, rel=1e-3)
    assert roads.road_spectral_density([0.1, 0.2], 3e-4) == pytest.approx([3e-4, 3e-4 / 4], rel=1e-14)
    assert roads.road_velocity_density("C", 20.0) == pytest.approx(0.002021295, rel=3e-7)


def quarter_car_modes() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    omega = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(MASS, STIFFNESS)).real))
    return (omega / (2 * np.pi), *complex_modes(MASS, DAMPING, STIFFNESS))


def test_the_quarter_car_is_the_one_of_the_reference_case() -> None:
    undamped, frequency, ratio = quarter_car_modes()
    assert undamped == pytest.approx([1.115571, 9.331334], rel=5e-7)
    assert frequency / (2 * np.pi) == pytest.approx([1.123739, 9.263503], rel=5e-7)
    assert ratio == pytest.approx([0.2027881, 0.1472087], rel=3e-7)


def test_the_stationary_response_on_a_random_road_has_the_reference_values() -> None:
    # Displacements relative to the road: its acceleration is the derivative of white noise; here, absolute states with
    # the elevation as a fifth state z' = white noise.
    inverse = np.linalg.inv(MASS)
    system = np.zeros((5, 5))
    system[:2, 2:4] = np.eye(2)
    system[2:4, :2], system[2:4, 2:4] = -inverse @ STIFFNESS, -inverse @ DAMPING
    system[2:4, 4] = inverse @ [0.0, TYRE]
    # Relative to the road, the elevation does not appear, and the system is stable.
    to_relative = np.eye(5)
    to_relative[:2, 4] = -1.0
    relative = (to_relative @ system @ np.linalg.inv(to_relative))[:4, :4]
    noise = (to_relative @ [0.0, 0.0, 0.0, 0.0, 1.0])[:4]
    density = roads.road_velocity_density("C", 20.0) / 2  # two-sided over frequency in Hz
    covariance = solve_continuous_lyapunov(relative, -density * np.outer(noise, noise))
    body = relative[2]
    travel, tyre = np.array([1.0, -1.0, 0, 0]), np.array([0, TYRE, 0, 0])
    for row, expected in ((body, 1.258668), (travel, 0.01348764), (tyre, 1038.575)):
        assert np.sqrt(row @ covariance @ row) == pytest.approx(expected, rel=0, abs=half_unit(expected, 7))


@pytest.mark.parametrize(
    ("speed", "body", "travel", "tyre"),
    [
        (5.0, 1.02952, 0.01796773, 0.001744091),
        (10.0, 0.9198319, 0.0135636, 0.00128095),
        (20.0, 1.214726, 0.01223144, 0.002284437),
        (40.0, 4.65574, 0.02647788, 0.02027508),
    ],
)
def test_the_response_on_a_sine_road_has_the_closed_form(speed: float, body: float, travel: float, tyre: float) -> None:
    road = roads.SineRoad(0.01, 5.0)
    omega = 2 * np.pi * speed / 5.0
    # Closed form, from the amplitude of the road's acceleration.
    acceleration = road.motion(speed, 10.0, 5.0 / speed / 400).peak_ground_acceleration
    assert acceleration == pytest.approx(0.01 * omega**2, rel=1e-4)
    exact = 0.01 * omega**2
    dynamic = STIFFNESS + 1j * omega * DAMPING - omega**2 * MASS
    relative = np.linalg.solve(dynamic, -LOAD * exact)
    assert abs(-(omega**2) * relative[0] + exact) == pytest.approx(body, rel=2e-6)
    assert abs(relative[0] - relative[1]) == pytest.approx(travel, rel=2e-6)
    assert abs(relative[1]) == pytest.approx(tyre, rel=2e-6)
    # The response to the sampled motion approaches it; linear interpolation takes (pi / 100)^2 / 12 from the sine.
    step = 5.0 / speed / 100
    motion = road.motion(speed, 12.0, step)
    found = response(MASS, DAMPING, STIFFNESS, LOAD, motion.acceleration, step=step, parts=2)
    late = found["time"] > 11.0
    total = (found["a"][:, 0] + found["ground"][:, 0])[late]
    assert np.abs(total).max() == pytest.approx(body, rel=1e-3)
    assert np.abs(found["u"][late] @ [1, -1]).max() == pytest.approx(travel, rel=1e-3)


def test_the_response_on_a_bump_has_the_reference_values() -> None:
    bump = roads.RoadBump(0.08, 2.0)
    motion = bump.motion(10.0, 3.0, 0.001)
    time = 0.001 * np.arange(201)
    q = np.pi * 10.0 * time / 2.0
    stated = 0.08 * (np.pi * 10 / 2) ** 2 * (2 * np.cos(2 * q) - 2 * np.cos(4 * q))
    assert motion.acceleration[:201] == pytest.approx(stated, abs=1e-9)
    assert not motion.acceleration[201:].any()
    found = response(MASS, DAMPING, STIFFNESS, LOAD, motion.acceleration, step=0.001, parts=2)
    time, u, v = found["time"], found["u"], found["v"]
    total = found["a"][:, 0] + found["ground"][:, 0]
    assert peak(time, total, np.gradient(total, time)) == pytest.approx((11.86114, 0.15919), rel=1e-4)
    assert peak(time, total, np.gradient(total, time))[0] == pytest.approx(11.86114, rel=2e-6)
    assert peak(time, u @ [1, -1], v @ [1, -1])[0] == pytest.approx(0.08803796, rel=2e-7)
    assert peak(time, u[:, 1], v[:, 1])[0] == pytest.approx(0.04429579, rel=2e-7)
    # A tenth of the step comes to the values of an exact displacement input.
    fine = bump.motion(10.0, 0.5, 0.0001)
    found = response(MASS, DAMPING, STIFFNESS, LOAD, fine.acceleration, step=0.0001, parts=1)
    total = found["a"][:, 0] + found["ground"][:, 0]
    assert peak(found["time"], total, np.gradient(total, found["time"]))[0] == pytest.approx(11.86333, rel=4e-6)
    relative = [found[each] @ [1, -1] for each in ("u", "v")]
    assert peak(found["time"], *relative)[0] == pytest.approx(0.08804839, rel=3e-6)
    assert peak(found["time"], found["u"][:, 1], found["v"][:, 1])[0] == pytest.approx(0.04430563, rel=4e-6)


ROADS = [
    roads.RandomRoad("B", 0.02, 3.0, 150, seed=3),
    roads.SineRoad(0.02, 7.0),
    roads.RoadBump(-0.05, 3.0),
]


def test_a_bump_has_the_stated_elevation() -> None:
    x = np.array([0.1, 0.5, 1.3, 1.9])
    assert roads.RoadBump(0.08, 2.0).elevation(x) == pytest.approx(0.08 * np.sin(np.pi * x / 2) ** 4, rel=1e-12)
    assert roads.RoadBump(0.08, 0.5).elevation([-0.1, 0.0, 0.25, 0.5, 0.6]) == pytest.approx([0, 0, 0.08, 0, 0])


def test_the_shortest_wave_limits_the_step() -> None:
    for road, shortest in ((roads.RandomRoad("A", 0.1, 4.0, 10), 0.25), (roads.RoadBump(0.1, 0.5), 0.25)):
        limit = shortest / 0.5 / 2
        assert road.shortest_wave == shortest
        assert road.motion(0.5, 1.0, 0.999 * limit).step == 0.999 * limit
        with pytest.raises(ValueError, match=f"give a step of at most {limit:g} s"):
            road.motion(0.5, 1.0, 1.001 * limit)


def test_a_motion_has_the_duration() -> None:
    road = roads.SineRoad(0.01, 5.0)
    assert road.motion(0.5, 1.1, 0.1).acceleration.size == 12  # 1.1 / 0.1 is rounded up
    assert road.motion(0.5, 0.05, 0.1).acceleration.size == 2
    assert road.motion(0.5, 1.05, 0.1).duration >= 1.05
    assert roads.road_velocity_density("A", 0.5) == pytest.approx(roads.road_velocity_density("A", 1.0) / 2)


@pytest.mark.parametrize("road", ROADS)
def test_slope_and_curvature_are_derivatives_of_the_elevation(road: roads.Road) -> None:
    x, h = np.linspace(-1.03, 6.01, 50), 1e-5
    slope = (road.elevation(x + h) - road.elevation(x - h)) / (2 * h)
    assert road.slope(x) == pytest.approx(slope, abs=1e-7)
    curvature = (road.slope(x + h) - road.slope(x - h)) / (2 * h)
    assert road.curvature(x) == pytest.approx(curvature, abs=1e-6)


@pytest.mark.parametrize("road", ROADS)
def test_a_rear_axle_passes_the_same_profile_later(road: roads.Road) -> None:
    front = road.motion(10.0, 2.0, 0.01)
    rear = road.motion(10.0, 2.0, 0.01, start=-2.0)
    assert rear.acceleration[20:] == pytest.approx(front.acceleration[:-20], abs=1e-9)
    assert front.acceleration == pytest.approx(100 * road.curvature(0.1 * np.arange(201)), abs=1e-12)


def test_a_random_road_has_the_spectral_density() -> None:
    # The period of the profile is 1 / dn; lines of its discrete Fourier transform are the waves.
    road = roads.RandomRoad("D", 0.05, 2.05, 400, seed=5)
    width = 2.0 / 400
    size = 4096
    places = np.arange(2 * size) / size / width  # two periods, because the frequencies are odd multiples of dn / 2
    elevation = road.elevation(places)
    density = 2 * np.abs(np.fft.rfft(elevation) / elevation.size) ** 2 / width
    frequency = np.arange(density.size) * width / 2
    is_line = np.isclose((frequency - 0.05) / width % 1, 0.5) & (frequency > 0.05) & (frequency < 2.05)
    assert is_line.sum() == 400
    assert density[is_line] == pytest.approx(roads.road_spectral_density(frequency[is_line], "D"), rel=1e-9)
    assert density[~is_line].max() < 1e-12 * density.max()
    assert elevation.std() == pytest.approx(road.standard_deviation, rel=1e-9)
    exact = np.sqrt(1024e-6 * 0.01 * (1 / 0.05 - 1 / 2.05))
    assert road.standard_deviation == pytest.approx(exact, rel=1e-3)


def test_profiles_are_reproducible_and_independent() -> None:
    x = np.linspace(0, 2000, 20001)
    first = roads.RandomRoad("A", 0.02, 2.0, 500, seed=1).elevation(x)
    assert np.array_equal(first, roads.RandomRoad("A", 0.02, 2.0, 500, seed=1).elevation(x))
    for other in (dict(profile=1, seed=1), dict(seed=2)):
        second = roads.RandomRoad("A", 0.02, 2.0, 500, **other).elevation(x)
        assert abs(np.corrcoef(first, second)[0, 1]) < 0.35
    scaled = roads.RandomRoad(4 * 16e-6, 0.02, 2.0, 500, seed=1).elevation(x)
    assert scaled == pytest.approx(2 * first, rel=1e-12)
    assert roads.RandomRoad("A", 0.02, 2.0, 501) == roads.RandomRoad("A", 0.02, 2.0, 501, profile=0, seed=0)
    phases = roads.RandomRoad("A", 0.02, 2.0, 501)._waves[2]
    assert phases.shape == (501,)
    assert 0 < phases.min() < 0.1
    assert 0 < 2 * np.pi - phases.max() < 0.1
    # The standard deviation over many profiles at one place.
    many = [float(roads.RandomRoad("A", 0.02, 2.0, 50, profile=i).elevation(3.0)) for i in range(1000)]
    assert np.std(many) == pytest.approx(roads.RandomRoad("A", 0.02, 2.0, 50).standard_deviation, rel=0.07)


NAMES = ("road_spectral_density", "road_velocity_density", "RandomRoad", "SineRoad", "RoadBump")


@pytest.mark.parametrize("name", NAMES)
def test_roads_are_documented(name: str) -> None:
    assert problems(name, getattr(roads, name)) == []


WRONG = [
    (lambda: roads.road_spectral_density(0.0, "A"), "spatial_frequency must be above 0"),
    (lambda: roads.road_spectral_density(0.1, "I"), "unknown road class 'I'; allowed: 'A'"),
    (lambda: roads.road_velocity_density("A", 0.0), "speed"),
    (lambda: roads.RandomRoad("A", 1.0, 0.5, 10), "highest is 0.5 1/m; it must be above lowest, 1 1/m"),
    (lambda: roads.RandomRoad(-1.0, 0.1, 0.5, 10), "roughness"),
    (lambda: roads.RandomRoad("A", 0.1, 0.5, 0), "waves must be a whole number of at least 1"),
    (lambda: roads.SineRoad(0.01, 0.0), "wavelength"),
    (lambda: roads.RoadBump(np.inf, 1.0), "height"),
    (lambda: roads.SineRoad(0.01, 5.0).motion(20.0, 2.0, 0.2), "step of at most 0.125 s, better 0.013 s"),
    (lambda: roads.SineRoad(0.01, 5.0).motion(0.0, 2.0, 0.01), "speed"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_invalid_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
