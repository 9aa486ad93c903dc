"""Fish-bone frames with hinges: refused frames, and all kinds of bases and connections in the elastic range."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from frame_cases import fishbone
from hinge_cases import motion

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given(
    "no_damping", "damping_ratio", "first_period", "strongest_motion", "peak_ground_acceleration"
)
STRONG = {"law": "bilinear", "yield_force": 1e8, "hardening_ratio": 0.02}


def changed(**changes: Any) -> wd.Frame:
    """Return the fish-bone of the reference set with other entries in rows of its tables; None removes an entry."""
    arguments = fishbone().description()
    for table, rows in changes.items():
        if isinstance(rows, str):
            arguments[table] = rows
            continue
        for name, row in rows.items():
            entries = arguments[table].get(name, {}) | row
            arguments[table][name] = {key: value for key, value in entries.items() if value is not None}
    return wd.Frame(**arguments)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"geometric_stiffness": "consistent"}, "geometric_stiffness='string'"),
        ({"supports": {"J3": {"uy": 1e9}}}, "node 'J3' .joint. must have the support 'roller'"),
        ({"members": {"B2": {"offset_start_x": 0.3}}}, "member 'B2' has rigid offsets"),
        ({"members": {"C2": {"spring_start": 0.0}}}, "member 'C2' has a release"),
        ({"members": {"B4": {"spring_end": 1e8}}}, "half-beam 'B4' has a spring at mid-span"),
    ],
)
def test_frames_that_are_not_fishbones_are_named(changes, message):
    frame = changed(**changes)
    with pytest.raises(ValueError, match=message):
        wd.HingedFishbone(frame, {("B1", "start"): STRONG})


COLUMNS = [f"C{storey}" for storey in range(1, 11)]
BEAMS = [f"B{storey}" for storey in range(1, 11)]
RIGID = {"spring_start": None, "spring_end": None}
RIGID_COLUMNS = dict.fromkeys(COLUMNS, RIGID)
ELASTIC_FRAMES = {
    "hinged columns, pinned base": {"supports": {"J0": {"rz": None}}},
    "hinged columns, elastic base": {"supports": {"J0": {"rz": 5e8}}},
    "some rigid ends": {
        "members": {"C1": RIGID, "C4": {"spring_end": None}, "B5": RIGID, "C7": {"spring_start": None}}
    },
    "hinged beams, fixed base": {"members": RIGID_COLUMNS},
    "hinged beams, pinned base": {"members": RIGID_COLUMNS, "supports": {"J0": {"rz": None}}},
    "hinged beams, elastic base": {"members": RIGID_COLUMNS, "supports": {"J0": {"rz": 5e8}}},
    "hinged beams, base hinge": {"members": RIGID_COLUMNS | {"C1": {"spring_end": None, "spring_start": 1e9}}},
    "some hinged beams": {"members": RIGID_COLUMNS | dict.fromkeys(BEAMS[1::2], RIGID)},
    "base hinge only": {
        "members": RIGID_COLUMNS | dict.fromkeys(BEAMS, RIGID) | {"C1": {"spring_end": None, "spring_start": 1e9}}
    },
}


LAWS = ("all hinges", "one hinge", "linear")
CASES = [
    pytest.param(name, law, id=f"{name}, {law}", marks=() if law == LAWS[place % 3] else pytest.mark.thorough)
    for place, name in enumerate(ELASTIC_FRAMES)
    for law in LAWS
]


@pytest.mark.parametrize(("name", "law"), CASES)
def test_elastic_drifts_equal_those_of_the_frame(name, law):
    frame = changed(**ELASTIC_FRAMES[name])
    ends = [
        (member, end)
        for member in COLUMNS + BEAMS
        for end in ("start", "end")
        if f"spring_{end}" in frame.description()["members"][member]
    ]
    hinge = {"law": "elastic"} if law == "linear" else STRONG
    structure = wd.HingedFishbone(frame, dict.fromkeys(ends if law == "all hinges" else ends[-1:], hinge))
    motions = wd.Cloud([motion("pulse_1", 1.0)])
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.01, "dtype": "float64"}
    found, due = (
        wd.simulate(wd.Scene(each, motions, recorders=("spring",)), **settings)
        for each in (structure, frame.lumped(p_delta=True))
    )
    assert found["status"].values.tolist() == [0]
    both = [each["peak_spring_deformation"].values[:, :10] for each in (found, due)]
    np.testing.assert_allclose(*both, rtol=1e-9)
