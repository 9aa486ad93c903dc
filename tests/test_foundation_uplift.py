"""Footings that lift off: closed forms of blocks on springs, statics, and an independent integration; cone models."""

from __future__ import annotations

import numpy as np
import pytest
from lumped_cases import pulse
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import warpdyn as wd
from warpdyn.model.structures.lumped.foundations.gazetas import gazetas_stiffness

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
SETTINGS = {"dtype": "float64", "device": "cpu"}
GRAVITY = 9.80665
MASS, HEIGHT = 500e3, 12.0
STIFFNESS = MASS * (2 * np.pi / 0.4) ** 2
BASE = {"foundation_mass": 150e3, "rocking_inertia": 2.0e6}
WEIGHT = GRAVITY * (MASS + 150e3)
SOIL_SPRINGS = wd.FoundationSprings(1.8e9, 7.6e10, 6.5e7, 2.1e8, vertical_stiffness=2.1e9)
DISTANCE = np.sqrt(7.6e10 / 2.1e9)  # of two contacts to the centre


def oscillator() -> wd.ShearBuilding:
    return wd.ShearBuilding([MASS], [STIFFNESS], HEIGHT, damping="stiffness_proportional", damping_ratio=0.05)


def on_contacts(springs: wd.FoundationSprings = SOIL_SPRINGS, **uplift) -> wd.LumpedStructure:
    return wd.structure_on_soil(oscillator(), springs, uplift=wd.FoundationUplift(**uplift), **BASE)


def test_the_structure_has_the_degrees_of_freedom_and_the_period_without_uplift():
    without = wd.structure_on_soil(oscillator(), SOIL_SPRINGS, **BASE)
    for uplift in ({}, {"points": 7, "half_width": 6.5}):
        found = on_contacts(**uplift)
        assert found.dof_names == ("u1", "sway", "rocking", "heave")
        assert found.fundamental_period == pytest.approx(without.fundamental_period, rel=1e-12)
        heave = 2 * np.pi * np.sqrt((MASS + 150e3) / 2.1e9)
        assert np.abs(found.modal()["period"].values / heave - 1).min() < 1e-12
        preload = found.parameters["preload"]
        assert np.nansum(preload) == pytest.approx(WEIGHT, rel=1e-12)
        assert found.kinds.rotating["dof"] == (False, False, True, False)
        assert not any(found.kinds.rotating["spring"])
    assert [spring.name for spring in on_contacts().springs] == ["storey 1", "sway", "contact 1", "contact 2"]


def test_a_small_motion_is_that_without_uplift():
    motion = pulse(0.3, 0.5, 0.5, 4.0)
    without = wd.structure_on_soil(oscillator(), SOIL_SPRINGS, **BASE)
    due = wd.simulate(wd.Scene(without, motion), step=0.0005, **SETTINGS)
    for uplift in ({}, {"points": 7, "half_width": 6.5}):
        run = wd.simulate(wd.Scene(on_contacts(**uplift), motion), step=0.0005, **SETTINGS)
        for dof in ("u1", "sway", "rocking"):
            peak = due["peak_displacement"].sel(dof=dof).item()
            assert run["peak_displacement"].sel(dof=dof).item() == pytest.approx(peak, rel=1e-9)
        assert run["peak_displacement"].sel(dof="heave").item() < 1e-12


def test_a_push_has_the_moment_of_tipping():
    """Two contacts: elastic until the moment W b, at which one of them lifts off; then the moment is constant."""
    structure = on_contacts()
    limit = WEIGHT * DISTANCE / HEIGHT
    elastic = 1 / (1 / STIFFNESS + 1 / 1.8e9 + HEIGHT**2 / 7.6e10)
    path = np.linspace(0, 4 * limit / elastic, 41)[1:]
    pushed = wd.pushover(structure, path, pattern={"u1": 1.0})
    np.testing.assert_allclose(pushed["base_shear"], np.minimum(elastic * path, limit), rtol=1e-9)
    # After the lift-off the footing rotates about the other contact, which carries the weight.
    lifted, carrying = (pushed["spring_deformation"].sel(spring=f"contact {number}").values for number in (2, 1))
    np.testing.assert_allclose(carrying[-1], -WEIGHT / 2.1e9, rtol=1e-9)
    assert lifted[-1] > 5 * WEIGHT / 2.1e9


def test_a_push_of_many_contacts_has_the_moment_of_statics():
    """At each rotation, the heave at which the contact forces carry the weight, by a root search."""
    half_width, points = 6.5, 9
    springs = wd.FoundationSprings(1.8e9, 5e10, vertical_stiffness=2.1e9)
    structure = on_contacts(springs, points=points, half_width=half_width)
    pushed = wd.pushover(structure, np.linspace(0, 0.4, 81)[1:], pattern={"u1": 1.0})
    places = half_width * np.linspace(-1, 1, points)
    stiffness = structure.parameters["stiffness"][-points:]
    assert stiffness.sum() == pytest.approx(2.1e9, rel=1e-12)
    assert stiffness @ places**2 == pytest.approx(5e10, rel=1e-12)
    settled = WEIGHT / 2.1e9
    moments = []
    for rotation in pushed["displacement"].sel(dof="rocking").values:

        def pressed(heave, rotation=rotation):
            return stiffness * np.maximum(settled - heave - places * rotation, 0.0)

        heave = brentq(lambda heave: pressed(heave).sum() - WEIGHT, -1.0, 1.0, xtol=1e-16, rtol=1e-14)
        moments.append(-pressed(heave) @ places)
    np.testing.assert_allclose(pushed["base_shear"] * HEIGHT, moments, rtol=1e-8)
    assert moments[0] / pushed["displacement"].sel(dof="rocking").values[0] == pytest.approx(5e10, rel=1e-8)
    assert 0.9 * WEIGHT * half_width < moments[-1] < WEIGHT * half_width * (1 + 1e-9)


def block(mass: float, inertia: float, distance: float, stiffness: float) -> wd.LumpedStructure:
    """Return a rigid block on two contacts that carry its weight."""
    law = wd.laws.PreloadedContact(preload=GRAVITY * mass / 2)
    contacts = [
        wd.Spring(f"edge {sign:g}", {"heave": 1.0, "rocking": sign * distance}, law=law, stiffness=stiffness)
        for sign in (-1.0, 1.0)
    ]
    return wd.LumpedStructure({"heave": mass, "rocking": inertia}, contacts, influence={"heave": 1.0})


@pytest.mark.parametrize("method", ["rk4", "velocity_verlet", "stoermer"])
def test_a_lifted_block_falls_as_its_closed_form(method):
    """One edge is lifted: the other edge vibrates, and the centre of percussion falls freely under the weight."""
    mass, inertia, b, k = 5e5, 8e6, 5.0, 4e8
    settled, rotation = GRAVITY * mass / 2 / k, 0.006
    start = [0.01, rotation]  # heave, rocking
    run = wd.simulate(
        wd.Scene(block(mass, inertia, b, k), wd.FreeVibration(0.2, start)),
        step=1e-4,
        method=method,
        histories=wd.Histories([0]),
        **SETTINGS,
    )
    time = run["time"].values
    heave, rocking = (run["displacement"].isel(history=0).sel(dof=dof).values for dof in ("heave", "rocking"))
    # The deformation d of the pressed edge: d'' = -w^2 (d - mean), and m heave'' + I / b rocking'' = -W.
    w = np.sqrt(k / mass + b**2 * k / inertia)
    mean = (b**2 / inertia - 1 / mass) * k * settled / w**2
    pressed = mean + (start[0] - b * start[1] - mean) * np.cos(w * time)
    fallen = (mass * start[0] + inertia / b * start[1]) - 0.5 * GRAVITY * mass * time**2
    due_rocking = (fallen - mass * pressed) / (inertia / b + mass * b)
    due_heave = pressed + b * due_rocking
    is_lifted = (due_heave + b * due_rocking > settled) & (pressed < settled)
    last = int(np.argmin(is_lifted)) if not is_lifted.all() else time.size
    assert last > 300
    bound = 1e-9 if method == "rk4" else 2e-7
    np.testing.assert_allclose(heave[:last], due_heave[:last], rtol=0, atol=bound)
    np.testing.assert_allclose(rocking[:last], due_rocking[:last], rtol=0, atol=bound)


def test_a_block_that_stays_on_its_contacts_has_the_periods_of_linear_springs():
    mass, inertia, b, k = 5e5, 8e6, 5.0, 4e8
    periods = 2 * np.pi * np.sqrt([mass / (2 * k), inertia / (2 * k * b**2)])
    np.testing.assert_allclose(np.sort(block(mass, inertia, b, k).modal()["period"]), np.sort(periods), rtol=1e-12)


def reference(motion: wd.GroundMotion, places, stiffness, dashpots, duration: float) -> np.ndarray:
    """Return peaks of u1 (relative to the ground), sway, rocking and heave by SciPy, from own equations."""
    storey_dashpot = 2 * 0.05 * np.sqrt(STIFFNESS * MASS)
    # Unknowns: deformation of the storey, sway, rocking, heave.
    mass = np.array(
        [
            [MASS, MASS, MASS * HEIGHT, 0.0],
            [MASS, MASS + 150e3, MASS * HEIGHT, 0.0],
            [MASS * HEIGHT, MASS * HEIGHT, MASS * HEIGHT**2 + 2e6, 0.0],
            [0.0, 0.0, 0.0, MASS + 150e3],
        ]
    )
    inverse, load = np.linalg.inv(mass), np.array([MASS, MASS + 150e3, MASS * HEIGHT, 0.0])
    preload = WEIGHT * stiffness / stiffness.sum()
    values, step = np.append(motion.acceleration, 0.0), motion.step

    def slope(time, state):
        x, v = state[:4], state[4:]
        change = np.minimum(stiffness * (x[3] + places * x[2]) + dashpots * (v[3] + places * v[2]), preload)
        resisting = [
            STIFFNESS * x[0] + storey_dashpot * v[0],
            1.8e9 * x[1] + 6.5e7 * v[1],
            places @ change,
            change.sum(),
        ]
        ground = np.interp(time, step * np.arange(len(values)), values)
        return np.append(v, inverse @ (-load * ground - resisting))

    state, peaks, uplifted = np.zeros(8), np.zeros(4), 0.0
    for interval in range(round(duration / step)):
        found = solve_ivp(slope, (interval * step, (interval + 1) * step), state, rtol=1e-9, atol=1e-13, max_step=1e-3)
        path = found.y
        moved = np.stack([path[0] + path[1] + HEIGHT * path[2], path[1], path[2], path[3]])
        peaks = np.maximum(peaks, np.abs(moved).max(axis=1))
        uplifted = max(uplifted, float((path[3] + np.abs(places).max() * np.abs(path[2])).max()))
        state = path[:, -1]
    assert uplifted > 2 * WEIGHT / stiffness.sum()  # the edges rise
    return peaks


@pytest.mark.parametrize("uplift", [{}, {"points": 5, "half_width": 6.5}], ids=["two", "five"])
def test_an_oscillator_that_lifts_off_has_the_response_of_an_independent_integration(uplift):
    motion, structure = pulse(6.0, 0.5, 0.8, 2.0), on_contacts(**uplift)
    places, stiffness = wd.FoundationUplift(**uplift).positions_and_stiffness(2.1e9, 7.6e10)
    due = reference(motion, places, stiffness, 2.1e8 * stiffness / 7.6e10, 2.0)
    scene = wd.Scene(structure, motion, tail=0.0)
    run = wd.simulate(scene, step=0.0005, **SETTINGS)
    found = run["peak_displacement"].sel(dof=["u1", "sway", "rocking", "heave"])[0]
    np.testing.assert_allclose(found, due, rtol=2e-5)
    single = wd.simulate(scene, step=0.0005, dtype="float32", device="cpu")
    np.testing.assert_allclose(single["peak_displacement"][0], run["peak_displacement"][0], rtol=1e-3)


def test_energy_is_kept():
    """Without dashpots the energy of a block that lifts off again and again is constant."""
    structure = block(5e5, 8e6, 5.0, 4e8)
    scene = wd.Scene(structure, wd.FreeVibration(3.0, [0.01, 0.006]), recorders=("spring", "energy"))
    run = wd.simulate(scene, step=1e-4, **SETTINGS)
    stored = GRAVITY * 5e5 / 2 * 0.04 - 0.5 * (GRAVITY * 5e5 / 2) ** 2 / 4e8 + 0.5 * 4e8 * 0.02**2  # J, of the start
    # Steps in which an edge lifts off or lands leave an error of the work, about 2e-6 of it.
    np.testing.assert_allclose(run["hysteretic_energy"], 0.0, rtol=0, atol=1e-5 * stored)
    assert abs(run["energy_balance_error"].item()) < 1e-8
    assert run["peak_spring_deformation"].min().item() > 0.04  # both edges rise


@pytest.mark.parametrize("ratio", [0.25, 0.45])
def test_a_disk_has_the_impedance_of_cones(ratio):
    """Formulas of Wolf and Deeks for a disk, by hand, at the period on soil."""
    radius, density, velocity = 7.0, 1800.0, 160.0
    soil = wd.Soil(ratio, density, shear_wave_velocity=velocity)
    extra = {"trapped_inertia": 0.0} if ratio > 1 / 3 else {}
    springs = wd.foundation_springs(oscillator(), wd.CircularFooting(radius), soil, **extra)
    modulus = density * velocity**2
    sway, rocking = 8 * modulus * radius / (2 - ratio), 8 * modulus * radius**3 / (3 * (1 - ratio))
    vertical = 4 * modulus * radius / (1 - ratio)
    assert springs.sway_stiffness == pytest.approx(sway, rel=1e-12)
    assert springs.vertical_stiffness == pytest.approx(vertical, rel=1e-12)
    assert springs.sway_dashpot == pytest.approx(density * velocity * np.pi * radius**2, rel=1e-12)
    omega = 2 * np.pi / (0.4 * np.sqrt(1 + STIFFNESS / sway + STIFFNESS * HEIGHT**2 / rocking))
    speed = 2 * velocity if ratio > 1 / 3 else velocity * np.sqrt((2 - 2 * ratio) / (1 - 2 * ratio))
    apex = 9 * np.pi / 32 * (1 - ratio) * (speed / velocity) ** 2 * radius
    b = omega * apex / speed
    assert springs.rocking_stiffness == pytest.approx(rocking * (1 - b**2 / (3 * (1 + b**2))), rel=1e-12)
    assert springs.rocking_dashpot == pytest.approx(rocking * b**3 / (3 * (1 + b**2)) / omega, rel=1e-12)
    both = wd.foundation_springs(oscillator(), wd.CircularFooting(radius), soil, direction="length", **extra)
    assert both == springs
    assert wd.structure_on_soil(oscillator(), springs, uplift=wd.FoundationUplift(), **BASE).dofs == 4


def test_rectangles_have_a_vertical_stiffness():
    """Table L06: 2.269752e9 N/m."""
    soil = wd.Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
    springs = wd.foundation_springs(oscillator(), wd.RectangularFooting(10.0, 6.0), soil)
    assert springs.vertical_stiffness == pytest.approx(2.269752e9, rel=1e-6)


CLAY = wd.Soil(0.45, 1800.0, shear_wave_velocity=160.0)
WRONG = [
    (lambda: wd.FoundationUplift(points=1), "points must be from 2 to 40, got 1"),
    (lambda: wd.FoundationUplift(points=5), "half_width is missing: 5 contacts"),
    (lambda: wd.FoundationUplift(half_width=5.0), "half_width has no effect on two contacts"),
    (lambda: wd.FoundationUplift(points=5, half_width=0.0), r"half_width \[m\] must be a finite number above 0"),
    (lambda: wd.FoundationUplift(weight=-1.0), r"weight \[N\] must be a finite number above 0"),
    (lambda: on_contacts(points=5, half_width=5.0), r"half_width of 5 m cannot have.*is 6\.016 m.*below 5 m"),
    (lambda: on_contacts(points=5, half_width=20.0), r"above 8\.165 m and below 20 m"),
    (lambda: on_contacts(wd.FoundationSprings(1e9, 1e10)), "uplift= needs the vertical stiffness"),
    (lambda: wd.FoundationSprings(1e9, 1e10, vertical_stiffness=0.0), r"vertical_stiffness \[N/m\]"),
    (lambda: wd.CircularFooting(-1.0), r"radius \[m\] must be a finite number above 0"),
    (lambda: wd.foundation_springs(oscillator(), wd.CircularFooting(5.0), CLAY), "trapped_inertia is missing"),
    (
        lambda: wd.foundation_springs(oscillator(), wd.RectangularFooting(9.0, 5.0), CLAY, trapped_inertia=0.0),
        "trapped_inertia has no effect on a RectangularFooting",
    ),
    (lambda: wd.laws.PreloadedContact(preload=0.0), "preload"),
    (
        lambda: wd.Spring("edge", {"a": 1.0}, law=wd.laws.PreloadedContact(preload=1e5)),
        "spring 'edge': stiffness is missing",
    ),
    (
        lambda: wd.pounding_row({"a": oscillator(), "b": oscillator()}, [0.02], contact="preloaded_contact"),
        "contact is 'preloaded_contact'.*allowed",
    ),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_wrong_arguments_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_other_classes_are_refused():
    with pytest.raises(TypeError, match="points must be a whole number"):
        wd.FoundationUplift(points=2.5)
    with pytest.raises(TypeError, match="takes a FoundationUplift, got bool as uplift"):
        wd.structure_on_soil(oscillator(), SOIL_SPRINGS, uplift=True, **BASE)
    with pytest.raises(TypeError, match="takes a RectangularFooting, got CircularFooting"):
        gazetas_stiffness(wd.CircularFooting(5.0), CLAY)
