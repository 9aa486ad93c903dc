"""Run scenes by the kernel of a GPU whose threads share samples, on a CPU: 32 calls take the place of a warp.

This file is a program: python run.py LIBRARY FOLDER. The library is `warp.c`, compiled. For each case of `cases.py` the
program writes a file CASE.npz with the outputs of the kernel of a CPU and of that of a GPU to the folder.
"""

import ctypes
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from warpdyn.engine.device import processor

THREADS = 32
library = ctypes.CDLL(sys.argv[1])
library.run_warp.restype = ctypes.c_long
library.run_warp.argtypes = [ctypes.c_void_p] * 3


def address(name: str) -> int:
    """Return the address of a function of the library."""
    return ctypes.cast(getattr(library, name), ctypes.c_void_p).value


# Functions of CUDA that exchange values, written with those of the library. The place of an exchange is a line of the
# device function of warpdyn in which it happens.
EXCHANGES = f"""
typedef int Whole;
const Whole lane = ((Whole (*)()){address("thread_of_warp")}ul)();
struct {{ Whole x; }} threadIdx{{lane}};
auto exchange = (double* (*)(double, Whole)){address("exchange")}ul;
auto __float_as_uint = [](float x) {{ unsigned int y; __builtin_memcpy(&y, &x, 4); return y; }};
auto __uint_as_float = [](unsigned int x) {{ float y; __builtin_memcpy(&y, &x, 4); return y; }};
auto __double_as_longlong = [](double x) {{ long long y; __builtin_memcpy(&y, &x, 8); return y; }};
auto __longlong_as_double = [](long long x) {{ double y; __builtin_memcpy(&y, &x, 8); return y; }};
auto __shfl_sync = [&](unsigned int, auto value, int thread) {{
    decltype(value) found;
    double held = 0;
    __builtin_memcpy(&held, &value, sizeof(value));
    __builtin_memcpy(&found, exchange(held, __LINE__) + (thread & 31), sizeof(value));
    return found;
}};
auto __shfl_xor_sync = [&](unsigned int mask, auto value, int other) {{
    return __shfl_sync(mask, value, lane ^ other);
}};
auto __shfl_up_sync = [&](unsigned int mask, auto value, int by, int width) {{
    return __shfl_sync(mask, value, lane % width < by ? lane : lane - by);
}};
auto __shfl_down_sync = [&](unsigned int mask, auto value, int by, int width) {{
    return __shfl_sync(mask, value, lane % width + by >= width ? lane : lane + by);
}};
auto __ballot_sync = [&](unsigned int, bool is_set) {{
    double* all = exchange(is_set ? 1.0 : 0.0, __LINE__);
    unsigned int bits = 0;
    for (int i = 0; i < 32; i++) bits |= (all[i] != 0 ? 1u : 0u) << i;
    return bits;
}};
auto __any_sync = [&](unsigned int mask, bool is_set) {{ return __ballot_sync(mask, is_set) != 0; }};
auto max = [](auto a, auto b) {{ return a > b ? a : b; }};
auto min = [](auto a, auto b) {{ return a < b ? a : b; }};
"""
on_gpu = processor.on_gpu
processor.on_gpu = lambda cuda: EXCHANGES + cuda + "\n" if "_sync(" in cuda else on_gpu(cuda)

sys.path.insert(0, str(Path(__file__).parents[1]))
import warp as wp  # noqa: E402  (after the functions that exchange values)
from emulated_gpu import cases  # noqa: E402

import warpdyn as wd  # noqa: E402
from warpdyn.campaigns.integration import model  # noqa: E402
from warpdyn.engine.kernels import build, queues  # noqa: E402
from warpdyn.engine.kernels.bilinear_hinges import yielding_members  # noqa: E402

fitted, launch_on_cpu = build.fitted, queues.CpuQueue.launch
sections = []  # threads that share a sample, of each launch


def launch(self, launches, arguments, advance=lambda done: None, **more):
    """Launch kernels whose threads share samples one warp after the other, and others as usual."""
    for each in launches:
        if each.plan.sections == 1:
            launch_on_cpu(self, [each], arguments, advance, **more)
            continue
        sections.append(each.plan.sections)
        kernel = build.load_kernel(each.plan, "cpu")
        for first in range(0, each.plan.threads_of(each.count), THREADS):
            run_warp(kernel, first, [*each.inputs, *arguments])
        advance(each.count)


def run_warp(kernel, first, arguments):
    """Run a kernel for the threads from `first` on."""
    hooks = kernel.module.load(wp.get_device("cpu"), 1).get_kernel_hooks(kernel)
    own, calls = hooks.forward, []
    hooks.forward = lambda bounds, values: calls.append((bounds._obj, values._obj))
    try:
        for thread in range(THREADS):
            wp.launch(kernel, dim=1, inputs=[first + thread, *arguments], device="cpu")
    finally:
        hooks.forward = own
    tables = [(ctypes.c_void_p * THREADS)(*(ctypes.addressof(call[part]) for call in calls)) for part in (0, 1)]
    if library.run_warp(ctypes.cast(own, ctypes.c_void_p), *tables) <= 0:
        raise RuntimeError("threads of a warp exchange different values, or none")


def outputs(scene, settings, *, is_gpu):
    """Return the outputs of the kernel of a GPU or of a CPU."""
    # Loops that are not unrolled compile sooner.
    model.fitted = lambda plan, _: replace(fitted(plan, is_gpu), max_unroll=1)
    result = wd.simulate(scene, device="cpu", **settings)
    return {f"{name} {is_gpu}": result[name].values for name in result.data_vars}


if __name__ == "__main__":
    wp.config.optimization_level = 1  # compiles sooner
    queues.CpuQueue.launch = launch
    for name, (scene, settings, constants) in cases.CASES.items():
        sections.clear()
        kept = {constant: getattr(yielding_members, constant) for constant in constants}
        expected = outputs(scene, settings, is_gpu=False)
        vars(yielding_members).update(constants)
        build._composed_kernel.cache_clear()
        found = outputs(scene, settings, is_gpu=True)
        motions = scene.excitation.motions if name in cases.ALSO_ALONE else ()
        alone = [outputs(replace(scene, excitation=wd.Cloud([each])), settings, is_gpu=True) for each in motions]
        found |= {
            f"{variable} alone": np.concatenate([each[f"{variable} True"] for each in alone])
            for variable in cases.PEAKS
            if alone
        }
        vars(yielding_members).update(kept)
        build._composed_kernel.cache_clear()
        np.savez(Path(sys.argv[2]) / f"{name}.npz", sections=sections, **expected, **found)
