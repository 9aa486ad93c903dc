"""What a kernel is built from, and the structs through which it is fed."""

# No `from __future__ import annotations` in this folder: warp reads annotations as live types.

import functools
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import warp as wp

from warpdyn.kernels.loads import LOADS
from warpdyn.laws.devices.viscous_damper import VALUES
from warpdyn.laws.rate_law import POWERS
from warpdyn.laws.springs import spring_row
from warpdyn.methods.kinds import ExplicitMethod
from warpdyn.methods.stability_limits import relaxation_limit
from warpdyn.methods.table import METHODS

LARGEST_LIMIT = 1e30  # stands for none: a constant of a kernel must be finite
MASS_DAMPED = ("rayleigh", "rayleigh_tangent", "mass_proportional")  # dampings with a part in proportion to mass
DTYPES = {"float32": wp.float32, "float64": wp.float64}


@dataclass(frozen=True)
class Plan:
    """Everything that decides a kernel's source: one kernel is built and compiled for each distinct plan.

    Args:
        family: "chain" (storeys in series) or "dense" (full matrices).
        dofs: Degrees of freedom.
        law: Row of SPRINGS ("elastic" for the dense family).
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
        p_delta: Whether gravity pushes leaning storeys over (chain, integrated step by step).
        resumes: Whether each structure starts from the state that an event before left it in, and not from the load's.
    """

    family: str
    dofs: int
    law: str
    damping: str
    load: str
    recorders: tuple[str, ...]
    method: str
    dtype: str
    lanes: int = 1
    max_unroll: int = 1
    sections: int = 1
    viscous_dampers: str = "none"
    p_delta: bool = False
    resumes: bool = False


# On a processor too, products and sums are fused, as a GPU does by itself; and rows take registers of 512 bits where
# there are any, of which the compiler makes no use on some by default, at half the speed.
CPU_FLAGS = f"{wp.config.cpu_compiler_flags} -ffp-contract=fast -mprefer-vector-width=512"


def options(plan: Plan) -> dict[str, object]:
    """Return the options of the module that a plan's kernel is compiled in."""
    return {"max_unroll": plan.max_unroll, "cpu_compiler_flags": CPU_FLAGS}


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
    return SimpleNamespace(
        stages=stages,
        adaptive=method.is_adaptive,
        halfway=method.starts_halfway,
        ends_in_stage=method.c[-1] == 1 and np.array_equal(method.displacement_a[-1], method.displacement_b),
        keeps_slopes=keeps_slopes(method),
        weight=constants(plan, method.b),
        reach=constants(plan, [*np.diag(a, -1), 0.0]),  # of the last slope, to the next stage
        node=constants(plan, method.c),
        first_stage=constants(plan, np.eye(stages)[0]),
        # Row s + 1 of a holds what stage s + 1 starts from; the row after the last stage is the step's end.
        a=constants(plan, np.vstack([a, method.b])),
        a_displacement=constants(plan, np.vstack([method.displacement_a, method.displacement_b])),
        ends=constants(plan, [*method.c, 1.0]),
        error=constants(plan, error),
        error_displacement=constants(plan, error @ a),
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


def values_held(plan: Plan) -> dict[str, int]:
    """Return how many values a kernel holds for each sample while it runs: what a scene does not name is not there."""
    n, kind, spring = plan.dofs, METHODS[plan.method].kind, spring_row(plan.law)
    states = 2 + spring.memory  # displacement and velocity of each degree of freedom, and the law's memory
    # Of a memory that stages move, each value has working copies; any other is looked at one storey after another.
    moving = 2 + (spring.memory if spring.rate is not None else min(1, spring.memory))
    dampers = {"none": 0, "storey": n, "rayleigh": n + 1, "rayleigh_tangent": 2, "mass_proportional": 1, "modal": n * n}
    if kind == "exact":
        size = 2 * n
        structure = {"classical": n * n + 8 * n, "general": size * size + 4 * n}[plan.damping]
        working = size
    elif plan.family == "dense":
        structure = (3 * n) ** 2 + 6 * n if kind == "implicit" else 2 * n * n + n
        working = 3 * n if kind == "implicit" else 4 * n
    else:
        structure = n * (1 + spring.coefficients + plan.p_delta) + dampers[plan.damping]
        structure += {"none": 0, "linear": n * (plan.damping not in ("storey", "rayleigh")), "power": VALUES * n}[
            plan.viscous_dampers
        ]
        working = 2 * moving * n
    if kind == "explicit":
        method = tableau(plan)
        working += (moving - 1) * n * method.stages if method.keeps_slopes else 0
    elif kind == "implicit" and plan.family == "chain":
        working = 5 * n  # acceleration, its correction, and the factors of a tridiagonal matrix
    recorders = {
        "drift": n,
        "time_of_peak": n + 2,
        "acceleration": n,
        "base_shear": 1,
        "residual": 0 if "time_of_peak" in plan.recorders else n,
        "energy": 2 * n + 4,
        "displacement": 2 * n,
    }
    return {
        "state": states * n + LOADS[plan.load].noise_states * 8 // np.dtype(plan.dtype).itemsize,  # noise in float64
        "structure": structure,
        "method": working,
        "recorders": sum(recorders.get(name, 0) for name in plan.recorders),
    }


@functools.cache
def structs(dtype_name: str) -> SimpleNamespace:
    """Return the argument structs of all kernels for one dtype; each field is named as the dataset names it."""
    dtype = DTYPES[dtype_name]
    plain = wp.array(dtype=dtype)
    table = wp.array2d(dtype=dtype)
    series = wp.array3d(dtype=dtype)

    class Control:  # one value a launch
        samples: wp.int32
        substeps: wp.int32  # steps in one interval of the motion
        every: wp.int32  # steps between the states that a history keeps
        collapse_drift_ratio: dtype
        tolerance: dtype  # of an adaptive method
        key: wp.uint64  # of the seed of random motions

    class Structure:  # first index as named, last index: structure
        mass: table
        inverse_mass: table
        inverse_height: table
        coefficients: table  # of the storey law, [storey x coefficient, structure]
        storey_damping: table
        viscous_damper: table  # of powers of the velocity, [storey x value, structure]
        storey_weight_over_height: table  # of gravity
        mass_damping: plain  # Rayleigh's factor of the mass, [structure]
        tangent_damping: plain  # and of the tangent stiffness
        damping_matrix: table  # [dof x dof, structure]
        # Where structures go on from an event before: what it left them in.
        initial_displacement: table
        initial_velocity: table
        initial_memory: table  # [storey x memory, structure]
        # A linear system's matrices are those of the nominal system, [dof, dof]; each structure scales them.
        mass_matrix: table
        rate_of_displacement: table  # M^-1 K
        rate_of_velocity: table  # M^-1 C
        flexibility_of_mass: table  # M^-1
        influence: plain  # [dof]
        mass_factor: plain  # [structure]
        damping_factor: plain
        stiffness_factor: plain
        # Of a linear structure in coordinates of its modes, last index: pair of a structure and a step.
        propagator: table  # increments by the state, [row x state, pair]
        load_response: table  # increments by the loads, [row x load x 2, pair]
        mode_shape: (
            table  # storey drift of a chain, [dof x mode, pair]; displacement of a linear system, [dof x mode, 1]
        )
        modal_stiffness: table  # over modal mass, as all but that, [mode, pair]
        modal_damping: table  # [mode, pair], [mode x mode, pair] where modes couple
        modal_load: table  # [mode, pair]
        modal_mass: plain  # [pair]
        initial_state: table  # modal displacements and velocities, [2 x mode, pair]

    class Load:
        values: plain  # all histories end to end, [time x width]
        first: wp.array(dtype=wp.int32)  # where each history starts, [motion]
        intervals: wp.array(dtype=wp.int32)  # intervals between its samples, [motion]
        amplitude: plain  # of a harmonic force, [dof]
        circular_frequency: wp.array(dtype=wp.float64)  # one value
        phase: wp.array(dtype=wp.float64)  # one value
        # Of random motions: growth, kick and start of the process, row by row, its output, and the envelope at nodes.
        noise: wp.array(dtype=wp.float64)
        initial_displacement: plain  # [dof]
        initial_velocity: plain  # [dof]

    class Samples:  # one value a sample of this launch, in the order of its lanes
        output: wp.array(dtype=wp.int32)  # column of the outputs
        number: wp.array(dtype=wp.uint64)  # the sample's index in the run, for random motions
        structure: wp.array(dtype=wp.int32)
        motion: wp.array(dtype=wp.int32)
        scale: plain
        step: plain  # integration step; an adaptive method's longest
        run_intervals: wp.array(dtype=wp.int32)  # intervals of the motion and of the free vibration after it
        residual_steps: wp.array(dtype=wp.int32)  # steps at the end over which the residual is averaged

    class Output:  # last index: sample
        peak_storey_drift: table
        time_of_peak_drift: plain
        storey_of_peak_drift: wp.array(dtype=wp.int32)
        peak_floor_acceleration: table
        peak_base_shear: plain
        residual_drift_ratio: table
        input_energy: plain
        viscous_energy: plain
        hysteretic_energy: table
        energy_balance_error: plain
        peak_displacement: table
        time_of_peak_displacement: table
        peak_acceleration: table
        final_displacement: table  # the state that an event leaves, [dof, sample]
        final_velocity: table
        final_memory: table  # [storey x memory, sample]
        accepted_steps: wp.array(dtype=wp.int32)
        rejected_steps: wp.array(dtype=wp.int32)
        status: wp.array(dtype=wp.int8)

    class History:  # [history, time, dof]
        displacement: series
        velocity: series
        acceleration: series
        storey_force: series

    def as_struct(cls: type):
        cls.__qualname__ = f"{cls.__name__}_{dtype_name}"
        cls.__name__ = cls.__qualname__
        return wp.struct(cls)

    return SimpleNamespace(**{c.__name__: as_struct(c) for c in (Control, Structure, Load, Samples, Output, History)})
