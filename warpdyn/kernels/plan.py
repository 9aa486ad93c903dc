"""What a kernel is built from, and the structs through which it is fed."""

# No `from __future__ import annotations` in this folder: warp reads annotations as live types.

import functools
from dataclasses import dataclass
from types import SimpleNamespace

import warp as wp

from warpdyn.methods import METHODS
from warpdyn.stability import stability_limit

DTYPES = {"float32": wp.float32, "float64": wp.float64}


@dataclass(frozen=True)
class Plan:
    """Everything that decides a kernel's source: one kernel is built and compiled for each distinct plan.

    Args:
        family: "chain" (storeys in series) or "dense" (full matrices).
        dofs: Degrees of freedom.
        law: Row of SPRINGS ("elastic" for the dense family).
        damping: "none", "storey", "rayleigh" or "modal" (chain); "matrix" (dense).
        load: Row of LOADS.
        recorders: Rows of RECORDERS, sorted.
        method: Row of METHODS.
        dtype: Row of DTYPES.
        lanes: Samples a thread carries.
        max_unroll: Loops up to this count are unrolled before the compiler sees them.
    """

    family: str
    dofs: int
    law: str
    damping: str
    load: str
    recorders: tuple[str, ...]
    method: str
    dtype: str
    lanes: int
    max_unroll: int


def row_types(plan: Plan) -> tuple:
    """Return types of one value a lane: of the plan's dtype, of float64, of whole numbers."""
    return tuple(
        wp.types.vector(length=plan.lanes, dtype=dtype) for dtype in (DTYPES[plan.dtype], wp.float64, wp.int32)
    )


def tableau(plan: Plan) -> tuple:
    """Return a method's constants: stages, weights b, the next stage's a, times c, and 1 at the first stage alone."""
    method = METHODS[plan.method]
    stages = method.stages
    vector = wp.types.vector(length=stages, dtype=DTYPES[plan.dtype])
    reach = [method.a[stage + 1][stage] for stage in range(stages - 1)]
    rows = (method.b, (*reach, 0.0), method.c, (1.0, *[0.0] * (stages - 1)))
    return stages, *(wp.constant(vector(*row)) for row in rows)


def stiff_limit(plan: Plan) -> float:
    """Return the longest stable step times rate of y' = -rate y: the limit of a law whose memory settles by itself."""
    return stability_limit(METHODS[plan.method].stability_polynomial, 1.0)


@functools.cache
def structs(dtype_name: str) -> SimpleNamespace:
    """Return the argument structs of all kernels for one dtype; each field is named as the dataset names it."""
    dtype = DTYPES[dtype_name]
    plain = wp.array(dtype=dtype)
    table = wp.array2d(dtype=dtype)
    series = wp.array3d(dtype=dtype)

    class Structure:  # first index as named, last index: structure
        mass: table
        inverse_mass: table
        inverse_height: table
        coefficients: table  # of the storey law, [storey x coefficient, structure]
        storey_damping: table
        mass_damping: plain  # Rayleigh's factor of the mass, [structure]
        damping_matrix: table  # [dof x dof, structure]
        # A linear system's matrices are those of the nominal system, [dof, dof]; each structure scales them.
        mass_matrix: table
        rate_of_displacement: table  # M^-1 K
        rate_of_velocity: table  # M^-1 C
        flexibility_of_mass: table  # M^-1
        influence: plain  # [dof]
        mass_factor: plain  # [structure]
        damping_factor: plain
        stiffness_factor: plain

    class Load:
        values: plain  # all histories end to end, [time x width]
        first: wp.array(dtype=wp.int32)  # where each history starts, [motion]
        intervals: wp.array(dtype=wp.int32)  # intervals between its samples, [motion]
        step: plain  # integration step, [motion]
        amplitude: plain  # of a harmonic force, [dof]
        circular_frequency: wp.array(dtype=wp.float64)  # one value
        phase: wp.array(dtype=wp.float64)  # one value
        initial_displacement: plain  # [dof]
        initial_velocity: plain  # [dof]

    class Samples:  # one value a sample of this launch, in the order of its lanes
        output: wp.array(dtype=wp.int32)  # column of the outputs
        structure: wp.array(dtype=wp.int32)
        motion: wp.array(dtype=wp.int32)
        scale: plain
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

    return SimpleNamespace(**{c.__name__: as_struct(c) for c in (Structure, Load, Samples, Output, History)})
