"""Bridges in the longitudinal direction: event-exact peaks, closed forms, OpenSees, and refused arguments."""

from __future__ import annotations

import importlib.util
import warnings

import numpy as np
import pytest
from lumped_cases import pulse
from opensees import opensees

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = pytest.mark.meant_as_given(
    "no_damping", "damping_ratio", "first_period", "strongest_motion", "record_baseline"
)
SETTINGS = {"dtype": "float64", "device": "cpu"}
LINEAR = {"contact": "one_sided_gap", "contact_stiffness": 150e6}
PIER = wd.BridgeSupport(60e3, 40e6, law="bilinear", yield_force=0.8e6, hardening_ratio=0.03)
ON_PIER = wd.Bearing("deck", "pier", 20e6, law="bilinear", yield_force=0.4e6, hardening_ratio=0.1)
RAYLEIGH = {"damping": "rayleigh", "damping_ratio": 0.05, "damping_modes": (1, 2)}


def one_pier(**changed) -> wd.LumpedStructure:
    given = {"deck": {"deck": 800e3}, "piers": {"pier": PIER}, "gaps": [0.05, 0.05], **LINEAR, **RAYLEIGH}
    given["bearings"] = [ON_PIER, wd.Bearing("deck", "left abutment", 6e6)]
    return wd.longitudinal_bridge(**given | changed)


def test_a_bridge_with_one_pier_has_the_peaks_of_the_event_exact_solution():
    bridge = one_pier()
    np.testing.assert_allclose(bridge.modal()["circular_frequency"], [4.895108, 31.75749], rtol=2e-7)
    run = wd.simulate(wd.Scene(bridge, pulse(5.0, 0.9, 0.35, 10.0), tail=0.0), step=1e-4, **SETTINGS)
    due = {
        "peak_displacement": {"pier": 0.02861445, "deck": 0.1317049},
        "peak_output": {"joint left abutment - deck": 0.1317049, "joint deck - right abutment": 0.1317049},
        "peak_spring_deformation": {"bearing deck - pier": 0.1117918},
        "peak_spring_force": {
            "pier": 810337.3,
            "bearing deck - pier": 583583.6,
            "contact deck - right abutment": 1.225574e7,
            "contact left abutment - deck": 9716607.0,
        },
        "peak_acceleration": {"deck": 17.04199},
    }
    for variable, peaks in due.items():
        found = run[variable].isel(sample=0).to_series()
        np.testing.assert_allclose(found[[*peaks]], [*peaks.values()], rtol=1e-5)


def test_an_elastic_bridge_has_the_frequencies_and_the_peak_of_a_hand_computation():
    # Two degrees of freedom: (k_p + k_b - m_p w)(k_b + k_a - m_d w) = k_b^2, a quadratic equation for w = omega^2.
    bridge = one_pier(
        piers={"pier": wd.BridgeSupport(60e3, 40e6)},
        bearings=[wd.Bearing("deck", "pier", 20e6), wd.Bearing("deck", "right abutment", 6e6)],
    )
    squared = np.roots([60e3 * 800e3, -(60e3 * 26e6 + 800e3 * 60e6), 60e6 * 26e6 - 20e6**2])
    np.testing.assert_allclose(bridge.modal()["circular_frequency"] ** 2, np.sort(squared), rtol=1e-12)


@pytest.mark.parametrize(("gap", "touches"), [(0.05, True), (0.5, False)])
def test_a_deck_on_elastic_bearings_under_a_suddenly_constant_acceleration(gap, touches):
    # Work and energy at the largest displacement u to the right: m a u = k u^2 / 2 + k_c (u - gap)^2 / 2.
    mass, stiffness, stop, ground = 800e3, 6e6, 150e6, 1.0
    deck = wd.longitudinal_bridge(
        {"deck": mass}, {}, [wd.Bearing("deck", "left abutment", stiffness)], gaps=[None, gap], **LINEAR
    )
    motion = wd.GroundMotion(np.full(200, -ground), 0.01)
    run = wd.simulate(wd.Scene(deck, motion, tail=0.0), step=2e-4, **SETTINGS)
    largest = 2 * mass * ground / stiffness
    assert (largest > gap) == touches
    if touches:
        largest = np.roots([(stiffness + stop) / 2, -(mass * ground + stop * gap), stop * gap**2 / 2]).max()
    assert run["peak_displacement"].item() == pytest.approx(largest, rel=1e-6)
    force = run["peak_spring_force"].sel(spring="contact deck - right abutment").item()
    assert force == pytest.approx(stop * max(largest - gap, 0.0), rel=1e-5)


SEGMENTS = {"west": 600e3, "east": 500e3}  # kg
BACKFILL = {"mass": 1.5e5, "stiffness": 1.2e8, "yield": 2.5e6, "hardening": 0.02}
PIERS = {"p1": (8e4, 3.5e7, 9e5), "p2": (7e4, 5e7, 1.1e6)}  # mass, stiffness, yield force
# Segment, support, stiffness, yield force (friction 5 to 8 % of the weight), hardening ratio.
BEARINGS = [
    ("west", "left abutment", 3e7, 1.0e5, 1e-3),
    ("west", "p1", 2.5e7, 5e5, 0.1),
    ("east", "p2", 4e7, 2.0e5, 1e-3),
    ("east", "right abutment", 5e6, None, None),
]
GAPS = [0.03, 0.02, 0.04]  # m


def two_segments() -> wd.LumpedStructure:
    abutment = wd.BridgeSupport(
        BACKFILL["mass"], BACKFILL["stiffness"], law="bilinear", yield_force=2.5e6, hardening_ratio=0.02
    )
    piers = {
        name: wd.BridgeSupport(mass, k, law="bilinear", yield_force=fy, hardening_ratio=0.03)
        for name, (mass, k, fy) in PIERS.items()
    }
    bearings = [
        wd.Bearing(segment, support, k, **({} if fy is None else bilinear(fy, ratio)))
        for segment, support, k, fy, ratio in BEARINGS
    ]
    return wd.longitudinal_bridge(
        SEGMENTS,
        piers,
        bearings,
        gaps=GAPS,
        contact="one_sided_gap",
        contact_stiffness=1e9,
        abutments={"left abutment": abutment, "right abutment": abutment},
        damping="rayleigh",
        damping_ratio=0.05,
        damping_modes=(1, 3),
    )


def bilinear(force: float, ratio: float) -> dict:
    return {"law": "bilinear", "yield_force": force, "hardening_ratio": ratio}


@pytest.mark.skipif(importlib.util.find_spec("openseespy") is None, reason="openseespy is not installed")
def test_two_segments_with_friction_and_yielding_backfill_against_opensees():
    step, motion, bridge = 5e-5, pulse(6.0, 0.9, 0.5, 4.0), two_segments()
    run = wd.simulate(wd.Scene(bridge, motion, tail=0.0), step=step, **SETTINGS)
    first, third = bridge.modal()["circular_frequency"].values[[0, 2]]
    a0, a1 = 0.1 * first * third / (first + third), 0.1 / (first + third)
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    abutments = dict.fromkeys(("left abutment", "right abutment"), BACKFILL["mass"])
    masses = SEGMENTS | {name: own[0] for name, own in PIERS.items()} | abutments
    nodes = {name: tag for tag, name in enumerate(masses, 1)}
    ops.node(100, 0.0)
    ops.fix(100, 1)
    for name, mass in masses.items():
        ops.node(nodes[name], 0.0, "-mass", mass)
    elements = [("ground", name, k, fy, 0.03) for name, (_, k, fy) in PIERS.items()]
    elements += [
        ("ground", name, BACKFILL["stiffness"], BACKFILL["yield"], BACKFILL["hardening"]) for name in abutments
    ]
    elements += [(support, segment, k, fy, ratio) for segment, support, k, fy, ratio in BEARINGS]
    for tag, (below, above, k, fy, ratio) in enumerate(elements, 1):
        if fy is None:
            ops.uniaxialMaterial("Elastic", tag, k)
        else:
            ops.uniaxialMaterial("Steel01", tag, fy, k, ratio)
        ends = nodes.get(below, 100), nodes[above]
        ops.element("zeroLength", tag, *ends, "-mat", tag, "-dir", 1, "-doRayleigh", 1)
    joints = ("left abutment", *SEGMENTS, "right abutment")
    for place, gap in enumerate(GAPS):
        tag = 50 + place
        ops.uniaxialMaterial("ElasticPPGap", tag, 1e9, -1e13, -gap)
        ops.element("zeroLength", tag, nodes[joints[place]], nodes[joints[place + 1]], "-mat", tag, "-dir", 1)
    ops.region(1, "-ele", *range(1, len(elements) + 1), "-rayleigh", a0, 0.0, a1, 0.0)
    ops.timeSeries("Path", 1, "-dt", motion.step, "-values", *motion.acceleration.tolist(), 0.0, 0.0)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-11, 50)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    moved, forces, pressed = np.zeros(len(masses)), np.zeros(len(elements)), np.zeros(3)
    for _ in range(round(4.0 / step)):
        assert ops.analyze(1, step) == 0
        moved = np.maximum(moved, [abs(ops.nodeDisp(tag, 1)) for tag in nodes.values()])
        forces = np.maximum(forces, [abs(ops.basicForce(tag)[0]) for tag in range(1, len(elements) + 1)])
        pressed = np.maximum(pressed, [abs(ops.basicForce(50 + place)[0]) for place in range(3)])
    ops.wipe()
    assert (pressed > 1e6).all()  # all joints close
    assert (forces[2:4] > BACKFILL["yield"]).all()  # the backfill of both abutments yields
    assert tuple(masses) == bridge.dof_names
    np.testing.assert_allclose(run["peak_displacement"][0], moved, rtol=2e-6)
    force = run["peak_spring_force"][0].values
    names = [f"bearing {segment} - {support}" for segment, support, *_ in BEARINGS]
    order = [*PIERS, *abutments, *names]
    found = [force[bridge.names_along("spring").index(name)] for name in order]
    np.testing.assert_allclose(found, forces, rtol=3e-6)
    np.testing.assert_allclose(force[-3:], pressed, rtol=2e-5)


def test_names_groups_and_impact_masses():
    bridge = two_segments()
    assert bridge.dof_names == ("west", "east", "p1", "p2", "left abutment", "right abutment")
    assert [*bridge.outputs] == ["joint left abutment - west", "joint west - east", "joint east - right abutment"]
    assert bridge.outputs["joint west - east"][0] == {"west": -1.0, "east": 1.0}
    groups = dict(zip(bridge.names_along("spring"), bridge.kinds.groups["spring"], strict=True))
    assert [name for name, group in groups.items() if group == "contact"] == [
        "contact left abutment - west",
        "contact west - east",
        "contact east - right abutment",
    ]
    assert [name for name, group in groups.items() if group == "soil"] == ["left abutment", "right abutment"]
    damped = one_pier(contact="kelvin_voigt_contact", restitution=0.6)
    assert [spring.parameters["impact_mass"] for spring in damped.springs[-2:]] == [800e3, 800e3]
    joined = wd.longitudinal_bridge(
        SEGMENTS,
        {},
        [wd.Bearing(name, "left abutment", 1e7) for name in SEGMENTS],
        gaps=[None, 0.02, None],
        contact="kelvin_voigt_contact",
        contact_stiffness=1e9,
        restitution=0.6,
    )
    assert joined.springs[-1].parameters["impact_mass"] == pytest.approx(600e3 * 500e3 / 1100e3)


def test_a_scene_from_its_json_has_the_same_samples():
    scatter = {"clearance": wd.RandomFactor(wd.Lognormal(1.0, 0.3), per="spring")}
    scene = wd.Scene(two_segments(), pulse(5.0, 0.9, 0.5, 2.0), scatter)
    other = wd.Scene.from_json(scene.to_json(), scene.excitation.motions)
    one, two = (wd.simulate(each, structures=4, seed=1, **SETTINGS) for each in (scene, other))
    np.testing.assert_array_equal(one["peak_output"], two["peak_output"])
    assert (one["clearance"].isel(spring=-1).std() > 0).item()


ABUTMENT = wd.BridgeSupport(1e5, 1e8)
WRONG_VALUES = [
    ({"deck": {}}, "deck is empty"),
    ({"deck": {"deck": -1.0}}, r"deck\['deck'\] \[kg\]"),
    ({"gaps": [0.05]}, "gaps has 1 entries, but there are 2 joints"),
    ({"gaps": [0.05, -0.05]}, r"gaps\[1\] \[m\]"),
    ({"piers": {"deck": PIER}}, "'deck' is the name of two parts of the bridge"),
    ({"piers": {"left abutment": PIER}}, "'left abutment' is the name of two parts of the bridge"),
    ({"abutments": {"left": ABUTMENT}}, "abutments has the unknown name 'left'"),
    ({"bearings": [wd.Bearing("dek", "pier", 2e7)]}, "is at the unknown deck segment 'dek'.*'deck'"),
    ({"bearings": [wd.Bearing("deck", "peir", 2e7)]}, "rests on the unknown support 'peir'.*'pier'"),
    ({"bearings": [wd.Bearing("deck", "deck", 2e7)]}, "rests on the unknown support 'deck'"),
    ({"bearings": [wd.Bearing("deck", "pier")]}, "spring 'bearing deck - pier': stiffness is missing"),
    ({"bearings": [ON_PIER, ON_PIER]}, "two springs have the name 'bearing deck - pier'"),
    ({"bearings": []}, "degree of freedom 'deck' can move freely"),
    ({"bearings": [wd.Bearing("deck", "pier", 2e7, law="bilinear")]}, "spring 'bearing deck - pier': yield_force"),
    ({"contact": "gap"}, r"longitudinal_bridge\(\): contact is 'gap'"),
    ({"hertz_stiffness": 1e9}, "spring 'contact left abutment - deck': unknown parameter 'hertz_stiffness'"),
    ({"clearance": 0.05}, "the gap is the clearance of the contact"),
]


@pytest.mark.parametrize(("changed", "message"), WRONG_VALUES)
def test_wrong_arguments_are_named(changed, message):
    with pytest.raises(ValueError, match=message):
        one_pier(**changed)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"deck": 8e5}, "deck must be a dictionary"),
        ({"piers": [PIER]}, "piers must be a dictionary"),
        ({"piers": {"pier": 4e7}}, r"piers\['pier'\] must be a BridgeSupport, got"),
        ({"bearings": ON_PIER}, "bearings must be a list of Bearings"),
        ({"gaps": 0.05}, "gaps must be a list with one gap in m per joint, got 0.05"),
    ],
)
def test_arguments_of_another_type_are_named(changed, message):
    with pytest.raises(TypeError, match=message):
        one_pier(**changed)


@pytest.mark.parametrize(("mass", "stiffness", "message"), [(0.0, 1e7, "mass"), (1e5, -1.0, "stiffness")])
def test_wrong_supports_are_named(mass, stiffness, message):
    with pytest.raises(ValueError, match=rf"BridgeSupport: {message} \["):
        wd.BridgeSupport(mass, stiffness)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, ""),
        ({"gaps": [50.0, 50.0]}, "given in mm, it would be 0.05 m"),
        ({"contact_stiffness": 150e3}, "given in kN/m or N/mm, it would be 1.5e+08 N/m"),
        (
            {"piers": {"pier": wd.BridgeSupport(60e3, 40e6, **bilinear(300.0, 0.03))}},
            "deformation at which the spring yields of spring 'pier'",
        ),
    ],
)
def test_a_value_in_another_unit_is_named(changed, words):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        warn_of_implausible(wd.Scene(one_pier(**changed), pulse(2.0, 0.5, 0.5)))
    said = " ".join(str(each.message) for each in found)
    assert (words in said) if words else not said
