"""The model of a run: everything that follows from the scene and the integration settings, computed once."""

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
from warpdyn.engine.kernels.build import composed, fitted, undivided
from warpdyn.engine.kernels.output_table import RECORDERS, STATE, recorded
from warpdyn.engine.kernels.plan import Plan, memory_of_springs
from warpdyn.engine.kernels.queues import checked_devices
from warpdyn.engine.methods.defaults import FALLBACK
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS, Method, check_fits
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.output_variables import Variable
from warpdyn.model.ground_motions.excitation import Assignment, Timeline
from warpdyn.model.scene.scene import Scene

MOST_VALUES = 2**28  # values of interpolated motions on a GPU: 1 GiB in float32
FAMILIES: dict[str, type[Dynamics]] = {
    "chain": ChainDynamics,
    "lumped": LumpedDynamics,
    "dense": DenseDynamics,
}


def dynamics_of(scene: Scene) -> Dynamics:
    """Return the equation of motion of all structures that a scene can draw."""
    return FAMILIES[scene.structure.family](scene.structure, scene.representative_parameters)


def central_vibration(scene: Scene, dynamics: Dynamics, method: Method) -> Vibration:
    """Return the vibration of the structure with median parameters."""
    return dynamics.vibration_of({name: values[None] for name, values in scene.central_parameters.items()}, method)


def plan_of(scene: Scene, dynamics: Dynamics, method: str, dtype: str, *, is_gpu: bool) -> Plan:
    """Return the plan of the kernel that integrates a scene."""
    is_exact = METHODS[method].kind == "exact"
    of_modes = "general" if dynamics.couples_modes else "classical"
    # Peak drifts decide which samples are run again: in float64, or to find out whether they are reliable.
    judging = {dynamics.peak[1]} if dynamics.counts_reversals or dynamics.is_sensitive else set()
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
        pattern=dynamics.pattern,
    )
    return fitted(plan, is_gpu)


def plans_of_events(plan: Plan, events: int) -> tuple[Plan, ...]:
    """Return the plan of each event; each of several events records its final state, and later ones start from one."""
    if events == 1:
        return (plan,)
    recorders = (*plan.recorders, STATE)
    later = replace(plan, recorders=recorders, resumes=True)
    return (replace(later, resumes=False), *[later] * (events - 1))


def levels_of(scene: Scene) -> list[Assignment]:
    """Return an assignment without samples for each event, which describes the intensity measure of the event."""
    nothing = np.arange(0)
    return [scene.excitation.assign(nothing, 0, event) for event in range(len(scene.excitation.event_names))]


def kernel_text(scene: Scene, method: str | None, dtype: str | None, device: str | None) -> str:
    """Return the text of a scene's kernel, of its first event if it has several; the keywords are those of `simulate`.

    Raises:
        TypeError, ValueError: If `scene` is not a Scene of one structure, or an argument is unknown or does not fit it.
    """
    check_kind("source", "a Scene", scene, Scene)
    if scene.structure.is_many:
        raise ValueError(
            "source() takes a scene of one structure, got a Portfolio, which runs several "
            "kernels: give a scene with the building of one archetype"
        )
    dynamics, damping = dynamics_of(scene), scene.structure.damping
    is_gpu = checked_devices(device)[0] != "cpu"
    integration = Integration(method=method, dtype=dtype).settled(dynamics.forces, scene.structure, is_gpu=is_gpu)
    check_fits(integration.method, dynamics.forces, damping)
    plan = plan_of(scene, dynamics, integration.method, integration.dtype, is_gpu=is_gpu)
    return composed(plans_of_events(plan, len(scene.excitation.event_names))[0]).text


@dataclass(frozen=True, eq=False)
class Model:
    """How all samples of a scene are integrated.

    Args:
        scene: The scene.
        dynamics: The equation of motion of its structures.
        method: Integration method.
        plan: The kernel's plan.
        timeline: Time grid of each motion.
        tolerance: Relative error that an adaptive method allows in a step.
        seed: Seed of every random draw.
        threads: CPU threads.
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
    _loads: dict[tuple[str, str, int], object] = field(default_factory=dict, repr=False)  # loads_on

    @cached_property
    def variables(self) -> dict[str, Variable]:
        """The variables that are recorded of each sample, by name."""
        return self._recorded(self.scene.recorders)

    def _recorded(self, recorders: tuple[str, ...]) -> dict[str, Variable]:
        """Return the variables that some recorders and the method fill."""
        plan, is_adaptive = self.plan, self.method.is_adaptive
        return recorded(plan.family, recorders, is_adaptive=is_adaptive, collapses=plan.collapses)

    @cached_property
    def demands(self) -> dict[str, Variable]:
        """The recorded variables that are demands."""
        table = RECORDERS[self.plan.family]
        return {k: v for row in self.scene.recorders for k, v in table[row].items() if v.is_demand}

    def launched(self, substeps: int) -> tuple[Plan, int]:
        """Return the plan of the kernel for samples with this number of steps per interval, and its `finer` motions.

        On a GPU the motions are interpolated before the launch, so that they have a value for each step, unless these
        values take too much memory.
        """
        most = self._values * substeps * (substeps + 1) // 2  # with all smaller numbers of steps
        is_interpolated = self._undivided.undivided and most <= max(self._values, MOST_VALUES)
        return (self._undivided, substeps) if is_interpolated else (self.plan, 1)

    @cached_property
    def _undivided(self) -> Plan:
        """The plan for motions that have a value for each step; `plan` where it gains nothing."""
        return undivided(self.plan)

    @cached_property
    def _values(self) -> int:
        """Number of values of all motions."""
        return sum(motion.values.size for motion in self.timeline.motions)

    @cached_property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """The shapes of one sample's outputs.

        Some outputs are not in the dataset: peak drifts that decide the status of a sample, and its final state.
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
        """A description of the kernel, in one line."""
        p = self.plan
        return f"{p.family} {p.dofs} {p.law} {p.damping} {p.load} {'+'.join(p.recorders)} {p.method} {p.dtype}"

    @property
    def needs_step(self) -> bool:
        """Whether the kernel's arrays of a structure depend on the integration step."""
        return self.method.kind == "exact" or (self.method.kind == "implicit" and self.dynamics.steps_modes)

    @cached_property
    def by_event(self) -> tuple[Model, ...]:
        """The model of each event; each of several events records its final state, and later ones start from one.

        All events but the first share one model.
        """
        first, *later = plans_of_events(self.plan, len(self.scene.excitation.event_names))
        if not later:
            return (self,)
        return (replace(self, plan=first), *[replace(self, plan=later[0])] * len(later))

    def in_float64(self, tolerance: float, device: str) -> Model:
        """Return the model in double precision on a device, with another tolerance."""
        plan = fitted(replace(self.plan, dtype="float64"), device != "cpu")
        return replace(self, plan=plan, tolerance=tolerance)

    @property
    def checking(self) -> Model:
        """The model that checks results: RK4 checks multistep methods, because its errors have other causes."""
        if not isinstance(self.method, MultistepMethod):
            return self
        return replace(self, plan=replace(self.plan, method=FALLBACK), method=METHODS[FALLBACK])

    def loads_on(self, device: str, finer: int = 1) -> object:
        """Return the load in the memory of a device; models of the same scene share one copy.

        Args:
            device: The device.
            finer: Number of intervals that replace each interval of the motions; their accelerations are interpolated.
        """
        place = device, self.plan.dtype, finer
        if place not in self._loads:
            if finer > 1:
                self._loads[place] = interpolated(self.loads_on(device), self.plan.dtype, finer)
            else:
                packed: Arrays = self.scene.excitation.pack(self.timeline, self.plan.dofs)
                self._loads[place] = arguments.brought("Load", packed, self.plan.dtype, device)
        return self._loads[place]

    def blank_outputs(self, samples: int, names: Iterable[str] | None = None) -> Arrays:
        """Return memory for outputs; the first dimension is the sample. `names` selects outputs (None: all)."""
        names = self.shapes if names is None else names
        dtype = self.plan.dtype
        return {k: np.empty((samples, *self.shapes[k]), arguments.output_dtype(k, dtype)) for k in names}
