"""The model of a run: all that follows from the scene and the integration settings (kernels, time grids, loads)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from warpdyn.campaigns.integration.chain import ChainDynamics
from warpdyn.campaigns.integration.dense import DenseDynamics
from warpdyn.campaigns.integration.dynamics import Arrays, Dynamics, Vibration
from warpdyn.campaigns.integration.lumped.dynamics import LumpedDynamics
from warpdyn.campaigns.integration.settings import Integration
from warpdyn.engine.kernels import arguments
from warpdyn.engine.kernels.auxiliary.interpolation import interpolated
from warpdyn.engine.kernels.build import as_in_live, composed, fitted, undivided
from warpdyn.engine.kernels.hinges.column_storeys import has_line
from warpdyn.engine.kernels.output_table import RECORDERS, STATE, recorded
from warpdyn.engine.kernels.plan import Plan, memory_of_springs
from warpdyn.engine.kernels.queues import checked_devices
from warpdyn.engine.methods.defaults import FALLBACK
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS, Method, check_fits
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.output_variables import Variable
from warpdyn.model.ground_motions.excitation import Assignment, Timeline
from warpdyn.model.scene.recording.floor_spectra import ABSOLUTE
from warpdyn.model.scene.scene import Scene

# A command acts from the start of a step, and the last stage of these methods is at the end of the step.
METHODS_OF_CONTROL = ("rk4", "heun")
MOST_VALUES = 2**28  # most values of interpolated motions on a GPU: 1 GiB in float32
FAMILIES: dict[str, type[Dynamics]] = {
    "chain": ChainDynamics,
    "lumped": LumpedDynamics,
    "dense": DenseDynamics,
}


def dynamics_of(scene: Scene) -> Dynamics:
    """Return the equation of motion of all structures that a scene can draw."""
    return FAMILIES[scene.structure.family](scene.structure, scene.representative_parameters)


def central_vibration(scene: Scene, dynamics: Dynamics, method: Method) -> Vibration:
    """Return the linear vibration (period, decay, stable step, Rayleigh factors) of the median-parameter structure."""
    return dynamics.vibration_of({name: values[None] for name, values in scene.central_parameters.items()}, method)


def plan_of(scene: Scene, dynamics: Dynamics, method: str, dtype: str, *, is_gpu: bool) -> Plan:
    """Return the plan of the kernel that integrates a scene: its parts, such as law, damping, load and recorders.

    Args:
        scene: The scene.
        dynamics: Equation of motion of the structures.
        method: Name of the integration method.
        dtype: Number type, "float32" or "float64".
        is_gpu: Whether the kernel runs on a GPU.
    """
    is_exact = METHODS[method].kind == "exact"
    of_modes = "general" if dynamics.couples_modes else "classical"
    # Peak drifts decide which samples are run again in float64, and which are run again to check their reliability.
    judging = {dynamics.peak[1]} if dynamics.counts_reversals or dynamics.is_sensitive else set()
    if scene.structure.family == "lumped" and "drift" in scene.recorders:
        judging |= {"spring"}  # storey drifts are the largest deformations of springs
    spectra = scene.floor_spectra
    plan = Plan(
        family=scene.structure.family,
        dofs=scene.structure.dofs,
        law=dynamics.law,
        damping=of_modes if is_exact else dynamics.damping,
        load=scene.excitation.kernel_load,
        recorders=tuple(sorted({*scene.recorders, *judging})),
        method=method,
        dtype=dtype,
        viscous_dampers=dynamics.viscous_dampers,
        physics=() if is_exact else dynamics.physics,
        collapses=scene.collapse_limit is not None or dynamics.has_drift_capacity,
        has_drift_capacity=dynamics.has_drift_capacity,
        starts_displaced=not scene.structure.forgets and bool(np.any(scene.excitation.start[0])),
        records_late=scene.record_from > 0,
        oscillators=len(spectra.periods) if spectra else 0,
        oscillators_are_absolute=spectra is not None and spectra.quantity == ABSOLUTE,
        pattern=dynamics.pattern,
        control=None if scene.control is None else scene.control.rules(scene.structure),
    )
    return as_in_live(fitted(plan, is_gpu), is_gpu=is_gpu)


def check_controlled(method: str, scene: Scene) -> None:
    """Raise a ValueError if a scene has a control and the method does not support it."""
    if scene.control is not None and method not in METHODS_OF_CONTROL:
        raise ValueError(
            f"method {method!r} does not support the control of the scene: give method= one of "
            f"{', '.join(map(repr, METHODS_OF_CONTROL))}"
        )


def plans_of_events(plan: Plan, events: int) -> tuple[Plan, ...]:
    """Return the kernel plan of each event of a sequence.

    In a sequence of several events, each kernel records the final state, and later events start from this state.
    """
    if events == 1:
        return (plan,)
    recorders = (*plan.recorders, STATE)
    later = replace(plan, recorders=recorders, resumes=True, pauses=False)
    return (replace(later, resumes=False), *[later] * (events - 1))


def levels_of(scene: Scene) -> list[Assignment]:
    """Return, for each event, an assignment without samples, which describes the event's intensity measure."""
    nothing = np.arange(0)
    return [scene.excitation.assign(nothing, 0, event) for event in range(len(scene.excitation.event_names))]


def kernel_text(scene: Scene, method: str | None, dtype: str | None, device: str | None) -> str:
    """Return the source text of a scene's kernel (several events: of the first event); keywords: see `simulate`.

    Raises:
        TypeError, ValueError: If `scene` is not a Scene of one structure, or an argument is unknown or not supported.
    """
    check_kind("source", "a Scene", scene, Scene)
    if scene.structure.is_many:
        raise ValueError(
            "source() takes a scene of one structure, got a Portfolio, which runs several "
            "kernels: give a scene with the building of one archetype"
        )
    dynamics, damping = dynamics_of(scene), scene.structure.damping
    is_gpu = checked_devices(device)[0] != "cpu"
    how, error = Integration(method=method, dtype=dtype), dynamics.error_of_float32
    integration = how.settled(dynamics.forces, scene, is_gpu=is_gpu, error_of_float32=error)
    check_fits(integration.method, dynamics.forces, damping)
    check_controlled(integration.method, scene)
    plan = plan_of(scene, dynamics, integration.method, integration.dtype, is_gpu=is_gpu)
    return composed(plans_of_events(plan, len(scene.excitation.event_names))[0]).text


@dataclass(frozen=True, eq=False)
class Model:
    """The way in which all samples of a scene are integrated: equation of motion, method, kernel and time grids.

    Args:
        scene: The scene.
        dynamics: Equation of motion of its structures.
        method: Integration method.
        plan: Plan of the kernel: its parts and number type.
        timeline: Time grid of each motion.
        tolerance: Relative error [1] that an adaptive method allows in a step.
        seed: Seed of every random draw.
        threads: Number of CPU threads.
        refinement: Number of integration steps that replace each step of the default rule.
    """

    scene: Scene
    dynamics: Dynamics
    method: Method
    plan: Plan
    timeline: Timeline
    tolerance: float
    seed: int
    threads: int
    refinement: int = 1
    _loads: dict[tuple[str, str, int], object] = field(default_factory=dict, repr=False)  # cache of loads_on

    @cached_property
    def variables(self) -> dict[str, Variable]:
        """The variables that the scene's recorders fill for each sample, by name."""
        return self._recorded(self.scene.recorders)

    def _recorded(self, recorders: tuple[str, ...]) -> dict[str, Variable]:
        """Return the variables that the given recorders and the method fill for each sample, by name."""
        plan, is_adaptive = self.plan, self.method.is_adaptive
        return recorded(
            plan.family,
            recorders,
            is_adaptive=is_adaptive,
            collapses=plan.collapses,
            has_line=has_line(plan),
            has_storeys=plan.pattern is not None and bool(plan.pattern.storeys),
            is_controlled=plan.control is not None,
        )

    @cached_property
    def demands(self) -> dict[str, Variable]:
        """The recorded variables that are demands, such as peak drifts, by name."""
        table = RECORDERS[self.plan.family]
        return {k: v for row in self.scene.recorders for k, v in table[row].items() if v.is_demand}

    def launched(self, substeps: int) -> tuple[Plan, int]:
        """Return the kernel plan for samples with `substeps` steps per motion interval, and a factor of interpolation.

        On a GPU the motions are interpolated before the launch, so that they have a value for each step. The factor is
        then `substeps`. The factor is 1 if the motions are not interpolated: on a CPU, or if the values need too much
        memory.
        """
        most = self._values * substeps * (substeps + 1) // 2  # includes all smaller numbers of steps
        is_interpolated = self._undivided.undivided and most <= max(self._values, MOST_VALUES)
        return (self._undivided, substeps) if is_interpolated else (self.plan, 1)

    @cached_property
    def _undivided(self) -> Plan:
        """The plan for motions that have a value for each step; equal to `plan` if such motions save no time."""
        return undivided(self.plan)

    @cached_property
    def _values(self) -> int:
        """Number of acceleration or force values, summed over all motions."""
        return sum(motion.values.size for motion in self.timeline.motions)

    @cached_property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of one sample's outputs by name.

        Some outputs are not in the dataset: peak drifts that are needed for the status of a sample, and the final state
        of a sample.
        """
        outputs = self._recorded(self.plan.recorders)
        shapes = {name: tuple(map(self.plan.length, v.dims)) for name, v in outputs.items()} | {"status": ()}
        if STATE in self.plan.recorders:
            dofs = self.plan.dofs
            values = {"displacement": dofs, "velocity": dofs, "memory": memory_of_springs(self.plan)}
            shapes |= {f"final_{name}": (count,) for name, count in values.items() if count}
        return shapes

    @property
    def kernel_name(self) -> str:
        """A description of the kernel in one line: structure, law, damping, load, recorders, method and number type."""
        p = self.plan
        return f"{p.family} {p.dofs} {p.law} {p.damping} {p.load} {'+'.join(p.recorders)} {p.method} {p.dtype}"

    @property
    def needs_step(self) -> bool:
        """Whether the arrays of a structure that the kernel reads depend on the integration step (propagators)."""
        return self.method.kind == "exact" or (self.method.kind == "implicit" and self.dynamics.steps_modes)

    @cached_property
    def by_event(self) -> tuple[Model, ...]:
        """The model of each event: with several events, each records its final state, from which the next one starts.

        All events except the first share one model.
        """
        first, *later = plans_of_events(self.plan, len(self.scene.excitation.event_names))
        if not later:
            return (self,)
        return (replace(self, plan=first), *[replace(self, plan=later[0])] * len(later))

    def in_float64(self, tolerance: float, device: str) -> Model:
        """Return the model in float64 for a device, with another relative tolerance [1] for adaptive methods."""
        plan = fitted(replace(self.plan, dtype="float64"), device != "cpu")
        return replace(self, plan=plan, tolerance=tolerance)

    @property
    def checking(self) -> Model:
        """The model for check runs: by RK4 for multistep methods, whose errors differ in kind; otherwise this model."""
        if not isinstance(self.method, MultistepMethod):
            return self
        return replace(self, plan=replace(self.plan, method=FALLBACK), method=METHODS[FALLBACK])

    def loads_on(self, device: str, finer: int = 1) -> object:
        """Return the motions or forces in the memory of a device; they are copied once for all models of the scene.

        Args:
            device: Name of the device.
            finer: Number of intervals into which each interval of the motions is divided, by linear interpolation.
        """
        place = device, self.plan.dtype, finer
        if place not in self._loads:
            if finer > 1:
                components = 1 if self.plan.pattern is None else self.plan.pattern.components
                self._loads[place] = interpolated(self.loads_on(device), self.plan.dtype, finer, components)
            else:
                self._loads[place] = arguments.brought("Load", self.packed_loads(), self.plan.dtype, device)
        return self._loads[place]

    def packed_loads(self) -> Arrays:
        """Return the arrays of the struct Load by name: motions or forces, floor spectra and control."""
        packed: Arrays = self.scene.excitation.pack(self.timeline, self.plan.dofs)
        packed |= self.scene.floor_spectra.arrays() if self.scene.floor_spectra else {}
        if self.scene.control is not None:
            packed |= self.scene.control.packed(self.scene.structure)
        return packed

    def blank_outputs(self, samples: int, names: Iterable[str] | None = None) -> Arrays:
        """Return uninitialised arrays [sample, ...] for the outputs `names` (None: all outputs), by name."""
        names = self.shapes if names is None else names
        dtype = self.plan.dtype
        return {k: np.empty((samples, *self.shapes[k]), arguments.output_dtype(k, dtype)) for k in names}
