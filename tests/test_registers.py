"""The chain's kernels as a GPU runs them hold a whole history in registers: none of it goes to local memory."""

import sys
from dataclasses import replace

import pytest
import warp as wp
from conftest import ROOT
from law_rows import rules_of

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of, plan_of
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.engine.kernels.plan import Plan

sys.path.insert(0, str(ROOT / "studies"))
from parts.cubin import usage

pytestmark = pytest.mark.as_shipped  # registers are what the optimiser leaves
DRIFT, EVERY = ("drift",), tuple(sorted(RECORDERS["chain"]))
CASES = [
    pytest.param(10, "float32", "bouc_wen_1_elastic_unloading", "rayleigh", EVERY, marks=pytest.mark.thorough),
    pytest.param(20, "float32", "elastic", "storey", DRIFT, marks=pytest.mark.thorough),
    (20, "float32", "bilinear", "rayleigh", EVERY),
    pytest.param(20, "float32", "bouc_wen_1", "rayleigh", DRIFT, marks=pytest.mark.thorough),
    pytest.param(20, "float32", "bouc_wen_1", "rayleigh", EVERY, marks=pytest.mark.thorough),
    pytest.param(60, "float32", "bouc_wen_1", "rayleigh", EVERY, marks=pytest.mark.thorough),
    pytest.param(14, "float32", "bilinear", "rayleigh", DRIFT, marks=pytest.mark.thorough),
    (5, "float64", "bouc_wen_1_elastic_unloading", "storey", DRIFT),
    (10, "float64", "elastic", "rayleigh", DRIFT),
    pytest.param(8, "float64", "bouc_wen_1", "rayleigh", EVERY, marks=pytest.mark.thorough),
    pytest.param(20, "float64", "bouc_wen_1", "rayleigh", EVERY, marks=pytest.mark.thorough),
]


@pytest.mark.parametrize(("storeys", "dtype", "law", "damping", "recorders"), CASES)
def test_a_history_stays_in_registers(storeys, dtype, law, damping, recorders, tmp_path):
    plan = build.fitted(
        Plan("chain", storeys, rules_of(law), damping, "base_acceleration", recorders, "rk4", dtype), is_gpu=True
    )
    wp.compile_aot_module(build.build_kernel(plan).module, arch=90, module_dir=tmp_path, use_ptx=False)
    [binary] = tmp_path.glob("*.sm90.cubin")
    taken = usage(binary)
    assert taken.local == 0, (plan, taken)
    assert 16 < taken.registers <= 255  # what a thread can have


def test_a_small_lumped_structure_stays_in_registers(tmp_path):
    # Four storeys with torsion: 12 degrees of freedom, 16 springs.
    masses, springs = {}, []
    for floor in range(1, 5):
        masses |= {f"x{floor}": 2e5, f"y{floor}": 2e5, f"theta{floor}": 9e6}
        for axis, arm in (("x", -5.0), ("x", 5.0), ("y", -9.0), ("y", 9.0)):
            direction = {f"{axis}{floor}": 1.0, f"theta{floor}": arm}
            direction |= {f"{axis}{floor - 1}": -1.0, f"theta{floor - 1}": -arm} if floor > 1 else {}
            law = wd.laws.Bilinear(yield_force=1e6, hardening_ratio=0.05)
            springs.append(wd.Spring(f"{floor}{axis}{arm}", direction, law=law, stiffness=1e8))
    influence = {f"x{floor}": 1.0 for floor in range(1, 5)}
    building = wd.LumpedStructure(masses, springs, influence=influence, damping="rayleigh", damping_ratio=0.05)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="spring")}
    scene = wd.Scene(building, wd.GroundMotion([0.0, 1.0], 0.01), scatter, recorders=("spring",))
    plan = plan_of(scene, dynamics_of(scene), "rk4", "float32", is_gpu=True)
    wp.compile_aot_module(build.build_kernel(plan).module, arch=90, module_dir=tmp_path, use_ptx=False)
    [binary] = tmp_path.glob("*.sm90.cubin")
    assert usage(binary).local == 0, usage(binary)


def test_local_memory_is_seen(tmp_path):
    # A row that is read where an index says stands in memory: the reading above can fail.
    row_type = wp.types.vector(length=256, dtype=float)

    @wp.kernel(module="unique", enable_backward=False)
    def look_up(index: wp.array(dtype=int), found: wp.array(dtype=float)):
        row = row_type()
        for i in range(256):
            row[(i * index[0]) % 256] = float(i)
        found[wp.tid()] = row[index[wp.tid()]]

    wp.compile_aot_module(look_up.module, arch=90, module_dir=tmp_path, use_ptx=False)
    [binary] = tmp_path.glob("*.sm90.cubin")
    assert usage(binary).local > 400


def test_one_that_goes_on_from_an_event_before_stays_there_too(tmp_path):
    plan = Plan(
        "chain",
        20,
        rules_of("bouc_wen_1_elastic_unloading"),
        "rayleigh",
        "base_acceleration",
        (*EVERY, "state"),
        "rk4",
        "float32",
    )
    plan = build.fitted(replace(plan, resumes=True), is_gpu=True)
    assert plan.sections > 1
    wp.compile_aot_module(build.build_kernel(plan).module, arch=90, module_dir=tmp_path, use_ptx=False)
    [binary] = tmp_path.glob("*.sm90.cubin")
    assert usage(binary).local == 0
