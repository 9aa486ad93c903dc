"""Kernels that are compiled side by side: in threads, or in other processes, into the cache that this one reads."""

import os
import subprocess
import sys
import threading
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from types import SimpleNamespace
from typing import NamedTuple

import pytest

from warpdyn.engine.kernels import compilation

# Without a `__main__` guard, as users write scripts: a process that ran it again would print twice, or never end.
SCRIPT = """
from dataclasses import replace
import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of, plan_of
from warpdyn.engine.kernels import compilation
from warpdyn.engine.kernels.compilation import compile_side_by_side, is_compiled
compilation.MOST_KERNELS_OF_THREADS = 0  # processes are to do it
building = wd.ShearBuilding(1.0, 100.0, 3.0)
scene = wd.Scene(building, wd.FreeVibration(1.0, velocity=0.1), recorders=("drift",))
plan = replace(plan_of(scene, dynamics_of(scene), "heun", "float64", is_gpu=False), lanes=1, max_unroll=1)
plans = [plan, replace(plan, physics=("p_delta",)), replace(plan, damping="mass_proportional"), plan]
print(*(is_compiled(plan, "cpu") for plan in plans))
compile_side_by_side(plans, "cpu", threads=2)
print(*(is_compiled(plan, "cpu") for plan in plans))
"""


def test_every_plan_is_in_the_cache_afterwards(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path / "kernels")}
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, env=environment, check=False)
    assert done.stdout.split() == ["False"] * 4 + ["True"] * 4, done.stderr


def test_a_few_kernels_start_no_process(monkeypatch):
    there, *missing = plans(6)
    compiled = []
    monkeypatch.setattr(compilation, "MOST_PROCESSES", 8)
    monkeypatch.setattr(compilation, "is_compiled", lambda plan, device: plan == there)
    monkeypatch.setattr(compilation, "load_kernel", lambda plan, device: compiled.append(plan))
    monkeypatch.setattr(compilation, "ProcessPoolExecutor", None)
    compilation.compile_side_by_side([there, missing[0], missing[1], missing[0]], "cpu", threads=8)
    assert sorted(compiled) == missing[:2]
    compilation.compile_side_by_side(missing, "cpu", threads=1)
    compilation.compile_side_by_side(missing[:1], "cpu", threads=8)
    assert len(compiled) == 2  # the others are compiled when they are launched
    with pytest.raises(TypeError):  # it would
        compilation.compile_side_by_side(missing, "cpu", threads=2)


def test_threads_compile_at_the_same_time_and_the_longest_first(monkeypatch):
    begun, together = [], threading.Barrier(2)

    def compile_here(plan, _device):
        begun.append(plan.dofs)
        together.wait(60)

    monkeypatch.setattr(compilation, "is_compiled", lambda _plan, _device: False)
    monkeypatch.setattr(compilation, "load_kernel", compile_here)
    compilation.compile_side_by_side(plans(4), "cpu", threads=2)
    assert sorted(begun[:2]) == [3, 4]
    assert sorted(begun[2:]) == [1, 2]


def test_helpers_take_the_longest_and_this_process_the_shortest(monkeypatch):
    class Helper(ThreadPoolExecutor):
        def __init__(self, helpers, **_settings):
            super().__init__(helpers)

    here, helped, under_way = [], [], threading.Event()

    def compile_here(plan, _device):
        assert under_way.wait(60)  # or this process might take all before a helper has begun
        here.append(plan.dofs)

    def compile_there(plan, _device):
        helped.append(plan.dofs)
        under_way.set()

    monkeypatch.setattr(compilation, "MOST_PROCESSES", 8)
    monkeypatch.setattr(compilation, "is_compiled", lambda _plan, _device: False)
    monkeypatch.setattr(compilation, "ProcessPoolExecutor", Helper)
    monkeypatch.setattr(compilation, "load_kernel", compile_here)
    monkeypatch.setattr(compilation, "_compile", compile_there)
    compilation.compile_side_by_side(plans(20)[::-1], "cpu", threads=2)
    assert sorted(here + helped) == list(range(1, 21))
    assert here == sorted(here)
    assert helped == sorted(helped, reverse=True)
    assert helped[0] == 20


class PlanOfStoreys(NamedTuple):
    """Stand-in of a plan."""

    dofs: int
    max_unroll: int = 1


def plans(number):
    """Return stand-ins of plans, of 1, 2, 3, ... storeys."""
    return [PlanOfStoreys(dofs) for dofs in range(1, number + 1)]


def test_a_process_that_fails_stops_no_run(monkeypatch):
    def fail(*_arguments, **_settings):
        raise OSError("no semaphores")

    monkeypatch.setattr(compilation, "MOST_PROCESSES", 8)
    monkeypatch.setattr(compilation, "is_compiled", lambda _plan, _device: False)
    monkeypatch.setattr(compilation, "ProcessPoolExecutor", fail)
    with pytest.warns(UserWarning, match=r"compiled one by one, because .* \(no semaphores\)"):
        compilation.compile_side_by_side(plans(5), "cpu", threads=2)


class Processes:
    """Processes that compile when they are asked for a result."""

    def __init__(self, helpers, **options):
        self.ended = None

    def submit(self, work, plan, device):
        compiled_for_gpu.append(plan)
        return SimpleNamespace(plan=plan)

    def shutdown(self, wait=True, kill_workers=False):
        self.ended = "killed" if kill_workers else "waited for"
        compiled_for_gpu.append(self.ended)


compiled_for_gpu = []


@pytest.fixture
def gpu(monkeypatch):
    """Pretend that kernels are compiled for a GPU by other processes; the fourth plan is compiled."""
    compiled_for_gpu.clear()
    there = plans(6)[3]
    monkeypatch.setattr(compilation, "is_compiled", lambda plan, device: plan == there)
    monkeypatch.setattr(compilation, "ProcessPoolExecutor", Processes)
    monkeypatch.setattr(compilation, "result_of", lambda task: task.result() if hasattr(task, "result") else None)


def test_kernels_of_a_gpu_are_compiled_in_the_order_of_the_plans(gpu):
    asked = plans(6)
    with compilation.compiling([*asked, asked[1]], "cuda:0", threads=16) as wait_for:
        wait_for(asked[:1])  # which is compiled here, when it is launched
        wait_for(asked)
    assert compiled_for_gpu == [asked[1], asked[2], asked[4], asked[5], "waited for"]


def test_nobody_waits_for_kernels_after_an_interruption(gpu):
    with pytest.raises(KeyboardInterrupt), compilation.compiling(plans(6), "cuda:0", threads=16):
        raise KeyboardInterrupt
    assert compiled_for_gpu[-1] == "killed"


def test_a_process_that_fails_leaves_the_rest_to_this_one(gpu, monkeypatch):
    def fail(task):
        raise BrokenExecutor("killed")

    with compilation.compiling(plans(6), "cuda:0", threads=16) as wait_for:
        monkeypatch.setattr(compilation, "result_of", fail)
        with pytest.warns(UserWarning, match="kernels are compiled one by one"):
            wait_for(plans(6)[1:])
        wait_for(plans(6)[1:])  # nothing is waited for any more
