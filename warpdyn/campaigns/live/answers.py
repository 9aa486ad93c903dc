"""Answers of a live ensemble after each packet: demands so far, their quantiles and damage-state probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import Model
from warpdyn.campaigns.integration.stability_guard import blank_failed
from warpdyn.campaigns.reductions.limits import NO_DAMAGE, DamageLimits, Limit, magnitudes
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.running.labels import columns_of, fill_outcomes, labelled
from warpdyn.campaigns.running.tables import blank_rows
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED
from warpdyn.foundations.files.netcdf import trace

# Variables that are known only after the end of the free vibration, and inputs of the run.
UNKNOWN = ("residual_drift_ratio", "residual_deformation", "integration_step", "unreliable")
QUANTILES: tuple[float, ...] = (0.16, 0.5, 0.84)


class Answers:
    """The form of the answers of a live ensemble.

    Args:
        model: Model of the ensemble.
        structures: Number of structures.
        limits: Limits of the damage states, from the lightest to the heaviest, as in `fragility`; None: no states.
        quantiles: Quantiles of the demands that are returned [1].

    Raises:
        ValueError, TypeError: If a limit or quantile is invalid, or the scene does not record a limited demand.
    """

    def __init__(
        self,
        model: Model,
        structures: int,
        limits: Mapping[str, Limit] | None,
        quantiles: Sequence[float] | np.ndarray,
    ) -> None:
        self.model = model
        self.quantiles = np.atleast_1d(finite_numbers("quantiles", quantiles))
        if self.quantiles.ndim != 1 or not np.all((self.quantiles >= 0) & (self.quantiles <= 1)):
            raise ValueError(f"quantiles must be numbers from 0 to 1, such as (0.16, 0.5, 0.84), got {quantiles}")
        self._columns = columns_of(model, keep_inputs=False)
        template = labelled(model, self._columns, blank_rows(model, self._columns, 0))
        self._labels = template.variables
        along = {dim for column in self._columns.values() for dim in column.dims}
        self._places = {name: self._labels[name] for name in template.coords if name in along}
        self._recorded = [name for name, column in self._columns.items() if not column.is_coordinate]
        self._recorded = [name for name in self._recorded if name not in UNKNOWN]
        of_demands = {*model.demands, "peak_storey_drift_ratio"} - set(UNKNOWN)
        self._demands = [name for name in self._recorded if name in of_demands]
        self.limits = None if limits is None else DamageLimits.of(limits)
        self._counted: dict[str, slice] = {}
        if self.limits is not None:
            if NO_DAMAGE in self.limits.states:
                raise ValueError(f"{NO_DAMAGE!r} is the state of samples that exceed no limit: remove it from limits")
            population = Population(model.scene, structures)
            for name in self.limits.demands:
                population.demand(name)
                if name in UNKNOWN:
                    raise ValueError(f"limits of {name!r} can be applied only after the motion: remove them")
                span = population.counted_places(name, np.arange(1), added_storeys=False)
                self._counted[name] = slice(None) if span is None else slice(*span)

    def of(self, ensemble: Ensemble, outputs: Arrays, time: float, attributes: Mapping[str, object]) -> xr.Dataset:
        """Return the dataset of an answer.

        Args:
            ensemble: The samples.
            outputs: Outputs of the kernel by name, shape [sample, ...]; they are changed.
            time: Time since the start of the motion up to which the samples are integrated [s].
            attributes: Attributes of the dataset that describe the packets.
        """
        blank_failed({name: values.T for name, values in outputs.items()}, outputs["status"] >= DIVERGED)
        rows = dict(outputs)
        if "peak_storey_drift_ratio" in self._columns:
            rows["peak_storey_drift_ratio"] = np.empty_like(outputs["peak_storey_drift"])
        fill_outcomes(ensemble, rows)
        variables: dict[str, tuple] = {}
        for name in self._recorded:
            label = self._labels[name]
            variables[name] = (label.dims, rows[name], label.attrs)
        ended = outputs["status"] < DIVERGED
        everything = bool(ended.all())
        for name in self._demands:
            label = self._labels[name]
            values = rows[name] if everything else rows[name][ended]
            found = _quantiles(values, self.quantiles)
            text = label.attrs | {"long_name": f"quantile among the samples of: {label.attrs['long_name']}"}
            variables[f"{name}_quantile"] = (("quantile", *label.dims[1:]), found, text)
        coordinates: dict[str, tuple | xr.Variable] = {
            "time": ((), time, {"long_name": "time since the start of the motion", "units": "s"}),
            "quantile": ("quantile", self.quantiles, {"long_name": "quantile", "units": "1"}),
            **self._places,
        }
        if self.limits is not None:
            states = [NO_DAMAGE, *self.limits.states]
            share = {"long_name": "share of the samples in the damage state", "units": "1"}
            variables["damage_probability"] = ("damage_state", self._shares(rows, ended), share)
            coordinates["damage_state"] = ("damage_state", np.array(states), {"long_name": "damage state"})
        described = trace(self.model.scene.title, "Live") | dict(attributes)
        return xr.Dataset(variables, coordinates, described)

    def _shares(self, rows: Arrays, ended: np.ndarray) -> np.ndarray:
        """Return the share of the samples that are in each damage state [1], shape [damage_state]; NaN: all failed."""
        assert self.limits is not None
        state = np.zeros(ended.size, dtype=np.int64)
        for name, limits in zip(self.limits.demands, self.limits.values, strict=True):
            values = magnitudes(name, rows[name])
            worst = values[:, self._counted[name]].max(axis=1) if values.ndim > 1 else values
            for number, limit in enumerate(limits, 1):
                if not np.isnan(limit):
                    state[worst > limit] = np.maximum(state[worst > limit], number)
        heaviest = len(self.limits.states)
        state[rows["status"] == COLLAPSED] = heaviest
        counts = np.bincount(state[ended], minlength=heaviest + 1)
        return counts / counts.sum() if counts.sum() else np.full(heaviest + 1, np.nan)


def _quantiles(values: np.ndarray, quantiles: np.ndarray) -> np.ndarray:
    """Return quantiles of values over the first dimension, shape [quantile, ...]; NaN if there is no sample."""
    if not len(values):
        return np.full((quantiles.size, *values.shape[1:]), np.nan)
    return np.quantile(values.astype(np.float64), quantiles, axis=0)
