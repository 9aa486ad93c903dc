"""Fish-bones and equivalent sticks of frames: closed equality, reference frequencies, and refused frames."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import braced, four_storey, portal, two_storey
from test_frame_reduction import uniform_frame

import warpdyn as wd

pytestmark = pytest.mark.fast


def test_the_fishbone_of_a_frame_with_half_outer_columns_is_exact():
    frame = uniform_frame(0.5)
    bone = wd.fishbone(frame)
    due = frame.lumped().matrices["stiffness_matrix"]
    np.testing.assert_allclose(bone.lumped().matrices["stiffness_matrix"], due, rtol=1e-6)
    np.testing.assert_allclose(1 / bone.modal()["period"].values, [1.119512, 3.213836, 5.724369], rtol=5e-7)


def test_the_fishbone_of_equal_columns_has_the_reference_frequencies():
    bone = wd.fishbone(uniform_frame(1.0))
    np.testing.assert_allclose(1 / bone.modal()["period"].values, [1.206298, 3.558393, 6.526991], rtol=5e-7)


def constrained(frame: wd.Frame) -> np.ndarray:
    """Return the floor stiffness of a frame whose joints of a floor rotate equally and do not move vertically."""
    numbering = frame.numbering
    stiffness = frame.stiffness(frame.nominal).toarray()
    levels = sorted({row["y"] for row in frame.nodes.values()})[1:]
    shapes = np.zeros((len(numbering.names), 2 * len(levels)))
    for place, (name, row) in enumerate(frame.nodes.items()):
        if row["y"] in levels and not name.startswith("L"):
            level = levels.index(row["y"])
            shapes[numbering.places[place, 0], level] = 1.0
            shapes[numbering.places[place, 2], len(levels) + level] = 1.0
    whole = shapes.T @ stiffness @ shapes
    n = len(levels)
    return whole[:n, :n] - whole[:n, n:] @ np.linalg.solve(whole[n:, n:], whole[n:, :n])


@pytest.mark.parametrize("make", [portal, two_storey, four_storey])
def test_a_fishbone_is_the_frame_with_equal_rotations(make):
    # The springs of the columns are proportional to their stiffness, so that both add up exactly.
    frame = make()
    bone = wd.fishbone(frame)
    found = bone.lumped().matrices["stiffness_matrix"]
    due = constrained(frame)
    np.testing.assert_allclose(found, due, rtol=1e-6, atol=1e-7 * due.max())
    assert (bone.modal()["period"][0] < frame.modal()["period"][0]).item()
    weights = frame.lumped(p_delta=True).matrices["geometric_stiffness"]
    np.testing.assert_allclose(bone.lumped(p_delta=True).matrices["geometric_stiffness"], weights, rtol=1e-9)


def test_a_shear_stick_has_the_first_period_and_mode():
    frame = four_storey()
    stick = wd.equivalent_stick(frame)
    assert isinstance(stick, wd.ShearBuilding)
    modes, due = stick.modal(), frame.modal()
    assert modes["period"][0].item() == pytest.approx(1.3364741, rel=1e-7)
    np.testing.assert_allclose(modes["shape"][0], due["shape"][0], rtol=1e-9)
    np.testing.assert_allclose(stick.parameters["height"], [4.3, 4.0, 4.0, 4.0])
    assert abs(modes["period"][1] / due["period"][1] - 1) > 0.01


def test_a_flexural_shear_stick_has_the_first_two_periods():
    stick = wd.equivalent_stick(four_storey(), "flexural_shear", damping="modal", damping_ratio=0.02)
    np.testing.assert_allclose(stick.modal()["period"][:2], [1.3364741, 0.44382542], rtol=1e-7)


def test_the_error_of_simplified_models_is_in_the_history():
    frame = four_storey()
    time = 0.01 * np.arange(1001)
    motion = wd.GroundMotion(1.5 * np.sin(np.pi * time) * np.exp(-0.35 * time), 0.01)
    damped = {"damping": "modal", "damping_ratio": 0.02}
    options = {"dtype": "float64", "device": "cpu", "method": "rk4", "step": 0.005}
    heights = np.array([4.3, 4.0, 4.0, 4.0])
    drifts = {}
    for name, structure in (("frame", frame.lumped(**damped)), ("bone", wd.fishbone(frame).lumped(**damped))):
        drifts[name] = (
            wd.simulate(wd.Scene(structure, motion), **options)["peak_spring_deformation"].values[0] / heights
        )
    stick = wd.simulate(wd.Scene(wd.equivalent_stick(frame, **damped), motion), **options)
    drifts["stick"] = stick["peak_storey_drift_ratio"].values[0]
    for name, bound in (("bone", 0.12), ("stick", 0.12)):
        difference = np.abs(drifts[name] / drifts["frame"] - 1).max()
        assert 1e-4 < difference < bound, (name, difference)


def changed_columns(storey: int, lines: tuple[int, ...], **columns) -> wd.Frame:
    """Return the frame with the exact fish-bone, with other columns (of the table of members) in a storey."""
    base = uniform_frame(0.5).description()
    for line in lines:
        base["members"][f"C{storey}{line}"] = base["members"][f"C{storey}{line}"] | columns
    return wd.Frame(**base)


@pytest.mark.parametrize("columns", [{"release": "end"}, {"spring_start": 0.0}, {"release": "start"}])
def test_hinges_of_all_columns_of_a_storey_are_hinges_of_the_fishbone(columns):
    frame = changed_columns(1, (0, 1, 2, 3), **columns)
    found = wd.fishbone(frame).lumped().matrices["stiffness_matrix"]
    due = frame.lumped().matrices["stiffness_matrix"]
    np.testing.assert_allclose(found, due, rtol=1e-6, atol=1e-9 * due.max())


def test_columns_with_hinges_at_both_ends_are_leaning_columns():
    base = uniform_frame(0.5).description()
    nodes = base["nodes"] | {f"{level}P": {"x": 24.0, "y": 3.5 * level, "gravity_load": 2e5} for level in range(4)}
    diaphragms = {name: [*row, f"{name[-1]}P"] for name, row in base["diaphragms"].items()}
    due = wd.fishbone(uniform_frame(0.5)).lumped().matrices["stiffness_matrix"]
    for release in ("both", "end"):  # at the pinned base, a hinge at the upper end is enough
        members = base["members"] | {
            f"P{level}": {"start": f"{level}P", "end": f"{level + 1}P", "section": "in0"}
            | {"release": "both" if level else release}
            for level in range(3)
        }
        supports = base["supports"] | {"0P": "pinned"}
        more = {"nodes": nodes, "members": members, "supports": supports, "diaphragms": diaphragms}
        frame = wd.Frame(**(base | more))
        bone = wd.fishbone(frame)
        np.testing.assert_allclose(bone.lumped().matrices["stiffness_matrix"], due, rtol=1e-6)
        weights = wd.geometric_stiffness([2e5] * 3, [3.5] * 3)
        found = bone.lumped(p_delta=True).matrices["geometric_stiffness"]
        np.testing.assert_allclose(found, weights, rtol=1e-8)
        found, due_period = (each.modal(p_delta=True)["period"].values for each in (bone, frame))
        np.testing.assert_allclose(found, due_period, rtol=1e-6)


def test_columns_that_a_fishbone_cannot_represent_are_refused():
    ratio = 1e7 * 3.5 / (200e9 * 3e-4)
    for columns, message in (
        ({"release": "end"}, "upper ends of columns 'C00' and 'C01' are inf and 0 times E I / L"),
        ({"release": "start"}, "lower ends of columns 'C00' and 'C01' are inf and 0 times"),
        ({"spring_end": 1e7}, f"upper ends of columns 'C00' and 'C01' are inf and {ratio:g} times"),
        ({"offset_start_y": 0.3}, "column 'C01' has the rigid end offset offset_start_y = 0.3 m"),
        ({"p_delta": "no"}, "column 'C01' has p_delta='no'"),
    ):
        with pytest.raises(ValueError, match=message):
            wd.fishbone(changed_columns(0, (1,), **columns))
    base = uniform_frame(1.0).description()
    with pytest.raises(ValueError, match="geometric_stiffness='consistent' cannot be transferred"):
        wd.fishbone(wd.Frame(**(base | {"geometric_stiffness": "consistent"})))
    with pytest.raises(ValueError, match="support of node '10' on a rigid floor"):
        wd.fishbone(wd.Frame(**(base | {"supports": base["supports"] | {"10": {"ux": 1e6}}})))
    deep = base["nodes"] | {"01": {"x": 6.0, "y": -1.0}}
    with pytest.raises(ValueError, match=r"columns 'C00' and 'C01' of a storey have the lengths 3\.5 and 4\.5 m"):
        wd.fishbone(wd.Frame(**(base | {"nodes": deep})))


def test_frames_without_a_fishbone_or_stick_are_refused():
    with pytest.raises(ValueError, match="member 'D1' is neither a beam within a floor nor a column"):
        wd.fishbone(braced())
    base = uniform_frame(1.0).description()
    without = wd.Frame(**(base | {"diaphragms": {}, "masses": {"10": 1e3}}))
    with pytest.raises(ValueError, match="has no rigid floors"):
        wd.fishbone(without)
    with pytest.raises(ValueError, match=r"'10 u[xy]' has mass"):
        wd.equivalent_stick(without)
    with pytest.raises(ValueError, match="base '00' is fixed, but that of '01' is not"):
        wd.fishbone(wd.Frame(**(base | {"supports": base["supports"] | {"01": "pinned"}})))
    with pytest.raises(ValueError, match="member_mass='lumped'"):
        wd.fishbone(wd.Frame(**(base | {"member_mass": "consistent"})))
    with pytest.raises(ValueError, match="at least two storeys"):
        wd.equivalent_stick(portal(), "flexural_shear")
    with pytest.raises(ValueError, match="did you mean 'shear'"):
        wd.equivalent_stick(portal(), "sheer")
    for function in (wd.fishbone, wd.equivalent_stick):
        with pytest.raises(TypeError, match="takes a Frame"):
            function("portal")
