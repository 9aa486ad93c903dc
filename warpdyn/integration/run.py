"""What comes before a run: its arguments are checked, its samples drawn, and their steps laid out."""

from __future__ import annotations

import collections.abc
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from warpdyn.core.checks import one_of, real_number, whole_number
from warpdyn.ground_motions.designs import OneMotionPerStructure
from warpdyn.ground_motions.event_sequences import EventSequence
from warpdyn.integration import packing
from warpdyn.integration.damping import law_to_integrate
from warpdyn.integration.ensemble import Ensemble, Terms
from warpdyn.integration.sampler import Sampler
from warpdyn.integration.time_grid import Vibration, build_schedule, build_timeline
from warpdyn.integration.vibration import vibration_of
from warpdyn.kernels.build import cores, fitted
from warpdyn.kernels.queues import Queue, checked_devices, open_queues
from warpdyn.methods.table import METHODS, check_fits
from warpdyn.scene.scene import Scene

# Parameters drawn, and the vibration of each structure at a method's limit.
Drawn = tuple[dict[str, np.ndarray], Vibration]
LEAST_TOLERANCE = {"float32": 1e-7, "float64": 1e-14}  # below it rounding is all that a step's estimate tells
DEFAULT_TOLERANCE = 1e-6  # of an adaptive method
MOST_SAMPLES = 2**31 - 1  # samples are counted in 32 bits


@dataclass(frozen=True, eq=False)
class Run:
    """A run whose arguments are checked, of which any structures can be made ready to integrate.

    Args:
        terms: How all samples are integrated.
        sampler: What draws the structures.
        structures: How many there are.
        seed: Seed of every random draw.
        devices: Devices that the samples are divided among.
    """

    terms: Terms
    sampler: Sampler
    structures: int
    seed: int
    devices: tuple[str, ...]

    @property
    def samples(self) -> int:
        """How many samples there are."""
        return self.structures * self.terms.scene.excitation.samples_per_structure

    def draw(self, structures: np.ndarray) -> Drawn:
        """Return the parameters and the vibration of some structures, given by their indices, increasing."""
        drawn = self.sampler.draw(structures, self.terms.threads)
        return drawn, vibration_of(self.terms.scene, drawn, METHODS[self.terms.plan.method], self.terms.threads)

    def ensemble(self, structures: np.ndarray, queue: Queue, known: Drawn | None = None) -> tuple[Ensemble, Vibration]:
        """Return some structures with all their samples, and their vibration.

        Args:
            structures: Their indices, increasing.
            queue: Where they are to run.
            known: What `draw` returned of them, if it was called before.
        """
        scene = self.terms.scene
        drawn, vibration = self.draw(structures) if known is None else known
        assignment = scene.excitation.assign(structures, self.seed)
        samples_per_structure = scene.excitation.samples_per_structure
        row = np.repeat(np.arange(structures.size, dtype=np.int32), samples_per_structure)
        if not drawn:  # one structure serves all
            row[:] = 0
        schedule = build_schedule(scene, self.terms.timeline, vibration, assignment, row)
        sample = (
            np.add.outer(structures * samples_per_structure, np.arange(samples_per_structure)).astype(np.int32).ravel()
        )
        rayleigh = vibration.rayleigh
        return Ensemble(self.terms, structures, drawn, rayleigh, assignment, row, schedule, sample, queue), vibration

    def events(self, structures: np.ndarray, queue: Queue) -> list[tuple[Ensemble, Vibration]]:
        """Return what `ensemble` does of each event of a sequence in turn; of other excitations there is one.

        From the second event on, each sample of the one before it is a structure.
        """
        scene, timeline = self.terms.scene, self.terms.timeline
        if not isinstance(scene.excitation, EventSequence):
            return [self.ensemble(structures, queue)]
        (drawn, vibration), found = self.draw(structures), []
        building, block, samples_before = np.asarray(structures), None, 1
        for event, samples in enumerate(scene.excitation.samples_by_event):
            assignment = scene.excitation.assign(event, building, self.seed)
            row = np.repeat(np.arange(building.size, dtype=np.int32), samples // samples_before)
            if block is None and not drawn:  # one structure serves all
                row[:] = 0
            comes_to_rest = event + 1 < len(scene.excitation.events)
            schedule = build_schedule(scene, timeline, vibration, assignment, row, comes_to_rest)
            sample = np.add.outer(structures * samples, np.arange(samples)).astype(np.int32).ravel()
            place = structures if block is None else block.sample
            terms, held = self._terms_by_event[min(event, 1)], (drawn, vibration.rayleigh, assignment, row, schedule)
            block = Ensemble(terms, place, *held, sample, queue, block)
            found.append((block, vibration))
            drawn, vibration = {name: values[row] for name, values in drawn.items()}, vibration.select(row)
            building, samples_before = assignment.structure, samples
        return found

    @cached_property
    def _terms_by_event(self) -> tuple[Terms, Terms]:
        """Terms of the first event of a sequence, and of any other."""
        return self.terms.for_event(resumes=False), self.terms.for_event(resumes=True)

    @property
    def samples_by_event(self) -> tuple[int, ...]:
        """How many samples each event has, the last one's being those of the run."""
        by_event = getattr(self.terms.scene.excitation, "samples_by_event", None)
        return (self.samples,) if by_event is None else tuple(self.structures * samples for samples in by_event)


def build_run(
    scene: Scene,
    *,
    structures: int,
    method: str,
    dtype: str,
    seed: int = 0,
    device: str | collections.abc.Sequence[str] | None = None,
    threads: int | None = None,
    step: float | None = None,
    longest_step: float | None = None,
    resample: bool = False,
    tolerance: float | None = None,
) -> Run:
    """Check a run's arguments (of `simulate`) and lay out its time grid; nothing is drawn yet."""
    if not isinstance(scene, Scene):
        raise TypeError(f"a run takes a Scene, got {type(scene).__name__}")
    check_fits(method, law_to_integrate(scene), scene.structure.damping)
    row = METHODS[method]
    one_of("dtype", dtype, ("float32", "float64"))
    structures, seed = whole_number("structures", structures, 1), whole_number("seed", seed, 0)
    threads = cores() if threads is None else whole_number("threads", threads, 1)
    if tolerance is not None and not row.is_adaptive:
        adaptive = [name for name, other in METHODS.items() if other.is_adaptive]
        raise ValueError(f"method {method!r} takes no tolerance; these do: {', '.join(adaptive)}")
    if not isinstance(resample, bool):
        raise TypeError(f"resample must be True or False, got {resample!r}")
    if tolerance is None:
        tolerance = DEFAULT_TOLERANCE
    elif not LEAST_TOLERANCE[dtype] <= real_number("tolerance", tolerance, above=0) <= 1:
        raise ValueError(f"tolerance must be from {LEAST_TOLERANCE[dtype]:g} ({dtype}) to 1, got {tolerance:g}")
    devices = checked_devices(device)
    if structures * scene.excitation.samples_per_structure > MOST_SAMPLES:
        raise ValueError(
            f"{structures} structures have more than {MOST_SAMPLES} samples: divide them into several runs"
        )
    sampler = Sampler(scene.structure, scene.scatter, scene.correlation, scene.sampling, structures, seed)
    if isinstance(scene.excitation, EventSequence) and row.kind == "exact":
        raise ValueError(
            "method 'exact' is for linear structures, which come out of an earthquake as they went into it: choose "
            "another method for an EventSequence, or run its events by themselves"
        )
    if isinstance(scene.excitation, OneMotionPerStructure | EventSequence):
        scene.excitation.check_structures(structures)
    sampler.draw(np.arange(1))  # the first error of a scatter out of bounds is of what it draws, not of its middle
    central = vibration_of(scene, {n: v[None] for n, v in scene.central_parameters.items()}, row)
    timeline = build_timeline(scene, central, step, longest_step, resample)
    plan = packing.plan_of(scene, method, dtype, devices[0] != "cpu")
    return Run(Terms(scene, timeline, plan, tolerance, seed, threads), sampler, structures, seed, devices)


def prepare(scene: Scene, *, known: dict[str, Drawn] | None = None, **arguments: object) -> tuple[Ensemble, Vibration]:
    """Make all samples of a run ready at once, on the first of its devices; arguments as of `build_run`.

    Whoever prepares many runs of the same samples of one scene passes the same `known` each time, at first empty: what
    was drawn and found of their vibration is kept there, by method.
    """
    run = build_run(scene, **arguments)
    everything = np.arange(run.structures)
    method, known = run.terms.plan.method, {} if known is None else known
    if method not in known:
        known[method] = run.draw(everything)
    return run.ensemble(everything, open_queues(run.devices[:1], run.terms.threads)[0], known[method])


def in_float64(terms: Terms, tolerance: float, device: str) -> Terms:
    """Return terms in double precision on a device, with another tolerance."""
    plan = fitted(replace(terms.plan, dtype="float64"), device != "cpu")
    return replace(terms, plan=plan, tolerance=tolerance)
