"""warpdyn against the hand-written programs for torsional buildings that the study of its speed uses."""

from __future__ import annotations

import importlib
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp

import warpdyn as wd

STUDIES = Path(__file__).parents[1] / "studies"


@pytest.fixture
def peer(monkeypatch):
    monkeypatch.syspath_prepend(str(STUDIES))
    yield importlib.import_module("peers.torsional_building")
    for name in [name for name in sys.modules if name.partition(".")[0] in ("peers", "parts")]:
        del sys.modules[name]


@pytest.mark.skipif(shutil.which("g++") is None, reason="g++ is not installed")
@pytest.mark.parametrize(("method", "own"), [("verlet", "leapfrog"), ("rk4", "rk4")])
def test_a_hand_written_program_finds_the_same_deformations(peer, method, own):
    ensemble = peer.Ensemble.drawn(8)
    due = peer.by_cpp(ensemble, method, "float64", lanes=8, mass_damping=0.0).peak_storey_drift
    settings = {"structures": 8, "method": own, "step": peer.STEP, "dtype": "float64", "device": "cpu"}
    run = wd.simulate(ensemble.scene("none"), **settings)
    found = run["peak_spring_deformation"].values * ensemble.scale[:, None]
    # Both programs follow the same formulas; sums of forces are rounded in another order.
    np.testing.assert_allclose(found, due, rtol=1e-7)
    yields = (ensemble.strength / ensemble.stiffness).mean()
    assert due.max() > 3 * yields  # the walls yield


@pytest.mark.skipif(shutil.which("nvcc") is None or not wp.get_cuda_device_count(), reason="no nvcc or no GPU")
@pytest.mark.parametrize(
    ("kernel", "own"),
    [("verlet by thread", "leapfrog"), ("verlet by storey", "leapfrog"), ("rk4 by storey", "rk4")],
)
def test_hand_written_cuda_finds_the_same_deformations(peer, kernel, own):
    ensemble = peer.Ensemble.drawn(64)
    due = peer.by_cuda(ensemble, kernel, mass_damping=0.0).peak_storey_drift
    settings = {"structures": 64, "method": own, "step": peer.STEP, "device": "cuda:0"}
    run = wd.simulate(ensemble.scene("none"), **settings)
    found = run["peak_spring_deformation"].values * ensemble.scale[:, None]
    assert np.abs(found / due - 1).max() < 1e-3  # float32
