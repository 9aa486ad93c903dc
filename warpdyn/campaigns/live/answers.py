"""Answers of a live ensemble after each packet: demands so far, their quantiles and damage-state probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.campaigns.integration.model import Model
from warpdyn.campaigns.integration.stability_guard import blank_failed
from warpdyn.campaigns.live.paused_ensemble import PausedEnsemble
from warpdyn.campaigns.live.sample_statistics import SampleStatistics
from warpdyn.campaigns.reductions.limits import NO_DAMAGE, DamageLimits, Limit
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.tally import FAILURES
from warpdyn.campaigns.running.labels import columns_of, fill_outcomes, labelled
from warpdyn.campaigns.running.tables import blank_rows
from warpdyn.foundations.core.checks import finite_numbers, true_or_false
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.scene.scene import Scene

# Variables that are known only after the end of the free vibration, and inputs of the run.
UNKNOWN = ("residual_drift_ratio", "residual_deformation", "integration_step", "unreliable")
QUANTILES: tuple[float, ...] = (0.16, 0.5, 0.84)


@dataclass(frozen=True, eq=False)
class AnswerSettings:
    """Checked arguments of answers.

    Args:
        quantiles: Quantiles of the demands that are returned [1].
        keep_samples: Whether answers contain the demands of each sample.
        limits: Limits of the damage states, from the lightest to the heaviest; None: no states.
        counted: Places of each limited demand that count, by demand.
    """

    quantiles: np.ndarray
    keep_samples: bool
    limits: DamageLimits | None
    counted: Mapping[str, slice]


def checked_settings(
    scene: Scene,
    structures: int,
    limits: Mapping[str, Limit] | None,
    quantiles: Sequence[float] | np.ndarray,
    keep_samples: bool,
) -> AnswerSettings:
    """Return the settings of the answers of a live ensemble.

    Args:
        scene: The scene.
        structures: Number of structures.
        limits: Limits of the damage states, from the lightest to the heaviest, as in `fragility`; None: no states.
        quantiles: Quantiles of the demands that are returned [1].
        keep_samples: Whether answers contain the demands of each sample.

    Raises:
        ValueError, TypeError: If a limit or quantile is invalid, or the scene does not record a limited demand.
    """
    true_or_false("keep_samples", keep_samples)
    checked = np.atleast_1d(finite_numbers("quantiles", quantiles))
    if checked.ndim != 1 or not np.all((checked >= 0) & (checked <= 1)):
        raise ValueError(f"quantiles must be numbers from 0 to 1, such as (0.16, 0.5, 0.84), got {quantiles}")
    counted: dict[str, slice] = {}
    if limits is None:
        return AnswerSettings(checked, keep_samples, None, counted)
    of_states = DamageLimits.of(limits)
    if NO_DAMAGE in of_states.states:
        raise ValueError(f"{NO_DAMAGE!r} is the state of samples that exceed no limit: remove it from limits")
    population = Population(scene, structures)
    for name in of_states.demands:
        population.demand(name)
        if name in UNKNOWN:
            raise ValueError(f"limits of {name!r} can be applied only after the motion: remove them")
        span = population.counted_places(name, np.arange(1), added_storeys=False)
        counted[name] = slice(None) if span is None else slice(*span)
    return AnswerSettings(checked, keep_samples, of_states, counted)


class Answers:
    """The form of the answers of a live ensemble.

    Args:
        model: Model of the ensemble.
        settings: Checked arguments.
    """

    def __init__(self, model: Model, settings: AnswerSettings) -> None:
        self.model, self.keep_samples = model, settings.keep_samples
        self.quantiles, self.limits, self._counted = settings.quantiles, settings.limits, settings.counted
        self._columns = columns_of(model, keep_inputs=False)
        template = labelled(model, self._columns, blank_rows(model, self._columns, 0))
        self._labels = template.variables
        along = {dim for column in self._columns.values() for dim in column.dims}
        self._places = {name: self._labels[name] for name in template.coords if name in along}
        self._recorded = [name for name, column in self._columns.items() if not column.is_coordinate]
        self._recorded = [name for name in self._recorded if name not in UNKNOWN]
        of_demands = {*model.demands, "peak_storey_drift_ratio"} - set(UNKNOWN)
        self._demands = [name for name in self._recorded if name in of_demands]
        self._statistics: SampleStatistics | None = None
        self._form = xr.Dataset()  # the labels of all answers

    def begin_statistics(self, paused: PausedEnsemble) -> None:
        """Compile the kernels of the statistics, and reserve their memory on the device of an ensemble."""
        self._statistics = SampleStatistics(paused, self._demands, self.quantiles, self.limits, self._counted)
        self._form = self._labelled(paused.ensemble.size)

    def of(self, paused: PausedEnsemble, time: float, attributes: Mapping[str, object]) -> xr.Dataset:
        """Return the dataset of an answer.

        Args:
            paused: The ensemble of `begin_statistics`, whose outputs are written.
            time: Time since the start of the motion up to which the samples are integrated [s].
            attributes: Attributes of the dataset that describe the packets.
        """
        assert self._statistics is not None
        found = self._statistics.find()
        values: dict[str, np.ndarray] = self._of_samples(paused) if self.keep_samples else {}
        values |= {f"{name}_quantile": of_demand for name, of_demand in found.quantiles.items()}
        if self.limits is not None:
            samples = found.in_state.sum()
            values["damage_probability"] = found.in_state / samples if samples else np.full(found.in_state.size, np.nan)
        if not self.keep_samples:
            values["failed_count"] = found.of_status[DIVERGED:]
            values["collapsed_count"] = np.array(found.of_status[COLLAPSED])
        answer = self._form.copy(data=values)
        answer.variables["time"].values = np.array(time)
        answer.attrs = trace(self.model.scene.title, "Live") | dict(attributes)
        return answer

    def _of_samples(self, paused: PausedEnsemble) -> dict[str, np.ndarray]:
        """Return the recorded variables of each sample; demands of failed samples are NaN."""
        rows = paused.read_outputs()
        blank_failed({name: values.T for name, values in rows.items()}, rows["status"] >= DIVERGED)
        if "peak_storey_drift_ratio" in self._columns:
            rows["peak_storey_drift_ratio"] = np.empty_like(rows["peak_storey_drift"])
        fill_outcomes(paused.ensemble, rows)
        return {name: rows[name] for name in self._recorded}

    def _labelled(self, samples: int) -> xr.Dataset:
        """Return a dataset with the labels of all answers and blank values."""
        variables: dict[str, tuple] = {}
        for name in self._recorded if self.keep_samples else ():
            label = self._labels[name]
            blank = np.broadcast_to(np.zeros((), label.dtype), (samples, *label.shape[1:]))
            variables[name] = (label.dims, blank, label.attrs)
        for name in self._demands:
            label = self._labels[name]
            text = label.attrs | {"long_name": f"quantile among the samples of: {label.attrs['long_name']}"}
            blank = np.broadcast_to(np.nan, (self.quantiles.size, *label.shape[1:]))
            variables[f"{name}_quantile"] = (("quantile", *label.dims[1:]), blank, text)
        coordinates: dict[str, tuple | xr.Variable] = {
            "time": ((), 0.0, {"long_name": "time since the start of the motion", "units": "s"}),
            "quantile": ("quantile", self.quantiles, {"long_name": "quantile", "units": "1"}),
            **self._places,
        }
        if self.limits is not None:
            states = np.array([NO_DAMAGE, *self.limits.states])
            share = {"long_name": "share of the samples in the damage state", "units": "1"}
            variables["damage_probability"] = ("damage_state", np.zeros(states.size), share)
            coordinates["damage_state"] = ("damage_state", states, {"long_name": "damage state"})
        if not self.keep_samples:
            said = {"long_name": "samples that are not counted, because their integration failed", "units": "1"}
            variables["failed_count"] = ("failure", np.zeros(len(FAILURES), dtype=np.int64), said)
            collapsed = {"long_name": "samples that have collapsed", "units": "1"}
            variables["collapsed_count"] = ((), np.int64(0), collapsed)
            coordinates["failure"] = ("failure", np.array(FAILURES), {"long_name": "status of samples that failed"})
        return xr.Dataset(variables, coordinates)
