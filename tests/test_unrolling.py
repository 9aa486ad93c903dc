"""Kernels whose loops are unrolled, as users get them, give what the rolled ones of most tests give."""

import numpy as np
import pytest
from conftest import quick_kernels

import warpdyn as wd
from warpdyn.integration.run import prepare

pytestmark = [pytest.mark.as_shipped, pytest.mark.meant_as_given("record_baseline")]
MOTION = wd.GroundMotion(4 * np.sin(np.arange(400) ** 1.2 * 0.1), 0.02)
YIELDS = {"yield_force": 3e5, "hardening_ratio": 0.05}
ROUNDINGS_OF_A_STEP = 8  # of each value: four stages, in each of which a product is fused to one neighbour or the other


@pytest.mark.parametrize(
    ("storeys", "law", "method", "dtype", "unrolled"),
    [
        (2, "peak_oriented", "rk4", "float64", 8),
        (3, "bilinear", "rk4", "float32", 8),
        (10, "bouc_wen", "rk4", "float64", 7),
        (3, "elastic", "newmark_average", "float64", 8),
    ],
)
def test_loops_change_no_result(storeys, law, method, dtype, unrolled):
    yields = {} if law == "elastic" else YIELDS
    damped = {"damping": "rayleigh", "damping_ratio": 0.05}
    building = wd.ShearBuilding(np.full(storeys, 1e5), 1e8, 3.0, law=law, **damped, **yields)
    scene = wd.Scene(building, wd.Stripes([MOTION], [0.5, 1.0], wd.PeakGroundAcceleration()))
    how = {"structures": 1, "method": method, "dtype": dtype, "device": "cpu"}

    def run():
        return prepare(scene, **how)[0].model.plan, wd.simulate(scene, **how)

    plan, shipped = run()
    with quick_kernels():
        rolled_plan, rolled = run()
    assert (plan.max_unroll, rolled_plan.max_unroll) == (unrolled, 1)
    np.testing.assert_array_equal(shipped.status, rolled.status)
    steps = MOTION.duration / float(shipped.integration_step.min())
    tolerance = ROUNDINGS_OF_A_STEP * steps * np.finfo(dtype).eps
    for name, values in shipped.items():
        if values.dtype.kind == "f" and name != "time_of_peak_drift":  # of which there may be two as large
            size = 1.0 if name == "energy_balance_error" else float(np.abs(values).max())  # a share by itself
            np.testing.assert_allclose(rolled[name], values, rtol=0, atol=tolerance * size, err_msg=name)
