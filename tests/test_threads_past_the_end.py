"""Threads that a GPU starts past the last sample, to fill its thread blocks, add nothing to sums in memory."""

import numpy as np
import pytest
import warp as wp

import warpdyn as wd
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.queues import CpuQueue, load_kernel

pytestmark = [pytest.mark.usefixtures("unoptimised"), pytest.mark.meant_as_given("yield_drift_ratio")]


@pytest.mark.parametrize("method", ["rk4", "exact"])
def test_they_leave_the_mean_of_residual_drifts_alone(method, monkeypatch):
    # A GPU sums this mean in memory. Threads past the end repeat the last sample at the same time as its own thread, so
    # that its mean was up to four times too large. One sample per thread on the CPU is the same loop.
    monkeypatch.setattr(build, "CPU_LANES", 1)
    monkeypatch.setattr(build, "CPU_LANES_OF_ONE_STOREY", 1)
    left_by_others = []
    launch_all = CpuQueue.launch

    def launch(queue, launches, arguments, *rest, **named):
        launch_all(queue, launches, arguments, *rest, **named)
        [output] = [each for each in arguments if hasattr(each, "residual_drift_ratio")]
        found = output.residual_drift_ratio.numpy().copy()
        output.residual_drift_ratio.fill_(np.nan)
        for each in launches:
            inputs = [each.order.size, *each.inputs, *arguments]
            wp.launch(load_kernel(each.plan, "cpu"), dim=3, inputs=inputs, device="cpu")
        left_by_others.append(output.residual_drift_ratio.numpy().copy())
        output.residual_drift_ratio.assign(found)

    monkeypatch.setattr(CpuQueue, "launch", launch)
    law = "elastic" if method == "exact" else "bilinear"
    strength = {"yield_force": 3e4, "hardening_ratio": 0.05} if law == "bilinear" else {}
    building = wd.ShearBuilding([1e4, 1e4], 2e6, 3.0, law=law, damping="rayleigh", damping_ratio=0.05, **strength)
    motion = wd.GroundMotion(4.0 * np.sin(8.0 * np.arange(0.0, 2.0, 0.01)), 0.01, "sine")
    scene = wd.Scene(building, wd.Cloud([motion]), recorders=("drift", "residual"), tail=2.0)
    run = wd.simulate(scene, method=method, device="cpu")
    assert np.all(np.isfinite(run["residual_drift_ratio"]))
    assert len(left_by_others) > 0
    assert all(np.isnan(each).all() for each in left_by_others)
