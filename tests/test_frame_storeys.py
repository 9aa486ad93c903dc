"""Frames whose joints are a grid: the kernel that loops over storeys gives what the kernel of any frame gives."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from frame_cases import fishbone
from hinge_cases import reference_model

import warpdyn as wd
from warpdyn.campaigns.integration import model
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.campaigns.integration.settings import is_grid
from warpdyn.campaigns.live.accepted_scenes import check_method
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.hinges.frame_storeys import frame_storeys
from warpdyn.engine.kernels.lumped.division import can_share_frame

HEIGHT, SPAN = 3.5, 6.0  # m
MASS = 1.2e5  # kg, of a floor
GPUS = [f"cuda:{number}" for number in range(min(1, wp.get_cuda_device_count()))]


def grid_frame(storeys=2, bays=1, *, base="fixed", hinged_beams=True, law=None, brackets=None, slab_load=0.0):
    """Return a frame with hinges, bilinear by default; every other member starts at its upper or right end.

    With the lengths of two brackets [m], a slab over the roof with a load [N/m] lies on brackets of the outer columns,
    so that moments act on their joints.
    """
    nodes, members, supports, floors, masses, hinges = {}, {}, {}, {}, {}, {}
    for line in reversed(range(bays + 1)):
        for level in range(storeys + 1):
            nodes[f"J{level}{line}"] = (SPAN * line, HEIGHT * level)
            supports[f"J{level}{line}"] = "roller" if level else base
    for level in range(1, storeys + 1):
        floors[f"F{level}"] = [f"J{level}{line}" for line in range(bays + 1)]
        masses[f"F{level}"] = MASS
    sections = {
        "column": {"elastic_modulus": 2e11, "area": 0.02, "second_moment": 8e-4},
        "beam": {"elastic_modulus": 2e11, "area": 0.02, "second_moment": 4e-4},
    }

    def member(name, start, end, kind, moment, is_turned):
        ends = (end, start) if is_turned else (start, end)
        members[name] = {"start": ends[0], "end": ends[1], "section": kind}
        if kind == "beam":
            members[name]["gravity_load"] = 1.5e4  # N/m
        if kind == "beam" and not hinged_beams:
            return
        members[name] |= {"spring_start": 2.7e8, "spring_end": 2.1e8}
        for side in ("start", "end"):
            hinges[name, side] = {"law": "bilinear", "yield_force": moment, "hardening_ratio": 0.01}
            if law is not None:
                hinges[name, side] = law | {"yield_force": moment}

    for level in range(1, storeys + 1):
        for line in range(bays + 1):
            member(f"C{level}{line}", f"J{level - 1}{line}", f"J{level}{line}", "column", 6e5, line % 2 == 1)
        for line in range(bays):
            member(f"B{level}{line}", f"J{level}{line}", f"J{level}{line + 1}", "beam", 4e5, level % 2 == 0)
    if brackets is not None:
        members["slab"] = {"start": f"J{storeys}0", "end": f"J{storeys}{bays}", "section": "beam", "kind": "truss"}
        members["slab"] |= {"offset_start_x": brackets[0], "offset_end_x": -brackets[1], "gravity_load": slab_load}
    frame = wd.Frame(nodes, members, sections, supports=supports, diaphragms=floors, masses=masses)
    return hinged(frame, hinges)


def hinged(frame, hinges):
    return wd.HingedFrame(frame, hinges, p_delta=False, damping_matrix=0.2 * np.diag([MASS] * len(frame.diaphragms)))


def fish_bone(storeys, law, **more):
    """Return a fish-bone with hinges at all ends of columns and at half-beams, and P-Delta."""
    hinges = {}
    for level in range(1, storeys + 1):
        hinges[f"C{level}", "start"] = hinges[f"C{level}", "end"] = law | {"yield_force": 2e6}
        hinges[f"B{level}", "start"] = law | {"yield_force": 1.2e6}
    return wd.HingedFishbone(fishbone(storeys), hinges, **more)


@pytest.fixture(scope="module")
def scene():
    """Return a scene with random frames whose hinges yield."""
    random = np.random.default_rng(2)
    wave = np.convolve(random.normal(size=240), np.ones(8) / 3, "same")
    motions = [wd.GroundMotion(scale * wave, 0.01, f"noise x {scale}") for scale in (0.5, 3.0)]
    scatter = {
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring"),
        "second_moment": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="member"),
    }
    return wd.Scene(grid_frame(), wd.Cloud(motions), scatter, recorders=("output", "spring", "acceleration"), tail=0.0)


def run_both(scene, monkeypatch, **settings):
    """Return the results of the kernel of any frame, and those of the kernel of grids."""
    found = wd.simulate(scene, device="cpu", **settings)
    fitted, shared = build.fitted, []

    def of_any_frame(plan, is_gpu):
        shared.append(can_share_frame(plan))
        return replace(fitted(plan, is_gpu), by_storey=False)

    monkeypatch.setattr(model, "fitted", of_any_frame)
    expected = wd.simulate(scene, device="cpu", **settings)
    assert all(shared)
    return expected, found


PEAKS = ("peak_output", "peak_spring_deformation", "peak_spring_force", "peak_acceleration")


def largest_error(expected, found, name):
    largest = np.abs(expected[name]).max(dim="sample")
    return float((np.abs(found[name] - expected[name]) / largest).max())


def test_kernel_of_grids_equals_the_kernel_of_any_frame(scene, monkeypatch):
    settings = {"structures": 4, "seed": 3, "method": "leapfrog", "step": 0.005, "dtype": "float64"}
    expected, found = run_both(scene, monkeypatch, **settings)
    yield_moment = found["yield_force"].sel(spring="C10 start").values
    assert (found["peak_spring_force"].sel(spring="C10 start").values > yield_moment).any()
    np.testing.assert_array_equal(found["status"], 0)
    for name in PEAKS:
        # Moments balance to 1e-9 of the largest one in each step; yielding hinges multiply such differences a little.
        assert largest_error(expected, found, name) < 1e-6, name


IMK = {
    "law": "ibarra_medina_krawinkler_bilinear",
    "plastic_drift_to_capping": 0.015,
    "post_capping_drift": 0.1,
    "ultimate_drift": 0.2,
    "capping_force_ratio": 1.08,
    "residual_force_ratio": 0.3,
}
CAPACITIES = ("strength_deterioration_drift", "post_capping_deterioration_drift", "unloading_deterioration_drift")


@pytest.mark.parametrize(
    "law",
    [IMK | dict.fromkeys(CAPACITIES, 1.0), pytest.param(IMK, marks=pytest.mark.thorough)],
    ids=["deteriorating", "capped"],
)
def test_both_kernels_agree_with_capped_hinges(law, monkeypatch):
    random = np.random.default_rng(4)
    wave = np.convolve(random.normal(size=300), np.ones(8) / 3, "same")
    motions = [wd.GroundMotion(scale * wave, 0.01, f"noise x {scale}") for scale in (1.0, 4.0)]
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring")}
    frame = grid_frame(law=law, brackets=(0.5, 0.2), slab_load=5e3)
    scene = wd.Scene(frame, wd.Cloud(motions), scatter, recorders=("output", "spring", "acceleration"), tail=0.0)
    settings = {"structures": 4, "seed": 3, "method": "leapfrog", "step": 0.0025, "dtype": "float64"}
    expected, found = run_both(scene, monkeypatch, **settings)
    np.testing.assert_array_equal(found["status"], 0)
    np.testing.assert_array_equal(expected["status"], 0)
    turned = found["peak_spring_deformation"].sel(spring="C10 start").max()
    assert turned > law["plastic_drift_to_capping"]  # hinges soften
    for name in PEAKS:
        # The kernel of grids evaluates a hinge first at the corner that it passes, so that energies differ (2e-6).
        assert largest_error(expected, found, name) < 2e-5, name
    # The bits of a sample do not depend on the other samples of a thread, also if some of them collapse.
    stronger = [wd.GroundMotion(scale * wave, 0.01, f"noise x {scale}") for scale in (4.0, 7.4)]
    both, one = (replace(scene, excitation=wd.Cloud(motions)) for motions in (stronger, stronger[:1]))
    monkeypatch.undo()
    of_both, of_one = (wd.simulate(each, device="cpu", **settings) for each in (both, one))
    assert (of_both["status"].values[1::2] != 0).any()
    for name in PEAKS:
        np.testing.assert_array_equal(of_both[name].values[::2], of_one[name].values)


LOST, CAPPED = 0.03, IMK["capping_force_ratio"]  # rad: rotation at which a hinge loses its strength
BRACKETS = {
    "left": ((2.0, 0.1), ("B20", "end"), ("C20", "end")),
    "right": ((0.1, 2.0), ("B20", "start"), ("C21", "start")),
}


@pytest.mark.parametrize("side", BRACKETS)
def test_a_joint_whose_hinges_cannot_carry_its_moment_has_no_equilibrium(side):
    brackets, beam, column = BRACKETS[side]
    load = 1.8e5  # N/m
    moment = load * (SPAN - sum(brackets)) / 2 * max(brackets)
    # The hinges of beam and column carry the moment of the bracket together. The column cannot do so alone: at its
    # capping point it has 1.08 times its yield moment. If the beam's hinge loses its strength, no rotation of the joint
    # is an equilibrium.
    assert CAPPED * 6e5 < moment < 4e5 + 6e5
    law = IMK | dict.fromkeys(CAPACITIES, 1.0)
    whole = grid_frame(law=law, brackets=brackets, slab_load=load)
    description = whole.frame.description()
    # Only the hinge of the column can resist then. It is also the stiffer one, so that it is the farthest from its line
    # in each solution that turns the joint.
    description["members"][column[0]][f"spring_{column[1]}"] = 2.1e9

    def run(lost_at, scales):
        hinges = {place: dict(row) for place, row in whole.hinges.items()}
        hinges[beam]["ultimate_drift"] = lost_at
        frame = hinged(wd.Frame(**description), hinges)
        pulse = np.sin(np.pi * np.arange(60) / 40) * (1 if side == "right" else -1)
        motions = wd.Cloud([wd.GroundMotion(scale * pulse, 0.01, f"pulse x {scale}") for scale in scales])
        scene = wd.Scene(frame, motions, recorders=("output", "spring", "acceleration"), tail=0.0)
        integration = {"method": "leapfrog", "step": 0.0025, "dtype": "float64"}
        return wd.simulate(scene, device="cpu", integration=wd.Integration(**integration))

    scales = (2.0, 3.0, 3.5, 8.0)
    sound, found = run(IMK["ultimate_drift"], scales), run(LOST, scales)
    np.testing.assert_array_equal(sound["status"], 0)
    loses = sound["peak_spring_deformation"].sel(spring=" ".join(beam)).values > LOST
    assert loses.tolist() == [False, False, True, True]
    np.testing.assert_array_equal(found["status"], np.where(loses, 4, 0))
    assert found["status"].attrs["flag_meanings"].split()[4] == "not_converged"
    hinge = found["spring"].values.tolist().index(" ".join(column))
    np.testing.assert_array_equal(found["spring_without_equilibrium"], np.where(loses, hinge, -1))
    # They were run again twice, each time with twice as many steps.
    np.testing.assert_allclose(found["integration_step"], np.where(loses, 0.0025 / 4, 0.0025), rtol=1e-6)
    # The samples beside them, in the same thread, keep their bits.
    alone = run(LOST, scales[:2])
    for name in PEAKS:
        assert np.isnan(found[name].values[loses]).all(), name
        np.testing.assert_array_equal(found[name].values[~loses], alone[name].values)


@pytest.mark.parametrize("device", GPUS)
# Threads without a storey: 0, 2, 2, 0, 2 of each warp.
@pytest.mark.parametrize(("storeys", "has_bays"), [(2, True), (3, True), (5, True), (4, False), (5, False)])
def test_threads_of_a_gpu_give_the_results_of_a_cpu(storeys, has_bays, device):
    damping = 0.3 * MASS * np.eye(storeys) + 2e4 * (storeys * np.eye(storeys) - 1)  # couples all floors
    settings = {"damping_matrix": damping, "drift_capacity": 0.1}
    if has_bays:
        base = grid_frame(storeys, 2, law=IMK, brackets=(0.5, 0.4), slab_load=3e4)
        frame = wd.HingedFrame(base.frame, base.hinges, **settings)
    else:
        frame = fish_bone(storeys, IMK | dict.fromkeys(CAPACITIES, 1.0), **settings)
    time = 0.01 * np.arange(200)
    shape = np.linspace(0.4, 1.0, storeys)
    push = wd.ForceHistory(3e5 * np.outer(np.sin(5 * time), shape), 0.01, initial_velocity=0.3)
    pulses = [wd.GroundMotion(scale * np.sin(4 * time), 0.01, f"sine x {scale}") for scale in (1.0, 4.0, 12.0)]
    recorders = ("output", "spring", "acceleration", "displacement")
    for excitation in (push, wd.Cloud(pulses)):
        scene = wd.Scene(frame, excitation, recorders=recorders, tail=0.2)
        settings = {"method": "leapfrog", "step": 0.0025, "dtype": "float64"}
        expected, found = (wd.simulate(scene, device=each, **settings) for each in ("cpu", device))
        for name in ("status", "spring_of_collapse", "storey_of_collapse"):
            np.testing.assert_array_equal(found[name], expected[name], err_msg=name)
        np.testing.assert_allclose(found["time_of_collapse"], expected["time_of_collapse"], rtol=1e-7)
        # The largest error of a moment is 1e-9 of the largest moment, in each step.
        assert max(largest_error(expected, found, name) for name in (*PEAKS, "peak_displacement")) < 1e-6
    assert 1 in expected["status"].values  # collapsed


@pytest.mark.fast
@pytest.mark.parametrize("threads", [1, 3])
def test_threads_divide_all_members_hinges_and_values(threads):
    line = grid_frame(3, 2).column_line
    storeys = frame_storeys(line)
    assert (storeys.count, storeys.lines) == (3, 3)
    of_threads = [storeys.springs_of(thread, threads) for thread in range(threads)]
    own = 3 // threads
    assert [spring for springs in of_threads for spring in springs[:own]] == [0, 1, 2]
    assert sorted(spring for springs in of_threads for spring in springs[own:]) == sorted(line.springs)
    terms = [place for thread in range(threads) for place in storeys.terms_of(thread, threads)]
    assert set(terms) - {-1} == set(range(line.values))
    assert len(terms) == threads * storeys.of_thread(threads).values


@pytest.mark.fast
@pytest.mark.parametrize("threads", [1, 10])
def test_a_fishbone_has_all_members_hinges_and_values_of_its_column_line(threads):
    line = reference_model().column_line
    storeys = frame_storeys(line)
    assert (storeys.count, storeys.lines, storeys.half_beams) == (10, 1, 10)
    own = 10 // threads
    of_threads = [storeys.springs_of(thread, threads) for thread in range(threads)]
    assert [spring for springs in of_threads for spring in springs[:own]] == list(range(10))
    assert sorted(spring for springs in of_threads for spring in springs[own:]) == list(range(10, 40))
    places = [storeys.terms_of(thread, threads) for thread in range(threads)]
    base = 4 * 10  # the stiffness of the base, which cannot rotate
    assert {place for terms in places for place in terms} - {-1} == set(range(line.values)) - {base}
    layout = storeys.of_thread(threads)
    assert {len(terms) for terms in places} == {layout.values}
    # A thread has the values and hinges of its own storeys: four values and three hinges for each storey.
    first = layout.first("stiffness")
    for thread, (springs, terms) in enumerate(zip(of_threads, places, strict=True)):
        storeys_of_thread = {(spring - 10) // 3 for spring in springs[own:]}
        assert storeys_of_thread == set(range(thread * own, (thread + 1) * own))
        assert {place // 4 for place in terms[:first] if place >= 0} == storeys_of_thread
        assert [place - 41 for place in terms[first:]] == [spring - 10 for spring in springs[own:]]
    assert frame_storeys(replace(line, is_fixed=False)) is None
    assert frame_storeys(replace(line, linear=(10,))) is None
    assert frame_storeys(replace(line, springs=(-1, *line.springs[1:]))) is None


@pytest.mark.fast
def test_frames_without_a_grid_of_hinged_members_have_no_storeys():
    assert frame_storeys(grid_frame(2, 1, base="pinned").column_line) is None
    assert frame_storeys(grid_frame(2, 1, hinged_beams=False).column_line) is None


@pytest.mark.fast
def test_frames_with_random_and_with_given_masses_have_one_kernel():
    motions = wd.Cloud([wd.GroundMotion(np.sin(np.arange(50.0)), 0.01, "sine")])
    random = {"mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="dof")}
    given, drawn = (dynamics_of(wd.Scene(grid_frame(3), motions, scatter)) for scatter in ({}, random))
    # All floors have the same nominal mass.
    assert given.pattern == drawn.pattern


@pytest.mark.fast
def test_the_default_method_of_grids_needs_the_kernel_of_grids():
    motion = wd.GroundMotion(np.sin(np.arange(50.0)), 0.01, "sine")

    def is_grid_with(frame, recorders=("drift",)):
        return is_grid(wd.Scene(frame, wd.Cloud([motion]), recorders=recorders))

    assert is_grid_with(grid_frame())
    assert is_grid_with(reference_model())
    assert not is_grid_with(grid_frame(), recorders=("residual",))
    assert not is_grid_with(grid_frame(hinged_beams=False))
    scene = wd.Scene(grid_frame(), wd.Cloud([motion]), recorders=("drift",))
    assert wd.Integration().settled(dynamics_of(scene).forces, scene, is_gpu=False).method == "leapfrog"
    with pytest.raises(ValueError, match="kernel of such frames cannot pause"):
        check_method("leapfrog", scene)
