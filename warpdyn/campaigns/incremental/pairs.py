"""Pairs of a structure and a motion, whose demands are computed at any intensity levels in one launch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from warpdyn.campaigns.accuracy.precision import rerun_in_float64
from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.incremental.elastic import elastic_drifts
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.settings import Settled
from warpdyn.campaigns.integration.stability_guard import Reruns, StabilityFindings, guard
from warpdyn.campaigns.integration.time_grid import build_schedule
from warpdyn.engine.kernels.queues import Queue
from warpdyn.foundations.core.interruption import stop_if_asked
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED, UNSTABLE_STEP
from warpdyn.foundations.core.random_numbers import Purpose, uniforms
from warpdyn.model.ground_motions.designs import Design
from warpdyn.model.ground_motions.excitation import Assignment
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding

DRIFT_RATIO = "peak_storey_drift_ratio"
# Demands that are 0 for an elastic response, each with another demand that is an upper bound and not 0; the search for
# a capacity starts from this bound.
NEVER_ABOVE = {"residual_drift_ratio": DRIFT_RATIO, "hysteretic_energy": "input_energy"}
WITHIN = 0.999  # a storey counts as elastic up to this share of its yield drift, to allow for rounding


def structures_of_pairs(design: Design, structures: np.ndarray) -> np.ndarray:
    """Return the index of the structure that runs under each motion, shape [structure, motion].

    Args:
        design: The design with its motions.
        structures: Indices of structures. If each motion has its own structures (nested design), these are indices
            among the structures of one motion.
    """
    own = design.own_structures
    motions = np.arange(len(design.motions))
    if own:
        return structures[:, None] + own * motions
    return np.repeat(structures[:, None], motions.size, axis=1)


class Pairs:
    """All pairs of a structure and a motion, for some structures and all motions of a run.

    Args:
        run: The prepared run; the excitation of its scene is a design.
        structures: Indices of the structures, increasing. If each motion has its own structures (nested design), these
            are indices among the structures of one motion.
        demand: Name of the demand; the largest value over storeys, floors or degrees of freedom counts.
        integration: Integration settings.
        queue: Device queue.
        first_level: Intensity level of the elastic run, at which no storey yields.
        findings: Findings on the stability of the pairs, which are updated.
        advance: Function that is called with the number of histories that were finished since its last call.
        reuse_elastic: Whether demands below the first yield are computed from the elastic run by scaling.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count.

    Attributes:
        structures: Index of each pair's structure, shape [structure, motion].
        count: Number of pairs; the pairs of a structure are contiguous, in the order of the motions.
        first_step: Random number between 0 and 1, shape [pair]. It multiplies the first step from the highest level
            downwards, so that different pairs have different levels.
        first_demand: Demand at `first_level`, shape [pair].
        guide: `first_demand`, or another demand at `first_level` that is an upper bound of it, shape [pair].
        exponent: Exponent e, if the demand of an elastic response is proportional to level^e.
        elastic_level: Level up to which the response is elastic, shape [pair]; 0 if it is unknown.
        collapse_level: Level at which an elastic response would reach the collapse drift, shape [pair].
        histories: Number of histories that were integrated.
        waves: Number of launches.
        failure_codes: Status codes of the histories that failed.
    """

    def __init__(
        self,
        run: Run,
        structures: np.ndarray,
        demand: str,
        integration: Settled,
        queue: Queue,
        first_level: float,
        findings: StabilityFindings,
        advance: Callable[[int], object],
        *,
        reuse_elastic: bool,
        added_storeys: bool = False,
    ) -> None:
        design = run.model.scene.excitation
        assert isinstance(design, Design)
        self.demand, self.integration, self.reruns, self.advance = demand, integration, Reruns(), advance
        self.intensities, self.power = design.intensities, design.measure.power
        self.added_storeys = added_storeys
        self.structures = structures_of_pairs(design, structures)
        motions = len(design.motions)
        structures, place = np.unique(self.structures.ravel(), return_inverse=True)
        drawn, vibration = run.draw(structures)
        self.count = self.structures.size
        motion = np.tile(np.arange(motions, dtype=np.int32), len(self.structures))
        place = place.astype(np.int32)
        row = place if drawn else np.zeros_like(place)
        held = structures[place].astype(np.int32), motion, np.ones(self.count), self.intensities[motion]
        assignment = Assignment(*held, design.measure.attributes())
        schedule = build_schedule(run.model.scene, run.model.timeline, vibration, assignment, row)
        sample = (self.structures * motions + np.arange(motions)).ravel().astype(np.int32)
        self.first_step = uniforms(run.model.seed, sample, Purpose.LADDERS, 0)[:, 0]
        self.whole = Ensemble(
            run.model, structures, drawn, vibration.rayleigh, assignment, row, schedule, sample, queue
        )
        shorten_steps(self.whole, vibration, findings, divides=integration.divides_steps)
        self.unstable = guard(self.whole, vibration, integration.on_unstable, findings)
        self.failure_codes: set[int] = set()
        self.histories = self.waves = 0
        self._find_elastic_response(first_level, reuse_elastic)

    def _find_elastic_response(self, level: float, reuse_elastic: bool) -> None:
        """Integrate every pair at a low level, and find the level up to which its response is elastic."""
        variables = self.whole.model.variables
        degree = 2 if self.demand in variables and variables[self.demand].units == "J" else 1
        self.exponent, self.first_level = degree / self.power, level
        self.elastic_level = np.zeros(self.count)
        everything = np.arange(self.count)
        outputs = self._run(everything, np.full(self.count, level))
        self.first_demand = self._worst(self.demand, everything, outputs)
        guide = NEVER_ABOVE.get(self.demand, self.demand)
        self.guide = self.first_demand if guide == self.demand else self._worst(guide, everything, outputs)
        self.collapse_level = np.full(self.count, np.inf)
        elastic, collapse = elastic_drifts(self.whole)
        if "peak_storey_drift" in outputs:
            peaks = outputs["peak_storey_drift"].T.astype(np.float64)
            row = self.whole.row
            with np.errstate(divide="ignore", invalid="ignore"):
                factor = np.nanmin(WITHIN * np.minimum(elastic, collapse)[row] / peaks, axis=1)
                self.collapse_level = level * np.nanmin(collapse[row] / peaks, axis=1) ** self.power
        else:  # only a linear structure is known to remain elastic at any level
            is_linear = self.whole.model.dynamics.forces.is_linear
            factor = np.full(self.count, np.inf if is_linear else 0.0)
        # If the first run already exceeds the first yield drift, it is not elastic.
        known = (factor > 1) & np.isfinite(self.first_demand)
        # If peaks are recorded only from a later time, they do not show whether a storey yields earlier.
        if reuse_elastic and self.whole.scene.record_from == 0:
            self.elastic_level = np.where(known, level * np.where(known, factor, 1.0) ** self.power, 0.0)

    def elastic_level_of(self, limit: float) -> np.ndarray:
        """Return the level at which the elastic response (or its upper bound) would reach a limit, shape [pair].

        `limit` is a value of the demand, in the units of the demand.
        """
        with np.errstate(divide="ignore"):
            return self.first_level * (limit / self.guide) ** (1 / self.exponent)

    def demands(self, pair: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Return the demand of pairs at given levels, shape [evaluation]; infinite after a collapse, NaN if failed.

        Args:
            pair: Index of the pair of each evaluation, shape [evaluation]; pairs may be repeated.
            level: Level of each evaluation [units of the intensity measure], shape [evaluation].
        """
        with np.errstate(invalid="ignore", over="ignore"):
            found = self.first_demand[pair] * (level / self.first_level) ** self.exponent
        beyond = np.flatnonzero(level > self.elastic_level[pair])
        if beyond.size:
            outputs = self._run(pair[beyond], level[beyond])
            found[beyond] = self._worst(self.demand, pair[beyond], outputs)
        return found

    def _run(self, pair: np.ndarray, level: np.ndarray) -> Arrays:
        """Integrate pairs at given levels, and return all recorded variables by name; the last dimension is the sample.

        `pair` and `level` have the shape [evaluation]; each evaluation is one sample.
        """
        stop_if_asked()
        whole = self.whole
        scale = (level / self.intensities[whole.assignment.motion[pair]]) ** (1 / self.power)
        assignment = replace(whole.assignment.select(pair), scale=scale, im_level=level)
        part = Ensemble(
            whole.model,
            whole.structures,
            whole.drawn,
            whole.rayleigh,
            assignment,
            whole.row[pair],
            whole.schedule.select(pair),
            whole.sample[pair],
            whole.queue,
        )
        rows = whole.model.blank_outputs(pair.size)
        part.start(rows, self.advance)
        part.finish(rows)
        outputs = {name: values.T for name, values in rows.items()}
        everything = np.arange(pair.size)
        if self.integration.on_unstable == "substep":
            self.reruns.settle(part, everything, outputs)
        rerun_in_float64(part, everything, outputs)
        outputs["status"][self.unstable[pair]] = UNSTABLE_STEP
        self.histories += pair.size
        self.waves += 1
        status = outputs["status"]
        self.failure_codes |= set(np.unique(status[status >= DIVERGED]).tolist())
        return outputs

    def _worst(self, demand: str, pair: np.ndarray, outputs: Arrays) -> np.ndarray:
        """Return the largest demand over storeys or floors, shape [sample]; inf after a collapse, NaN if failed."""
        name = "peak_storey_drift" if demand == DRIFT_RATIO else demand
        values = np.abs(outputs[name].astype(np.float64)).reshape(-1, pair.size)
        if demand == DRIFT_RATIO:
            values = values / self.whole.heights_of(pair)
        worst, status = values[self._counted(name, len(values))].max(axis=0), outputs["status"]
        return np.where(status == COLLAPSED, np.inf, np.where(status >= DIVERGED, np.nan, worst))

    def _counted(self, name: str, places: int) -> np.ndarray:
        """Return whether each of the places (storeys, floors, springs) of a variable counts, shape [place]."""
        structure, dims = self.whole.model.scene.structure, self.whole.model.variables[name].dims
        if dims and not self.added_storeys:
            if isinstance(structure, ShearBuilding):  # the floor above a storey counts if the storey does
                return structure.own_storeys
            if isinstance(structure, LumpedStructure) and dims[0] != "storey":
                return structure.kinds.of_building(dims[0])
        return np.ones(places, dtype=bool)
