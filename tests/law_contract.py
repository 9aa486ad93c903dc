"""What any law of the table must do, found by its own device functions: storeys of every row, taken along paths."""

from __future__ import annotations

import ast
import functools
import inspect
import itertools

import numpy as np
import warp as wp
from law_rows import VARIANTS

import warpdyn as wd
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.laws import DEVICES, LAWS, Parameter
from warpdyn.engine.laws.law import StoreyElement
from warpdyn.engine.laws.springs import spring_row

STIFFNESS, YIELD_FORCE = 1.0e7, 1.0e5  # a storey that yields at 10 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
STOREYS, TURNS, STEPS = 12, 24, 120
CHORD = 1e-7  # m
TRIES = 20_000
NOISE = 1e-4  # yield drifts: by so much float32 rounds the place of a floor that has moved by 1,700 of them
ELEMENTS = LAWS | DEVICES
ROWS = [(name, row) for name, element in ELEMENTS.items() for row in element.rows]


def drawn_value(name: str, parameter: Parameter, defaults: float, rng: np.random.Generator) -> float:
    """Return a value of a parameter inside its bounds, of the order that its units and bounds tell, or its default.

    It is not at a bound: a storey may be without friction there, and so without a range in which it is elastic.
    """
    if parameter.default is not None and rng.random() < defaults:
        return parameter.default
    if name.startswith(("ductility_", "force_ratio_")):  # corners of a backbone, one beyond another
        return 1 + 3 * rng.random() * (int(name[-1]) - 1) if name.startswith("d") else 1.4 * rng.random()
    scale = {"N": YIELD_FORCE, "N m-1": 0.2 * STIFFNESS, "m": 5 * YIELD_DRIFT}.get(parameter.units)
    if scale is not None and not np.isfinite(parameter.high):
        return scale * 10 ** rng.uniform(-0.5, 0.5)
    if np.isfinite(parameter.low) and np.isfinite(parameter.high):
        is_flag = parameter.default in (0, 1) and rng.random() < 0.3  # such as whether cycles are counted
        return 1 - parameter.default if is_flag else rng.uniform(parameter.low, parameter.high)
    value = (parameter.low if np.isfinite(parameter.low) else 0.0) + 10 ** rng.uniform(-0.3, 0.5)
    return float(np.ceil(value)) if rng.random() < 0.5 else value  # rules may be quicker for whole numbers


@functools.cache
def drawn_storeys(name: str, row: str) -> dict[str, np.ndarray]:
    """Return parameters of storeys, [structure, storey], that lead a law or a device to a row."""
    element, rng = ELEMENTS[name], np.random.default_rng(len(name) + 100 * len(row))
    found: list[dict[str, float]] = []
    for _ in range(TRIES):
        defaults = rng.choice([0.1, 0.5, 0.95])  # rows may be for storeys without what has a default of 0
        values = {key: drawn_value(key, parameter, defaults, rng) for key, parameter in element.parameters.items()}
        given = {key: np.full((1, 1), value) for key, value in ({"stiffness": STIFFNESS} | values).items()}
        fits = not any(parameter.violations(given[key]).any() for key, parameter in element.parameters.items())
        if fits and element.problem(given) is None and element.spring(given) == row:
            found.append(values)
        if len(found) == STOREYS:
            break
    assert found, f"no parameters within the bounds of {name!r} lead to its row {row!r}"
    found = (found * STOREYS)[:STOREYS]
    return {"stiffness": np.full((1, STOREYS), STIFFNESS)} | {
        key: np.array([[values[key] for values in found]]) for key in element.parameters
    }


def coefficients_of(element: type[StoreyElement], p: dict[str, np.ndarray], row: str) -> np.ndarray:
    """Return what a row reads, [coefficient, storey]."""
    return np.concatenate(np.broadcast_arrays(*element.coefficients(p, row), p["stiffness"])[:-1])


def paths() -> np.ndarray:
    """Return drifts [m] to and fro, of all sizes, [step, storey]; they end at 0."""
    rng = np.random.default_rng(11)
    to = 10 ** rng.uniform(-0.5, 1.2, (TURNS, STOREYS)) * YIELD_DRIFT * rng.uniform(-1, 1, (TURNS, STOREYS))
    to[-1] = 0
    corners = np.concatenate([np.zeros((1, STOREYS)), to])
    along = np.linspace(0, 1, STEPS, endpoint=False)[1:, None]
    return np.concatenate([a + (b - a) * along for a, b in itertools.pairwise(corners)])


@functools.cache
def contract_kernel(row: str) -> wp.Kernel:
    """Return the kernel that takes storeys of a row along drifts and asks all of its device functions at each step."""
    spring = spring_row(VARIANTS[row])
    MEMORY = max(1, spring.memory)
    ADVANCES, MAPS, GLIDES = (
        function is not None for function in (spring.memory_after, spring.return_mapping, spring.memory_on_line)
    )
    GLIDING = spring.values_on_line or spring.memory
    C = spring.coefficients
    force_of, held_of, recoverable_of = (
        spring.force,
        spring.force_at_accepted_state or spring.force,
        spring.elastic_energy,
    )
    tangent_of, advance, mapped_memory = (
        spring.tangent,
        spring.memory_after or spring.force,
        spring.return_mapping or spring.force,
    )
    memory_on_line, leaves_line, tangent_on_line = (
        function or spring.force for function in (spring.memory_on_line, spring.leaves_line, spring.tangent_on_line)
    )
    coefficient_vector = wp.types.vector(length=C, dtype=wp.float64)
    memory_vector = wp.types.vector(length=MEMORY, dtype=wp.float64)

    # Functions stand in a rolled loop: compiling is most of this test's time.
    @wp.kernel(module="unique", enable_backward=False, module_options={"max_unroll": 1})
    def follow(
        coefficients: wp.array2d(dtype=wp.float64),
        drift: wp.array2d(dtype=wp.float64),
        chord: wp.float64,
        result: wp.array3d(dtype=wp.float64),
    ):
        storey = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, storey]
        memory = memory_vector()
        last = wp.float64(0.0)
        for step in range(drift.shape[0]):
            now = drift[step, storey]
            way = wp.where(now < last, -chord, chord)
            after = memory
            for k in range(2):
                # A chord ends at the step: the law is not asked for drifts beyond it.
                at = now - wp.float64(1 - k) * way
                if ADVANCES:
                    after = advance(at, at - last, memory, c)
                result[k, step, storey] = force_of(at, after, c)
            result[2, step, storey] = held_of(now, after, c)
            result[3, step, storey] = force_of(now, memory, c)  # as a trial stage asks for it
            result[4, step, storey] = tangent_of(now, now - last, memory, after, c)
            result[5, step, storey] = recoverable_of(now, after, c)
            result[6, step, storey] = wp.float64(0.0)
            if MAPS:
                mapped = mapped_memory(now, memory, c)
                for m in range(MEMORY):
                    result[6, step, storey] += wp.abs(mapped[m] - after[m])
            result[7, step, storey] = wp.float64(0.0)
            result[8, step, storey] = wp.float64(1.0)
            result[9, step, storey] = result[4, step, storey]
            if GLIDES:  # a branch that is decided when the kernel is built stands alone  # noqa: SIM102
                if not leaves_line(now, memory, c):
                    on_line = memory_on_line(now, memory, c)
                    result[8, step, storey] = wp.float64(0.0)
                    result[9, step, storey] = tangent_on_line(now, memory, c)
                    for m in range(GLIDING):
                        result[7, step, storey] += wp.abs(on_line[m] - after[m])
            memory = after
            last = now

    return follow


NAMES = (
    "behind", "force", "held", "trial", "tangent", "recoverable", "unlike_advance", "unlike_mapping", "leaves_line",
    "tangent_on_line",
)  # fmt: skip


@functools.cache
def answers(name: str, row: str) -> dict[str, np.ndarray]:
    """Return what a row says of its storeys at each step of the paths, [step, storey] each; "drift" is the path."""
    element, p = ELEMENTS[name], drawn_storeys(name, row)
    drift = paths()
    arrays = [wp.array(values, dtype=wp.float64, device="cpu") for values in (coefficients_of(element, p, row), drift)]
    result = wp.full((len(NAMES), *drift.shape), np.nan, dtype=wp.float64, device="cpu")
    wp.launch(loaded(contract_kernel(row)), dim=STOREYS, inputs=[*arrays, CHORD, result], device="cpu")
    return dict(zip(NAMES, result.numpy(), strict=True)) | {"drift": drift}


def change_by_noise(name: str, row: str) -> float:
    """Return by how much of its largest force a storey of a row changes its force if noise is added to its drift.

    Drifts are sums of six waves of 4,000 steps, with ductilities of up to ten, and the noise is uniform.
    """
    rng = np.random.default_rng(1)
    time = np.linspace(0, 1, 4000)[:, None]
    c = wp.array(coefficients_of(ELEMENTS[name], drawn_storeys(name, row), row), dtype=wp.float64, device="cpu")
    largest = 0.0
    for _ in range(8):
        waves = [
            rng.normal(size=STOREYS) * np.sin(2 * np.pi * (rng.uniform(2, 14, STOREYS) * time + rng.random(STOREYS)))
            for _ in range(6)
        ]
        drift = YIELD_DRIFT * np.sum(waves, axis=0) * np.sqrt(np.sin(np.pi * time)) * rng.uniform(1, 3, STOREYS)
        forces = []
        for noise in (0.0, NOISE * YIELD_DRIFT * rng.uniform(-1, 1, drift.shape)):
            path = wp.array(drift - drift[0] + noise, dtype=wp.float64, device="cpu")
            result = wp.full((len(NAMES), *drift.shape), np.nan, dtype=wp.float64, device="cpu")
            wp.launch(loaded(contract_kernel(row)), dim=STOREYS, inputs=[c, path, CHORD, result], device="cpu")
            forces.append(result.numpy()[NAMES.index("held")])
        change = np.abs(forces[1] - forces[0]).max(axis=0) / np.abs(forces[0]).max(axis=0)
        largest = max(largest, float(change.max()))
    return largest


def coefficients_read(row: str) -> set[int] | None:
    """Return the places of the coefficients that a row's device functions read; None if places are worked out."""
    found: set[int] = set()
    functions = [value for value in vars(spring_row(VARIANTS[row])).values() if isinstance(value, wp.Function)]
    is_fixed = all([_read(function, found, set()) for function in functions])
    return found if is_fixed else None


def _read(function: wp.Function, found: set[int], seen: set[wp.Function]) -> bool:
    """Collect the places that a function and those it calls read; return whether all are constants."""
    if function in seen or not function.func:
        return True
    seen.add(function)
    outer = inspect.getclosurevars(function.func)
    known = {**outer.globals, **outer.nonlocals}
    is_fixed = True

    def visit(node: ast.AST) -> None:
        nonlocal is_fixed
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and isinstance(known.get(node.test.id), bool):
            for child in node.body if known[node.test.id] else node.orelse:
                visit(child)
            return
        if isinstance(node, ast.Subscript) and getattr(node.value, "id", None) == "c":
            try:
                found.add(int(eval(ast.unparse(node.slice), dict(known))))
            except NameError:
                is_fixed = False
        if isinstance(node, ast.Name) and isinstance(known.get(node.id), wp.Function):
            is_fixed = _read(known[node.id], found, seen) and is_fixed
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(function.adj.tree)
    return is_fixed


def drawn_building(name: str, row: str) -> wd.ShearBuilding:
    """Return a building of the drawn storeys."""
    values = {key: value[0] for key, value in drawn_storeys(name, row).items() if key != "stiffness"}
    kind = {"law": name} if name in LAWS else {"devices": (name,)}
    return wd.ShearBuilding(np.ones(STOREYS), STIFFNESS, 3.0, **kind, **values)
