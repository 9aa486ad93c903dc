"""Settings of a run besides its scene: how it is integrated, and where."""

from __future__ import annotations

import collections.abc
from dataclasses import dataclass, field, replace
from typing import Any, Self

from warpdyn.engine.kernels.queues import checked_devices
from warpdyn.engine.methods.defaults import MEASURED_DAMPING_RATIO, default_method
from warpdyn.engine.methods.table import METHODS, StoreyForces
from warpdyn.foundations.core.checks import one_of, real_number, whole_number
from warpdyn.foundations.core.thread_pool import MOST_THREADS, cores
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

ON_UNSTABLE = ("substep", "raise", "flag")
DTYPES = ("float32", "float64")
LEAST_TOLERANCE = {"float32": 1e-7, "float64": 1e-14}  # below it a step's error estimate is rounding alone
DEFAULT_TOLERANCE = 1e-6  # of an adaptive method
LEAST_ERROR = 1e-8  # least target error


@dataclass(frozen=True, kw_only=True)
class Integration:
    """How samples are integrated; arguments as of `simulate`.

    Args:
        left_open: Which of "method" and "dtype" are chosen for the target error, or, without one, whether the method
            is the default of the scene's law.
        divides_steps: Whether the caller left the steps open, so that they are divided where a sample needs it.
        refinement: Number of steps that are taken in each step of the default rule, which is RK4's.
        reason: Why the method is the default of the law; "" where it, or a step, is given.
    """

    method: str = "rk4"
    dtype: str = "float32"
    step: float | None = None
    longest_step: float | None = None
    resample: bool = False
    tolerance: float | None = None
    target_error: float | None = None
    on_unstable: str = "substep"
    left_open: tuple[str, ...] = ()
    divides_steps: bool = False
    refinement: int = 1
    reason: str = ""

    def __post_init__(self) -> None:
        one_of("on_unstable", self.on_unstable, ON_UNSTABLE)
        one_of("method", self.method, METHODS)
        one_of("dtype", self.dtype, DTYPES)
        if not isinstance(self.resample, bool):
            raise TypeError(f"resample must be True or False, got {self.resample!r}")
        for name in ("step", "longest_step"):
            if getattr(self, name) is not None:
                real_number(f"{name} [s]", getattr(self, name), above=0)
        if self.tolerance is not None:
            self._check_tolerance(self.tolerance)

    def _check_tolerance(self, tolerance: float) -> None:
        if not METHODS[self.method].is_adaptive:
            adaptive = [name for name, other in METHODS.items() if other.is_adaptive]
            raise ValueError(f"method {self.method!r} takes no tolerance; these do: {', '.join(adaptive)}")
        least = LEAST_TOLERANCE[self.dtype]
        if not least <= real_number("tolerance", tolerance, above=0) <= 1:
            raise ValueError(f"tolerance must be from {least:g} ({self.dtype}) to 1, got {tolerance:g}")

    @classmethod
    def from_arguments(
        cls, *, method: str | None, dtype: str | None, target_error: float | None, **rest: object
    ) -> Self:
        """Return the settings of `simulate`'s arguments, with defaults in place of None."""
        given = {"method": method, "dtype": dtype}
        if target_error is not None:
            check_target_error(target_error)
            if any(rest.get(name) is not None for name in ("step", "longest_step", "tolerance")):
                raise ValueError(
                    "target_error chooses the step: give simulate() no step, longest_step or tolerance beside it"
                )
        is_stepped = any(rest.get(name) is not None for name in ("step", "longest_step", "tolerance"))
        # Without a target error the dtype is the default, as if it were given, and so is the method beside a step:
        # the table of default methods is of default steps.
        chosen = ("method", "dtype") if target_error is not None else () if is_stepped else ("method",)
        left_open = tuple(name for name in chosen if given[name] is None)
        settled: dict[str, Any] = {name: value for name, value in given.items() if value is not None} | rest
        found = cls(target_error=target_error, left_open=left_open, **settled)
        return replace(found, divides_steps=found.on_unstable == "substep" and not found.is_stepped)

    def settled(self, forces: StoreyForces, structure: Structure, *, is_gpu: bool) -> Self:
        """Return the settings with the default method of a structure, where neither method nor step is given.

        Args:
            forces: Storey forces that the method must fit.
            structure: The nominal structure.
            is_gpu: Whether it is run on a GPU.
        """
        if "method" not in self.left_open or self.target_error is not None:
            return self
        default = default_method(forces, measured_dampings(structure), is_gpu=is_gpu)
        chosen: dict[str, Any] = {"method": default.method, "refinement": default.steps, "reason": default.reason}
        return replace(self, left_open=(), **chosen)

    @property
    def is_stepped(self) -> bool:
        """Whether the caller determines the step, directly or by a target error."""
        return any(value is not None for value in (self.step, self.longest_step, self.target_error))


@dataclass(frozen=True, kw_only=True)
class Execution:
    """Devices, threads and memory of a run; arguments as of `simulate`.

    Attributes:
        devices: Devices that the samples are divided among.
        cores: CPU threads that are used.
    """

    device: str | collections.abc.Sequence[str] | None = None
    threads: int | None = None
    memory: int | None = None
    devices: tuple[str, ...] = field(init=False)
    cores: int = field(init=False)

    def __post_init__(self) -> None:
        if self.memory is not None:
            whole_number("memory [bytes]", self.memory, 1)
        found = cores() if self.threads is None else whole_number("threads", self.threads, 1, MOST_THREADS)
        object.__setattr__(self, "cores", found)
        object.__setattr__(self, "devices", checked_devices(self.device))

    @property
    def is_gpu(self) -> bool:
        """Whether samples are run on GPUs."""
        return self.devices[0] != "cpu"

    def on_first(self) -> Self:
        """Return the same with the first device alone."""
        return replace(self, device=self.devices[0])


def measured_dampings(structure: Structure) -> tuple[str, ...]:
    """Return the kinds of damping of the table of default methods that a structure has.

    A building counts as undamped, the least accurate case, if its damping ratio is below that of the measured buildings
    or if its Rayleigh damping has this ratio in other modes than the first two: its higher modes have less damping.
    """
    if not isinstance(structure, ShearBuilding):
        return (structure.damping,)
    kind, inherent = structure.damping, structure.inherent_damping
    ratio = structure.parameters.get("damping_ratio")
    is_less = ratio is not None and float(ratio.min()) < MEASURED_DAMPING_RATIO
    other_modes = inherent.modes is not None and inherent.modes != (1, min(2, structure.storeys))
    if is_less or other_modes or inherent.storeys is not None:
        kind = "none"
    return (kind, "storey") if "viscous_damper" in structure.devices and kind != "storey" else (kind,)


def check_target_error(target_error: float) -> None:
    """Raise an error unless a target error is within the range that can be kept."""
    if not LEAST_ERROR <= real_number("target_error", target_error, above=0) < 1:
        raise ValueError(f"target_error must be a relative error from {LEAST_ERROR:g} to below 1, got {target_error}")
