"""Torsional buildings: reference cases, random eccentricity, gravity, an independent integration, and invalid input."""

from __future__ import annotations

import numpy as np
import pytest
from lumped_cases import pair, pulse
from scipy.integrate import solve_ivp

import warpdyn as wd

# Structures of the cases are round, and some are undamped or yield a lot.
pytestmark = [
    pytest.mark.meant_as_given(
        "no_damping", "gravity_load_over_weight", "damping_ratio", "first_period", "strongest_motion"
    )
]
SETTINGS = {"dtype": "float64", "device": "cpu"}
PLAN = [[-10.0, 10.0], [-6.0, 6.0]]


def deck() -> wd.TorsionalBuilding:
    """L01: one elastic storey; frame A across, frames B and C along."""
    frames = [
        wd.PlanFrame("A", (0.4572, 0.0), "y", 1094542.72),
        wd.PlanFrame("B", (0.0, 3.048), "x", 583756.117),
        wd.PlanFrame("C", (0.0, -3.048), "x", 583756.117),
    ]
    plan = [[-4.572, 4.572], [-3.048, 3.048]]
    return wd.TorsionalBuilding([27215.5422], plan, frames, base_motion="y", damping="modal", damping_ratio=0.05)


def three_storeys(**changed: object) -> wd.TorsionalBuilding:
    """L02: bilinear frames under two components."""
    share = np.array([1.0, 0.85, 0.65])
    rows = [("x+5", (0, 5), "x", 60e6, 900e3), ("x-5", (0, -5), "x", 40e6, 600e3)]
    rows += [(f"y{x:+}", (x, 0), "y", k, fy) for x, k, fy in ((-9, 90e6, 12e5), (0, 30e6, 4e5), (9, 30e6, 4e5))]
    frames = [
        wd.PlanFrame(name, at, axis, k * share, law=wd.laws.Bilinear(yield_force=fy * share, hardening_ratio=0.05))
        for name, at, axis, k, fy in rows
    ]
    damped = {"damping": "rayleigh", "damping_ratio": 0.05, "damping_modes": (1, 5)}
    return wd.TorsionalBuilding([150e3, 150e3, 120e3], PLAN, frames, **{**damped, **changed})


def run_of(building, motion, step=0.0005, **changed):
    settings = {"tail": 0.0} | {key: changed.pop(key) for key in ("tail", "recorders") if key in changed}
    return wd.simulate(wd.Scene(building, motion, **settings), step=step, **SETTINGS, **changed)


def test_one_storey_has_the_reference_response():
    building = deck()
    frequencies = building.modal()["circular_frequency"].values
    np.testing.assert_allclose(frequencies, [5.876126, 6.549712, 6.791378], rtol=1e-7)
    # Closed form of frame A off the centre: x alone, and two coupled modes of y and theta.
    mass, inertia = 27215.5422, 27215.5422 * (9.144**2 + 6.096**2) / 12
    a, b, arm, half = 1094542.72, 583756.117, 0.4572, 3.048
    kyy, kyt, ktt = a / mass, a * arm / np.sqrt(mass * inertia), (a * arm**2 + 2 * b * half**2) / inertia
    middle, swing = (kyy + ktt) / 2, np.hypot((kyy - ktt) / 2, kyt)
    due = np.sqrt(np.sort([2 * b / mass, middle - swing, middle + swing]))
    np.testing.assert_allclose(frequencies, due, rtol=1e-12)
    run = run_of(building, pulse(3.0, 1.0, 0.5, 10.0))
    assert run["peak_displacement"].sel(dof="uy1").item() == pytest.approx(0.1832691, rel=2e-6)
    assert run["peak_displacement"].sel(dof="theta1").item() == pytest.approx(0.04548127, rel=2e-6)
    deformation = run["peak_spring_deformation"]
    assert deformation.sel(spring="A 1").item() == pytest.approx(0.1802158, rel=2e-6)
    assert deformation.sel(spring="B 1").item() == pytest.approx(0.1386269, rel=2e-6)
    assert run["peak_acceleration"].sel(dof="uy1").item() == pytest.approx(7.309982, rel=5e-6)
    # Frames B and C are at the edges of the plan.
    assert run["peak_output"].sel(output="x1 at y=3.048").item() == pytest.approx(0.1386269, rel=2e-6)


def test_three_storeys_have_the_reference_response():
    building = three_storeys()
    due = [11.30993, 12.27073, 20.34943, 28.77817, 31.22293, 41.31271, 44.82231, 51.77922, 74.33204]
    np.testing.assert_allclose(building.modal()["circular_frequency"], due, rtol=1e-6)
    run = run_of(building, pair(pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5)), histories=wd.Histories([0], every=1))
    peaks = {"ux3": 0.08927797, "uy3": 0.04588134, "theta3": 0.005485471}
    for dof, value in peaks.items():
        assert run["peak_displacement"].sel(dof=dof).item() == pytest.approx(value, rel=5e-5)
    for spring, value in {"x+5 1": 0.07317494, "y-9 1": 0.01222826, "y+9 1": 0.05619458}.items():
        assert run["peak_spring_deformation"].sel(spring=spring).item() == pytest.approx(value, rel=5e-5)
    assert run["peak_spring_force"].sel(spring="y+9 1").item() == pytest.approx(464291.9, rel=5e-5)
    assert run["peak_acceleration"].sel(dof="ux3").item() == pytest.approx(7.880575, rel=5e-5)
    forces = run["spring_force"].isel(history=0)
    for axis, value in {"x": 1737631.0, "y": 1723424.0}.items():
        springs = [f"{axis}{place} 1" for place in (("+5", "-5") if axis == "x" else ("-9", "+0", "+9"))]
        assert np.abs(forces.sel(spring=springs).sum("spring")).max().item() == pytest.approx(value, rel=5e-5)
    last = run["displacement"].isel(history=0, time=-1)
    for dof, value in {"ux1": 0.00974664, "uy1": -0.00127953, "theta1": -0.000112164, "ux3": 0.0159521}.items():
        assert last.sel(dof=dof).item() == pytest.approx(value, abs=2e-5)


def about(x: float, y: float, base_motion: str = "xy") -> wd.TorsionalBuilding:
    """L09: a deck whose degrees of freedom are those of a point, at (x, y) from its corner."""
    rows = [("x", 11, 60e6, 900e3), ("x", 1, 40e6, 600e3), ("y", 1, 90e6, 1200e3), ("y", 19, 30e6, 400e3)]
    frames = [
        wd.PlanFrame(
            f"{axis}{place}",
            (5.0 - x, place - y) if axis == "x" else (place - x, 5.0 - y),
            axis,
            stiffness,
            law="bilinear",
            yield_force=force,
            hardening_ratio=0.05,
        )
        for axis, place, stiffness, force in rows
    ]
    plan = [[-x, 20.0 - x], [-y, 12.0 - y]]
    damped = {"damping": "rayleigh", "damping_ratio": 0.05, "damping_modes": (1, 3)}
    return wd.TorsionalBuilding([150e3], plan, frames, base_motion=base_motion, **damped)


@pytest.mark.parametrize("point", [(0.0, 0.0), (10.0, 6.0)])
def test_the_reference_point_does_not_change_the_response(point):
    building = about(*point)
    np.testing.assert_allclose(building.modal()["circular_frequency"], [23.51723, 25.98215, 45.11755], rtol=1e-6)
    run = run_of(building, pair(pulse(9.0, 0.35, 0.6, 6.0), pulse(8.0, 0.3, 0.5, 6.0)))
    assert run["peak_displacement"].sel(dof="theta1").item() == pytest.approx(0.002839879, rel=5e-5)
    assert run["peak_spring_deformation"].sel(spring="y19 1").item() == pytest.approx(0.04603151, rel=5e-5)
    corner = run["peak_output"].isel(output=[0, 2]).values[0]
    np.testing.assert_allclose(corner, [0.04477649, 0.01004903], rtol=5e-5)


def test_drawn_eccentricities_are_those_of_buildings_with_these_centres():
    motion = pair(pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5))
    scatter = {
        "eccentricity_x": wd.RandomValue(wd.Uniform(-2.0, 2.0)),
        "eccentricity_y": wd.RandomValue(wd.Uniform(-1.0, 1.0)),
    }
    scene = wd.Scene(three_storeys(), motion, scatter)
    run = wd.simulate(scene, structures=12, seed=3, **SETTINGS)
    assert (run["status"] == 0).all()
    assert run["eccentricity_x"].min() < -0.5
    assert run["eccentricity_x"].max() > 0.5
    twists = []
    for number in (0, 5, 11):
        drawn = run.isel(sample=number)
        centre = (drawn["eccentricity_x"].item(), drawn["eccentricity_y"].item())
        alone = run_of(three_storeys(mass_centre=centre), motion, drawn["integration_step"].item())
        for name in ("peak_displacement", "peak_output", "peak_spring_force", "peak_acceleration"):
            np.testing.assert_allclose(alone[name][0], drawn[name], rtol=1e-8)
        twists.append(drawn["peak_displacement"].sel(dof="theta1").item())
    assert max(twists) > 1.05 * min(twists)


def test_gravity_has_the_reference_response_in_both_directions():
    # L17: four storeys; the frames are symmetric, so that no floor rotates.
    stiffness = {"x": np.array([40e6, 36e6, 30e6, 22e6]), "y": np.array([30e6, 26e6, 20e6, 14e6])}
    frames = [
        wd.PlanFrame(f"{axis}{side:+}", (side, side), axis, stiffness[axis] / 2)
        for axis in "xy"
        for side in (-5.0, 5.0)
    ]
    weight = 1961330.0
    due = {  # periods, and peaks
        None: (
            [1.626036, 1.369144, 0.6363156, 0.5229164, 0.4141995, 0.3407412, 0.3112725, 0.262132],
            {"ux4": 0.5852287, "uy4": 0.5641508},
            {"x": 6563455.0, "y": 4448684.0},
        ),
        "weight": (
            [1.680147, 1.401823, 0.6540418, 0.5329355, 0.426107, 0.3473997, 0.3217014, 0.2681681],
            {"ux4": 0.6025265, "uy4": 0.6063173},
            {"x": 6826340.0, "y": 4838696.0},
        ),
    }
    for gravity_load, (periods, peaks, forces) in due.items():
        building, bare = (
            wd.TorsionalBuilding([200e3] * 4, PLAN, frames, storey_height=3.5, gravity_load=each)
            for each in (gravity_load, None)
        )
        one = {name: values[None] for name, values in bare.parameters.items()}
        elastic, mass = bare.stiffness_matrices(one)[0], bare.mass_matrices(one)[0]
        building = wd.TorsionalBuilding(
            [200e3] * 4,
            PLAN,
            frames,
            storey_height=3.5,
            gravity_load=None if gravity_load is None else [weight] * 4,
            damping_matrix=0.332081581 * mass + 0.00602235802 * elastic,
        )
        modes = building.modal()
        shapes = modes["shape"].transpose("mode", "dof").values
        horizontal = np.abs(shapes[:, 2::3]).max(axis=1) < 1e-9
        np.testing.assert_allclose(modes["period"].values[horizontal], periods, rtol=1e-6)
        run = run_of(building, pair(pulse(3.0, 1.4, 0.3, 12.0), pulse(2.5, 1.8, 0.3, 12.0)))
        for dof, value in peaks.items():
            assert run["peak_displacement"].sel(dof=dof).item() == pytest.approx(value, rel=1e-5)
        for axis, value in forces.items():
            force = run["peak_spring_force"].sel(spring=[f"{axis}-5.0 1", f"{axis}+5.0 1"]).sum().item()
            assert force == pytest.approx(value, rel=1e-5)
        assert run["peak_displacement"].sel(dof="theta4").item() < 1e-10
    factors = wd.buckling_factors(building)
    assert factors[0] == pytest.approx(13.38378, rel=1e-6)
    assert np.abs(factors - 17.84503).min() < 1e-4


def test_gravity_reduces_the_torsional_stiffness_by_the_loads_at_their_places():
    frames = [wd.PlanFrame(f"{axis}{side}", (side, side), axis, 2e7) for axis in "xy" for side in (-4.0, 5.0)]
    given = {"storey_height": [4.0, 3.0], "mass_centre": (1.0, -2.0)}
    building = wd.TorsionalBuilding([2e5, 1e5], PLAN, frames, gravity_load=[1.5e6, 1e6], **given)
    matrix = building.matrices["geometric_stiffness"]
    # A rectangle of many small columns with equal loads about the centre of mass has the inertia of the floor.
    radius = (20**2 + 12**2) / 12
    columns = np.array(
        [(1 + sx * np.sqrt(radius / 2), -2 + sy * np.sqrt(radius / 2)) for sx in (-1, 1) for sy in (-1, 1)]
    )
    due = np.zeros((6, 6))
    for storey, (force, height) in enumerate(((2.5e6, 4.0), (1e6, 3.0))):
        for x, y in columns:
            for row in ([1, 0, -y], [0, 1, x]):
                own = np.zeros(6)
                own[3 * storey : 3 * storey + 3] = row
                if storey:
                    own[:3] = [-each for each in row]
                due += force / 4 / height * np.outer(own, own)
    np.testing.assert_allclose(matrix, due, rtol=1e-12, atol=1e-6)


def test_the_response_is_that_of_an_independent_integration():
    # Two storeys, an inclined frame, an eccentric mass; elastic, integrated by SciPy's DOP853 with own matrices.
    angle = 0.6
    rows = [((0, 4), 0.0, 5e7), ((-3, -5), angle, 4e7), ((-8, 1), np.pi / 2, 6e7), ((9, 0), np.pi / 2, 2e7)]
    frames = [wd.PlanFrame(str(place), at, turn, [k, 0.7 * k]) for place, (at, turn, k) in enumerate(rows)]
    building = wd.TorsionalBuilding(
        [2e5, 1.5e5], PLAN, frames, mass_centre=[(1.0, 0.5), (-0.5, 1.0)], damping="modal", damping_ratio=0.04
    )
    mass, stiffness = np.zeros((6, 6)), np.zeros((6, 6))
    for floor, (m, x, y) in enumerate(((2e5, 1.0, 0.5), (1.5e5, -0.5, 1.0))):
        rigid = np.array([[1, 0, -y], [0, 1, x], [0, 0, 1]])
        own = slice(3 * floor, 3 * floor + 3)
        mass[own, own] = rigid.T @ np.diag([m, m, m * (20**2 + 12**2) / 12]) @ rigid
    for (x, y), turn, k in rows:
        row = np.array([np.cos(turn), np.sin(turn), x * np.sin(turn) - y * np.cos(turn)])
        for storey, share in enumerate((1.0, 0.7)):
            whole = np.zeros(6)
            whole[3 * storey : 3 * storey + 3] = row
            if storey:
                whole[:3] = -row
            stiffness += share * k * np.outer(whole, whole)
    root = np.linalg.cholesky(mass)
    squared, vectors = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, stiffness).T))
    np.testing.assert_allclose(building.modal()["circular_frequency"], np.sqrt(squared), rtol=1e-9)
    damping = root @ (vectors * (0.08 * np.sqrt(squared))) @ vectors.T @ root.T
    both = pair(pulse(3.0, 0.7, 0.4, 5.0), pulse(2.0, 0.5, 0.4, 5.0))
    time = 0.01 * np.arange(501)
    inverse, iota = np.linalg.inv(mass), np.tile([[1.0, 0], [0, 1], [0, 0]], (2, 1))

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        ground = [np.interp(t, time, each.acceleration) for each in both.components]
        u, v = state[:6], state[6:]
        return np.concatenate([v, -inverse @ (damping @ v + stiffness @ u) - iota @ ground])

    found = solve_ivp(rate, (0, 5), np.zeros(12), "DOP853", rtol=1e-9, atol=1e-12, max_step=0.01, dense_output=True)
    peaks = np.abs(found.sol(np.linspace(0, 5, 20001))[:6]).max(axis=1)
    np.testing.assert_allclose(
        run_of(building, both)["peak_displacement"][0], peaks, rtol=1e-5
    )  # peaks lie between steps


WRONG = [
    ({"frames": []}, "frames is empty"),
    ({"floor_mass": [1e5] * 22}, "at most 21 floors"),
    ({"floor_mass": [1e5, 0.0, 1e5]}, "floor_mass of floor 2 is 0 kg"),
    ({"plan": [[-10.0, 10.0], [-4.0, 4.0]]}, r"frame 'x\+5' has y = 5 m, outside the plan from -4 to 4 m"),
    ({"mass_centre": (11.0, 0.0)}, "mass_centre of floor 1 has x = 11 m, outside the plan"),
    ({"base_motion": "z"}, "base_motion"),
    ({"gravity_load": "weight"}, "storey_height is missing: gravity_load needs it"),
    ({"gravity_load": "mass", "storey_height": 3.0}, "gravity_load is 'mass': give 'weight'"),
    ({"gravity_load": [3e8] * 3, "storey_height": 3.0}, "can move freely or buckles under the geometric stiffness"),
]


@pytest.mark.parametrize(("changed", "message"), WRONG)
def test_a_wrong_building_is_refused(changed, message):
    building = three_storeys()
    share = np.array([1.0, 0.85, 0.65])
    names = ("x+5", "x-5", "y-9", "y+9")
    places = ((0, 5), (0, -5), (-9, 0), (9, 0))
    frames = [wd.PlanFrame(name, at, name[0], 5e7) for name, at in zip(names, places, strict=True)]
    given = {"floor_mass": 1.5e5 * share, "plan": building.plan, "frames": frames} | changed
    with pytest.raises(ValueError, match=message):
        wd.TorsionalBuilding(**given)


def test_wrong_frames_and_eccentricities_are_refused():
    with pytest.raises(ValueError, match="frame 'a': direction"):
        wd.PlanFrame("a", (0, 0), "z", 1e7)
    with pytest.raises(ValueError, match=r"frame 'a': position must be x, y in m, such as \(0.0, 5.0\)"):
        wd.PlanFrame("a", 5.0, "x", 1e7)
    one = wd.PlanFrame("a", (0, 0), "x", [1e7, 1e7])
    with pytest.raises(ValueError, match="frame 'a': stiffness must be one value or one per storey"):
        wd.TorsionalBuilding([1e5] * 3, PLAN, [one])
    with pytest.raises(ValueError, match="two frames have the name 'a'"):
        wd.TorsionalBuilding([1e5] * 2, PLAN, [one, one])
    with pytest.raises(ValueError, match="can move freely"):
        wd.TorsionalBuilding([1e5] * 2, PLAN, [one])
    with pytest.raises(ValueError, match="spring 'b 1': unknown parameter 'yeild_force'"):
        wd.TorsionalBuilding([1e5], PLAN, [wd.PlanFrame("b", (0, 0), "x", 1e7, law="bilinear", yeild_force=1e5)])
    with pytest.raises(TypeError, match=r"frames must be a list of wd\.PlanFrame"):
        wd.TorsionalBuilding([1e5], PLAN, [("a", 0, 0)])
    scatter = {"eccentricity_y": wd.RandomValue(wd.Uniform(-9.0, 9.0))}
    both = pair(pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5))
    with pytest.raises(ValueError, match="outside the plan: give values from -6 to 6 m"):
        wd.simulate(wd.Scene(three_storeys(), both, scatter), structures=30, **SETTINGS)
