"""Biaxial springs: paths and response histories against results of other programs, closed forms and rotated axes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from lumped_cases import pulse

import warpdyn as wd
from warpdyn import laws

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]

SETTINGS = {"dtype": "float64", "device": "cpu"}
# A spring with the strength 150 kN, the stiffness 1 MN/m after yield and the yield displacement 0.04 m.
STRENGTH, AFTER, YIELD = 150e3, 1.0e6, 0.04
STIFFNESS = STRENGTH / YIELD + AFTER
YIELDING = {"yield_force": STIFFNESS * YIELD, "post_yield_stiffness": AFTER}
FORMS = {
    "isotropic": laws.IsotropicBoucWen(**YIELDING),
    "Park-Wen-Ang 0.5": laws.ParkWenAng(**YIELDING),
    "Park-Wen-Ang 0.1": laws.ParkWenAng(beta=0.1, gamma=0.9, **YIELDING),
    "circular": laws.CircularYield(**YIELDING),
}
# Forces [N] on a straight line to (0.1 m, 0), s = 0 to 1, and on two turns of a circle about 0, s = 1 to 3. The first
# and the last form agree with OpenSees' elements within 0.04 N, the others come from two integrators.
PATH = {
    1.0: ((247992.1, 0), (247992.1, 0), (247992.1, 0), (250000, 0)),
    1.125: ((56023.39, 219673.4), (47633.49, 210542.7), (54018.65, 217345.8), (57011.74, 220083.8)),
    1.25: ((-134424.1, 166534.7), (-135281.1, 164162.3), (-134634, 165944.5), (-134335.1, 166739)),
    1.4: ((-210672.9, -16450.39), (-210196.3, -16902.43), (-210563.8, -16557.44), (-210686.4, -16427.34)),
    1.5: ((-160182.5, -137397.5), (-160027.8, -137453.8), (-160146.6, -137410.7), (-160188.3, -137394.9)),
    1.7: ((81298.51, -194660.2), (81377.81, -194515.4), (81314.94, -194630.3), (81298.27, -194660.5)),
    2.0: ((160000.1, 137477.2), (159923.5, 137501.2), (159984.4, 137482.1), (160000.1, 137477.2)),
    2.3: ((-180191.4, 109686.2), (-178145.4, 109178.4), (-179774.1, 109582.6), (-180191.4, 109686.2)),
    2.65: ((17175.81, -210249.8), (17343.19, -209972.2), (17210.03, -210192.9), (17175.81, -210249.8)),
    3.0: ((160000, 137477.3), (159923.5, 137501.2), (159984.3, 137482.2), (160000, 137477.3)),
}
ENERGY = {"isotropic": 86379.51, "Park-Wen-Ang 0.5": 86109.44, "Park-Wen-Ang 0.1": 86324.35, "circular": 86379.51}  # J
STEPS = 4000  # per unit of s


def spring_of(law: laws.BiaxialLaw, stiffness: float = STIFFNESS, **arguments: float) -> wd.BiaxialSpring:
    return wd.BiaxialSpring("bearing", {"x": 1.0}, {"y": 1.0}, law=law, stiffness=stiffness, **arguments)


def line_and_circles() -> np.ndarray:
    s = np.arange(1, 3 * STEPS + 1) / STEPS
    angle = 2 * np.pi * (s - 1)
    circle = 0.1 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.where(s[:, None] <= 1, np.stack([0.1 * s, 0 * s], axis=1), circle)


@pytest.mark.parametrize("form", FORMS)
def test_forces_along_a_line_and_two_circles(form):
    path = line_and_circles()
    force = spring_of(FORMS[form]).forces_along(path)
    column = list(FORMS).index(form)
    found = [force[round(s * STEPS) - 1] for s in PATH]
    np.testing.assert_allclose(found, [row[column] for row in PATH.values()], atol=1.0)  # N
    middle, moved = (force[1:] + force[:-1]) / 2, np.diff(path, axis=0)
    energy = np.einsum("sk,sk->s", middle, moved)[-STEPS:].sum()
    assert energy == pytest.approx(ENERGY[form], rel=1e-5)


@pytest.mark.parametrize("form", ["isotropic", "circular"])
def test_the_steady_state_on_a_circle_is_that_of_a_closed_form(form):
    force = spring_of(FORMS[form]).forces_along(line_and_circles())[-1]
    radial, along = YIELD / 0.1, np.sqrt(1 - (YIELD / 0.1) ** 2)
    np.testing.assert_allclose(force, [STRENGTH * radial + AFTER * 0.1, STRENGTH * along], rtol=1e-6)


def test_only_the_form_of_park_wen_and_ang_depends_on_the_axes():
    path = line_and_circles()
    turn = np.array([[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]])
    changes = {}
    for form, law in FORMS.items():
        force, turned = spring_of(law).forces_along(path), spring_of(law).forces_along(path @ turn.T)
        changes[form] = np.abs(turned - force @ turn.T).max() / np.abs(force).max()
    assert changes["isotropic"] < 1e-12
    assert changes["circular"] < 1e-12
    assert changes["Park-Wen-Ang 0.5"] > 0.02


@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.5])
def test_along_one_axis_it_is_the_bouc_wen_law_of_storeys(exponent):
    drift = 0.1 * np.sin(np.linspace(0, 12, 3000)) * np.linspace(0.2, 1, 3000)
    law = laws.IsotropicBoucWen(exponent=exponent, beta=0.3, gamma=0.2, **YIELDING)
    force = spring_of(law).forces_along(np.stack([drift, 0 * drift], axis=1))
    storey = wd.ShearBuilding(
        1e5,
        STIFFNESS,
        3.0,
        law="bouc_wen",
        yield_force=YIELDING["yield_force"],
        hardening_ratio=AFTER / STIFFNESS,
        beta=0.3,
        gamma=0.2,
        exponent=exponent,
    )
    due = wd.storey_hysteresis(storey, drift)["storey_force"].values[:, 0]
    np.testing.assert_allclose(force[:, 0], due, atol=1e-6 * np.abs(due).max())
    assert not force[:, 1].any()


def test_along_one_axis_circular_yield_is_bilinear():
    drift = 0.2 * np.sin(np.linspace(0, 12, 300)) * np.linspace(0.2, 1, 300)
    force = spring_of(FORMS["circular"]).forces_along(np.stack([0 * drift, drift], axis=1))
    storey = wd.ShearBuilding(
        1e5, STIFFNESS, 3.0, law="bilinear", yield_force=YIELDING["yield_force"], hardening_ratio=AFTER / STIFFNESS
    )
    due = wd.storey_hysteresis(storey, drift)["storey_force"].values[:, 0]
    np.testing.assert_allclose(force[:, 1], due, atol=1e-9 * np.abs(due).max())


def slider_on(weight: float = 100e3 * 9.80665, **arguments: float) -> wd.LumpedStructure:
    law = laws.FrictionSlider(fast_friction=0.08, slow_friction=0.03, rate_parameter=50.0, radius=2.0, weight=weight)
    slider = spring_of(law, 0.03 * weight / 0.001 + weight / 2.0, **arguments)
    return wd.LumpedStructure({"x": 100e3, "y": 100e3}, [slider], influence=[{"x": 1.0}, {"y": 1.0}])


@pytest.mark.parametrize(("method", "bound"), [("rk4", 2e-6), ("velocity_verlet", 1e-5), ("dormand_prince5", 2e-6)])
def test_slider_with_velocity_dependent_friction(method, bound):
    scene = wd.Scene(slider_on(), wd.PairOfMotions(pulse(4.0, 1.2, 0.4), pulse(3.0, 0.8, 0.4)))
    run = wd.simulate(scene, step=5e-4, method=method, histories=wd.Histories([0]), **SETTINGS)
    assert run["status"].item() == 0
    np.testing.assert_allclose(run["peak_displacement"][0], [0.3710296, 0.1545466], rtol=bound)
    np.testing.assert_allclose(run["peak_spring_force"][0], [237587.2, 94978.18], rtol=bound)
    history = run.isel(history=0)
    resultant = np.hypot(history["displacement"].sel(dof="x"), history["displacement"].sel(dof="y")).max().item()
    assert resultant == pytest.approx(0.3863427, rel=bound)
    last = history.sel(time=8.0, method="nearest")
    np.testing.assert_allclose(last["displacement"], [-0.0159352, -0.00855185], atol=1e-6)
    np.testing.assert_allclose(last["velocity"], [0.00160256, -0.0072364], atol=3e-6)


def test_a_step_that_is_too_long_for_the_slider_is_detected():
    # At 1 m/s the state follows the motion at a rate of 2000/s.
    scene = wd.Scene(slider_on(), wd.PairOfMotions(pulse(4.0, 1.2, 0.4), pulse(3.0, 0.8, 0.4)))
    assert wd.simulate(scene, step=5e-3, on_unstable="flag", **SETTINGS)["status"].item() != 0
    run = wd.simulate(scene, **SETTINGS)  # a shorter step replaces the default step
    assert run["status"].item() == 0
    np.testing.assert_allclose(run["peak_displacement"][0], [0.3710296, 0.1545466], rtol=1e-4)


def mixed(damping_ratio: float = 0.02) -> wd.LumpedStructure:
    """Return a deck on bearings of three laws, with a brace and a contact."""
    masses = {"x": 4e5, "y": 4e5, "theta": 1.6e7}
    springs = [
        wd.Spring(
            "brace", {"x": 1.0, "theta": -3.0}, law="bouc_wen", stiffness=1e7, yield_force=1e5, hardening_ratio=0.1
        ),
    ]
    places = {"a": (-8.0, -5.0), "b": (8.0, -5.0), "c": (0.0, 5.0), "d": (3.0, 5.0)}
    for (name, (x, y)), law in zip(places.items(), FORMS.values(), strict=True):
        directions = {"x": 1.0, "theta": -y}, {"y": 1.0, "theta": x}
        springs.append(wd.BiaxialSpring(name, *directions, law=law, stiffness=STIFFNESS, damping_coefficient=2e4))
    wall = laws.YeLiZhuContact(clearance=0.05, hertz_stiffness=2e9, restitution=0.7)
    springs.append(wd.Spring("wall", {"y": 1.0}, law=wall))
    return wd.LumpedStructure(
        masses, springs, influence=[{"x": 1.0}, {"y": 1.0}], damping="rayleigh", damping_ratio=damping_ratio
    )


@pytest.mark.parametrize("method", ["rk4", "dormand_prince5", "velocity_verlet"])
def test_several_laws_in_one_structure_are_in_balance(method):
    structure = mixed()
    scene = wd.Scene(structure, wd.PairOfMotions(pulse(4.0, 1.2, 0.4, 4.0), pulse(3.0, 0.8, 0.4, 4.0)))
    run = wd.simulate(scene, step=5e-4, method=method, histories=wd.Histories([0]), **SETTINGS).isel(history=0)
    names = [spring.name for spring in structure.springs]
    assert names == ["brace", "wall", *(f"{name} {axis}" for name in "abcd" for axis in "xy")]
    u, force = run["displacement"], run["spring_force"]
    directions = structure.directions  # [spring, dof]
    np.testing.assert_allclose(
        run["spring_deformation"].transpose("time", "spring"),
        u.transpose("time", "dof").values @ directions.T,
        atol=1e-9,
    )
    # Each bearing has the forces of its law along its path.
    bearings = {spring.name: spring for spring in structure.given_springs if isinstance(spring, wd.BiaxialSpring)}
    for name, bearing in bearings.items():
        rows = [f"{name} x", f"{name} y"]
        path = run["spring_deformation"].sel(spring=rows).transpose("time", "spring").values
        due = bearing.forces_along(path)
        found = force.sel(spring=rows).transpose("time", "spring").values
        np.testing.assert_allclose(found, due, atol=2e-4 * np.abs(due).max())
        assert np.hypot(*found.T).max() > YIELDING["yield_force"]
    # The mass times the absolute acceleration is the sum of the forces.
    central = structure.central_matrices(structure.parameters)
    inertia = run["acceleration"].transpose("time", "dof").values @ central["mass"].T
    viscous = run["velocity"].transpose("time", "dof").values @ central["damping"].T
    contact = force.sel(spring="wall").values
    assert contact.max() > 1e5
    total = force.transpose("time", "spring").values @ directions + viscous
    # Mass-proportional damping acts on the velocity relative to the base, as in the equation of motion.
    np.testing.assert_allclose(inertia, -total, atol=1e-6 * np.abs(inertia).max())


@pytest.mark.parametrize("method", ["rk4", "velocity_verlet"])
def test_energies_are_in_balance(method):
    motion = wd.PairOfMotions(pulse(4.0, 1.2, 0.4, 4.0), pulse(3.0, 0.8, 0.4, 4.0))
    structure = mixed()
    scene = wd.Scene(structure, motion, recorders=("energy", "spring"), tail=2.0)
    run = wd.simulate(scene, step=2e-4, method=method, histories=wd.Histories([0]), **SETTINGS)
    assert run["energy_balance_error"].item() < 1e-5
    history = run.isel(history=0)
    for bearing in structure.given_springs:
        rows = [bearing.name] if isinstance(bearing, wd.Spring) else [f"{bearing.name} {axis}" for axis in "xy"]
        moved = np.diff(history["spring_deformation"].sel(spring=rows).transpose("time", "spring").values, axis=0)
        force = history["spring_force"].sel(spring=rows).transpose("time", "spring").values
        work = ((force[1:] + force[:-1]) / 2 * moved).sum()
        found = run["hysteretic_energy"].isel(sample=0).sel(spring=rows).sum().item()
        stored = 0.5 * (force[-1] ** 2).sum() / STIFFNESS  # at most, but of the brace
        assert found == pytest.approx(work, abs=2 * stored + 1e-3 * work)
        assert found > 0


def test_an_event_begins_with_the_state_after_the_last_one():
    # Two events with a long rest between them, in which the vibration decays, are one motion.
    first, second = (
        (pulse(4.0, 1.2, 0.4, 4.0), pulse(3.0, 0.8, 0.4, 4.0)),
        (pulse(-3.0, 0.9, 0.4, 4.0), pulse(5.0, 0.7, 0.4, 4.0)),
    )
    rest = np.zeros(1500)
    joined = [
        wd.GroundMotion(np.concatenate([a.acceleration, rest, b.acceleration]), 0.01)
        for a, b in zip(first, second, strict=True)
    ]
    both = [
        wd.PairOfMotions(*(wd.GroundMotion(np.concatenate([each.acceleration, rest]), 0.01) for each in motions))
        for motions in (first, second)
    ]
    sequence = wd.EventSequence(dict(zip(("first", "second"), both, strict=True)))
    events = wd.simulate(wd.Scene(mixed(0.15), sequence, recorders=("spring",)), step=1e-3, **SETTINGS)
    whole = wd.simulate(wd.Scene(mixed(0.15), wd.PairOfMotions(*joined), recorders=("spring",)), step=1e-3, **SETTINGS)
    assert (events["peak_spring_force"].values[0, 0] != events["peak_spring_force"].values[0, 1]).all()
    assert (events["peak_spring_force"].values[0, 1] > events["peak_spring_force"].values[0, 0]).any()
    found = events["peak_spring_force"].max("event").values[0]
    np.testing.assert_allclose(found, whole["peak_spring_force"].values[0], rtol=1e-4)


def test_random_parameters_are_equal_in_both_components():
    spring = wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring")
    scatter = {"yield_force": spring, "stiffness": spring}
    structure = wd.LumpedStructure(
        {"x": 1e5, "y": 1e5},
        [
            spring_of(FORMS["circular"]),
            wd.BiaxialSpring("other", {"x": 1.0}, {"y": 1.0}, law=FORMS["circular"], stiffness=STIFFNESS),
        ],
        influence=[{"x": 1.0}, {"y": 1.0}],
    )
    motion = wd.PairOfMotions(pulse(4.0, 1.2, 0.4, 3.0), pulse(3.0, 0.8, 0.4, 3.0))
    scene = wd.Scene(structure, motion, scatter, recorders=("spring",))
    run = wd.simulate(scene, structures=10, **SETTINGS)
    for name in scatter:
        drawn = run[name].transpose("sample", "spring").values
        np.testing.assert_array_equal(drawn[:, ::2], drawn[:, 1::2])
        assert (drawn[:, 0] != drawn[:, 2]).all()
    one = run.isel(sample=3)
    springs = [
        wd.BiaxialSpring(
            name,
            {"x": 1.0},
            {"y": 1.0},
            law="circular_yield",
            post_yield_stiffness=AFTER,
            **{each: one[each].sel(spring=f"{name} x").item() for each in scatter},
        )
        for name in ("bearing", "other")
    ]
    same = wd.LumpedStructure({"x": 1e5, "y": 1e5}, springs, influence=[{"x": 1.0}, {"y": 1.0}])
    alone = wd.simulate(wd.Scene(same, motion, recorders=("spring",)), step=one["integration_step"].item(), **SETTINGS)
    np.testing.assert_allclose(alone["peak_spring_force"][0], one["peak_spring_force"], rtol=1e-9)


def test_free_vibration_starts_from_a_slow_push():
    spring = spring_of(FORMS["isotropic"])
    structure = wd.LumpedStructure({"x": 1e5, "y": 1e5}, [spring])
    scene = wd.Scene(structure, wd.FreeVibration(1.0, [0.08, -0.05]), recorders=("spring",))
    run = wd.simulate(scene, step=1e-3, histories=wd.Histories([0]), **SETTINGS)
    push = np.linspace(0, 1, 2001)[1:, None] * [0.08, -0.05]
    np.testing.assert_allclose(run["spring_force"].isel(history=0, time=0), spring.forces_along(push)[-1], rtol=1e-6)


def test_a_scene_is_rebuilt_from_its_json():
    motion = wd.PairOfMotions(pulse(4.0, 1.2, 0.4, 2.0), pulse(3.0, 0.8, 0.4, 2.0))
    scene = wd.Scene(mixed(), motion)
    again = wd.Scene.from_json(scene.to_json(), [motion])
    assert again.to_json() == scene.to_json()
    assert isinstance(again.structure.given_springs[1], wd.BiaxialSpring)


def test_free_vibration_returns_the_elastic_energy():
    # Within the yield surface no energy is lost.
    structure = wd.LumpedStructure({"x": 1e5, "y": 1e5}, [spring_of(FORMS["circular"])])
    load = wd.FreeVibration(1.0, [0.01, -0.02])
    run = wd.simulate(wd.Scene(structure, load, recorders=("energy", "spring")), step=1e-3, **SETTINGS)
    assert run["energy_balance_error"].item() < 1e-8
    assert np.abs(run["hysteretic_energy"]).max() < 1e-7 * 0.5 * STIFFNESS * (0.01**2 + 0.02**2)


def test_given_values_must_be_equal_in_both_components():
    structure = wd.LumpedStructure({"x": 1e5, "y": 1e5}, [spring_of(FORMS["circular"])])
    motion = pulse(4.0, 1.2, 0.4, 1.0)
    for values, is_right in (([[2e5, 2e5]], True), ([[2e5, 3e5]], False)):
        scene = wd.Scene(structure, motion, {"yield_force": wd.GivenValues(values)}, recorders=("spring",))
        if is_right:
            assert wd.simulate(scene, **SETTINGS)["status"].item() == 0
        else:
            with pytest.raises(
                ValueError, match="biaxial spring 'bearing': yield_force differs between its components"
            ):
                wd.simulate(scene, **SETTINGS)


@pytest.mark.parametrize("form", [*FORMS, "slider"])
def test_single_precision_gives_the_same_peaks(form):
    structure = slider_on()
    if form in FORMS:
        structure = wd.LumpedStructure(
            {"x": 1e5, "y": 1e5}, [spring_of(FORMS[form])], influence=[{"x": 1.0}, {"y": 1.0}]
        )
    motion = wd.PairOfMotions(pulse(4.0, 1.2, 0.4, 4.0), pulse(3.0, 0.8, 0.4, 4.0))
    scene = wd.Scene(structure, motion, recorders=("spring",))
    one, other = (wd.simulate(scene, step=1e-3, dtype=dtype, device="cpu") for dtype in ("float32", "float64"))
    for name in ("peak_spring_deformation", "peak_spring_force"):
        np.testing.assert_allclose(one[name], other[name], rtol=2e-4)


COMMON = {"direction_x": {"x": 1.0}, "direction_y": {"y": 1.0}, "stiffness": STIFFNESS}
SLIDER = {"rate_parameter": 50.0, "radius": 2.0, "weight": 1e6}
MISTAKES = {
    "no direction": (
        lambda: wd.BiaxialSpring("b", {"x": 1.0}, {"y": 0.0}, law=FORMS["circular"], stiffness=1e6),
        "biaxial spring 'b': direction_y names no degree of freedom",
    ),
    "storey law": (
        lambda: wd.BiaxialSpring("b", law="bilinear", **COMMON),
        "biaxial spring 'b': unknown biaxial law 'bilinear'",
    ),
    "as a storey": (
        lambda: wd.Spring("b", {"x": 1.0}, law="park_wen_ang", stiffness=1e6, **YIELDING),
        "'park_wen_ang' is a biaxial law, which only a BiaxialSpring of a LumpedStructure can have",
    ),
    "unknown": (
        lambda: wd.BiaxialSpring("b", law="circular_yield", yeild_force=1e5, **COMMON),
        "biaxial spring 'b': unknown parameter 'yeild_force' (did you mean 'yield_force'?)",
    ),
    "missing": (
        lambda: wd.BiaxialSpring("b", law="circular_yield", yield_force=1e5, **COMMON),
        "biaxial spring 'b': post_yield_stiffness (stiffness after yield) is missing",
    ),
    "stiffness after yield": (
        lambda: wd.LumpedStructure(
            {"x": 1e5, "y": 1e5},
            [wd.BiaxialSpring("b", law="circular_yield", yield_force=1e5, post_yield_stiffness=1e8, **COMMON)],
        ),
        "post_yield_stiffness is 1e+08 N/m",
    ),
    "friction": (
        lambda: wd.LumpedStructure(
            {"x": 1e5, "y": 1e5},
            [wd.BiaxialSpring("b", law="friction_slider", fast_friction=0.02, slow_friction=0.03, **SLIDER, **COMMON)],
        ),
        "fast_friction is 0.02 and slow_friction is 0.03",
    ),
    "beta and gamma": (
        lambda: wd.LumpedStructure(
            {"x": 1e5, "y": 1e5}, [spring_of(laws.ParkWenAng(beta=0.2, gamma=-0.3, **YIELDING))]
        ),
        "gamma is -0.3 and beta is 0.2",
    ),
    "unknown degree of freedom": (
        lambda: wd.LumpedStructure({"x": 1e5, "z": 1e5}, [spring_of(FORMS["circular"])]),
        "spring 'bearing y' names the unknown degree of freedom 'y'",
    ),
    "two of a name": (
        lambda: wd.LumpedStructure({"x": 1e5, "y": 1e5}, [spring_of(FORMS["circular"])] * 2),
        "two springs have the name 'bearing x'",
    ),
    "path": (
        lambda: spring_of(FORMS["circular"]).forces_along([0.0, 0.1]),
        "path must have shape [step, 2], got [2]",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes(mistake):
    make, text = MISTAKES[mistake]
    with pytest.raises((ValueError, TypeError), match=re.escape(text)):
        make()
