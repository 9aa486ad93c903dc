"""Implicit methods of lumped structures: OpenSees' Newmark and HHT, chains, an independent Newmark, and refusals."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from hinge_cases import reference_model
from lumped_cases import pair, pulse
from opensees import opensees

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
needs_opensees = pytest.mark.skipif(importlib.util.find_spec("openseespy") is None, reason="openseespy is missing")
SETTINGS = {"dtype": "float64", "device": "cpu"}
STEP = 0.005
MASSES, STIFFNESS, YIELDS = [2e5, 2e5, 1.5e5], [1.2e8, 1e8, 7e7], [9e5, 7e5, 5e5]
IMPLICIT = ["newmark_average", "newmark_linear", "hht_alpha", "generalised_alpha", "wilson_theta", "central_difference"]


def chain(**changed) -> wd.ShearBuilding:
    given = {"law": "bilinear", "yield_force": YIELDS, "hardening_ratio": 0.05}
    given |= {"damping": "rayleigh", "damping_ratio": 0.05} | changed
    return wd.ShearBuilding(MASSES, STIFFNESS, 3.5, **given)


def frames(structure: wd.LumpedStructure, motion, method: str, **changed):
    recorders = ("spring", "displacement", "acceleration")
    scene = wd.Scene(structure, motion, recorders=recorders, tail=0.0)
    return wd.simulate(scene, step=STEP, method=method, histories=wd.Histories([0]), **SETTINGS | changed)


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("gravity", [{}, {"gravity_load": [2e6, 2e6, 1.5e6]}], ids=["plain", "gravity"])
@pytest.mark.usefixtures("unoptimised")  # one run is compared with another
def test_a_chain_has_the_response_of_its_shear_building(method, gravity):
    building, motion = chain(**gravity), pulse(6.0, 0.5, 0.4, 4.0)
    recorders = ("drift", "acceleration", "energy")
    due = wd.simulate(wd.Scene(building, motion, recorders=recorders), step=STEP, method=method, **SETTINGS)
    lumped = wd.Scene(wd.lumped_chain(building), motion, recorders=("spring", "acceleration", "energy"))
    run = wd.simulate(lumped, step=STEP, method=method, **SETTINGS)
    assert (due["peak_storey_drift"][0] > 2 * np.divide(YIELDS, STIFFNESS)).any()
    np.testing.assert_allclose(run["peak_spring_deformation"][0], due["peak_storey_drift"][0], rtol=1e-8)
    np.testing.assert_allclose(run["peak_acceleration"][0], due["peak_floor_acceleration"][0], rtol=1e-8)
    for name in ("input_energy", "viscous_energy"):
        # Measured difference: at most 7e-15 (rounding).
        assert run[name].item() == pytest.approx(due[name].item(), rel=1e-12)
    assert run["status"].item() == 0


@pytest.mark.parametrize("method", IMPLICIT)
def test_an_elastic_structure_may_be_at_rest_at_first(method):
    """The response after zeros of the motion is that without the zeros, and that of an independent Newmark method."""
    shaken = pulse(6.0, 0.5, 0.4, 4.0)
    late = wd.GroundMotion(np.append(np.zeros(20), shaken.acceleration), shaken.step, "late")
    masses, stiffnesses = [2e5, 1.5e5], [1.2e8, 7e7]
    building = wd.ShearBuilding(masses, stiffnesses, 3.5, law="elastic", damping="none")
    scenes = [wd.Scene(wd.lumped_chain(building), each, recorders=("spring",), tail=0.0) for each in (late, shaken)]
    settings = SETTINGS | {"step": shaken.step, "method": method, "longest_step": None, "on_unstable": "flag"}
    found, due = (wd.simulate(scene, **settings) for scene in scenes)
    assert found["status"].item() == due["status"].item() == 0
    peaks = found["peak_spring_deformation"].values[0]
    np.testing.assert_allclose(peaks, due["peak_spring_deformation"].values[0], rtol=1e-9)
    if method != "newmark_average":
        return
    mass, h = np.diag(masses), shaken.step
    stiffness = np.array([[sum(stiffnesses), -stiffnesses[1]], [-stiffnesses[1], stiffnesses[1]]])
    u, v, a = np.zeros(2), np.zeros(2), np.full(2, -late.acceleration[0])
    largest = np.zeros(2)
    for base in late.acceleration[1:]:
        ahead, quick = u + h * v + h**2 / 4 * a, v + h / 2 * a
        a = np.linalg.solve(mass + h**2 / 4 * stiffness, -mass @ np.full(2, base) - stiffness @ ahead)
        u, v = ahead + h**2 / 4 * a, quick + h / 2 * a
        largest = np.maximum(largest, np.abs([u[0], u[1] - u[0]]))
    np.testing.assert_allclose(peaks, largest, rtol=1e-6)


def eccentric(strength: float = 1.0) -> wd.TorsionalBuilding:
    """Two floors with eccentric masses (full mass matrix) and bilinear frames."""
    rows = [("a", (0, 5), "x", 6e7, 9e5), ("b", (-2, -5), "x", 4e7, 6e5), ("c", (-9, 1), "y", 9e7, 12e5)]
    rows += [("d", (9, 0), "y", 3e7, 4e5)]
    share = np.array([1.0, 0.7])
    law = {"law": "bilinear", "hardening_ratio": 0.05}
    planned = [
        wd.PlanFrame(n, at, axis, k * share, yield_force=strength * fy * share, **law) for n, at, axis, k, fy in rows
    ]
    damped = {"damping": "rayleigh", "damping_ratio": 0.05, "damping_modes": (1, 4)}
    return wd.TorsionalBuilding([1.5e5, 1.2e5], [[-10, 10], [-6, 6]], planned, mass_centre=(1.2, -0.7), **damped)


@needs_opensees
@pytest.mark.parametrize("method", ["newmark_average", "newmark_linear", "hht_alpha(alpha=-0.2)"])
def test_a_torsional_building_has_the_response_of_opensees_with_the_same_step(method):
    """Nodes in plan with rigid links and zero-length springs; the same method and the same step.

    OpenSees' HHT evaluates the spring forces at displacements between the two states, warpdyn weights the forces of
    both states. Both are equal if no spring yields.
    """
    is_elastic = method.startswith("hht")
    strength = 20.0 if is_elastic else 1.0
    building, floors, share = eccentric(strength), 2, np.array([1.0, 0.7])
    rows = [((0, 5), 0, 6e7, 9e5), ((-2, -5), 0, 4e7, 6e5), ((-9, 1), 1, 9e7, 12e5), ((9, 0), 1, 3e7, 4e5)]
    first, fourth = building.modal()["circular_frequency"].values[[0, 3]]
    a1 = 2 * 0.05 / (first + fourth)
    motions = pair(pulse(5.0, 0.9, 0.6, 3.0), pulse(4.0, 0.6, 0.5, 3.0))
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for floor in range(floors + 1):
        tag = 100 * floor
        ops.node(tag + 10, 1.2, -0.7)
        for place, (at, *_) in enumerate(rows):
            ops.node(tag + 11 + place, float(at[0]), float(at[1]))
            if floor == 0:
                ops.fix(tag + 11 + place, 1, 1, 1)
            else:
                ops.rigidLink("beam", tag + 10, tag + 11 + place)
        if floor == 0:
            ops.fix(tag + 10, 1, 1, 1)
        else:
            mass = [1.5e5, 1.2e5][floor - 1]
            ops.mass(tag + 10, mass, mass, mass * (20**2 + 12**2) / 12)
    for storey in range(floors):
        for place, (_, axis, k, fy) in enumerate(rows):
            tag = 10 * (storey + 1) + place
            ops.uniaxialMaterial("Steel01", tag, strength * fy * share[storey], k * share[storey], 0.05)
            nodes = (100 * storey + 11 + place, 100 * storey + 111 + place)
            ops.element("zeroLength", tag, *nodes, "-mat", tag, "-dir", axis + 1, "-doRayleigh", 1)
    for direction, motion in enumerate((motions.x, motions.y), start=1):
        values = [*motion.acceleration.tolist(), 0.0, 0.0]
        ops.timeSeries("Path", direction, "-dt", motion.step, "-values", *values)
        ops.pattern("UniformExcitation", direction, direction, "-accel", direction)
    ops.rayleigh(a1 * first * fourth, 0.0, a1, 0.0)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-13, 100)
    ops.algorithm("Newton")
    if method.startswith("hht"):
        ops.integrator("HHT", 0.8)
    else:
        ops.integrator("Newmark", 0.5, 0.25 if method == "newmark_average" else 1 / 6)
    ops.analysis("Transient")
    path = []
    for _ in range(round(3.0 / STEP)):
        assert ops.analyze(1, STEP) == 0
        path.append(
            [
                ops.nodeDisp(100 * storey + 111 + place, axis + 1) - ops.nodeDisp(100 * storey + 11 + place, axis + 1)
                for place, (_, axis, *_) in enumerate(rows)
                for storey in range(floors)
            ]
        )
    ops.wipe()
    due = np.abs(path).max(axis=0)
    run = frames(building, motions, method)
    found = run["peak_spring_deformation"][0].values
    yielding = due > 2 * building.parameters["yield_force"] / building.parameters["stiffness"]
    assert not yielding.any() if is_elastic else yielding.sum() >= 2
    np.testing.assert_allclose(found, due, rtol=1e-6)
    ours = run["spring_deformation"].isel(history=0)
    np.testing.assert_allclose(ours.sel(time=1.5, method="nearest"), path[round(1.5 / STEP) - 1], rtol=0, atol=1e-8)


def newmark(mass, damping, stiffness, load, start, steps, beta=0.25):
    """Return displacements of a linear system by Newmark's method, shape [step, dof]; own code."""
    u, v = np.array(start), np.zeros(len(mass))
    a = np.linalg.solve(mass, load(0.0) - damping @ v - stiffness @ u)
    effective = mass + 0.5 * STEP * damping + beta * STEP**2 * stiffness
    path = [u]
    for step in range(1, steps + 1):
        ahead, speed = u + STEP * v + STEP**2 * (0.5 - beta) * a, v + 0.5 * STEP * a
        new = np.linalg.solve(effective, load(step * STEP) - damping @ speed - stiffness @ ahead)
        u, v, a = ahead + beta * STEP**2 * new, speed + 0.5 * STEP * new, new
        path.append(u)
    return np.array(path)


LINKED = {"stiffness_matrix": 2e7 * np.array([[2, -1, 0], [-1, 2, -1], [0, -1, 1.0]])}
LINKED |= {"mass_matrix": 3e4 * np.array([[1, -1, 0], [-1, 1, 0], [0, 0, 0.0]])}
LINKED |= {"damping_matrix": 1e5 * np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1.0]])}


@pytest.mark.parametrize("damping", ["modal", "none"])
def test_full_matrices_and_forces_have_the_response_of_an_own_newmark(damping):
    ratio = {} if damping == "none" else {"damping_ratio": 0.04}
    springs = [wd.Spring(f"k{n}", {n: 1.0}, stiffness=k) for n, k in zip("abc", (4e7, 2e7, 1e7), strict=True)]
    springs.append(wd.Spring("damper", {"c": 1.0, "a": -1.0}, damping_coefficient=4e5))
    structure = wd.LumpedStructure(dict(zip("abc", MASSES, strict=True)), springs, damping=damping, **ratio, **LINKED)
    time = STEP * np.arange(401)
    values = 1e6 * np.sin(7 * time)[:, None] * [0.2, 0.0, 1.0]
    values[200:] = 0.0
    scene = wd.Scene(structure, wd.ForceHistory(values, STEP), tail=0.0)
    run = wd.simulate(scene, step=STEP, method="newmark_average", histories=wd.Histories([0]), **SETTINGS)
    matrices = structure.central_matrices(structure.parameters)
    three = [matrices[name] for name in ("mass", "damping", "stiffness")]
    due = newmark(*three, lambda t: values[min(round(t / STEP), 400)], [0.0] * 3, 400)
    found = run["displacement"].isel(history=0).values
    np.testing.assert_allclose(
        found[:, : len(due)] if found.shape[0] == 3 else found[: len(due)], due, rtol=0, atol=1e-10
    )


def test_gaps_and_hertz_contacts_converge_to_the_response_of_rk4():
    """A stiff stop at a fine step; both methods are of second order there."""
    springs = [
        wd.Spring("left", {"a": 1.0}, stiffness=1.2e7, damping_coefficient=1.6e5),
        wd.Spring("right", {"b": 1.0}, stiffness=6.8e7, damping_coefficient=4.9e5),
        wd.Spring("contact", {"a": 1.0, "b": -1.0}, law=wd.laws.HertzContact(clearance=0.02, hertz_stiffness=2.75e9)),
        wd.Spring("stop", {"b": -1.0}, law="one_sided_gap", clearance=0.05, contact_stiffness=2e8),
    ]
    row = wd.LumpedStructure({"a": 2e5, "b": 3.5e5}, springs)
    scene = wd.Scene(row, pulse(6.0, 0.7, 0.4, 2.0), tail=0.0)
    due, found = (
        wd.simulate(scene, step=1e-4, method=method, **SETTINGS)["peak_spring_deformation"][0].values
        for method in ("rk4", "newmark_average")
    )
    assert due[2] > 0.02
    assert due[3] > 0.05
    # Measured difference at this step: 3e-7 to 1.4e-6.
    np.testing.assert_allclose(found, due, rtol=5e-6)


@pytest.mark.parametrize("law", ["bouc_wen", "takeda", "menegotto_pinto"])
@pytest.mark.usefixtures("unoptimised")  # one run is compared with another
def test_other_laws_have_the_response_of_their_shear_buildings(law):
    building, motion = chain(law=law), pulse(6.0, 0.5, 0.4, 3.0)
    for method in ("newmark_average", "hht_alpha"):
        due = wd.simulate(wd.Scene(building, motion), step=STEP, method=method, **SETTINGS)
        run = wd.simulate(wd.Scene(wd.lumped_chain(building), motion), step=STEP, method=method, **SETTINGS)
        np.testing.assert_allclose(run["peak_spring_deformation"][0], due["peak_storey_drift"][0], rtol=1e-7)
        assert run["status"].item() == 0


def test_ensembles_collapse_and_float32():
    building = chain(drift_capacity=0.05)
    scatter = {
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
        "yield_force": wd.RandomFactor(wd.Lognormal(1, 0.2)),
    }
    motions = [pulse(6.0, 0.5, 0.4, 3.0), pulse(5.0, 0.8, 0.4, 4.0)]
    stripes = wd.Stripes(motions, [0.2, 0.5, 0.9], wd.PeakGroundAcceleration())
    settings = {"structures": 6, "seed": 2, "step": STEP, "method": "newmark_average", "device": "cpu"}
    scenes = [wd.Scene(each, stripes, scatter) for each in (building, wd.lumped_chain(building))]
    due, run = (wd.simulate(scene, dtype="float64", **settings) for scene in scenes)
    np.testing.assert_array_equal(run["status"], due["status"])
    assert {0, 1} <= set(run["status"].values.tolist())
    np.testing.assert_allclose(run["time_of_collapse"], due["time_of_collapse"], rtol=1e-6)
    stands = run["status"].values == 0
    peaks = run["peak_spring_deformation"].values[stands]
    np.testing.assert_allclose(peaks, due["peak_storey_drift"].values[stands], rtol=1e-6)
    single = wd.simulate(scenes[1], dtype="float32", **settings)
    assert (single["status"].values[stands] == 0).all()
    # Measured difference of float32 and float64: 1.4e-6.
    np.testing.assert_allclose(single["peak_spring_deformation"].values[stands], peaks, rtol=1e-5)


def test_a_stiff_link_needs_no_short_step():
    """With a link whose stable step of rk4 is 0.9 ms, a step of 5 ms gives the response of the rigid link."""
    masses = {"a": 2e5, "b": 1e3}
    springs = [
        wd.Spring("frame", {"a": 1.0}, law="bilinear", stiffness=2e7, yield_force=4e5, hardening_ratio=0.05),
        wd.Spring("link", {"b": 1.0, "a": -1.0}, stiffness=1e10),
    ]
    rigid = wd.LumpedStructure({"a": 2.01e5}, springs[:1])
    motion = pulse(4.0, 0.7, 0.3, 3.0)
    due = wd.simulate(wd.Scene(rigid, motion), step=STEP, method="newmark_average", **SETTINGS)
    run = wd.simulate(wd.Scene(wd.LumpedStructure(masses, springs), motion), step=STEP, method="hht_alpha", **SETTINGS)
    assert run["status"].item() == 0
    peak = due["peak_spring_deformation"].item()
    # Measured difference: 1.2e-4, because hht_alpha and newmark_average have different errors at a step of 5 ms.
    assert run["peak_spring_deformation"].sel(spring="frame").item() == pytest.approx(peak, rel=3e-4)


def many(dofs: int) -> wd.LumpedStructure:
    names = [f"u{n}" for n in range(dofs)]
    springs = [wd.Spring(f"k{n}", {n: 1.0}, stiffness=1e7) for n in names]
    return wd.LumpedStructure(dict.fromkeys(names, 1e5), springs)


def test_springs_and_sizes_that_are_not_supported_are_refused_by_name():
    motion = pulse(2.0, 0.5, 0.4, 1.0)
    bearing = wd.BiaxialSpring(
        "bearing",
        {"u0": 1.0},
        {"u1": 1.0},
        law="circular_yield",
        stiffness=1e7,
        yield_force=1e5,
        post_yield_stiffness=1e6,
    )
    contact = wd.Spring(
        "wall", {"u0": 1.0}, law=wd.laws.YeLiZhuContact(clearance=0.02, hertz_stiffness=1e9, restitution=0.6)
    )
    own = [wd.Spring(n, {n: 1.0}, stiffness=1e7) for n in ("u0", "u1")]
    cases = [
        (reference_model(), "do not support frames with hinges"),
        (many(17), "at most 16 degrees of freedom, not 17; these do: .*rk4"),
        (
            wd.LumpedStructure({"u0": 1e5, "u1": 1e5}, [*own, bearing]),
            "do not support biaxial springs, such as 'bearing'",
        ),
        (wd.LumpedStructure({"u0": 1e5, "u1": 1e5}, [*own, contact]), "'ye_li_zhu_contact' of spring 'wall'"),
    ]
    for structure, message in cases:
        with pytest.raises(ValueError, match=f"'newmark_average' does not support this LumpedStructure: .*{message}"):
            wd.simulate(wd.Scene(structure, motion), method="newmark_average", step=STEP)
    with pytest.raises(ValueError, match=r"method 'exact' does not support a LumpedStructure; these do: .*hht_alpha"):
        wd.simulate(wd.Scene(many(2), motion), method="exact")
    assert wd.simulate(wd.Scene(many(16), motion), method="newmark_average", step=STEP)["status"].item() == 0
