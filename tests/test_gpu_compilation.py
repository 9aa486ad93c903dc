"""Kernels for GPUs compile on a computer without a GPU: Warp's own copy of NVIDIA's compiler (NVRTC) needs no driver.

The kernels of a GPU differ from those of a CPU: all loops are unrolled, and several threads share a long chain.
"""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of, plan_of
from warpdyn.engine.kernels.build import build_kernel

pytestmark = [pytest.mark.meant_as_given("no_damping", "first_period", "strongest_motion")]
COMPUTE_CAPABILITY = 90  # H100, H200


def chain(storeys: int, law: str, **parameters: float) -> wd.ShearBuilding:
    return wd.ShearBuilding([2e5] * storeys, [4e8] * storeys, [3.0] * storeys, law=law, yield_force=2e6, **parameters)


def torsional(storeys: int) -> wd.TorsionalBuilding:
    shared = {"law": "bilinear", "yield_force": 9e5, "hardening_ratio": 0.05}
    frames = [
        wd.PlanFrame("A", (0.0, 5.0), "x", [6e7] * storeys, **shared),
        wd.PlanFrame("B", (-9.0, 0.0), "y", [9e7] * storeys, **shared),
        wd.PlanFrame("C", (9.0, 0.0), "y", [9e7] * storeys, **shared),
    ]
    return wd.TorsionalBuilding(
        [1.5e5] * storeys, [[-10.0, 10.0], [-6.0, 6.0]], frames, damping="rayleigh", damping_ratio=0.05
    )


@pytest.mark.parametrize(
    ("structure", "method", "threads"),
    [
        pytest.param(lambda: chain(3, "bilinear", hardening_ratio=0.05), "stoermer", 1, id="chain"),
        pytest.param(
            lambda: chain(30, "elastic_perfectly_plastic"),
            "rk4",
            4,
            id="chain that threads share",
            marks=pytest.mark.thorough,
        ),
        pytest.param(lambda: torsional(1), "velocity_verlet", 1, id="lumped structure"),
    ],
)
def test_kernels_compile_for_a_gpu(structure, method, threads, tmp_path):
    if not wp.get_cuda_supported_archs():
        pytest.skip("this build of Warp has no compiler for GPUs")
    motion = wd.GroundMotion(np.sin(np.arange(200) * 0.1), 0.01)
    system = structure()
    scene = wd.Scene(system, wd.PairOfMotions(motion, motion) if system.components == 2 else motion)
    plan = plan_of(scene, dynamics_of(scene), method, "float32", is_gpu=True)
    wp.compile_aot_module(build_kernel(plan).module, arch=COMPUTE_CAPABILITY, module_dir=tmp_path)
    code = next(tmp_path.glob("*.cubin")).read_bytes()
    assert code.startswith(b"\x7fELF")
    assert plan.sections == threads
