"""Messages on drift ratios of frames name the arguments of a Frame."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import portal

import warpdyn as wd


def test_drift_ratios_of_a_frame_need_rigid_floors_and_their_recorder():
    motion = wd.GroundMotion(np.sin(np.arange(200) / 10), 0.01)
    structure = portal().lumped(damping="modal", damping_ratio=0.02)
    stripes = wd.Stripes([motion], [0.1, 0.3], wd.PeakGroundAcceleration())
    run = wd.simulate(wd.Scene(structure, stripes, recorders=("spring",)), structures=1, device="cpu")
    with pytest.raises(ValueError, match=r"add the recorder 'drift', .* the Frame needs rigid floors") as caught:
        wd.fragility(run, {"slight": 0.01})
    assert "storey_height" not in str(caught.value)
    described = portal().description() | {"diaphragms": {}, "masses": {"J1_1": 7e4}}
    described["supports"] |= {"L1": "fixed"}  # no rigid floor connects the leaning column
    structure = wd.Frame(**described).lumped(damping="modal", damping_ratio=0.02)
    for more, message in (
        ({"recorders": ("drift",)}, "recorder 'drift' needs storeys: give the Frame diaphragms= with the nodes"),
        ({"collapse_drift_ratio": 0.1}, "collapse_drift_ratio needs storeys: give the Frame diaphragms="),
    ):
        with pytest.raises(ValueError, match=message):
            wd.Scene(structure, motion, **more)
    with pytest.raises(ValueError, match="a ReducedFrame in a portfolio needs storeys: give the Frame diaphragms="):
        wd.Archetype(structure, 3)
