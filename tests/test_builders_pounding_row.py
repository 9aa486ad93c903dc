"""Buildings in a row that collide: against event-exact peaks, SciPy and OpenSees, and refused arguments."""

from __future__ import annotations

import importlib.util
import warnings

import numpy as np
import pytest
from lumped_cases import pulse
from opensees import opensees
from scipy.integrate import solve_ivp

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")
SETTINGS = {"dtype": "float64", "device": "cpu"}
LINEAR = {"contact": "one_sided_gap", "contact_stiffness": 93.5e6}
MASSES = {"first": [2e5, 1.6e5], "second": [3e5, 3e5, 2.2e5], "third": [1.5e5, 1.2e5]}  # kg
STIFFNESS = {"first": [5e7, 4e7], "second": [2.4e8, 2e8, 1.5e8], "third": [3e7, 2.4e7]}  # N/m
GAPS = [0.02, [0.015, 0.03]]  # m
HERTZ = {"hertz_stiffness": 2.75e9, "restitution": 0.65}


def oscillator(mass: float, period: float) -> wd.ShearBuilding:
    stiffness = mass * (2 * np.pi / period) ** 2
    dashpot = 2 * 0.05 * np.sqrt(stiffness * mass)
    return wd.ShearBuilding([mass], stiffness, 3.0, damping="storey", damping_coefficient=dashpot)


def three(law: str = "elastic", **parameters) -> dict[str, wd.ShearBuilding]:
    """Return buildings of 2, 3 and 2 storeys, each with its own Rayleigh damping; yields are at 8 mm."""
    found = {}
    for name, masses in MASSES.items():
        stiffness = np.array(STIFFNESS[name])
        own = {"yield_force": 0.008 * stiffness, "hardening_ratio": 0.05} if law == "bilinear" else {}
        found[name] = wd.ShearBuilding(
            masses, stiffness, 3.2, law=law, damping="rayleigh", damping_ratio=0.05, **own, **parameters
        )
    return found


def matrices(name: str) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Return mass and stiffness matrix of a building, and its Rayleigh factors, from the numbers above."""
    mass, k = np.diag(MASSES[name]), np.array([*STIFFNESS[name], 0.0])
    stiffness = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    one, two = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real))[:2]
    return mass, stiffness, (0.1 * one * two / (one + two), 0.1 / (one + two))


@pytest.mark.parametrize(
    ("contact", "peaks"),
    [
        ("one_sided_gap", (0.2605235, 0.0904291, 8470988.0, 52.78469, 17.70298)),
        ("kelvin_voigt_contact_with_tension", (0.2151704, 0.07633299, 6931603.0, 43.25171, 15.53343)),
        ("kelvin_voigt_contact", (0.2172359, 0.07639323, 6952900.0, 43.44379, 14.95033)),
    ],
)
def test_two_oscillators_have_the_peaks_of_the_event_exact_solution(contact, peaks):
    own = {} if contact == "one_sided_gap" else {"restitution": 0.65}
    row = wd.pounding_row(
        {"a": oscillator(200e3, 0.8), "b": oscillator(350e3, 0.45)},
        [0.02],
        contact=contact,
        contact_stiffness=93.5e6,
        **own,
    )
    run = wd.simulate(wd.Scene(row, pulse(6.0, 0.7, 0.4), tail=0.0), step=1e-4, **SETTINGS)
    found = [
        *run["peak_output"].sel(output=["a drift 1", "b drift 1"]).values[0],
        run["peak_spring_force"].sel(spring="contact a u1 - b u1").item(),
        *run["peak_acceleration"].values[0],
    ]
    # Forces of Kelvin-Voigt contacts jump at the first touch: errors are proportional to the step.
    np.testing.assert_allclose(found, peaks, rtol=1e-5 if contact == "one_sided_gap" else 1e-3)


def hertz_damp_peaks(motion: wd.GroundMotion, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the peak drifts and contact forces of the three buildings by SciPy, from touch to touch."""
    mass, stiffness, damping = (np.zeros((7, 7)) for _ in range(3))
    rows, first = [], 0
    for name, own in MASSES.items():
        part = slice(first, first + len(own))
        mass[part, part], stiffness[part, part], (a0, a1) = matrices(name)
        damping[part, part] = a0 * mass[part, part] + a1 * stiffness[part, part]
        rows += [np.eye(7)[first + floor] - (np.eye(7)[first + floor - 1] if floor else 0) for floor in range(len(own))]
        first += len(own)
    drifts, inverse = np.array(rows), np.diag(1 / np.diag(mass))
    pairs = np.array([np.eye(7)[left] - np.eye(7)[right] for left, right in ((0, 2), (1, 3), (2, 5), (3, 6))])
    gaps, factor = np.array([0.02, 0.02, 0.015, 0.03]), 8 * (1 - 0.65) / (5 * 0.65)
    ground_time = motion.step * np.arange(motion.acceleration.size)
    speeds = np.full(4, np.nan)  # at the first touch of the contacts that are closed

    def forces(y: np.ndarray) -> np.ndarray:
        depth, rate = pairs @ y[:7] - gaps, pairs @ y[7:]
        closed = ~np.isnan(speeds) & (depth > 0)
        damped = np.maximum(0.0, 1 + factor * rate / np.where(closed, np.maximum(speeds, 0.01), 1.0))
        return np.where(closed, 2.75e9 * np.maximum(depth, 0.0) ** 1.5 * damped, 0.0)

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        ground = np.interp(t, ground_time, motion.acceleration)
        force = damping @ y[7:] + stiffness @ y[:7] + pairs.T @ forces(y)
        return np.concatenate([y[7:], -inverse @ force - ground])

    def crossing(contact: int):
        def event(_: float, y: np.ndarray) -> float:
            return pairs[contact] @ y[:7] - gaps[contact]

        event.terminal = True
        return event

    start, y, paths, pressed = 0.0, np.zeros(14), [], []
    while start < duration:
        events = [crossing(contact) for contact in range(4)]
        for contact, event in enumerate(events):
            event.direction = 1.0 if np.isnan(speeds[contact]) else -1.0
        part = solve_ivp(
            slope, (start, duration), y, method="DOP853", rtol=1e-9, atol=1e-12, max_step=5e-4, events=events
        )
        paths.append(part.y)
        pressed.append(np.array([forces(each) for each in part.y.T]))
        start, y = part.t[-1], part.y[:, -1]
        for contact, times in enumerate(part.t_events):
            if times.size:
                speeds[contact] = pairs[contact] @ y[7:] if np.isnan(speeds[contact]) else np.nan
    moved = drifts @ np.concatenate(paths, axis=1)[:7]
    return np.abs(moved).max(axis=1), np.concatenate(pressed).max(axis=0)


def test_three_elastic_buildings_with_hertz_damp_contacts_against_scipy():
    motion = pulse(5.0, 0.6, 0.5, 3.0)
    row = wd.pounding_row(three(), GAPS, contact="ye_li_zhu_contact", **HERTZ)
    run = wd.simulate(wd.Scene(row, motion, tail=0.0), step=5e-5, **SETTINGS)
    drifts, forces = hertz_damp_peaks(motion, 3.0)
    assert (forces > 1e6).all()  # all four pairs of floors collide
    np.testing.assert_allclose(run["peak_output"][0], drifts, rtol=3e-5)
    # SciPy's peaks of the forces are those at its steps, which are up to 0.5 ms long.
    np.testing.assert_allclose(run["peak_spring_force"][0, -4:], forces, rtol=1e-3)


@pytest.mark.skipif(importlib.util.find_spec("openseespy") is None, reason="openseespy is not installed")
def test_three_yielding_buildings_with_linear_contacts_against_opensees():
    step, motion = 5e-5, pulse(6.0, 0.6, 0.5, 3.0)
    row = wd.pounding_row(three("bilinear"), GAPS, **LINEAR)
    run = wd.simulate(wd.Scene(row, motion, tail=0.0), step=step, **SETTINGS)
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    nodes, storeys = {}, []
    for place, (name, masses) in enumerate(MASSES.items()):
        below = 10 * place
        ops.node(below, 0.0)
        ops.fix(below, 1)
        own = []
        for storey, mass in enumerate(masses):
            tag, k = below + 1, STIFFNESS[name][storey]
            ops.node(tag, 0.0, "-mass", mass)
            nodes[name, storey + 1] = tag
            ops.uniaxialMaterial("Steel01", tag, 0.008 * k, k, 0.05)
            ops.element("zeroLength", tag, below, tag, "-mat", tag, "-dir", 1, "-doRayleigh", 1)
            storeys.append((below, tag))
            own.append(tag)
            below = tag
        a0, a1 = matrices(name)[2]
        ops.region(place + 1, "-ele", *own, "-rayleigh", a0, 0.0, a1, 0.0)  # and the nodes of these elements
    contacts = [("first", "second", floor, 0.02) for floor in (1, 2)]
    contacts += [("second", "third", 1, 0.015), ("second", "third", 2, 0.03)]
    for tag, (left, right, floor, gap) in enumerate(contacts, 100):
        # Deformation of the element is u_right - u_left: the material acts in compression.
        ops.uniaxialMaterial("ElasticPPGap", tag, 93.5e6, -1e12, -gap)
        ops.element("zeroLength", tag, nodes[left, floor], nodes[right, floor], "-mat", tag, "-dir", 1)
    ops.timeSeries("Path", 1, "-dt", motion.step, "-values", *motion.acceleration.tolist(), 0.0, 0.0)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-11, 50)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    drifts, forces = np.zeros(7), np.zeros(4)
    for _ in range(round(3.0 / step)):
        assert ops.analyze(1, step) == 0
        moved = [ops.nodeDisp(top, 1) - ops.nodeDisp(bottom, 1) for bottom, top in storeys]
        drifts = np.maximum(drifts, np.abs(moved))
        pressed = [abs(ops.basicForce(tag)[0]) for tag in range(100, 104)]
        forces = np.maximum(forces, pressed)
    ops.wipe()
    assert (forces > 1e5).all()
    assert (drifts > 0.012).sum() >= 4  # storeys yield
    np.testing.assert_allclose(run["peak_output"][0], drifts, rtol=2e-6)
    np.testing.assert_allclose(run["peak_spring_force"][0, -4:], forces, rtol=2e-5)


def test_buildings_far_apart_move_as_each_alone():
    motion = pulse(6.0, 0.6, 0.5, 3.0)
    buildings = three("bilinear")
    row = wd.pounding_row(buildings, [1.0, 1.0], **LINEAR)
    together = wd.simulate(wd.Scene(row, motion, tail=0.0), step=1e-3, **SETTINGS)
    alone = [
        wd.simulate(wd.Scene(building, motion, tail=0.0), step=1e-3, **SETTINGS)["peak_storey_drift"].values[0]
        for building in buildings.values()
    ]
    np.testing.assert_allclose(together["peak_output"][0], np.concatenate(alone), rtol=1e-9)
    assert (together["peak_spring_force"][0, -4:] == 0).all()


def test_names_groups_and_impact_masses():
    row = wd.pounding_row(three(), GAPS, contact="jankowski_contact", **HERTZ)
    assert row.dof_names[:3] == ("first u1", "first u2", "second u1")
    assert row.names_along("spring")[-1] == "contact second u2 - third u2"
    assert [*row.outputs] == [f"{name} drift {i + 1}" for name, own in MASSES.items() for i in range(len(own))]
    assert [spring.parameters["clearance"] for spring in row.springs[-4:]] == [0.02, 0.02, 0.015, 0.03]
    assert row.springs[-1].parameters["impact_mass"] == pytest.approx(3e5 * 1.2e5 / 4.2e5)
    assert row.kinds.of_building("spring").sum() == 7
    assert set(row.kinds.groups["dof"]) == {*MASSES}


def test_random_gaps_and_stiffness_of_one_building():
    row = wd.pounding_row(three(), GAPS, **LINEAR)
    factor = wd.RandomFactor(wd.Lognormal(1.0, 0.3), per="spring")
    scatter = {"clearance": factor, "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1), only=("third",))}
    run = wd.simulate(wd.Scene(row, pulse(5.0, 0.6, 0.5, 2.0), scatter), structures=8, seed=1, **SETTINGS)
    gaps, stiffness = run["clearance"].values, run["stiffness"].values
    assert np.isnan(gaps[:, :7]).all()
    assert (gaps[:, 7:].std(axis=0) > 0.001).all()
    assert (stiffness[:, 5:7].std(axis=0) > 0).all()
    assert (stiffness[:, :5].std(axis=0) == 0).all()


def test_contacts_do_not_count_in_the_largest_demand():
    motions = [pulse(4.0, period, 0.5, 2.0) for period in (0.5, 0.6, 0.7)]
    stripes = wd.Stripes(motions, [0.05, 0.1, 0.2], wd.PeakGroundAcceleration())
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    row = wd.pounding_row(three(), GAPS, **LINEAR)
    run = wd.simulate(wd.Scene(row, stripes, scatter), structures=6, seed=1, **SETTINGS)
    peaks, limit = run["peak_spring_deformation"].values, 0.012
    due, with_contacts = ((values > limit).any(axis=1).sum() for values in (peaks[:, :7], peaks))
    assert 0 < due < with_contacts  # neighbours move apart by more than the drift of each storey
    curve = wd.fragility(run, {"moderate": limit}, demand="peak_spring_deformation")
    assert curve["exceeding_samples"].sum().item() == due


def test_any_floors_collide_if_they_are_named():
    tall = wd.FlexuralShearBuilding([2e5] * 3, 2.8, period=0.4, alpha0=3.0, damping="modal", damping_ratio=0.05)
    torsional = wd.LumpedStructure(
        {"u": 1e5, "theta": 1e6},
        [
            wd.Spring("a", {"u": 1.0, "theta": 4.0}, stiffness=2e7),
            wd.Spring("b", {"u": 1.0, "theta": -4.0}, stiffness=1e7),
        ],
        influence={"u": 1.0},
        outputs={"edge": {"u": 1.0, "theta": 4.0}},
        output_units={"edge": "m"},
    )
    row = wd.pounding_row({"tall": tall, "low": torsional}, [{("u1", "u"): 0.01}], **LINEAR)
    assert [*row.outputs] == ["tall drift 1", "tall drift 2", "tall drift 3", "low edge"]
    assert row.kinds.rotating["dof"] == (False, False, False, False, True)
    np.testing.assert_array_equal(row.influence[:, 0], [1, 1, 1, 1, 0])
    periods = np.sort(np.concatenate([tall.modal()["period"].values, torsional.modal()["period"].values]))
    np.testing.assert_allclose(np.sort(row.modal()["period"].values), periods, rtol=1e-9)


def test_a_scene_from_its_json_has_the_same_samples():
    scene = wd.Scene(wd.pounding_row(three(), GAPS, **LINEAR), pulse(5.0, 0.6, 0.5, 2.0))
    other = wd.Scene.from_json(scene.to_json(), scene.excitation.motions)
    one, two = (wd.simulate(each, **SETTINGS) for each in (scene, other))
    np.testing.assert_array_equal(one["peak_output"], two["peak_output"])


TWO = {name: oscillator(2e5, 0.5) for name in ("left", "right")}
SHIFTED = {"left": TWO["left"], "right": wd.ShearBuilding([1e5], 1e8, 3.6, damping="modal", damping_ratio=0.05)}
UNKNOWN = {"left": TWO["left"], "right": wd.LumpedStructure({"u": 1e5}, [wd.Spring("k", {"u": 1.0}, stiffness=1e7)])}
TALL = {name: wd.ShearBuilding([1e5] * 33, 1e9, 3.0) for name in ("left", "right")}


@pytest.mark.parametrize(
    ("buildings", "gaps", "changed", "message"),
    [
        ({"left": TWO["left"]}, [], {}, "at least two buildings, got 1"),
        (TWO, [0.02, 0.02], {}, "gaps has 2 entries, but 2 buildings have 1 pairs"),
        (TWO, [-0.02], {}, r"gaps\[0\] is -0.02 m; it must be at least 0"),
        (TWO, [[0.02, 0.03]], {}, r"gaps\[0\] must be one value or one per common level of 'left' and 'right' \(1\)"),
        (TWO, [float("nan")], {}, r"gaps\[0\]"),
        (TWO, [{}], {}, r"gaps\[0\] is an empty dictionary"),
        (TWO, [{("u1", "v1"): 0.02}], {}, "names the floor 'v1', but building 'right' has no such degree of freedom"),
        (TWO, [{("u1", "u1"): -0.02}], {}, r"gaps\[0\]\[\('u1', 'u1'\)\] \[m\]"),
        (SHIFTED, [0.02], {}, "floor 'u1' of 'left' at 3 m is not at the level of a floor of 'right'"),
        (UNKNOWN, [0.02], {}, "the levels of the floors of 'right' are unknown"),
        (TALL, [0.02], {}, r"33 \+ 33 = 66 degrees of freedom, at most 64"),
        ({"soil": TWO["left"], "right": TWO["right"]}, [0.02], {}, "cannot have the name 'soil'"),
        (TWO, [0.02], {"contact": "gap"}, "contact is 'gap'.* allowed: 'one_sided_gap'"),
        (TWO, [0.02], {"contact": "hertz_contct"}, "did you mean 'hertz_contact'"),
        (TWO, [0.02], {"clearance": 0.02}, "the gap is the clearance of the contact: remove clearance="),
        (TWO, [0.02], {"hertz_stiffness": 1e9}, "spring 'contact left u1 - right u1': unknown parameter"),
        (TWO, [0.02], {"contact": "hertz_contact", "contact_stiffness": 1e8}, "unknown parameter 'contact_stiffness'"),
    ],
)
def test_wrong_arguments_are_named(buildings, gaps, changed, message):
    with pytest.raises(ValueError, match=message):
        wd.pounding_row(buildings, gaps, **LINEAR | changed)


@pytest.mark.parametrize(
    ("buildings", "gaps", "changed", "message"),
    [
        ([*TWO.values()], [0.02], {}, "buildings must be a dictionary"),
        ({"left": TWO["left"], "right": 3.0}, [0.02], {}, "a LumpedStructure or ShearBuilding"),
        (TWO, 0.02, {}, "gaps must be a list with one entry per pair of neighbours, got 0.02"),
        (TWO, [{"u1": 0.02}], {}, "a key must be a pair of floors"),
        (
            TWO,
            [0.02],
            {"contact": wd.laws.HertzContact(clearance=0.02, hertz_stiffness=1e9)},
            "give the name 'hertz_contact'",
        ),
    ],
)
def test_arguments_of_another_type_are_named(buildings, gaps, changed, message):
    with pytest.raises(TypeError, match=message):
        wd.pounding_row(buildings, gaps, **LINEAR | changed)


def test_two_components_are_refused():
    plane = wd.LumpedStructure(
        {"x": 1e5, "y": 1e5},
        [wd.Spring("x", {"x": 1.0}, stiffness=1e7), wd.Spring("y", {"y": 1.0}, stiffness=1e7)],
        influence=[{"x": 1.0}, {"y": 1.0}],
    )
    with pytest.raises(ValueError, match="building 'right' has 2 components of base motion"):
        wd.pounding_row({"left": TWO["left"], "right": plane}, [{("u1", "x"): 0.01}], **LINEAR)


@pytest.mark.parametrize(
    ("gap", "changed", "words"),
    [
        (0.02, {}, ""),
        (20.0, {}, "given in mm, it would be 0.02 m"),
        (0.02, {"contact": "hertz_contact", "hertz_stiffness": 2.75e6}, "given in kN/m^1.5, it would be 2.75e+09"),
        (0.02, {"contact_stiffness": 93.5e3}, "given in kN/m or N/mm, it would be 9.35e+07 N/m"),
    ],
)
def test_a_value_in_another_unit_is_named(gap, changed, words):
    own = LINEAR | changed
    if "hertz_stiffness" in own:
        del own["contact_stiffness"]
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        warn_of_implausible(wd.Scene(wd.pounding_row(TWO, [gap], **own), pulse(2.0, 0.5, 0.5)))
    said = " ".join(str(each.message) for each in found)
    assert (words in said) if words else not said
