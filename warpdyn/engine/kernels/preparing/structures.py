"""Kernels that draw random structures on a device, and write the arguments of the kernels that integrate them.

The first kernel draws the random parameters, and writes masses and stiffnesses of the chains whose frequencies are
needed. Another kernel finds the frequencies. If the damping couples modes, a second pair of kernels writes the dashpots
and finds the slowest decay. The last kernel draws the same parameters again, checks them, and writes all results:
drawing the parameters several times needs less time than storing them.
"""

import functools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from warpdyn.engine.device.random_numbers import normal_of, uniform_pair
from warpdyn.engine.kernels.auxiliary.decays import find_decays, launch_decays
from warpdyn.engine.kernels.auxiliary.frequencies import frequencies_kernel, launch_frequencies, most_storeys
from warpdyn.engine.kernels.build import GPU_UNROLL
from warpdyn.engine.kernels.plan import DTYPES, structs
from warpdyn.engine.kernels.preparing.text import INTEGERS, REALS, TABLE, PreparingKernel, launch
from warpdyn.engine.tracing.nodes import Node, apply, constant
from warpdyn.engine.tracing.program import Program
from warpdyn.engine.tracing.requests import DECAY, FREQUENCIES, PREFIX, Request
from warpdyn.foundations.core.random_numbers import Purpose

SOLVERS = {FREQUENCIES: launch_frequencies, DECAY: launch_decays}
PERIOD, SLOWEST_DECAY, STABLE_STEP = range(3)  # row indices of the array `vibration`
LONGEST_PERIOD, LEAST_STABLE_STEP = range(2)  # indices in the array `extremes`

POINTS = {
    "monte_carlo": """\
    for pair in range({pairs}):
        drawn = uniform_pair(key, wp.uint64(number), {purpose}, wp.uint32(pair))
        z[2 * pair] = drawn[0]
        if 2 * pair + 1 < {variables}:
            z[2 * pair + 1] = drawn[1]
""",
    "sobol": """\
    code = wp.uint32(number ^ (number >> 1))
    for v in range({variables}):
        word = digits[0, v]
        for bit in range(digits.shape[0] - 1):
            if (code >> wp.uint32(bit)) % wp.uint32(2) == wp.uint32(1):
                word = word ^ digits[bit + 1, v]
        z[v] = wp.float64(word) * wp.float64({spacing!r})
""",
    "latin_hypercube": """\
    for v in range({variables}):
        z[v] = points[number, v]
""",
}
# The normal value of a point at exactly 0 would be infinite.
NORMALS = """\
    for v in range({variables}):
        z[v] = normal_of(wp.clamp(z[v], wp.float64({least!r}), wp.float64({most!r})))
    for back in range({variables}):
        v = {variables} - 1 - back
        total = wp.float64(0.0)
        for k in range(v + 1):
            share = factor[v, k]
            if share != wp.float64(0.0):
                total += share * z[k]
        z[v] = total
"""
HEAD = """\
    s = wp.tid()
    if s >= count:
        return
    number = first + s
    z = variables()
"""
ARGUMENTS = {
    "first": "int",
    "count": "int",
    "key": "wp.uint64",
    "digits": "wp.array2d(dtype=wp.uint32)",
    "points": TABLE,
    "factor": TABLE,
    "nominal": REALS,
}


class Draws(NamedTuple):
    """How the random variables of structures are drawn.

    Args:
        sampling: Key of POINTS, such as "monte_carlo".
        key: Key of the random numbers, computed from the seed.
        digits: Shift and direction numbers of a Sobol sequence, shape [1 + bit, variable].
        points: Points of a Latin hypercube, shape [structure, variable].
        factor: Lower triangular factor of the correlation matrix, shape [variable, variable].
        bits: Number of binary digits of a coordinate of a Sobol point.
    """

    sampling: str
    key: int
    digits: np.ndarray
    points: np.ndarray
    factor: np.ndarray
    bits: int


class StructureValues(NamedTuple):
    """Quantities that are computed for each structure, as nodes of a recorded computation.

    Args:
        fields: Quantities for the fields of the struct Structure: {field: array of shape [row] or []}.
        vibration: Period [s], slowest decay [1/s] and stable step [s].
        refused: Whether a parameter is outside its bounds.
        requests: Quantities that separate kernels compute, such as natural frequencies.
    """

    fields: Mapping[str, np.ndarray]
    vibration: Sequence[Node]
    refused: Node
    requests: Sequence[Request]


class StructurePreparation:
    """Draws random structures on a device and writes the arguments of the kernels that integrate them.

    Args:
        draws: How random variables are drawn.
        nominal: Nominal values of parameters, which the recorded computation reads as `nominal[0]`, `nominal[1]`, ...
        given: Given values of parameters, shape [structure] or [structure, storey], in the order of the inputs
            `given_0`, `given_1`, ...
        values: Quantities that are computed for each structure.
        dtype: Number type of the kernels that integrate the structures.
    """

    def __init__(
        self, draws: Draws, nominal: np.ndarray, given: Sequence[np.ndarray], values: StructureValues, dtype: str
    ) -> None:
        self.draws, self.nominal, self.given, self.values, self.dtype = draws, nominal, given, values, dtype
        self.rows = {name: nodes.shape for name, nodes in values.fields.items()}
        self._kernels = [*map(self._kernel_of_requests, self._levels()), self._kernel_of_structures()]
        self._inputs: dict[str, list[Any]] = {}  # by device

    @property
    def kernels(self) -> list[wp.Kernel]:
        """The kernels that `prepare` launches, including those that compute frequencies and decay rates."""
        solving = [
            find_decays if each.kind == DECAY else frequencies_kernel(most_storeys(each.rows), 1)
            for each in self.values.requests
        ]
        return [*(each.kernel for each in self._kernels), *solving]

    def prepare(self, first: int, count: int, structures: Any, vibration: Any, counts: Any, extremes: Any) -> None:
        """Queue the kernels for a range of structures on the present stream of the arrays' device.

        Args:
            first: Index of the first structure.
            count: Number of structures.
            structures: Output: struct Structure.
            vibration: Output: period [s], slowest decay [1/s] and stable step [s], shape [3, structure].
            counts: Output: element 0 counts the structures that are refused.
            extremes: Output: the longest period and the least stable step [s].
        """
        device = str(vibration.device)
        if device not in self._inputs:
            self._inputs[device] = self._brought(device)
        inputs = [first, count, np.uint64(self.draws.key), *self._inputs[device]]
        *of_requests, of_structures = self._kernels
        results = [wp.empty((each.rows, count), dtype=wp.float64, device=device) for each in self.values.requests]
        for of_inputs, answered in zip(of_requests, self._levels(), strict=True):
            read = {
                place: [wp.empty((array.size, count), dtype=wp.float64, device=device) for array in request.inputs]
                for place, request in answered.items()
            }
            own = [*results, *(array for arrays in read.values() for array in arrays)]
            launch(of_inputs.kernel, count, [*inputs, *of_inputs.arguments(device), *own], device)
            for place, request in answered.items():
                SOLVERS[request.kind](*read[place], results[place], device=device)
        outputs = [*results, structures, vibration, counts, extremes]
        launch(of_structures.kernel, count, [*inputs, *of_structures.arguments(device), *outputs], device)

    def _brought(self, device: str) -> list[Any]:
        draws = self.draws
        arrays = [(draws.digits, wp.uint32), (draws.points, wp.float64), (draws.factor, wp.float64)]
        arrays.append((self.nominal, wp.float64))
        arrays += [(values, wp.float64) for values in self.given]
        return [wp.array(np.ascontiguousarray(values), dtype=dtype, device=device) for values, dtype in arrays]

    def _levels(self) -> list[dict[int, Request]]:
        """Return the requests by level, a list with one {index of the request: request} per level.

        A request is a quantity that a separate kernel computes. Requests of a level need only results of lower levels.
        """
        levels: list[dict[int, Request]] = []
        for place, request in enumerate(self.values.requests):
            levels += [{} for _ in range(request.level + 1 - len(levels))]
            levels[request.level][place] = request
        return levels

    def _kernel_of_requests(self, level: dict[int, Request]) -> PreparingKernel:
        """Return the kernel that computes the inputs of the requests of a level."""
        program, arguments = Program(), self._results()
        for place, request in level.items():
            for number, nodes in enumerate(request.inputs):
                arguments[f"input_{place}_{number}"] = TABLE
                for row, node in enumerate(nodes):
                    text = program.name_of(node)
                    program.add(f"input_{place}_{number}[{row}, s] = {text}")
        return self._kernel("prepare_requests", program, arguments)

    def _results(self) -> dict[str, str]:
        """Return the names and types of the kernel arguments that contain the results of requests: {name: type}."""
        return {f"{PREFIX}{place}": TABLE for place in range(len(self.values.requests))}

    def _kernel_of_structures(self) -> PreparingKernel:
        values, program, largest = self.values, Program(), np.finfo(np.float32).max
        refused = values.refused
        for name, nodes in values.fields.items():
            for index in np.ndindex(nodes.shape):
                node = nodes[index]
                if self.dtype == "float32" and node.varies:
                    beyond = apply("greater", apply("absolute", node), constant(float(largest)))
                    refused = apply("logical_or", refused, apply("logical_and", beyond, apply("isfinite", node)))
                place = f"{index[0]}, s" if index else "s"
                text = program.name_of(node)
                program.add(f"structures.{name}[{place}] = dtype({text})")
        for row, node in enumerate(values.vibration):
            text = program.name_of(node)
            program.add(f"vibration[{row}, s] = {text}")
        period, stable = (program.name_of(values.vibration[row]) for row in (PERIOD, STABLE_STEP))
        if not refused.is_constant or refused.value:
            text = program.name_of(refused)
            program.add(f"if {text}:")
            program.add("    wp.atomic_add(counts, 0, 1)")
        # Compare before the atomic operation: most structures change neither the maximum nor the minimum, and atomic
        # operations on one address wait for each other.
        program.add(f"if {period} > extremes[{LONGEST_PERIOD}]:")
        program.add(f"    wp.atomic_max(extremes, {LONGEST_PERIOD}, {period})")
        program.add(f"if {stable} < extremes[{LEAST_STABLE_STEP}]:")
        program.add(f"    wp.atomic_min(extremes, {LEAST_STABLE_STEP}, {stable})")
        arguments = self._results() | {
            "structures": "Structure",
            "vibration": TABLE,
            "counts": INTEGERS,
            "extremes": REALS,
        }
        return self._kernel("prepare_structures", program, arguments)

    def _kernel(self, name: str, program: Program, own: dict[str, str]) -> PreparingKernel:
        """Return a kernel that draws the random variables of a structure and runs a recorded computation with them.

        Args:
            name: Name of the kernel.
            program: The recorded computation.
            own: Names and types of the arguments that follow the arguments of all such kernels.
        """
        variables = len(self.draws.factor)
        arguments = ARGUMENTS | {f"given_{i}": REALS if v.ndim == 1 else TABLE for i, v in enumerate(self.given)}
        known = {"variables": variables, "pairs": (variables + 1) // 2, "purpose": int(Purpose.STRUCTURE)}
        known |= {"spacing": 2.0**-self.draws.bits, "least": 2.0**-54, "most": 1 - 2.0**-53}
        body = (POINTS[self.draws.sampling] + NORMALS).format(**known) if variables else ""
        names = {"uniform_pair": uniform_pair, "normal_of": normal_of, "dtype": DTYPES[self.dtype]}
        names |= {"Structure": structs(self.dtype).Structure, "variables": _vector(max(1, variables))}
        return PreparingKernel(name, HEAD, (arguments, own), body, program, names, GPU_UNROLL)


@functools.cache
def _vector(length: int) -> Any:
    return wp.types.vector(length=length, dtype=wp.float64)
