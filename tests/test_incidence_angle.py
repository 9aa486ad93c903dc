"""Random angles of incidence of pairs of motions: the response is that to the turned motion."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
TIME = 0.01 * np.arange(500)
SETTINGS = {"dtype": "float64", "device": "cpu", "step": 0.005}
ANGLES = [0.0, 35.0, 90.0, 144.0, 180.0, 260.0, 400.0]


def motion(period, size=3.0):
    return wd.GroundMotion(size * np.sin(2 * np.pi * TIME / period) * np.exp(-0.3 * TIME), 0.01, f"{period} s")


PAIR = wd.PairOfMotions(motion(0.4), motion(0.55, 2.0))


def frames(law):
    def force(value):
        return {"yield_force": value, "hardening_ratio": 0.05} if law == "bilinear" else {}

    return [
        wd.PlanFrame("f", (0.0, -5.0), "x", 5e7, law=law, **force(3e5)),
        wd.PlanFrame("b", (0.0, 5.0), "x", 5e7, law=law, **force(3e5)),
        wd.PlanFrame("w", (-9.0, 0.0), "y", 9e7, law=law, **force(5e5)),
        wd.PlanFrame("g", (9.0, 0.0), "y", 3e7, law=law, **force(2e5)),
    ]


def building(law="elastic"):
    return wd.TorsionalBuilding(
        [1.5e5, 1.2e5], [[-10.0, 10.0], [-6.0, 6.0]], frames(law), damping="rayleigh", damping_ratio=0.05
    )


def with_load_mass():
    """A full mass matrix, another load mass and oblique influence vectors."""
    springs = [wd.Spring(f"k{dof}", {dof: 1.0}, stiffness=5e7 * (1 + i)) for i, dof in enumerate("abc")]
    coupling = np.array([[0.0, 2e4, 0.0], [2e4, 0.0, 1e4], [0.0, 1e4, 0.0]])
    influence = [{"a": 0.6, "b": 0.8, "c": 0.1}, {"a": -0.8, "b": 0.6}]
    masses = dict.fromkeys("abc", 2e5)
    loads = [1.8e5, 2e5, 1.9e5]
    return wd.LumpedStructure(masses, springs, mass_matrix=coupling, load_mass=loads, influence=influence)


@pytest.mark.parametrize("structure", [building(), building("bilinear"), with_load_mass()], ids=["e", "b", "m"])
def test_a_given_angle_is_that_of_the_turned_motion(structure):
    given = {"incidence_angle": wd.GivenValues(np.radians(ANGLES))}
    run = wd.simulate(wd.Scene(structure, PAIR, given), **SETTINGS)
    names = [name for name in run.data_vars if name.startswith(("peak_", "residual_", "input_energy", "time_of_peak"))]
    assert len(names) >= 6
    for sample, angle in enumerate(ANGLES):
        due = wd.simulate(wd.Scene(structure, PAIR.turned(angle)), **SETTINGS)
        for name in names:
            scale = np.abs(due[name]).max().item()
            np.testing.assert_allclose(run[name][sample], due[name][0], rtol=1e-9, atol=1e-9 * scale, err_msg=name)


def test_an_oscillator_in_one_direction_has_the_response_to_the_component_in_this_direction():
    """The closed form: the response along x to a motion turned by t is cos t times that to x plus sin t that to y."""
    deck = wd.LumpedStructure(
        {"x": 1e5, "y": 1e5},
        [wd.Spring(f"k{dof}", {dof: 1.0}, stiffness=2e7, damping_coefficient=1e5) for dof in "xy"],
        influence=[{"x": 1.0}, {"y": 1.0}],
    )
    given = {"incidence_angle": wd.GivenValues(np.radians(ANGLES))}
    run = wd.simulate(wd.Scene(deck, PAIR, given, recorders=("displacement",)), **SETTINGS)
    alone = wd.simulate(wd.Scene(deck, PAIR), histories=wd.Histories(), **SETTINGS)["displacement"]
    history = alone.isel(history=0).transpose("time", "dof").values
    for sample, angle in enumerate(np.radians(ANGLES)):
        due = np.abs(history @ [np.cos(angle), np.sin(angle)]).max()
        assert run["peak_displacement"].sel(dof="x").values[sample] == pytest.approx(due, rel=1e-9)


def test_random_angles_are_those_of_their_distribution_and_with_random_eccentricity():
    scatter = {
        "incidence_angle": wd.RandomValue(wd.Uniform(0.0, 2 * np.pi)),
        "eccentricity_x": wd.RandomValue(wd.Uniform(-1.0, 1.0)),
    }
    run = wd.simulate(wd.Scene(building("bilinear"), PAIR, scatter), structures=64, seed=3, **SETTINGS)
    angle = run["incidence_angle"]
    assert angle.attrs["units"] == "rad"
    assert 0 < angle.min() < 0.2
    assert 2 * np.pi - 0.2 < angle.max() < 2 * np.pi
    for sample in (0, 17, 42):
        centre = [run["eccentricity_x"].values[sample], 0.0]
        fixed = wd.TorsionalBuilding(
            [1.5e5, 1.2e5],
            [[-10.0, 10.0], [-6.0, 6.0]],
            frames("bilinear"),
            mass_centre=centre,
            damping="rayleigh",
            damping_ratio=0.05,
        )
        due = wd.simulate(wd.Scene(fixed, PAIR.turned(np.degrees(angle.values[sample]))), **SETTINGS)
        np.testing.assert_allclose(run["peak_spring_deformation"][sample], due["peak_spring_deformation"][0], rtol=1e-7)


def test_a_run_is_built_again_from_its_json():
    scatter = {"incidence_angle": wd.RandomValue(wd.Uniform(0.0, 2 * np.pi))}
    run = wd.simulate(wd.Scene(building(), PAIR, scatter), structures=3, seed=2, **SETTINGS)
    again = wd.simulate(wd.Scene.from_json(run.attrs["scene"], [PAIR]), structures=3, seed=2, **SETTINGS)
    np.testing.assert_array_equal(again["peak_output"], run["peak_output"])


def test_misuse_is_refused():
    spread = {"incidence_angle": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    with pytest.raises(ValueError, match=r"incidence_angle is 0, which a factor does not change: give wd\.RandomValue"):
        wd.Scene(building(), PAIR, spread)
    with pytest.raises(ValueError, match="eccentricity_x is 0, which a factor does not change"):
        wd.Scene(building(), PAIR, {"eccentricity_x": wd.RandomFactor(wd.Lognormal(1.0, 0.2))})
    angle = {"incidence_angle": wd.RandomValue(wd.Uniform(0.0, 2 * np.pi))}
    along_x = wd.TorsionalBuilding([1e5], [[-10.0, 10.0], [-6.0, 6.0]], frames("elastic"), base_motion="x")
    for structure, load in ((along_x, motion(0.4)), (wd.lumped_chain(wd.ShearBuilding(1e5, 1e7, 3.0)), motion(0.4))):
        with pytest.raises(ValueError, match="unknown parameter 'incidence_angle'"):
            wd.Scene(structure, load, angle)
    car = wd.HalfCar(1200.0, 2100.0, 0.9, 1.2, (60.0, 60.0), (28e3, 21e3), (2500.0, 2000.0), (2e5, 2e5))
    axles = wd.RoadBump(height=0.05, length=2.0).motion_of_axles(car.wheelbase, speed=10.0, duration=3.0, step=0.002)
    with pytest.raises(ValueError, match="unknown parameter 'incidence_angle'"):
        wd.Scene(car, axles, angle)


@pytest.mark.parametrize(
    "given", [wd.GivenValues([0.0, 45.0]), wd.RandomValue(wd.Uniform(0.0, 90.0)), wd.RandomValue(wd.Normal(0.0, 30.0))]
)
def test_angles_in_degrees_give_a_warning(given):
    with pytest.warns(UserWarning, match=r"angle of incidence is .* rad \(usual: at most 7 rad\): if given in degrees"):
        warn_of_implausible(wd.Scene(building(), PAIR, {"incidence_angle": given}))


@pytest.mark.parametrize(
    "load",
    [wd.HarmonicForce([1e3] + [0.0] * 5, 10.0, 1.0), wd.FreeVibration(1.0, velocity=[0.1, 0.0, 0.0] * 2)],
    ids=["force", "free vibration"],
)
def test_an_angle_without_a_base_motion_is_refused(load):
    angle = {"incidence_angle": wd.RandomValue(wd.Uniform(0.0, 2 * np.pi))}
    match = r"scatter\['incidence_angle'\] has no effect under a (HarmonicForce|FreeVibration), which does not move"
    with pytest.raises(ValueError, match=match):
        wd.Scene(building(), load, angle)
    wd.Scene(building(), load)
