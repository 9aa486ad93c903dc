"""Kernels that contain a computation which was recorded from Python code.

The constants of the computation, and the tables in which it looks up values, are arguments of the kernel.
"""

import functools
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.composition import Composed, kernel_of
from warpdyn.engine.kernels.kernel_cache import block_size, loaded
from warpdyn.engine.kernels.preparing.lookup import args_of, value_in_table
from warpdyn.engine.tracing.functions import functions_in
from warpdyn.engine.tracing.program import Program
from warpdyn.engine.tracing.tables import PREFIX

# Types of arguments.
REALS, TABLE, INTEGERS = "wp.array(dtype=wp.float64)", "wp.array2d(dtype=wp.float64)", "wp.array(dtype=wp.int32)"
PARTS = ("grid", "values", "even", "last")


class PreparingKernel:
    """A kernel whose last statements are a computation that was recorded from Python code.

    Args:
        name: Name of the kernel.
        head: The first statements of the kernel.
        arguments: Types of the arguments before and after the arguments for constants and tables: two dictionaries
            {name: type}.
        body: Statements between the head and the computation.
        program: The computation.
        names: Values of the names in the text: {name: value}.
        max_unroll: Largest number of iterations of a loop that is unrolled.
    """

    def __init__(
        self,
        name: str,
        head: str,
        arguments: tuple[Mapping[str, str], Mapping[str, str]],
        body: str,
        program: Program,
        names: Mapping[str, Any],
        max_unroll: int = 1,
    ) -> None:
        tables = sorted(set(re.findall(rf"\b{PREFIX}\d+(?=\()", program.text)))
        text = f"{head}{body}{program.text}\n"
        # Tables are numbered in the order of their use in a process, but the text must not depend on it.
        own = {table: f"cells_{place}" for place, table in enumerate(tables)}
        for table, known in own.items():
            arrays = ", ".join(f"{known}_{part}" for part in PARTS)
            text = re.sub(rf"\b{table}\(", f"value_in_table({arrays}, ", text)
        before, after = arguments
        types = {
            **before,
            "constants": REALS,
            **{f"{k}_{part}": REALS for k in own.values() for part in PARTS},
            **after,
        }
        listed = ", ".join(f"{key}: {kind}" for key, kind in types.items())
        called = {"value_in_table": value_in_table, **functions_in(program.text)}
        known_names = tuple(sorted({**names, **called}.items()))
        self.kernel = _kernel(f"def {name}({listed}):\n{text}", known_names, max_unroll)
        self._tables, self._constants = tables, np.array(program.constants or [0.0])
        self._brought: dict[str, list[Any]] = {}

    def arguments(self, device: str) -> list[Any]:
        """Return the arrays of the kernel's constants and tables in the memory of a device."""
        if device not in self._brought:
            constants = wp.array(self._constants, dtype=wp.float64, device=device)
            self._brought[device] = [constants, *args_of(self._tables, device)]
        return self._brought[device]


def launch(kernel: wp.Kernel, threads: int, inputs: Sequence[Any], device: str) -> None:
    """Compile and load a kernel if necessary, and launch it on the present stream of a device."""
    wp.launch(loaded(kernel, device), dim=threads, inputs=inputs, device=device, block_dim=block_size(device))


@functools.lru_cache(maxsize=256)
def _kernel(text: str, names: tuple[tuple[str, Any], ...], max_unroll: int) -> wp.Kernel:
    return kernel_of(Composed(text, dict(names)), module_options(max_unroll))
