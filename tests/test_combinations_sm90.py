"""Kernels of every law x load and of every method compile for sm_90, and stay in its registers."""

import itertools
import sys
from dataclasses import replace

import pytest
import warp as wp
from combination_cases import (
    MANY,
    SM90,
    is_default_on_sm90,
    name_of,
    sm90_plan,
)
from combined_rows import COMBINED, SOME
from conftest import ROOT
from law_rows import rules_of
from method_sources import thorough_unless

from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.plan import Plan

sys.path.insert(0, str(ROOT / "studies"))
from parts.cubin import usage

pytestmark = pytest.mark.as_shipped  # registers are what the optimiser leaves
LIBRARY_SCRATCH, FEW_VALUES, MANY_VALUES = 40, 128, 8192  # bytes a thread


def compiled(plan, folder):
    """Compile a plan's kernel for sm_90, and return what it takes."""
    wp.compile_aot_module(build.build_kernel(plan).module, arch=90, module_dir=folder)
    [binary] = folder.glob("*.sm90.cubin")
    return usage(binary)


# Every second row has a gap, a friction damper, a viscous one and two laws among them.
@pytest.mark.parametrize(
    ("row", "method"),
    [
        thorough_unless(place % 2 == 1, *case, id="-".join(case))
        for place, case in enumerate(zip(COMBINED, itertools.cycle(SOME[::2])))
    ],
)
def test_sm90_of_devices(row, method, tmp_path):
    dampers = "power" if "viscous_damper" in COMBINED[row]["devices"] else "none"
    plan = Plan("chain", 2, rules_of(row), "rayleigh", "base_acceleration", ("drift", "energy"), method, "float32")
    taken = compiled(build.fitted(replace(plan, viscous_dampers=dampers), True), tmp_path)
    assert taken.local == 0
    assert taken.registers <= 255


@pytest.mark.parametrize("case", [thorough_unless(is_default_on_sm90(case), case, id=name_of(case)) for case in SM90])
def test_sm90(case, tmp_path):
    taken = compiled(sm90_plan(case), tmp_path)
    # The library's sine needs some for angles that none of ours is, full matrices under noise a few values more than a
    # thread has registers for; nothing else does.
    # Laws of many values work out more than that too: theirs goes to local memory, up to a few hundred values.
    needed = {"harmonic_force": LIBRARY_SCRATCH}.get(case[4], FEW_VALUES * (case[0] == "dense"))
    assert taken.local <= (MANY_VALUES if case[3] in MANY else needed), taken
    assert taken.registers <= 255
