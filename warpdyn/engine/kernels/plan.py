"""What a kernel is built from, and the structs through which it is fed."""

# No `from __future__ import annotations` in this folder: warp reads annotations as live types.

import functools
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import FEWEST_LANES, module_options
from warpdyn.engine.kernels.registry import fields, parts_in
from warpdyn.engine.laws.rate_law import POWERS
from warpdyn.engine.laws.springs import StoreyRules, spring_row
from warpdyn.engine.methods.kinds import ExplicitMethod, product
from warpdyn.engine.methods.stability_limits import relaxation_limit
from warpdyn.engine.methods.table import METHODS

LARGEST_LIMIT = 1e30  # stands for none: a constant of a kernel must be finite
DTYPES = {"float32": wp.float32, "float64": wp.float64}


@dataclass(frozen=True)
class Plan:
    """Everything that decides a kernel's source: one kernel is built and compiled for each distinct plan.

    Args:
        family: "chain" (storeys in series) or "dense" (full matrices).
        dofs: Degrees of freedom.
        law: Device functions of the storeys (elastic for the dense family).
        damping: "none", "storey", "rayleigh", "rayleigh_tangent", "mass_proportional" or "modal" (chain); "matrix"
            (dense); "classical" or "general" where the method is exact.
        load: Row of LOADS.
        recorders: Rows of RECORDERS, sorted, and "state" where the next event goes on from this one's.
        method: Row of METHODS.
        dtype: Row of DTYPES.
        lanes: Samples a thread carries.
        max_unroll: Loops up to this count are unrolled before the compiler sees them.
        sections: Threads that share a sample's storeys (a GPU's chains of many storeys), a power of 2.
        viscous_dampers: "none", "linear" (part of the storey damping) or "power" of the velocity, devices of a chain.
        physics: Parts of the kernel beside storey laws and damping, such as "p_delta" (chain, integrated step by step).
        collapses: Whether a sample ends where a storey drift passes its capacity (chain).
        has_drift_capacity: Whether storeys have capacities of their own, beside the building's drift ratio.
        resumes: Whether each structure starts from the state that an event before left it in, and not from the load's.
        undivided: Whether every interval of the motion is one step.
        starts_displaced: Whether storeys that yield start from a drift, to which they are pulled slowly from rest.
        records_late: Whether recorders of peaks start at a time after the start of the run.
    """

    family: str
    dofs: int
    law: StoreyRules
    damping: str
    load: str
    recorders: tuple[str, ...]
    method: str
    dtype: str
    lanes: int = 1
    max_unroll: int = 1
    sections: int = 1
    viscous_dampers: str = "none"
    physics: tuple[str, ...] = ()
    collapses: bool = False
    has_drift_capacity: bool = False
    resumes: bool = False
    undivided: bool = False
    starts_displaced: bool = False
    records_late: bool = False

    @property
    def kind(self) -> str:
        """The kind of the method: explicit, implicit or exact."""
        return METHODS[self.method].kind

    @property
    def storeys_of_thread(self) -> int:
        """Storeys of the section that a thread has; the last section may be filled up."""
        return -(-self.dofs // self.sections)


def options(plan: Plan) -> dict[str, object]:
    """Return the options of the module that a plan's kernel is compiled in."""
    law, method = spring_row(plan.law), METHODS[plan.method]
    in_registers = plan.family == "chain" and method.kind == "explicit" and not keeps_slopes(method)
    # Laws with many values have loops that must be unrolled, or those over lanes about them stay what they are.
    is_small = max(law.memory, law.coefficients) < FEWEST_LANES and plan.damping != "modal"
    # Histories are of a few samples: what they gain by flags alike is the time of the compiler's second header.
    gains = (plan.lanes > 1 and plan.max_unroll > 1) or plan.recorders == ("history",)
    return module_options(plan.max_unroll, in_registers and is_small and gains)


def row_types(plan: Plan) -> tuple:
    """Return types of one value a lane: of the plan's dtype, of float64, of whole numbers."""
    return tuple(
        wp.types.vector(length=plan.lanes, dtype=dtype) for dtype in (DTYPES[plan.dtype], wp.float64, wp.int32)
    )


def constants(plan: Plan, values: object) -> object:
    """Return a row of numbers as a constant vector of the plan's dtype."""
    row = np.ravel(values).astype(np.float64)
    return wp.constant(wp.types.vector(length=row.size, dtype=DTYPES[plan.dtype])(*row))


def keeps_slopes(method: ExplicitMethod) -> bool:
    """Return whether a method's stages need more than the last slope."""
    return bool(method.is_nystroem or method.is_adaptive or np.any(np.tril(np.array(method.a), -2)))


def tableau(plan: Plan) -> SimpleNamespace:
    """Return an explicit method's constants, and whether its stages need more than the last slope."""
    method = METHODS[plan.method]
    a, stages = np.array(method.a), method.stages
    error = np.array(method.error or np.zeros(stages))
    unit = next(weight for weight in method.b if weight)
    return SimpleNamespace(
        stages=stages,
        adaptive=method.is_adaptive,
        halfway=method.starts_halfway,
        ends_in_stage=method.c[-1] == 1 and np.array_equal(method.displacement_a[-1], method.displacement_b),
        keeps_slopes=keeps_slopes(method),
        weight=constants(plan, method.b),
        unit_weight=wp.constant(DTYPES[plan.dtype](unit)),
        times_unit=constants(plan, np.divide(method.b, unit)),
        reach=constants(plan, [*np.diag(a, -1), 0.0]),  # of the last slope, to the next stage
        node=constants(plan, method.c),
        first_stage=constants(plan, np.eye(stages)[0]),
        # Row s + 1 of a holds what stage s + 1 starts from; the row after the last stage is the step's end.
        a=constants(plan, np.vstack([a, method.b])),
        a_displacement=constants(plan, np.vstack([method.displacement_a, method.displacement_b])),
        ends=constants(plan, [*method.c, 1.0]),
        error=constants(plan, error),
        error_displacement=constants(plan, product(error, a)),
    )


def settling_polynomial(plan: Plan) -> tuple[float, ...]:
    """Return the growth a step of what settles at a rate, as a polynomial in minus the rate times the step.

    Implicit methods take a law's memory along the drift by classical RK4.
    """
    method = METHODS[plan.method]
    polynomial = (method if method.kind == "explicit" else METHODS["rk4"]).stability_polynomial
    return polynomial + (0.0,) * (POWERS - len(polynomial))


def settling_limit(plan: Plan) -> float:
    """Return the rate times the step up to which no deviation of a memory grows."""
    return min(relaxation_limit(METHODS[plan.method]), LARGEST_LIMIT)


# What the values are of that a part holds, by its folder.
HELD = {"loads": "state", "dampings": "structure", "parts": "structure", "stepping": "method", "recorders": "recorders"}


def values_held(plan: Plan) -> dict[str, int]:
    """Return how many values a kernel holds for each sample while it runs: what a scene does not name is not there."""
    n, kind, spring = plan.dofs, plan.kind, spring_row(plan.law)
    # Displacement and velocity of each degree of freedom, and the law's memory.
    held = {"state": (2 + spring.memory) * n, "structure": 0, "method": 0, "recorders": 0}
    # Of a memory that stages move, each value has working copies; any other is looked at one storey after another.
    moving = 2 + (spring.memory if spring.rate is not None else min(1, spring.memory))
    if kind == "exact":
        size = 2 * n
        held["structure"] = {"classical": n * n + 8 * n, "general": size * size + 4 * n}[plan.damping]
        held["method"] = size
    elif plan.family == "dense":
        held["structure"] = (3 * n) ** 2 + 6 * n if kind == "implicit" else 2 * n * n + n
        held["method"] = 3 * n if kind == "implicit" else 4 * n
    else:
        held["structure"] = n * (1 + spring.coefficients)
        held["method"] = 2 * moving * n
    if kind == "explicit":
        method = tableau(plan)
        held["method"] += (moving - 1) * n * method.stages if method.keeps_slopes else 0
    elif kind == "implicit" and plan.family == "chain":
        held["method"] = 5 * n  # acceleration, its correction, and the factors of a tridiagonal matrix
    for folder, name in HELD.items():
        parts = [part for part in parts_in(folder) if hasattr(part, "values_held") and part.wanted(plan)]
        held[name] += sum(part.values_held(plan) for part in parts)
    return held


@functools.cache
def structs(dtype_name: str) -> SimpleNamespace:
    """Return the argument structs of all kernels for one dtype; each field is named as the dataset names it."""
    return SimpleNamespace(
        **{name: _struct(f"{name}_{dtype_name}", types, dtype_name) for name, types in fields().items()}
    )


def _struct(name: str, types: dict[str, str], dtype_name: str) -> type:
    annotations = {field: _field_type(type_name, DTYPES[dtype_name]) for field, type_name in types.items()}
    return wp.struct(type(name, (), {"__annotations__": annotations, "__module__": __name__}))


def _field_type(type_name: str, dtype: type) -> object:
    """Return the type that words stand for: "float" is of the kernel's dtype, "float[,]" an array of two dimensions."""
    scalar, bracket, commas = type_name.partition("[")
    element = dtype if scalar == "float" else getattr(wp, scalar)
    return wp.array(dtype=element, ndim=1 + commas.count(",")) if bracket else element
