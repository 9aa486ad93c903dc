"""Kernels whose loops are unrolled, as users get them, give what the rolled ones of most tests give."""

import numpy as np
import pytest
import warp as wp
from conftest import quick_kernels
from law_rows import rules_of

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.engine.device import processor
from warpdyn.engine.device.processor import has_wide_registers
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.plan import Plan

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
        pytest.param(10, "bilinear", "rk4", "float32", 12 if has_wide_registers() else 7, marks=pytest.mark.thorough),
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


@pytest.mark.parametrize("is_wide", [True, False])
def test_rows_suit_the_registers(monkeypatch, is_wide):
    monkeypatch.setattr(build, "has_wide_registers", lambda: is_wide)

    def rows_of(storeys, law, dtype):
        plan = Plan("chain", storeys, rules_of(law), "storey", "base_acceleration", ("drift",), "rk4", dtype)
        fitted = build.fitted(plan, is_gpu=False)
        return fitted.lanes, fitted.max_unroll

    for law in ("elastic", "bilinear", "bouc_wen_1_elastic_unloading"):
        assert rows_of(8, law, "float32") == (16, 8)
        found = [rows_of(storeys, law, "float32") for storeys in (9, 12, 13, 60)]
        assert found == ([(16, 12), (16, 12), (16, 7), (16, 7)] if is_wide else [(8, 7)] * 4)
        assert [rows_of(storeys, law, "float64") for storeys in (9, 12, 13, 60)] == [(8, 7)] * 4
    assert [rows_of(storeys, "takeda", "float32") for storeys in (5, 9, 20)] == [(16, 8), (16, 5), (16, 5)]


@pytest.mark.parametrize(
    ("found", "is_wide"),
    [
        ({"baseline": ["X86_V2"], "found": ["X86_V3", "X86_V4"]}, True),  # NumPy 2.4
        ({"baseline": ["SSE", "SSE2"], "found": ["AVX2", "AVX512F"], "not found": ["AVX512_SPR"]}, True),
        ({"baseline": ["X86_V4"]}, True),  # built for its machine: nothing is left to be found
        ({"baseline": ["X86_V2"], "found": ["X86_V3"], "not found": ["X86_V4", "AVX512_ICL"]}, False),
        ({"baseline": ["NEON", "ASIMD"]}, False),
        (None, False),
    ],
)
def test_registers_are_read_from_what_numpy_knows(monkeypatch, found, is_wide):
    known = {} if found is None else {"SIMD Extensions": found}
    monkeypatch.setattr(np, "show_config", lambda mode: known)
    monkeypatch.setattr(processor, "_has_512_bits", processor._has_512_bits.__wrapped__)
    for flags, is_native in ((None, True), ("-march=native -O2", True), ("", False), ("-mavx2", False)):
        monkeypatch.setattr(wp.config, "cpu_compiler_flags", flags)
        assert processor.has_wide_registers() == (is_wide and is_native), flags
