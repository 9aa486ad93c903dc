"""`Plan`, the properties that decide the source of a kernel, and the structs that are arguments of a kernel."""

# No `from __future__ import annotations` in this folder: Warp needs the types of annotations, not their text.

import functools
from collections.abc import Iterable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.controllers.rules import ControlRules
from warpdyn.engine.device.processor import FEWEST_LANES, module_options
from warpdyn.engine.kernels.composing.user_recorders import Recorder, users_of_variables
from warpdyn.engine.kernels.hinges.column_storeys import ColumnStoreys
from warpdyn.engine.kernels.hinges.floor_matrices import FloorMatrices, floor_matrices
from warpdyn.engine.kernels.hinges.frame_storeys import FrameStoreys, frame_storeys
from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.engine.kernels.lumped.pattern import ColumnLine, Pattern
from warpdyn.engine.kernels.lumped.storeys import Storeys, storeys_of
from warpdyn.engine.kernels.pausing.paused_text import FIELDS as FIELDS_OF_PAUSED
from warpdyn.engine.kernels.registry import fields, parts_in
from warpdyn.engine.laws.rate_law import POWERS
from warpdyn.engine.laws.springs import StoreyRules, is_mixed, spring_row
from warpdyn.engine.methods.kinds import ExplicitMethod, ImplicitMethod, MultistepMethod, product
from warpdyn.engine.methods.stability_limits import relaxation_limit
from warpdyn.engine.methods.table import METHODS

WARP = 32  # threads of a GPU that run together and can exchange values
LARGEST_LIMIT = 1e30  # used if there is no limit, because constants of kernels must be finite
LAST_INTERVAL = 2**31 - 1  # an interval after the end of every run
DTYPES = {"float32": wp.float32, "float64": wp.float64}


@dataclass(frozen=True)
class Plan:
    """All properties of a run that decide the source of its kernel; each distinct plan has one kernel.

    Args:
        family: "chain" (storeys in series), "lumped" (springs between any degrees of freedom) or "dense" (full
            matrices).
        dofs: Number of degrees of freedom.
        law: Device functions of the storeys (elastic for the dense family).
        damping: "none", "storey", "rayleigh", "rayleigh_tangent", "mass_proportional" or "modal" (chain); "matrix"
            (dense); "classical" or "general" if the method is exact.
        load: Key of LOADS.
        recorders: Names of recorders, sorted; "state" is among them if the next event starts from the final state.
        method: Key of METHODS.
        dtype: Key of DTYPES.
        lanes: Samples per thread.
        max_unroll: Largest number of iterations of a loop that Warp unrolls.
        sections: Threads that share a sample's storeys on a GPU, a power of 2 (tall chains) or a divisor of the number
            of storeys (lumped structures of equal storeys).
        viscous_dampers: Viscous dampers of a chain: "none", "linear" (computed as storey damping) or "power" (the force
            is a power of the velocity).
        physics: Further parts of the kernel, such as "p_delta" (chain, not with the exact method).
        collapses: Whether the simulation of a sample ends when a storey drift exceeds its capacity (chain).
        has_drift_capacity: Whether storeys have individual drift capacities in addition to the building's limit of the
            drift ratio.
        resumes: Whether each structure starts from its final state in the last event.
        by_storey: Whether the kernel of a lumped structure loops over equal storeys (see lumped/by_storey.py and, for
            frames with hinges, grids/joint_rotations.py).
        undivided: Whether the motions contain one value for each integration step (see `Model.launched`).
        starts_displaced: Whether yielding storeys start at an initial drift, to which they are pushed slowly from rest.
        records_late: Whether peaks are recorded only after a later time than the start of the run (`record_from`).
        oscillators: Number of oscillators on each floor (recorder "floor_spectra").
        oscillators_are_absolute: Whether their absolute accelerations are recorded, not their pseudo-accelerations.
        pauses: Whether the kernel can pause between two intervals of the motion (see kernels/pausing). Its launches
            have a struct Paused as an additional argument.
        pattern: The entries of the matrices of a lumped structure that are not 0; None for other families.
        control: Actuators, sensors and controller of a controlled structure; None without control.
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
    by_storey: bool = False
    undivided: bool = False
    starts_displaced: bool = False
    records_late: bool = False
    oscillators: int = 0
    oscillators_are_absolute: bool = False
    pauses: bool = False
    pattern: Pattern | None = None
    control: ControlRules | None = None

    @property
    def kind(self) -> str:
        """The kind of the integration method: "explicit", "implicit" or "exact"."""
        return METHODS[self.method].kind

    @property
    def storeys_of_thread(self) -> int:
        """Number of storeys per thread; the last threads of a chain may have extra storeys without mass (padding)."""
        return -(-self.dofs // self.sections)

    @property
    def springs_of_thread(self) -> int:
        """Number of springs per thread without biaxial ones: of a chain, one in each storey."""
        if self.frame_storeys is not None:
            return self.storeys_of_thread + self.frame_storeys.of_thread(self.sections).hinges
        return self.storeys_of_thread if self.pattern is None else self.pattern.single_springs // self.sections

    @property
    def storeys(self) -> Storeys | None:
        """The storeys of a lumped structure whose kernel loops over equal storeys; otherwise None."""
        return storeys_of(self.pattern) if self.by_storey and self.pattern is not None else None

    @property
    def frame_storeys(self) -> FrameStoreys | ColumnStoreys | None:
        """The storeys of a frame with hinges whose kernel loops over storeys of members; otherwise None."""
        line = None if self.pattern is None or not self.by_storey else self.pattern.line
        return None if line is None else frame_storeys(line)

    @property
    def line_of_thread(self) -> ColumnLine | JointFrame | None:
        """The layout of the hinges of a frame, or of those that a thread computes."""
        storeys = self.frame_storeys
        return storeys.of_thread(self.sections) if storeys else self.pattern.line if self.pattern else None

    @property
    def floors(self) -> FloorMatrices | None:
        """The matrices of the floors of a frame with hinges that several threads share; otherwise None."""
        if self.pattern is None or self.sections == 1 or self.frame_storeys is None:
            return None
        return floor_matrices(self.pattern, self.sections)

    def threads_of(self, samples: int) -> int:
        """Return the number of threads for a number of samples."""
        if self.pattern is None or self.sections == 1:
            return -(-samples // self.lanes) * self.sections
        return -(-samples // (WARP // self.sections)) * WARP  # some threads of each warp are idle

    def length(self, dim: str) -> int:
        """Return the length of a dimension of the outputs, such as "storey" or "spring"."""
        if dim == "period":
            return self.oscillators
        if dim == "actuator":
            return 0 if self.control is None else len(self.control.actuators)
        if self.pattern is None:
            return self.dofs
        lengths = {"spring": self.pattern.springs, "output": len(self.pattern.resultants)}
        return (lengths | {"storey": len(self.pattern.storeys)}).get(dim, self.dofs)


def options(plan: Plan) -> dict[str, object]:
    """Return the options of the Warp module that contains the kernel of a plan, such as the compiler flags."""
    method = METHODS[plan.method]
    in_registers = plan.family != "dense" and method.kind == "explicit" and not keeps_slopes(method)
    # Loops over a law's many values must be unrolled; otherwise LLVM does not vectorise the lane loops around them.
    is_small = has_few_values(plan) and plan.damping != "modal"
    # Kernels that record histories run few samples. Compile them with the flags of the other kernels, so that Warp does
    # not precompile its headers a second time.
    gains = (plan.lanes > 1 and plan.max_unroll > 1) or plan.recorders == ("history",)
    # If the storeys have several laws, and one law has many values, LLVM unrolls the loops over lanes. Measured in
    # float64 with isolators below storeys of two laws: without fused products, kernels take 0.9 and 1.5 times as long.
    fuses = has_few_values(plan) or not is_mixed(plan.law)
    has_lines = plan.frame_storeys is not None  # the text contains the law of the hinges several times
    return module_options(plan.max_unroll, in_registers and is_small and gains, fuses, has_lines)


def has_few_values(plan: Plan) -> bool:
    """Return whether loops over the memory and the coefficients of the plan's law have fewer iterations than lanes."""
    law = spring_row(plan.law)
    return max(law.memory, law.coefficients) < FEWEST_LANES


def row_types(plan: Plan) -> tuple:
    """Return three vector types with one element per lane: of the plan's dtype, of float64 and of int32.

    A lane is one of the samples that a thread integrates at once.
    """
    return tuple(
        wp.types.vector(length=plan.lanes, dtype=dtype) for dtype in (DTYPES[plan.dtype], wp.float64, wp.int32)
    )


def constants(plan: Plan, values: object) -> object:
    """Return the values as a constant Warp vector in the dtype of the plan."""
    row = np.ravel(values).astype(np.float64)
    return wp.constant(wp.types.vector(length=row.size, dtype=DTYPES[plan.dtype])(*row))


def memory_of_springs(plan: Plan) -> int:
    """Return the number of memory values of all storeys or springs."""
    memory = spring_row(plan.law).memory
    if plan.pattern is None:
        return memory * plan.dofs
    if plan.pattern.biaxial_law is None:
        return memory * plan.pattern.springs
    from warpdyn.engine.laws.biaxial.functions import biaxial_functions

    return (
        memory * plan.pattern.single_springs + biaxial_functions(plan.pattern.biaxial_law).memory * plan.pattern.pairs
    )


def keeps_drifts(plan: Plan) -> bool:
    """Return whether the unknowns of the plan's method are storey drifts (multistep methods)."""
    return isinstance(METHODS[plan.method], MultistepMethod)


def has_joints(plan: Plan) -> bool:
    """Return whether the plan is of a frame with hinges that has several bays."""
    return plan.pattern is not None and isinstance(plan.pattern.line, JointFrame)


def state_of_stage(plan: Plan) -> tuple[str, str]:
    """Return the names of the displacements and velocities of a stage; multistep methods have only accepted states."""
    return ("u", "v") if keeps_drifts(plan) else ("us", "vs")


def holds_step(plan: Plan) -> bool:
    """Return whether each thread integrates one whole sample in equal steps.

    Then the step is read once for a whole run of the sample, unless the forces of the last state are recorded, too.
    """
    return plan.lanes == plan.sections == 1 and not METHODS[plan.method].is_adaptive


def keeps_slopes(method: ExplicitMethod | MultistepMethod) -> bool:
    """Return whether a stage of the method needs the slopes (velocities, accelerations) of several earlier stages."""
    return isinstance(method, ExplicitMethod) and bool(
        method.is_nystroem or method.is_adaptive or np.any(np.tril(np.array(method.a), -2))
    )


def tableau(plan: Plan) -> SimpleNamespace:
    """Return the coefficients and properties of a plan's explicit method as attributes, for its kernel.

    `a`, `weight` and `node` are the Runge-Kutta matrix, the weights of the stages and their times; a multistep method
    has one stage. So has an implicit method; its second time is that at which the equation of motion is satisfied.
    """
    method = METHODS[plan.method]
    if not isinstance(method, ExplicitMethod):
        first = constants(plan, [1.0])
        node = constants(plan, [0.0, method.extension] if isinstance(method, ImplicitMethod) else [0.0])
        properties = {"adaptive": False, "halfway": False, "ends_in_stage": False, "keeps_slopes": False}
        return SimpleNamespace(stages=1, weight=first, first_stage=first, node=node, **properties)
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
        reach=constants(plan, [*np.diag(a, -1), 0.0]),  # coefficient of a stage's slope in the next stage
        node=constants(plan, method.c),
        first_stage=constants(plan, np.eye(stages)[0]),
        # Row s + 1 of a gives the start of stage s + 1; the row after the last stage gives the end of the step.
        a=constants(plan, np.vstack([a, method.b])),
        a_displacement=constants(plan, np.vstack([method.displacement_a, method.displacement_b])),
        ends=constants(plan, [*method.c, 1.0]),
        error=constants(plan, error),
        error_displacement=constants(plan, product(error, a)),
    )


def settling_polynomial(plan: Plan) -> tuple[float, ...]:
    """Return the coefficients of R(-rate * step), lowest power first, for the method of a plan.

    R is the factor per step by which the method multiplies a value that decays at this rate. Implicit methods integrate
    the memory of a storey law by the classical method RK4, so its polynomial is returned for them.
    """
    method = METHODS[plan.method]
    polynomial = (method if method.kind == "explicit" else METHODS["rk4"]).stability_polynomial
    return polynomial + (0.0,) * (POWERS - len(polynomial))


def settling_limit(plan: Plan) -> float:
    """Return the largest product of decay rate and step at which errors in the memory of a storey law do not grow."""
    return min(relaxation_limit(METHODS[plan.method]), LARGEST_LIMIT)


# Folder of a part -> category in `values_held`.
HELD = {"loads": "state", "control": "structure", "dampings": "structure", "parts": "structure", "lumped": "structure"}
HELD |= {"stepping": "method", "hinges": "method", "grids": "method", "bilinear_hinges": "method"}
HELD |= {"recorders": "recorders"}


def values_held(plan: Plan) -> dict[str, int]:
    """Return the number of values that a kernel keeps in registers or local memory per sample: {category: number}.

    The categories are "state", "structure", "method" and "recorders".
    """
    n, kind, spring = plan.dofs, plan.kind, spring_row(plan.law)
    # Displacement and velocity of each degree of freedom, and the law's memory.
    held = {"state": (2 + spring.memory) * n, "structure": 0, "method": 0, "recorders": 0}
    # If the stages of a method change the memory, the kernel keeps working copies of each memory value.
    moving = 2 + (spring.memory if spring.rate is not None else min(1, spring.memory))
    if plan.pattern is not None:
        single, pattern = plan.pattern.single_springs, plan.pattern
        held["state"] = 2 * n + spring.memory * single
        held["structure"] = spring.coefficients * single + pattern.values + pattern.values_of_pairs
        held["method"] = 4 * n + 3 * pattern.springs
    elif kind == "exact":
        size = 2 * n
        held["structure"] = {"classical": n * n + 8 * n, "general": size * size + 4 * n}[plan.damping]
        held["method"] = size
    elif plan.family == "dense":
        held["structure"] = (3 * n) ** 2 + 6 * n if kind == "implicit" else 2 * n * n + n
        held["method"] = 3 * n if kind == "implicit" else 4 * n
    else:
        held["structure"] = n * (1 + spring.coefficients)
        held["method"] = 2 * moving * n
    if keeps_drifts(plan):
        held["method"] = 4 * n  # drift without the correction, two earlier changes, acceleration
    elif kind == "explicit":
        method = tableau(plan)
        held["method"] += (moving - 1) * n * method.stages if method.keeps_slopes else 0
    elif kind == "implicit" and plan.family == "chain":
        held["method"] = 5 * n  # acceleration, its correction, and the factors of a tridiagonal matrix
    for folder, name in HELD.items():
        parts = [part for part in parts_in(folder) if hasattr(part, "values_held") and part.wanted(plan)]
        held[name] += sum(part.values_held(plan) for part in parts)
    return held


def structs(dtype_name: str, users: tuple[type[Recorder], ...] = ()) -> SimpleNamespace:
    """Return the argument structs of kernels for one dtype: Control, Samples, Structure, Load, Output and History.

    The fields of Output have the names of the variables in the dataset.

    Args:
        dtype_name: Key of DTYPES.
        users: Recorders of users; the struct Output contains their variables. Kernels without these recorders use a
            struct without the variables, so that they need not be compiled again.
    """
    return _structs(dtype_name, users)


@functools.cache
def _structs(dtype_name: str, users: tuple[type[Recorder], ...]) -> SimpleNamespace:
    found = fields(users)
    if users:
        name = "_".join(("Output", dtype_name, *(each.part_name for each in users)))
        return SimpleNamespace(
            **vars(_structs(dtype_name, ())) | {"Output": _struct(name, found["Output"], dtype_name)}
        )
    return SimpleNamespace(
        **{name: _struct(f"{name}_{dtype_name}", types, dtype_name) for name, types in found.items()}
    )


def output_struct(dtype_name: str, names: Iterable[str]) -> Any:
    """Return the Warp struct Output with fields for these output variables."""
    return structs(dtype_name, users_of_variables(names)).Output


@functools.cache
def paused_struct(dtype_name: str) -> Any:
    """Return the Warp struct Paused: the interval at which a kernel begins, and its variables at this interval."""
    return _struct(f"Paused_{dtype_name}", FIELDS_OF_PAUSED, dtype_name)


def whole_run(plan: Plan) -> list[Any]:
    """Return the additional arguments of a launch that integrates without a pause: for a kernel that can pause, one."""
    if not plan.pauses:
        return []
    paused = paused_struct(plan.dtype)()
    paused.first, paused.last, paused.stores = 0, LAST_INTERVAL, 0
    return [paused]


def _struct(name: str, types: dict[str, str], dtype_name: str) -> type:
    annotations = {field: _field_type(type_name, DTYPES[dtype_name]) for field, type_name in types.items()}
    return wp.struct(type(name, (), {"__annotations__": annotations, "__module__": __name__}))


def _field_type(type_name: str, dtype: type) -> object:
    """Return the Warp type of a text: "float" is the kernel's dtype, "float[,]" a two-dimensional array of it."""
    scalar, bracket, commas = type_name.partition("[")
    element = dtype if scalar == "float" else getattr(wp, scalar)
    return wp.array(dtype=element, ndim=1 + commas.count(",")) if bracket else element
