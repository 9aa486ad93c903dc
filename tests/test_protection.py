"""Buildings on isolators and under tuned mass dampers, against closed forms and OpenSees."""

import numpy as np
import pytest
from opensees import chain_drifts
from scipy.constants import g as STANDARD_GRAVITY

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("damping_ratio")


def frame(**parameters):
    given = {"mass": np.full(3, 1e5), "stiffness": [2e8, 1.6e8, 1.2e8], "height": 3.2} | parameters
    return wd.ShearBuilding(**given)


def run_of(building, load, step, tail=0.0, **options):
    scene = wd.Scene(building, load, tail=tail, recorders=("drift", "energy"))
    options = {"method": "rk4", "dtype": "float64"} | options
    if step is not None and hasattr(load, "duration"):
        step = load.duration / np.ceil(load.duration / step)
    run = wd.simulate(scene, step=step, histories=wd.Histories(), device="cpu", **options)
    assert run.status.item() == 0
    return run


def test_isolated_period_of_two_masses():
    # Kelly (1990): with g the mass ratio m / (m + mb), (1 - g) w^4 - (wb^2 + ws^2) w^2 + wb^2 ws^2 = 0.
    mass, base, stiffness, isolators = 2e5, 5e4, 8e7, 2.5e6
    building = wd.ShearBuilding(mass, stiffness, 3.0).on_isolators("elastic", base, 0.4, stiffness=isolators)
    ws2, wb2, g = stiffness / mass, isolators / (mass + base), mass / (mass + base)
    squared = np.sort(np.roots([1 - g, -(wb2 + ws2), wb2 * ws2]))
    np.testing.assert_allclose(building.modal()["circular_frequency"] ** 2, squared, rtol=1e-10)
    assert building.fundamental_period == pytest.approx(2 * np.pi * np.sqrt((mass + base) / isolators), rel=0.02)


def test_friction_pendulum_swings_as_a_pendulum():
    # Without friction the period is 2 pi sqrt(R / g), whatever the mass.
    radius = 1.5
    building = wd.ShearBuilding(2e5, 1e12, 3.0).on_isolators(
        "friction_pendulum", 5e4, 0.4, stiffness=1e9, friction_coefficient=0.0, radius=radius
    )
    period = 2 * np.pi * np.sqrt(radius / STANDARD_GRAVITY)
    run = run_of(building, wd.FreeVibration(2 * period, velocity=0.3), 2e-4)
    u = run.displacement.values[0, :, 0]
    zeros = np.flatnonzero(u[1:-1] * u[2:] < 0) + 1
    time = run["time"].values[zeros]
    np.testing.assert_allclose(time[:3], period * np.array([0.5, 1.0, 1.5]), atol=4e-4)  # two steps


def test_damping_does_not_act_across_isolators():
    ratio = 0.05
    building = frame(damping="rayleigh", damping_ratio=ratio)
    isolated = building.on_isolators("elastic", 1e5, 0.5, stiffness=1e7, damper_coefficient=4e5)
    assert isolated.damped_storeys == (2, 4)
    run = run_of(isolated, wd.FreeVibration(2.0, velocity=0.2), 1e-3)
    # The viscous energy of the dashpots that the frame has by C = a1 K, a1 = 2 zeta / w1 of its own first mode.
    a1 = 2 * ratio / float(building.modal()["circular_frequency"][0])
    dashpots = np.array([4e5, *(a1 * building.parameters["stiffness"])])
    rates = np.diff(run.velocity.values[0], axis=1, prepend=0)
    time = run["time"].values
    expected = np.trapezoid((dashpots * rates**2).sum(axis=1), time)
    assert run.viscous_energy.item() == pytest.approx(expected, rel=1e-4)  # the trapezoidal rule's, at 1 ms


def test_damped_storeys_of_a_whole_building_have_their_ratio():
    ratio = 0.03
    building = frame(damping="rayleigh", damping_ratio=ratio, damped_storeys=(1, 3))
    first = building.modal().isel(mode=0)
    omega, shape = float(first["circular_frequency"]), first["shape"].values
    cycles = 4
    damped = omega * np.sqrt(1 - ratio**2)
    load = wd.FreeVibration(cycles * 2 * np.pi / damped, velocity=0.1 * shape)
    for method in ("rk4", "exact"):
        run = run_of(building, load, None, method=method) if method == "exact" else run_of(building, load, 1e-3)
        # In its first mode the building decays by exp(-zeta w t), at whole cycles back to the shape of its velocity.
        decayed = 0.1 * shape * np.exp(-ratio * omega * load.duration)
        np.testing.assert_allclose(run.velocity.values[0, -1], decayed, rtol=2e-3)


@pytest.mark.parametrize("mass_ratio", [0.02, 0.1])
def test_tuned_mass_damper_against_den_hartog(mass_ratio):
    mass, stiffness, amplitude = 1e5, 4e6, 1e4
    building = wd.ShearBuilding(mass, stiffness, 3.0)
    damped = building.with_tuned_mass_damper(mass_ratio)
    omega = np.sqrt(stiffness / mass)
    f, zeta = 1 / (1 + mass_ratio), np.sqrt(3 * mass_ratio / (8 * (1 + mass_ratio)))
    # The fixed points of all damping ratios, of equal height sqrt(1 + 2 / mu) at the optimum tuning.
    fixed = np.sqrt((1 + np.array([-1, 1]) * np.sqrt(mass_ratio / (2 + mass_ratio))) / (1 + mass_ratio))
    for g in (*fixed, 0.9, 1.0):
        of_damper = f**2 + 2j * zeta * f * g
        response = (of_damper - g**2) / ((1 - g**2) * (of_damper - g**2) - mass_ratio * g**2 * of_damper)
        if g in fixed:
            assert abs(response) == pytest.approx(np.sqrt(1 + 2 / mass_ratio), rel=1e-9)
        # The slowest mode decays at about zeta w / 2: by the last cycles nothing of it is left.
        duration = 18 / (zeta * omega / 2)
        load = wd.HarmonicForce([amplitude, 0.0], g * omega, duration)
        run = run_of(damped, load, 2 * np.pi / omega / 200)
        last = run.displacement.values[0, -400:, 0]
        assert np.abs(last).max() == pytest.approx(abs(response) * amplitude / stiffness, rel=1e-3)


def test_tuned_mass_damper_of_a_frame():
    building = frame()
    damped = building.with_tuned_mass_damper(0.05, 0.9, 0.1)
    first = building.modal().isel(mode=0)
    shape = first["shape"].values / first["shape"].values[-1]
    mass = 0.05 * (building.parameters["mass"] * shape**2).sum()
    omega = 0.9 * float(first["circular_frequency"])
    assert damped.storeys == 4
    assert damped.parameters["mass"][-1] == pytest.approx(mass)
    assert damped.parameters["stiffness"][-1] == pytest.approx(mass * omega**2)
    assert damped.parameters["damper_coefficient"][-1] == pytest.approx(2 * 0.1 * omega * mass)
    np.testing.assert_array_equal(damped.parameters["stiffness"][:-1], building.parameters["stiffness"])


PULSE = 4.0 * np.sin(0.35 * np.arange(160)) * np.hanning(160) + 2.0 * np.sin(0.06 * np.arange(160))


@pytest.mark.parametrize(
    ("method", "dtype"),
    [
        ("newmark_average", "float64"),
        pytest.param("rk4", "float32", marks=pytest.mark.thorough),
        pytest.param("rk4", "float64", marks=pytest.mark.thorough),
    ],
)
def test_whole_history_of_many_devices_against_opensees(method, dtype):
    # Lead-rubber bearings with a stop, a yielding frame with friction dampers in one storey, viscous ones in another.
    mass, step = np.array([1e5, 8e4, 8e4, 6e4]), 0.02
    strength, hardening = [6e5, 5e5, 4e5], 0.05
    bearings = {"stiffness": 2e7, "yield_force": 1.2e5, "post_yield_stiffness": 1.5e6}
    building = wd.ShearBuilding(
        mass,
        [2e7, 2e8, 1.6e8, 1.2e8],
        3.2,
        law=("lead_rubber_bearing", "bilinear", "bilinear", "bilinear"),
        yield_force=[1.2e5, *strength],
        hardening_ratio=hardening,
        post_yield_stiffness=bearings["post_yield_stiffness"],
        devices=("friction_damper", "viscous_damper", "gap"),
        slip_force=[0, 0, 8e4, 0],
        brace_stiffness=2e8,
        damper_coefficient=[0, 0, 0, 1.5e5],
        velocity_exponent=0.5,
        linear_velocity=1e-3,
        clearance=0.2,
        contact_stiffness=[5e7, 0, 0, 0],
        damping="storey",
        damping_coefficient=[0.0, 6e5, 5e5, 4e5],
    )
    load = wd.GroundMotion(PULSE, step)
    ours = run_of(building, load, 1e-3, tail=1.0, method=method, dtype=dtype)
    intervals = round(float(ours["time"].values[-1]) / step)
    materials = [("Steel01", [1.2e5, 2e7, 1.5e6 / 2e7])]
    materials += [("Steel01", [f, k, hardening]) for f, k in zip(strength, [2e8, 1.6e8, 1.2e8], strict=True)]
    devices = [
        [("ElasticPPGap", [5e7, 1e12, 0.2]), ("ElasticPPGap", [5e7, -1e12, -0.2])],
        [],
        [("ElasticPP", [2e8, 8e4 / 2e8])],
        [("Viscous", [1.5e5, 0.5])],
    ]
    theirs = chain_drifts(mass, materials, (0.0, [0, 6e5, 5e5, 4e5]), np.zeros(4), PULSE, step, intervals, 40, devices)
    drift = np.diff(ours.displacement.values[0], axis=1, prepend=0)
    every = round(step / float(ours["time"].values[1]))
    peak = np.abs(theirs).max(axis=0)
    assert peak[0] > 0.2  # the stop is met
    assert ours.hysteretic_energy.values[0, 2] > 100  # friction slips
    # Both are of second order across the corners of these laws, at 1 ms and at 0.5 ms.
    np.testing.assert_allclose(drift[::every] / peak, theirs[::40] / peak, rtol=0, atol=0.01)
    np.testing.assert_allclose(np.abs(drift).max(axis=0), peak, rtol=0.005)
    assert abs(ours.energy_balance_error.item()) < 1e-3


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"base_mass": -1e5}, ["base_mass", "above 0"]),
        ({"displacement_capacity": 0.0}, ["displacement_capacity", "above 0"]),
        ({"yield_force": 1.0}, ["yield_force", "elastic"]),
        ({"stiffness": np.nan}, ["stiffness", "finite", "nan"]),
        ({"law": "lead_rubber_bearing", "yield_force": 1e5}, ["post_yield_stiffness is missing", "storey 1"]),
        ({"law": "rubber"}, ["law of isolators 'rubber'", "lead_rubber_bearing"]),
    ],
)
def test_bad_isolators(parameters, words):
    given = {"law": "elastic", "base_mass": 1e5, "displacement_capacity": 0.5, "stiffness": 1e7} | parameters
    with pytest.raises(ValueError, match=".*".join(words)):
        frame().on_isolators(**given)


def test_isolators_do_not_take_the_frames_stiffness_for_theirs():
    with pytest.raises(ValueError, match="stiffness is missing at storey 1, whose law 'elastic' needs it"):
        frame().on_isolators("elastic", 1e5, 0.5)


def test_isolators_have_the_defaults_of_their_law():
    own = {"yield_force": 1e6, "hardening_ratio": 0.1, "exponent": 3.0}
    isolators = {"stiffness": 1e7, "yield_force": 1e5, "hardening_ratio": 0.05}
    building = frame(law="bouc_wen", **own).on_isolators("bouc_wen", 1e5, 0.5, **isolators)
    np.testing.assert_array_equal(building.parameters["exponent"], [1.0, 3.0, 3.0, 3.0])
    with pytest.raises(ValueError, match="hardening_ratio is missing at storey 1, whose law 'bouc_wen' needs it"):
        frame(law="bouc_wen", **own).on_isolators("bouc_wen", 1e5, 0.5, stiffness=1e7, yield_force=1e5)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"mass_ratio": 0.0}, ["mass_ratio", "above 0"]),
        ({"mass_ratio": 5}, ["mass_ratio is 5; it must be finite and above 0 and at most 1; 5 % is 0.05"]),
        ({"mass_ratio": 0.1, "frequency_ratio": 0.0}, ["frequency_ratio", "above 0"]),
        ({"mass_ratio": 0.1, "damping_ratio": -0.1}, ["damping_ratio", "at least 0"]),
    ],
)
def test_bad_tuned_mass_dampers(parameters, words):
    with pytest.raises(ValueError, match=".*".join(words)):
        frame().with_tuned_mass_damper(**parameters)


@pytest.mark.parametrize("damping", ["modal", "mass_proportional", "rayleigh_tangent"])
def test_damping_of_the_whole_building_takes_no_isolators(damping):
    building = frame(damping=damping, damping_ratio=0.05)
    with pytest.raises(ValueError, match=rf"{damping}.*isolators.*would also act on them.*'stiffness_proportional'"):
        building.with_tuned_mass_damper(0.05)


def test_damping_in_proportion_to_stiffness_stays_that_of_the_fixed_base():
    ratio = 0.05
    building = frame(damping="stiffness_proportional", damping_ratio=ratio)
    isolated = building.on_isolators("elastic", 1e5, 0.5, stiffness=1e7, damper_coefficient=4e5)
    assert isolated.damped_storeys == (2, 4)
    a1 = 2 * ratio / float(building.modal()["circular_frequency"][0])
    dashpots = np.array([4e5, *(a1 * building.parameters["stiffness"])])
    same = wd.ShearBuilding(
        **{name: isolated.parameters[name] for name in ("mass", "stiffness", "height")},
        damping="storey",
        damping_coefficient=dashpots,
    )
    load = wd.FreeVibration(2.0, velocity=0.2)
    ours, expected = (run_of(each, load, 1e-3) for each in (isolated, same))
    np.testing.assert_allclose(ours.displacement, expected.displacement, rtol=0, atol=1e-12)
