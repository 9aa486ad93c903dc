"""Identities of a run's buildings, structures and motions, which do not depend on their numbers in the run.

Numbers are valid only within one run: structure 0 of another seed is another structure, and motion 0 of another scene
may be another record. An identity is a digest: the same structure or motion has the same identity in every run.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.description import fingerprint

OF_SAMPLES, OF_MOTIONS = "structure_identity", "motion_identity"  # variables of a joined run
OF_BUILDING, OF_ARCHETYPES = "building_identity", "archetype_identity"  # an attribute; a variable along archetype
OF_INPUTS = "drawn_parameters"  # an attribute: names of the variables with drawn parameters
_ONE_FOR_ALL = "none"


def number_of(*values: object) -> int:
    """Return the first 63 bits of the digest of some values, as an integer."""
    return int(fingerprint(*values)[:16], 16) >> 1


@dataclass(frozen=True, eq=False)
class Identities:
    """The identities (digests) of one run's buildings, structures, motions and samples.

    Args:
        place: Number of the run in the arguments of `join`, for error messages.
        run: The run.
    """

    place: int
    run: xr.Dataset

    @cached_property
    def scene(self) -> Mapping[str, Any]:
        """The scene of the run, read from the JSON in the attributes of the run."""
        try:
            found = json.loads(str(self.run.attrs["scene"]))
        except (KeyError, json.JSONDecodeError):
            raise ValueError(
                f"join: run {self.place} has no attribute 'scene', which identifies its samples. Give the dataset that "
                "simulate() returned, with its attributes (xarray keeps them with xr.set_options(keep_attrs=True))"
            ) from None
        return dict(found)

    @cached_property
    def is_portfolio(self) -> bool:
        """Whether the run is the run of a portfolio."""
        return "archetype_index" in self.run.coords

    @cached_property
    def buildings(self) -> dict[str, int]:
        """Identity of each building type, by its name: digest of the building, its scatter and the collapse limit."""
        run = self.run
        if OF_BUILDING in run.attrs:
            return {str(run.attrs.get("title", "building")): int(run.attrs[OF_BUILDING])}
        if OF_ARCHETYPES in run:
            names = map(str, run["archetype"].values)
            return dict(zip(names, map(int, run[OF_ARCHETYPES].values), strict=True))
        structure, collapse = self.scene["structure"], self.scene.get("collapse_drift_ratio")
        if not self.is_portfolio:
            what = structure, self.scene.get("scatter", {}), self.scene.get("correlation", {}), collapse
            return {str(run.attrs.get("title", "building")): number_of(*what)}
        told = structure["archetypes"]
        return {
            name: number_of(*(told[name].get(key, {}) for key in ("structure", "scatter", "correlation")), collapse)
            for name in map(str, run["archetype"].values)
        }

    @cached_property
    def building_of_sample(self) -> np.ndarray:
        """Identity of the building type of each sample, shape [sample]."""
        if not self.is_portfolio:
            return np.full(self.run.sizes["sample"], next(iter(self.buildings.values())))
        by_place = np.array([self.buildings[str(name)] for name in self.run["archetype"].values])
        return by_place[self.run["archetype_index"].values]

    @cached_property
    def structures(self) -> np.ndarray:
        """Digest of each sample's structure (its type, seed, index in the run and parameters), shape [sample]."""
        if OF_SAMPLES in self.run.coords:
            return self.run[OF_SAMPLES].values
        label = "building" if self.is_portfolio else "structure"
        if label not in self.run.coords:
            raise ValueError(f"join: run {self.place} has no coordinate {label!r}: give the result of simulate()")
        columns = {"building_type": self.building_of_sample, "number": self.run[label].values}
        columns["seed"] = np.full(self.run.sizes["sample"], number_of(self.seed, *self._number_of_points))
        for name in self.inputs:
            # Runs in float32 and float64 draw the same parameters; rounded to float32 they are equal.
            values = self.run[name].transpose("sample", ...).values.astype(np.float32)
            values = values.reshape(self.run.sizes["sample"], -1)
            columns |= {f"{name} {place}": column for place, column in enumerate(values.T)}
        hashed = pd.util.hash_pandas_object(pd.DataFrame(columns), index=False)
        return (hashed.to_numpy() >> np.uint64(1)).astype(np.int64)

    @cached_property
    def _number_of_points(self) -> tuple[int, ...]:
        """Number of drawn structures for Latin hypercube sampling, whose structures depend on it; otherwise empty."""
        if "structure" not in self.run.coords or self.run["structure"].attrs.get("sampling") != "latin_hypercube":
            return ()
        return (int(self.run["structure"].values.max()) + 1,)

    @cached_property
    def seed(self) -> object:
        """The seed of the run; a constant if the samples do not depend on the seed."""
        if "seed" not in self.run.attrs:
            raise ValueError(f"join: run {self.place} has no attribute 'seed'; give the result of simulate()")
        excitation = json.dumps(self.scene["excitation"])
        labels = ("drawn_structure", "structure")  # the first is in results of `capacities`, the second in runs
        attributes = next((self.run[name].attrs for name in labels if name in self.run.coords), {})
        sampling = "" if self.is_portfolio else str(attributes.get("sampling", ""))
        draws_motions = '"type": "FilteredNoise"' in excitation or '"motion": null' in excitation
        if sampling == "given" and not draws_motions:
            return _ONE_FOR_ALL
        return int(self.run.attrs["seed"])

    @cached_property
    def inputs(self) -> list[str]:
        """Names of the variables that contain the drawn parameters of each sample."""
        if OF_INPUTS in self.run.attrs:
            return [name for name in str(self.run.attrs[OF_INPUTS]).split() if name in self.run]
        scatter = dict(self.scene.get("scatter", {}))
        if self.is_portfolio:
            for each in self.scene["structure"]["archetypes"].values():
                scatter |= each.get("scatter", {})
        named = [name for each in scatter for name in (each, f"{each}_factor")]
        return [name for name in named if name in self.run and self.run[name].dims[:1] == ("sample",)]

    @cached_property
    def motions(self) -> np.ndarray:
        """Identity of each motion (digest of its name and samples), shape [motion]; empty for a run without motions."""
        if OF_MOTIONS in self.run:
            return self.run[OF_MOTIONS].values
        if "motion_name" not in self.run:
            return np.zeros(0, dtype=np.int64)
        told = _motions_of(self.scene["excitation"])
        names = [str(name) for name in self.run["motion_name"].values]
        if [each["name"] for each in told] == names and all("digest" in each for each in told):
            return np.array([number_of(each["name"], each["digest"]) for each in told])
        rest = [name for name in ("motion_step", "motion_peak_acceleration") if name in self.run]
        columns = zip(names, *(self.run[name].values for name in rest), strict=True)
        return np.array([number_of(*column) for column in columns])

    @cached_property
    def samples(self) -> pd.MultiIndex:
        """Identity of each sample: structure, motion, level, and a count of samples for which these three are equal."""
        run, motion = self.run, np.zeros(self.run.sizes["sample"], dtype=np.int64)
        if "motion_index" in run.coords and run["motion_index"].dims == ("sample",):
            motion = self.motions[run["motion_index"].values]
        level = np.zeros(motion.size)
        if "im_level" in run.coords and run["im_level"].dims == ("sample",):
            level = run["im_level"].values.astype(np.float64)
        again = pd.Series(level).groupby([self.structures, motion, level]).cumcount().to_numpy()
        if "event" in run.dims:  # the motions of all events
            motion = _rows_as_numbers(run["motion_index"].transpose("sample", "event").values)
            level = _rows_as_numbers(run["im_level"].transpose("sample", "event").values).astype(np.float64)
            again = np.zeros_like(motion)
        return pd.MultiIndex.from_arrays([self.structures, motion, level, again])


def _rows_as_numbers(rows: np.ndarray) -> np.ndarray:
    hashed = pd.util.hash_pandas_object(pd.DataFrame(rows), index=False).to_numpy()
    return (hashed >> np.uint64(12)).astype(np.int64)  # float64 represents 52 bits exactly


def _motions_of(excitation: Any) -> list[dict[str, Any]]:
    """Return the motions in the JSON of an excitation as dictionaries, in the order of their numbers in the run."""
    if not isinstance(excitation, Mapping):
        return []
    return [dict(each) for each in excitation.get("motions", []) if isinstance(each, Mapping) and "name" in each]
