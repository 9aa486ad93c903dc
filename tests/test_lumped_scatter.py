"""Random parameters of lumped structures (masses with an inerter, eccentricities, outputs that are forces), and IDA."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.integration.stability_guard import StabilityFindings

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
TIME = 0.01 * np.arange(500)


def motion(period, name=""):
    acceleration = 3.0 * np.sin(2 * np.pi * TIME / period) * np.exp(-0.3 * TIME)
    return wd.GroundMotion(acceleration, 0.01, name or f"{period} s")


def test_the_load_follows_random_masses_but_not_an_inerter():
    inertance = np.array([[0.0, 0.0], [0.0, 1e4]])

    def structure(factor):
        springs = [
            wd.Spring("frame", {"u": 1.0}, stiffness=5e7),
            wd.Spring("absorber", {"a": 1.0, "u": -1.0}, stiffness=2e5, damping_coefficient=2e4),
        ]
        masses = {"u": 2e5 * factor, "a": 4e3 * factor}
        return wd.LumpedStructure(masses, springs, mass_matrix=inertance, load_mass=list(masses.values()))

    scatter = {"mass": wd.GivenValues(np.array([[3e5, 6e3]]))}
    settings = {"dtype": "float64", "device": "cpu", "step": 0.005}
    random = wd.simulate(wd.Scene(structure(1.0), motion(0.6), scatter), structures=1, **settings)
    built = wd.simulate(wd.Scene(structure(1.5), motion(0.6)), **settings)
    np.testing.assert_allclose(random["peak_displacement"], built["peak_displacement"], rtol=1e-9)


def test_random_eccentricities_in_both_directions_are_those_of_buildings_with_these_centres():
    frames = [
        wd.PlanFrame("f", (0.0, -5.0), "x", 5e7),
        wd.PlanFrame("b", (0.0, 5.0), "x", 5e7),
        wd.PlanFrame("w", (-9.0, 0.0), "y", 9e7),
        wd.PlanFrame("g", (9.0, 0.0), "y", 3e7),
    ]
    plan, pair = [[-10.0, 10.0], [-6.0, 6.0]], wd.PairOfMotions(motion(0.4), motion(0.33))
    names = ("eccentricity_x", "eccentricity_y")
    settings = {"dtype": "float64", "device": "cpu", "step": 0.005}
    for mass in (1e5, 1.7e5, 3.3e5):  # rounding hid equal places of entries for some masses
        scatter = {name: wd.RandomValue(wd.Uniform(-3.0, 3.0)) for name in names}
        run = wd.simulate(wd.Scene(wd.TorsionalBuilding([mass], plan, frames), pair, scatter), structures=3, **settings)
        for sample in range(3):
            centre = [run[name].values[sample] for name in names]
            fixed = wd.TorsionalBuilding([mass], plan, frames, mass_centre=centre)
            due = wd.simulate(wd.Scene(fixed, pair), **settings)["peak_spring_deformation"][0]
            np.testing.assert_allclose(run["peak_spring_deformation"][sample], due, rtol=1e-7)


def test_an_incremental_analysis_is_that_of_the_chain():
    chain = wd.ShearBuilding(
        [2e5, 2e5],
        [8e7, 7e7],
        3.0,
        law="bilinear",
        yield_force=[8e5, 6e5],
        hardening_ratio=0.02,
        damping="rayleigh",
        damping_ratio=0.05,
    )
    motions = wd.Cloud([motion(period) for period in (0.3, 0.4, 0.5)])
    settings = {"device": "cpu", "method": "rk4", "step": 0.002, "dtype": "float64"}
    found = [
        wd.capacities(wd.Scene(structure, motions), {"slight": 0.03}, demand=demand, **settings)["capacity"]
        for structure, demand in ((chain, "peak_storey_drift"), (wd.lumped_chain(chain), "peak_spring_deformation"))
    ]
    np.testing.assert_allclose(found[1], found[0], rtol=0.02)  # the tolerance of the search


@pytest.mark.parametrize("built", ["tank", "tower"])
def test_random_stiffness_needs_outputs_that_are_not_forces(built):
    def structure(**more):
        if built == "tank":
            return wd.HousnerTank(wd.housner_cylinder(10.0, 8.0), impulsive_period=0.15, **more)
        return wd.FlexuralShearBuilding([4e5] * 3, 3.0, period=0.5, alpha0=4.0, **more)

    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
    with pytest.raises(ValueError, match="force_outputs=False"):
        wd.Scene(structure(), motion(0.4), scatter)
    without = structure(force_outputs=False)
    assert "base shear" not in without.outputs
    wd.Scene(without, motion(0.4), scatter)


def test_masses_of_a_floor_have_one_factor():
    frames = [wd.PlanFrame("f", (0.0, 0.0), "x", 5e7), wd.PlanFrame("w", (1.0, 0.0), "y", 5e7)]
    frames.append(wd.PlanFrame("g", (9.0, 0.0), "y", 3e7))
    building = wd.TorsionalBuilding([1e5], [[-10.0, 10.0], [-6.0, 6.0]], frames, base_motion="x")
    for spread in (wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="dof"), wd.RandomValue(wd.Uniform(9e4, 1.1e5))):
        with pytest.raises(ValueError, match="moment of inertia"):
            wd.Scene(building, motion(0.4), {"mass": spread})
    wd.Scene(building, motion(0.4), {"mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1))})


def test_a_rotation_needs_an_influence():
    with pytest.raises(ValueError, match="influence is missing"):
        wd.LumpedStructure({"x": 1e5, "t": 1e6}, [wd.Spring("a", {"x": 1.0, "t": 5.0}, stiffness=1e7)])


def test_components_of_a_pair_are_perpendicular():
    first, second = (wd.GroundMotion(motion(0.4).acceleration, 0.01, c, component=c) for c in ("000", "045"))
    with pytest.raises(ValueError, match="not perpendicular"):
        wd.PairOfMotions(first, second)
    wd.PairOfMotions(first, wd.GroundMotion(first.acceleration, 0.01, "E", component="090"))


def test_a_contact_that_is_pressed_after_a_slow_touch_is_stable():
    springs = [
        wd.Spring("frame", {"u": 1.0}, stiffness=1e5),
        wd.Spring(
            "wall",
            {"u": 1.0},
            law="ye_li_zhu_contact",
            clearance=1e-4,
            hertz_stiffness=2e9,
            restitution=0.4,
            expected_penetration=0.01,
        ),
    ]
    structure = wd.LumpedStructure({"u": 2e5}, springs)
    force = np.interp(TIME, [0.0, 2.0, 2.1, 5.0], [0.0, 0.01, 3.0, 3.0])  # m/s2
    scene = wd.Scene(structure, wd.GroundMotion(-force, 0.01, "push"), recorders=("spring", "energy"), tail=0.0)
    run = wd.simulate(scene, dtype="float64", device="cpu")
    fine = wd.simulate(scene, dtype="float64", device="cpu", step=1e-5)
    assert abs(run["energy_balance_error"].item()) < 0.02
    np.testing.assert_allclose(run["peak_spring_force"], fine["peak_spring_force"], rtol=0.01)


def test_an_exponent_of_a_biaxial_law_other_than_2_runs():
    law = wd.laws.IsotropicBoucWen(yield_force=1e5, post_yield_stiffness=5e5, exponent=1.5)
    spring = wd.BiaxialSpring("bearing", {"x": 1.0}, {"y": 1.0}, law=law, stiffness=1e7)
    structure = wd.LumpedStructure({"x": 1e5, "y": 1e5}, [spring], influence=[{"x": 1.0}, {"y": 1.0}])
    still = wd.GroundMotion(np.zeros(TIME.size), 0.01, "none")
    run = wd.simulate(wd.Scene(structure, wd.PairOfMotions(motion(0.8), still)), dtype="float64", device="cpu")
    assert run["status"].item() == 0
    assert run["peak_spring_deformation"].values[0, 0] > 0.01
    assert run["peak_spring_deformation"].values[0, 1] == 0


@pytest.mark.parametrize("has_residual", [False, True])
def test_decays_that_are_not_computed_at_first_change_no_step(has_residual):
    """Steps of structures with short periods depend on the decay, here as it is computed for all structures at once."""
    springs = [
        wd.Spring("lower", {"a": 1.0}, law="bilinear", stiffness=4e7, yield_force=4e5, hardening_ratio=0.02),
        wd.Spring("upper", {"b": 1.0, "a": -1.0}, stiffness=2e7, damping_coefficient=3e4),
    ]
    structure = wd.LumpedStructure({"a": 1e5, "b": 8e4}, springs, damping="rayleigh", damping_ratio=0.03)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 1.0), per="spring")}
    recorders = ("residual", "displacement") if has_residual else ("displacement",)
    scene = wd.Scene(structure, motion(0.6), scatter, recorders=recorders)
    settings = {"structures": 200, "method": "leapfrog", "divides_steps": True, "device": "cpu"}
    known, whole = {}, {}
    ensemble, vibration = prepare(scene, known=known, **settings)
    drawn = known["leapfrog"][0]
    whole["leapfrog"] = drawn, ensemble.model.dynamics.vibration_of(drawn, ensemble.model.method)
    other, other_vibration = prepare(scene, known=whole, **settings)
    assert np.isnan(vibration.decay).any() != has_residual
    assert (other_vibration.decay > 0).all()
    # Eigenvalues by two routines of LAPACK differ by rounding.
    np.testing.assert_allclose(vibration.period, other_vibration.period, rtol=1e-12)
    np.testing.assert_allclose(vibration.stable_step, other_vibration.stable_step, rtol=1e-12)
    undivided = ensemble.schedule.substeps.copy()
    for run, found in ((ensemble, vibration), (other, other_vibration)):
        shorten_steps(run, found, StabilityFindings(run.size, "leapfrog"), divides=True)
    assert (ensemble.schedule.substeps > undivided).any()
    np.testing.assert_array_equal(ensemble.schedule.substeps, other.schedule.substeps)
    np.testing.assert_array_equal(ensemble.schedule.run_intervals, other.schedule.run_intervals)
