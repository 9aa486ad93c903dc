"""Settings of a run in addition to its scene: `Integration` (method, step, number type) and `Execution` (devices)."""

from __future__ import annotations

import collections.abc
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from warpdyn.engine.kernels.lumped.division import has_grid_kernel
from warpdyn.engine.kernels.queues import checked_devices, free_memory
from warpdyn.engine.laws.devices.parameters import ViscousDamper
from warpdyn.engine.methods.defaults import (
    FALLBACK,
    HIGHEST_LIGHT_MODE,
    LIGHT_RATIO,
    LIGHT_RAYLEIGH,
    MEASURED_DAMPING_RATIO,
    STEPS_OF_MULTISTEP,
    default_method,
)
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS, StoreyForces
from warpdyn.foundations.core.checks import one_of, real_number, true_or_false, whole_number
from warpdyn.foundations.core.thread_pool import MOST_THREADS, cores
from warpdyn.model.ground_motions.event_sequences import EventSequence
from warpdyn.model.ground_motions.filtered_noise import FilteredNoise
from warpdyn.model.scene.normal_variables.noise import NoiseOfNormals
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

if TYPE_CHECKING:
    from distributed import Client

    from warpdyn.model.scene.scene import Scene

ON_UNSTABLE = ("substep", "raise", "flag")
DTYPES = ("float32", "float64")
LEAST_TOLERANCE = {"float32": 1e-7, "float64": 1e-14}  # with a smaller one, the error estimate of a step is rounding
DEFAULT_TOLERANCE = 1e-6  # relative error that an adaptive method allows in a step [1]
LEAST_ERROR = 1e-8  # least target error [1]


@dataclass(frozen=True, kw_only=True)
class Integration:
    """Settings that decide how the samples of a run are integrated: method, step, number type and stability.

    Args:
        method: Name of the integration method, such as "rk4". None: if `target_error` is given, `plan` chooses.
            Otherwise, if no step is given, the cheapest method whose measured error is at most that of "rk4" for the
            scene's storey laws; the recorders and the processor of the run (CPU or GPU) decide which is cheapest. The
            attributes `method` and `method_chosen_because` of the run contain the method and the reason.
        dtype: Number type, "float32" or "float64". None: the choice for `target_error`, or "float32"; "float64" for a
            LumpedStructure in which float32 would be inaccurate, such as a tall flexural-shear building.
        step: Integration step [s], which must divide the step of every motion; None: chosen for each motion.
        longest_step: Upper bound of the chosen steps [s], instead of the default rule.
        resample: Whether a motion whose step is not a multiple of `step` is resampled at `step`. Resampling cuts the
            peaks of the motion.
        tolerance: Relative error [1] that an adaptive method allows in a step (default 1e-6). Its steps are never
            longer than those of other methods.
        target_error: Bound [1] on the relative error of peak drifts, for 95 % of the samples. A pilot run of a few
            samples chooses the step; it also chooses method and dtype if they are not given. None: no pilot run.
        on_unstable: Action if the step is beyond the stability limit of a structure. "substep": the samples of
            the structure use the smallest stable number of steps in each interval of the record. "raise": an error
            before any sample runs. "flag": the status of the samples is unstable_step. If a step turns out to be too
            long only during the run, "substep" runs the sample again with shorter steps, up to a limit on the cost;
            "raise" and "flag" do not.
    Raises:
        ValueError: If a name is unknown, a number is out of its range, or arguments contradict each other.
        TypeError: If an argument is of another type.

    Example:
        >>> exact = wd.Integration(method="rk4", dtype="float64", step=0.005)
        >>> float(wd.simulate(scene, structures=3, integration=exact)["integration_step"][0])
        0.005
    """

    method: str | None = None
    dtype: str | None = None
    step: float | None = None
    longest_step: float | None = None
    resample: bool = False
    tolerance: float | None = None
    target_error: float | None = None
    on_unstable: str = "substep"

    def __post_init__(self) -> None:
        if self.target_error is not None:
            check_target_error(self.target_error)
            if any(each is not None for each in (self.step, self.longest_step, self.tolerance)):
                raise ValueError(
                    "target_error chooses the step: remove target_error, or remove step, longest_step and tolerance"
                )
        elif any(each is not None for each in (self.step, self.longest_step, self.tolerance)):
            # If a step is given, the default method is FALLBACK, because others were measured at default steps only.
            object.__setattr__(self, "method", self.method or FALLBACK)
        self._check()

    def _check(self) -> None:
        """Raise an error if a setting is out of its range."""
        one_of("on_unstable", self.on_unstable, ON_UNSTABLE)
        if self.method is not None:
            one_of("method", self.method, METHODS)
        if self.dtype is not None:
            one_of("dtype", self.dtype, DTYPES)
        true_or_false("resample", self.resample)
        for name in ("step", "longest_step"):
            if getattr(self, name) is not None:
                real_number(f"{name} [s]", getattr(self, name), above=0)
        if self.tolerance is None:
            return
        if not METHODS[self.nominal_method].is_adaptive:
            adaptive = [name for name, other in METHODS.items() if other.is_adaptive]
            raise ValueError(
                f"method {self.nominal_method!r} does not use a tolerance: remove tolerance=, or choose "
                f"{', '.join(adaptive)}"
            )
        dtype = self.dtype or "float32"
        if not LEAST_TOLERANCE[dtype] <= real_number("tolerance", self.tolerance, above=0) <= 1:
            raise ValueError(
                f"tolerance must be from {LEAST_TOLERANCE[dtype]:g} ({dtype}) to 1, got {self.tolerance:g}"
            )

    @property
    def nominal_method(self) -> str:
        """Name of the method; "rk4" if the method is not chosen yet."""
        return self.method or FALLBACK

    @property
    def is_stepped(self) -> bool:
        """Whether the user determines the step, directly or by a target error."""
        return any(value is not None for value in (self.step, self.longest_step, self.target_error))

    def settled(self, forces: StoreyForces, scene: Scene, *, is_gpu: bool, error_of_float32: float = 0.0) -> Settled:
        """Return the settings for a scene, with the default method if none is given, and the refinement of steps.

        Args:
            forces: Properties of the storey forces that the method must support.
            scene: The scene.
            is_gpu: Whether the structure is integrated on a GPU.
            error_of_float32: Estimated relative error of float32 if it is too large for a default [1]; otherwise 0.
        """
        default_dtype = "float64" if error_of_float32 else "float32"
        chosen: dict[str, Any] = {"method": self.nominal_method, "dtype": self.dtype or default_dtype}
        if self.method is None and self.target_error is None and scene.control is None:
            default = default_method(
                forces,
                measured_dampings(scene.structure),
                is_gpu=is_gpu,
                records_only_drifts=scene.recorders == ("drift",) and scene.collapse_limit is None,
                is_noise=isinstance(scene.excitation, FilteredNoise | NoiseOfNormals),
                is_grid=is_grid(scene),
            )
            chosen |= {"method": default.method, "refinement": default.steps, "reason": default.reason}
        elif isinstance(METHODS[chosen["method"]], MultistepMethod) and not self.is_stepped:
            chosen |= {"refinement": STEPS_OF_MULTISTEP}
        divides = self.on_unstable == "substep" and not self.is_stepped
        return Settled(**vars(self) | chosen, divides_steps=divides)


def is_grid(scene: Scene) -> bool:
    """Return whether the kernel of grids applies to the structure, a frame or a fish-bone with hinges."""
    structure: Any = scene.structure
    line = getattr(structure, "column_line", None)
    if isinstance(scene.excitation, EventSequence) or not has_grid_kernel(line, scene.recorders):
        return False
    return len({row["law"] for row in structure.hinges.values()}) == 1


@dataclass(frozen=True, kw_only=True)
class Settled(Integration):
    """Settings for the integration of a scene of one structure, in which method and number type are decided.

    Args:
        divides_steps: Whether steps that are too long for a sample may be divided; False if the user gave a step.
        refinement: Number of integration steps that replace each default step of RK4.
        reason: Reason why this method is the default for the law; empty if the user gave the method or a step.
    """

    method: str = FALLBACK
    dtype: str = "float32"
    divides_steps: bool = False
    refinement: int = 1
    reason: str = ""

    def __post_init__(self) -> None:
        self._check()


@dataclass(frozen=True, kw_only=True)
class Execution:
    """Settings that decide where a run is executed: devices, threads, memory, cluster.

    Args:
        device: "cpu" or "cuda:0"; several GPUs as ["cuda:0", "cuda:1"], or "cuda" for all GPUs. Several GPUs share the
            samples of the run. None: the first GPU, or the CPU if there is no GPU.
        threads: Number of CPU threads; None: every core that this process may use.
        memory: Memory [bytes] that the blocks of samples in progress may use on the host, and on each device; None: a
            share of the free memory. `histories` must fit in this memory, too. A dataset that is returned in memory
            does not count.
        cluster: Client of a `dask.distributed` cluster, whose workers integrate the samples in parts (regions).
            `device`, `threads` and `memory` then apply to each worker; by default a worker uses its first GPU and the
            number of threads that it was started with. Results are bit-identical to those of this process. If a worker
            dies, its regions are run again. None: this process integrates all samples.

    Raises:
        ValueError: If a number is out of its range.

    Example:
        >>> two = wd.Execution(device="cpu", threads=2)
        >>> wd.simulate(scene, structures=3, execution=two).attrs["device"].split()[0]
        'cpu'
    """

    device: str | collections.abc.Sequence[str] | None = None
    threads: int | None = None
    memory: int | None = None
    cluster: Client | None = None

    def __post_init__(self) -> None:
        if self.memory is not None:
            whole_number("memory [bytes]", self.memory, 1)
        if self.threads is not None:
            whole_number("threads", self.threads, 1, MOST_THREADS)

    @cached_property
    def devices(self) -> tuple[str, ...]:
        """Names of the devices of this process among which the samples are divided."""
        return checked_devices(self.device)

    @cached_property
    def free_on_devices(self) -> int:
        """Smallest free memory of the devices [bytes]; it is read once, because a busy GPU needs 80 ms to answer."""
        return min(free_memory(name) for name in self.devices)

    @property
    def cores(self) -> int:
        """Number of CPU threads that are used."""
        return cores() if self.threads is None else int(self.threads)

    @property
    def is_gpu(self) -> bool:
        """Whether samples are integrated on GPUs."""
        return self.devices[0] != "cpu"

    def on_first(self) -> Self:
        """Return these settings with the first device only."""
        return replace(self, device=self.devices[0])


def measured_dampings(structure: Structure) -> tuple[str, ...]:
    """Return the kinds of damping, in the table of default methods, that apply to a structure.

    The table was measured with damping of 5 % of critical in the first two modes. If a building has a lower damping
    ratio, or Rayleigh damping in other modes, its higher modes have less damping than the measured buildings. Then it
    counts as lightly damped by Rayleigh damping, or as undamped (the least accurate case). Viscous dampers whose force
    is a power of the velocity were not measured.
    """
    if not isinstance(structure, ShearBuilding):
        return (structure.damping,)
    kind, inherent = structure.damping, structure.inherent_damping
    ratio = structure.parameters.get("damping_ratio")
    is_less = ratio is not None and float(ratio.min()) < MEASURED_DAMPING_RATIO
    modes = inherent.modes
    other_modes = modes is not None and modes != (1, min(2, structure.storeys))
    if is_less or other_modes or inherent.storeys is not None:
        is_light = (
            kind == "rayleigh" and inherent.storeys is None and (modes is None or max(modes) <= HIGHEST_LIGHT_MODE)
        )
        is_light = is_light and ratio is not None and float(ratio.min()) >= LIGHT_RATIO
        kind = LIGHT_RAYLEIGH if is_light else "none"
    if ViscousDamper.name not in structure.devices:
        return (kind,)
    is_linear = bool(np.all(structure.parameters["velocity_exponent"] == 1.0))
    return tuple(dict.fromkeys((kind, "storey" if is_linear else "power of the velocity")))


def check_target_error(target_error: float) -> None:
    """Raise an error unless a target error [1] is from LEAST_ERROR to below 1."""
    if not LEAST_ERROR <= real_number("target_error", target_error, above=0) < 1:
        raise ValueError(f"target_error must be a relative error from {LEAST_ERROR:g} to below 1, got {target_error}")
