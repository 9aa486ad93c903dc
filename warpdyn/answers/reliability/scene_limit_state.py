"""Limit-state function of a scene: a demand above a limit, or collapse, for given standard normal values."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.demands import checked_demand, refuse_failed_samples
from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.answers.reliability.densities import LinearEvents
from warpdyn.answers.reliability.linear_events import linear_events_of, nonlinearity
from warpdyn.answers.risk.exceedance_probability import times_of_peaks
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.run import Run
from warpdyn.campaigns.running.selections import without_added_places
from warpdyn.foundations.core.checks import check_kind, finite_numbers, real_number
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.core.messages import collected_warnings, warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.output_variables import COLLAPSED
from warpdyn.model.ground_motions.designs import Cloud
from warpdyn.model.ground_motions.filtered_noise import FilteredNoise
from warpdyn.model.scene.normal_variables.noise import NoiseOfNormals, variables_of_noise
from warpdyn.model.scene.normal_variables.structures import StructuresOfNormals
from warpdyn.model.scene.plausibility import warn_of_implausible
from warpdyn.model.scene.scatter import RandomFactor, RandomScatter
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.physics import capacities_of, inverse_drift_capacity
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

COLLAPSED_VALUE = -1e-6  # largest value of a collapsed sample, in units of the limit
FUNCTION = "SceneLimitState"
NUMBER = re.compile(r"[\d.,]+")  # of a warning
DRIFTS = (DRIFT, "peak_storey_drift")  # demands for which linear events are known
RATIOS, LARGEST_RATIO = (DRIFT, "residual_drift_ratio"), 0.3  # larger limits of drift ratios are probably in percent
TAIL = 6.0  # standard normal value; values beyond it have a probability of 1e-9
LARGEST_DEVIATION = 0.1  # of a demand from linear response; peaks between nodes are up to a few percent larger


@with_suggestions
class SceneLimitState:
    """Limit-state function of a scene: limit minus demand, negative if a sample exceeds the limit.

    A sample is one structure under one random motion (FilteredNoise), or under a given ground motion. Its random
    parameters come first among the standard normal variables, in the order of the scene's scatter; then follow the
    values of the noise at its nodes. The probability is the one that `exceedance_probability` estimates for
    `simulate(scene, structures=N)`: motions and parameters have the same distributions. The samples of one call run in
    one launch of one kernel.

    Times of peaks: a demand is the largest value at the ends of integration steps, from `record_from` to the end of the
    run (including `tail`). Values between steps do not count. All calls have the same number of steps in an interval of
    the noise, except that samples with short periods have more steps. Give `integration` with a shorter `step` for more
    frequent peaks.

    Args:
        scene: A scene of one structure under FilteredNoise, with random parameters or without scatter; or with random
            parameters under one GroundMotion.
        limit: Limit of the demand [units of the demand]; `math.inf`: only collapse counts, and the value is 1 minus
            the largest ratio of a storey drift to the drift at which the storey collapses.
        demand: Name of the demand. The storey or floor with the largest demand counts. A collapsed sample exceeds every
            limit.
        integration: How samples are integrated; None: the defaults of `simulate`.
        execution: Where samples are integrated; None: the defaults of `simulate`.

    Attributes:
        variables: Number of standard normal variables.

    Raises:
        TypeError: If `scene` is not a Scene of one structure under FilteredNoise or one GroundMotion.
        ValueError: If parameters have given values, a distribution exceeds the bounds of its parameter within 6
            standard deviations, the limit is not above 0, the recorder of the demand is missing, the limit is
            `math.inf` and the scene has no collapse limit; when it is called, if samples failed or a parameter is out
            of its bounds.

    Example:
        >>> noise = wd.FilteredNoise(wd.WhiteNoise(0.01), duration=10.0, interval=0.02)
        >>> random = wd.Scene(building, noise, scatter, recorders=("drift",), tail=0.0)
        >>> limit_state = wd.SceneLimitState(random, limit=0.02)
        >>> limit_state.variables  # one random parameter, and 501 nodes of white noise
        502
        >>> bool(limit_state(np.zeros((1, 502)))[0] == 0.02)  # without motion, the drift ratio is 0
        True
    """

    def __init__(
        self,
        scene: Scene,
        limit: float,
        *,
        demand: str = DRIFT,
        integration: Integration | None = None,
        execution: Execution | None = None,
    ) -> None:
        check_kind(FUNCTION, "a Scene", scene, Scene, argument="scene")
        excitation = scene.excitation
        is_single = isinstance(excitation, Cloud) and len(excitation.motions) == 1
        if scene.structure.is_many or not (isinstance(excitation, FilteredNoise) or is_single):
            raise TypeError(
                f"{FUNCTION} needs a scene of one structure under FilteredNoise, whose motions follow from standard "
                f"normal values, or under one GroundMotion, got a {type(scene.structure).__name__} under {excitation!r}"
            )
        if is_single and not scene.scatter:
            raise ValueError(
                f"{FUNCTION}: nothing is random under one ground motion without scatter: give Scene(..., scatter=...), "
                "or FilteredNoise"
            )
        for name, spread in scene.scatter.items():
            if not isinstance(spread, RandomScatter):
                raise ValueError(
                    f"{FUNCTION}: scatter[{name!r}] lists given values, which have no distribution: give a "
                    "RandomFactor or RandomValue"
                )
            _check_tails(name, spread, scene.structure)
        is_collapse = bool(np.ndim(limit) == 0 and limit == np.inf)
        self.limit = np.inf if is_collapse else real_number("limit", limit, above=0)
        if demand in RATIOS and LARGEST_RATIO < self.limit < np.inf:
            warn_caller(f"{FUNCTION}: limit={self.limit:g} is implausible for a drift ratio: 2 % is 0.02")
        self.scene, self.demand = scene, demand
        self._capacities = tuple(capacities_of(scene.structure.parameters))
        if is_collapse and scene.collapse_limit is None and not self._capacities:
            raise ValueError(
                f"{FUNCTION}: limit=math.inf counts collapses, but the scene has no collapse limit: give "
                "Scene(..., collapse_drift_ratio=...) or a drift capacity of the storeys"
            )
        if is_collapse and "drift" not in scene.recorders:
            raise ValueError(f"{FUNCTION}: collapse needs storey drifts: add 'drift' to the recorders of the scene")
        self.integration, self.execution = integration or Integration(), execution or Execution()
        check_kind(FUNCTION, "wd.Integration", self.integration, Integration, argument="integration")
        check_kind(FUNCTION, "wd.Execution", self.execution, Execution, argument="execution")
        warn_of_implausible(scene, step=self.integration.step, longest_step=self.integration.longest_step)
        self._structures = StructuresOfNormals(scene.structure, scene.scatter, scene.correlation)
        of_noise = variables_of_noise(excitation) if isinstance(excitation, FilteredNoise) else 0
        self.variables = self._structures.variables + of_noise
        self._given: set[str] = set()  # texts of warnings, without numbers
        self._peaks_recorded = ""  # of the last call
        if not is_collapse:
            self(np.zeros((1, self.variables)))  # an unknown demand is refused before any level runs

    def __repr__(self) -> str:
        what = "collapse" if self.limit == np.inf else f"{self.demand} above {self.limit:g}"
        return f"SceneLimitState({what}, {self.variables} variables, {self.scene!r})"

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of a dataset: demand, limit, and when peaks are recorded."""
        return {
            "demand": "collapse" if self.limit == np.inf else self.demand,
            "limit": float(self.limit),
            "peaks_recorded": self._peaks_recorded,
            "record_from": self.scene.record_from,
            "scene": self.scene.to_json(),
        }

    def __call__(self, normals: np.ndarray) -> np.ndarray:
        """Return limit minus demand [units of the demand] for standard normal values, shape [sample, variable].

        Args:
            normals: Standard normal values of the random parameters and of the noise, shape [sample, variable].

        Raises:
            ValueError: If the shape is wrong, samples failed, or a parameter is out of its bounds.
        """
        values = finite_numbers("normals", normals)
        if values.ndim != 2 or values.shape[1] != self.variables or not len(values):
            raise ValueError(f"normals must have the shape [sample, {self.variables}], got {values.shape}")
        scatter = self._structures.scatter_of(values[:, : self._structures.variables])
        scene = replace(self.scene, scatter=scatter, correlation={})
        if isinstance(scene.excitation, FilteredNoise):
            motions = NoiseOfNormals.of(scene.excitation, values[:, self._structures.variables :])
            scene = replace(scene, excitation=motions)
        run = without_added_places(self._run(scene, len(values)))
        status = decoded_status(run["status"])
        refuse_failed_samples(FUNCTION, status)
        self._peaks_recorded = times_of_peaks(run)
        if self.limit == np.inf:
            margin, scale = 1.0 - self._progress(run, {name: each.values for name, each in scatter.items()}), 1.0
        else:
            worst = checked_demand(FUNCTION, run, self.demand, status).max(axis=0).astype(np.float64)
            margin, scale = self.limit - worst, self.limit
        found: np.ndarray = np.where(status == COLLAPSED, np.minimum(margin, COLLAPSED_VALUE * scale), margin)
        if self.limit == np.inf:  # only collapse counts
            found = np.where(status == COLLAPSED, found, np.maximum(found, 0.0))
        return found

    def linear_events(self) -> tuple[LinearEvents, str] | None:
        """Return the density of importance sampling for noise, and words that describe it; None without noise.

        Raises:
            ValueError: If parameters are random, the demand is not a storey drift of a ShearBuilding, or the structure
                is not linear up to the limit.
        """
        structure = self.scene.structure
        if not isinstance(self.scene.excitation, FilteredNoise):
            return None
        problem = ""
        if self.scene.scatter:
            problem = f"its parameters are random ({', '.join(self.scene.scatter)})"
        elif not isinstance(structure, ShearBuilding) or (self.limit < np.inf and self.demand not in DRIFTS):
            problem = f"the demand is {self.demand} of a {type(structure).__name__}"
        if problem:
            raise ValueError(
                f"importance_sampling under FilteredNoise needs a ShearBuilding without scatter and a storey drift as "
                f"demand, but {problem}: use subset_simulation"
            )
        assert isinstance(structure, ShearBuilding)
        limits = self._drift_limits(structure.parameters, structure.storeys)
        scene = replace(self.scene, collapse_drift_ratio=None)
        events = linear_events_of(scene, limits, structure.fundamental_period, self.integration, self.execution)
        deviation = nonlinearity(events, self, self.limit if self.limit < np.inf else 1.0)
        if deviation > LARGEST_DEVIATION:
            raise ValueError(
                "importance_sampling under FilteredNoise needs a structure that is linear up to the limit, but demands "
                f"near the limit differ from a linear response by up to {deviation:.0%}, so that the estimate could be "
                "wrong by orders of magnitude: use subset_simulation"
            )
        return events, f"{len(events.distances)} linear events"

    def _drift_limits(self, parameters: Mapping[str, np.ndarray], storeys: int) -> np.ndarray:
        """Return the drift of each storey at which a sample fails [m], shape [storey]."""
        height = parameters["height"]
        if self.limit < np.inf:
            return np.broadcast_to(self.limit * (height if self.demand == DRIFT else 1.0), storeys)
        inverse = np.zeros(storeys)
        if self.scene.collapse_limit is not None:
            inverse = inverse + 1 / (self.scene.collapse_limit * height)
        if self._capacities:
            inverse = np.maximum(inverse, inverse_drift_capacity(parameters))
        return 1 / inverse

    def _run(self, scene: Scene, samples: int) -> xr.Dataset:
        """Run the samples of a scene with given structures and motions in one launch."""
        try:
            with interruptible(), collected_warnings() as found:
                what = Outputs(keep_inputs=False)
                run = Run(scene, samples, self.integration, self.execution, what, 0).result()
        except ValueError as error:
            if not self.scene.scatter or "correct its ValuesOfNormals" not in str(error):
                raise
            raise ValueError(
                f"{FUNCTION}: {str(error).split('; correct its')[0]}. Rare events need the tails of distributions: "
                "give a distribution within the bounds, such as Lognormal or Truncated(Normal(...), low=...)"
            ) from None
        for message, category in found:
            if (
                text := NUMBER.sub("", message)
            ) not in self._given:  # each call may warn of the same with other numbers
                self._given.add(text)
                warn_caller(message, category)
        return run

    def _progress(self, run: xr.Dataset, drawn: dict[str, np.ndarray]) -> np.ndarray:
        """Return the largest ratio of a storey drift to the drift at which the storey collapses, shape [sample]."""
        found = np.zeros(run.sizes["sample"])
        if self.scene.collapse_limit is not None:
            ratio = run[DRIFT].transpose("sample", "storey").values
            found = ratio.max(axis=1).astype(np.float64) / self.scene.collapse_limit
        if self._capacities:
            parameters = {**self.scene.structure.parameters, **drawn}
            drift = run["peak_storey_drift"].transpose("sample", "storey").values
            inverse = np.broadcast_to(inverse_drift_capacity(parameters), drift.shape)
            found = np.maximum(found, (drift * inverse).max(axis=1))
        return found


def _check_tails(name: str, spread: RandomScatter, structure: Structure) -> None:
    """Raise a ValueError if a parameter is out of its bounds in the tails of its distribution."""
    parameter, nominal = structure.parameter_table[name], np.asarray(structure.nominal_values[name])
    for value in spread.distribution.from_standard_normal(np.array([-TAIL, TAIL])):
        values = value * nominal if isinstance(spread, RandomFactor) else np.array([value])
        outside = ~((values >= parameter.low) & (values <= parameter.high))
        outside |= (values == parameter.low) & parameter.low_open & (nominal != 0)
        if outside.any():
            raise ValueError(
                f"{FUNCTION}: scatter[{name!r}] = {spread.distribution!r} gives {name} = {values[outside][0]:.4g} at "
                f"{TAIL:g} standard deviations, but {name} must be {parameter.allowed}. Rare events need the tails of "
                "distributions: give a distribution within the bounds, such as Lognormal or Truncated(Normal(...), "
                "low=...)"
            )
