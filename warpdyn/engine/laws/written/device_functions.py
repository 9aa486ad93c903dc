"""Compile the device functions that a user writes in the class body of a law, and derive the missing ones.

A user's function `follow` returns force and memory after a step. `force`, `return_mapping` and `tangent` are derived
from `follow` in the same way for all such laws. The tangent is a difference quotient in the direction of the last step.
"""

# No `from __future__ import annotations`: Warp needs the types of annotations, not their text.

import ast
import importlib
import linecache
from typing import Any, cast

import warp as wp

from warpdyn.engine.laws.rate_law import along_drift
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring
from warpdyn.engine.laws.written.source import Written

HALF_FLEXIBILITY = "half_flexibility"  # coefficient of the elastic energy of laws without one: 0.5 / stiffness
# Length of the drift increment in difference quotients: a fraction of the drift, plus a smallest length [m].
PART_OF_DRIFT, LEAST_CHORD = wp.constant(1e-6), wp.constant(1e-9)  # float64
COARSE_PART_OF_DRIFT, COARSE_LEAST_CHORD = wp.constant(3e-4), wp.constant(1e-6)  # float32
MEMORY_CHORD = wp.constant(1e-3)  # length of difference quotients for memory values, which are of the order of 1


@wp.func
def chord_at(drift: wp.float64) -> wp.float64:
    return wp.float64(PART_OF_DRIFT) * wp.abs(drift) + wp.float64(LEAST_CHORD)


@wp.func
def chord_at(drift: wp.float32) -> wp.float32:  # type: ignore[no-redef]  # noqa: F811 (Warp's overload)
    return wp.float32(COARSE_PART_OF_DRIFT) * wp.abs(drift) + wp.float32(COARSE_LEAST_CHORD)


def written_spring(name: str, written: Written) -> Spring:
    """Return the device functions of a law whose functions are written in a class body.

    Args:
        name: Name of the variant (set of functions), which no other law has.
        written: The functions.
    """
    functions = built_functions(name, written)
    if "follow" in functions:
        functions |= _of_follow(name, functions["follow"], len(written.memory))
    if "return_mapping" in functions and "memory_after" not in functions:
        functions |= _mapped(name, functions["return_mapping"])
    # The relaxation rate is computed once per step if it does not read the memory, or if warpdyn estimates it.
    once = "rate" in functions and not _reads_memory(written, "relaxation_rate")
    if "rate" in functions:
        if "relaxation_rate" not in functions:
            functions |= _relaxation(name, functions["rate"], len(written.memory))
        found = along_drift(functions["rate"], functions["relaxation_rate"])
        functions = {**found, **_tangent_of_rate(name, functions["force"], functions["rate"]), **functions}
    elif "tangent" not in functions:
        functions |= _tangent(name, functions["force"])
    if "elastic_energy" not in functions:
        functions |= _elastic_energy(name, functions["force"], written.coefficients.index(HALF_FLEXIBILITY))
    functions.setdefault("return_mapping", None)
    fields = {field: function for field, function in functions.items() if field in Spring.__dataclass_fields__}
    sizes = {"coefficients": len(written.coefficients), "memory": len(written.memory)}
    return Spring(**fields, **sizes, relaxes_by_velocity=once)


def _reads_memory(written: Written, name: str) -> bool:
    """Return whether the function `name` of a law reads the memory; False if the law does not define this function."""
    found = [node for node in ast.parse(written.text).body if getattr(node, "name", "") == name]
    return any(isinstance(each, ast.Name) and each.id == "memory" for node in found for each in ast.walk(node))


def built_functions(name: str, written: Written) -> dict[str, Any]:
    """Return the Warp functions of a law or controller: {name in the class body: Warp function}."""
    file = f"<device functions of {name}>"
    linecache.cache[file] = (len(written.text), None, written.text.splitlines(keepends=True), file)
    namespace: dict[str, Any] = {"wp": wp, "Any": Any, "__name__": __name__}
    namespace |= {own: getattr(importlib.import_module(module), of) for own, module, of in written.imports}
    before = set(namespace)
    exec(compile(written.text, file, "exec"), namespace)
    for own in namespace.keys() - before - {"__builtins__"}:
        function = namespace[own]
        function.__qualname__ = f"{name}_{own}"
        namespace[own] = cast(wp.Function, wp.func(function))
    return {field: namespace[own] for field, own in written.functions}


def _of_follow(name: str, follow: wp.Function, memory: int) -> dict[str, Any]:
    if not memory:
        return {"force": follow}

    def force(drift: Any, memory: Any, c: Any):
        reached, _after = follow(drift, memory, c)
        return reached

    def return_mapping(drift: Any, memory: Any, c: Any):
        _reached, after = follow(drift, memory, c)
        return after

    return device_functions(name, force, return_mapping)


def _mapped(name: str, mapping: wp.Function) -> dict[str, Any]:
    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return mapping(drift, memory, c)

    return device_functions(name, memory_after)


def _tangent(name: str, force: wp.Function) -> dict[str, Any]:
    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        chord = chord_at(drift)
        if increment < type(drift)(0.0):
            chord = -chord
        return (force(drift + chord, after, c) - force(drift, after, c)) / chord

    return device_functions(name, tangent)


def _tangent_of_rate(name: str, force: wp.Function, rate: wp.Function) -> dict[str, Any]:
    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        chord = chord_at(drift)
        if increment < type(drift)(0.0):
            chord = -chord
        return (force(drift + chord, after + rate(chord, after, c), c) - force(drift, after, c)) / chord

    return device_functions(name, tangent)


def _relaxation(name: str, rate: wp.Function, memory: int) -> dict[str, Any]:
    M = memory

    # The largest absolute row sum of the Jacobian d(rate)/d(memory) is an upper bound of the rates of decay.
    def relaxation_rate(velocity: Any, memory: Any, c: Any):
        now = rate(velocity, memory, c)
        sums = type(memory)()
        chord = type(velocity)(MEMORY_CHORD)
        for m in range(M):
            moved = memory
            moved[m] = moved[m] + chord
            then = rate(velocity, moved, c)
            for n in range(M):
                sums[n] = sums[n] + wp.abs(then[n] - now[n]) / chord
        largest = sums[0]
        for m in range(1, M):
            largest = wp.max(largest, sums[m])
        return largest

    return device_functions(name, relaxation_rate)


def _elastic_energy(name: str, force: wp.Function, place: int) -> dict[str, Any]:
    FLEXIBILITY = place

    def elastic_energy(drift: Any, memory: Any, c: Any):
        now = force(drift, memory, c)
        return c[FLEXIBILITY] * now * now

    return device_functions(name, elastic_energy)
