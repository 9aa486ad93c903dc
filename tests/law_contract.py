"""Storeys of every variant of every law and device, with parameters drawn within their bounds, along paths."""

from __future__ import annotations

import ast
import functools
import inspect

import numpy as np
import warp as wp
from law_rows import VARIANTS

import warpdyn as wd
from warpdyn.campaigns.running.certification.paths import Storeys
from warpdyn.engine.laws import DEVICES, LAWS, Parameter
from warpdyn.engine.laws.springs import spring_row

STIFFNESS, YIELD_FORCE = 1.0e7, 1.0e5  # a storey that yields at 10 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
STOREYS = 12
TRIES, TRIES_OF_A_SIDE = 20_000, 300
NOISE = 1e-4  # yield drifts: the rounding in float32 of a displacement of 1,700 yield drifts
ELEMENTS = LAWS | DEVICES
ROWS = [(name, row) for name, element in ELEMENTS.items() for row in element.rows]


def drawn_value(name: str, parameter: Parameter, defaults: float, rng: np.random.Generator) -> float:
    """Return a value of a parameter inside its bounds, of a usual size for its units and bounds, or its default.

    It is not at a bound, where a storey may have no friction and no elastic range.
    """
    if name == "stiffness_ratio_negative":
        return 1.0  # tests compare with one initial stiffness
    if parameter.default is not None and rng.random() < defaults:
        return parameter.default
    if name.startswith(("ductility_", "force_ratio_")):  # corners of a backbone, one beyond another
        corner = int(name.removesuffix("_negative")[-1])
        return 1 + 3 * rng.random() * (corner - 1) if name.startswith("d") else 1.4 * rng.random()
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
    """Return parameters of storeys, [structure, storey], for which a law or device uses a variant."""
    element, rng = ELEMENTS[name], np.random.default_rng(len(name) + 100 * len(row))
    found: list[dict[str, float]] = []
    sides = [{key: each for key, each in element.parameters.items() if not each.optional}]
    if "asymmetric" in row:  # a negative side that goes with a positive side
        sides.append({key: each for key, each in element.parameters.items() if each.optional})
    for _ in range(TRIES):
        defaults = rng.choice([0.1, 0.5, 0.95])  # some variants need defaults of 0
        values: dict[str, float] = {}
        for side in sides:
            for _ in range(TRIES_OF_A_SIDE if values else 1):
                tried = {key: drawn_value(key, parameter, defaults, rng) for key, parameter in side.items()}
                # Most tries violate a bound: numbers are checked, and arrays are made of those that do not.
                if fits := not any(parameter.violations(tried[key]) for key, parameter in side.items()):
                    known = {"stiffness": STIFFNESS} | values | tried
                    given = {key: np.array([[each]]) for key, each in known.items()}
                    fits = element.problem(given) is None
                if fits:
                    values |= tried
                    break
            if not fits:
                break
        if fits and element.spring(given) == row:
            found.append(values)
        if len(found) == STOREYS:
            break
    assert found, f"no parameters within the bounds of {name!r} lead to its row {row!r}"
    found = (found * STOREYS)[:STOREYS]
    return {"stiffness": np.full((1, STOREYS), STIFFNESS)} | {
        key: np.array([[values[key] for values in found]]) for key in found[0]
    }


def storeys_of(name: str, row: str) -> Storeys:
    """Return storeys with drawn parameters."""
    return Storeys(ELEMENTS[name], drawn_storeys(name, row), YIELD_DRIFT)


@functools.cache
def answers(name: str, row: str) -> dict[str, np.ndarray]:
    """Return the results of a row's device functions at each step of the paths, [step, storey] each, and "drift"."""
    storeys = storeys_of(name, row)
    return storeys.answers(storeys.path())


def change_by_noise(name: str, row: str) -> float:
    """Return by how much of its largest force a storey of a row changes its force if noise is added to its drift.

    Drifts are sums of six waves of 4,000 steps, with ductilities of up to ten, and the noise is uniform.
    """
    rng = np.random.default_rng(1)
    time = np.linspace(0, 1, 4000)[:, None]
    largest = 0.0
    for _ in range(8):
        waves = [
            rng.normal(size=STOREYS) * np.sin(2 * np.pi * (rng.uniform(2, 14, STOREYS) * time + rng.random(STOREYS)))
            for _ in range(6)
        ]
        drift = YIELD_DRIFT * np.sum(waves, axis=0) * np.sqrt(np.sin(np.pi * time)) * rng.uniform(1, 3, STOREYS)
        forces = [
            storeys_of(name, row).answers(drift - drift[0] + noise)["held"]
            for noise in (0.0, NOISE * YIELD_DRIFT * rng.uniform(-1, 1, drift.shape))
        ]
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
