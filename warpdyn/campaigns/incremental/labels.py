"""The dataset of capacities (intensities at which limits are first exceeded), from the levels that were run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.incremental.pairs import DRIFT_RATIO
from warpdyn.campaigns.incremental.search import Search
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.settings import Settled
from warpdyn.engine.kernels.queues import device_names
from warpdyn.foundations.core.output_variables import DIVERGED, STATUS_MEANINGS, UNNAMED, label_of_levels
from warpdyn.foundations.core.units import unit_attributes
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.ground_motions.designs import Design
from warpdyn.model.ground_motions.motions import motion_names, motion_numbers

FOUND, ABOVE_HIGHEST, BELOW_LOWEST, FAILED = range(4)
CAPACITY_MEANINGS = ("found", "above_highest", "below_lowest", "failed")
PAIR = ("structure", "motion")
SOURCE = "first passage of each limit on increasing levels, bracketed (Vamvatsikos and Cornell 2002)"


@dataclass(eq=False)
class Found:
    """Results of the capacity searches, collected for all blocks of structures.

    Args:
        names: Names of the damage states.
        limit: Limits of the damage states [units of the demand], shape [damage_state].
        demand: Name of the demand.
        tolerance: Largest relative width of a bracket [1].
        ladder: Ratio of neighbouring levels [1].
        keep_curves: Whether all levels and demands that were run are kept (IDA curves).
    """

    names: list[str]
    limit: np.ndarray
    demand: str
    tolerance: float
    ladder: float
    keep_curves: bool
    histories: int = 0
    waves: int = 0
    structures: list[np.ndarray] = field(default_factory=list)
    lower: list[np.ndarray] = field(default_factory=list)
    upper: list[np.ndarray] = field(default_factory=list)
    resurrections: list[np.ndarray] = field(default_factory=list)
    failures: list[np.ndarray] = field(default_factory=list)
    codes: set[int] = field(default_factory=set)
    curves: list[tuple[np.ndarray, ...]] = field(default_factory=list)

    def add(self, search: Search) -> None:
        """Add the results of the search for a block of structures."""
        pairs, levels = search.pairs, search.levels
        everything = np.arange(pairs.count)
        lower, upper, *_ = levels.brackets(everything, self.limit)
        lower[search.failed] = upper[search.failed] = np.nan
        shape = pairs.structures.shape
        self.structures.append(pairs.structures)
        self.lower.append(lower.reshape(*shape, self.limit.size))
        self.upper.append(upper.reshape(*shape, self.limit.size))
        self.failures.append(search.failed.reshape(shape))
        self.codes |= pairs.failure_codes
        # Count levels only up to the one that exceeds the last limit: which higher levels were run depends on the
        # device.
        with np.errstate(invalid="ignore"):
            is_counted = levels.level <= np.minimum(upper[:, -1], search.highest)[:, None]
            is_counted &= levels.demand < np.inf
            counts = [
                (is_counted & (levels.level > upper[:, [state]]) & (levels.demand <= value)).sum(1)
                for state, value in enumerate(self.limit)
            ]
        self.resurrections.append(np.stack(counts, axis=-1).reshape(*shape, self.limit.size))
        self.histories += pairs.histories
        self.waves += pairs.waves
        if self.keep_curves:
            row, slot = np.nonzero(levels.is_run & np.isfinite(levels.level))
            level = levels.level[row, slot]
            order = np.lexsort((level, row))
            motions = len(pairs.intensities)
            demand = levels.demand[row, slot][order]
            self.curves.append((pairs.structures.ravel()[row[order]], row[order] % motions, level[order], demand))

    @property
    def failed(self) -> np.ndarray:
        """Which pairs of a structure and a motion failed, shape [structure, motion]."""
        return np.concatenate(self.failures)

    def reasons(self) -> str:
        """Return the kinds of failures that occurred, as text for a message."""
        return ", ".join(STATUS_MEANINGS[code] for code in sorted(self.codes)) or "no finite demand"


def labelled_capacities(found: Found, run: Run, integration: Settled, highest: float) -> xr.Dataset:
    """Return the dataset of capacities; its attributes contain the settings of the run and the highest level."""
    scene = run.model.scene
    design = scene.excitation
    assert isinstance(design, Design)
    units = design.intensity_units
    of_level: dict[str, Any] = {**unit_attributes(units)}
    lower, upper = np.concatenate(found.lower), np.concatenate(found.upper)
    with np.errstate(invalid="ignore"):
        capacity = np.where(np.isinf(upper), np.inf, np.sqrt(lower * upper))
        status = np.where(np.isinf(upper), ABOVE_HIGHEST, np.where(lower > 0, FOUND, BELOW_LOWEST))
    status = np.where(np.isnan(upper), FAILED, status).astype(np.int8)
    flags = {
        "flag_values": np.arange(len(CAPACITY_MEANINGS), dtype=np.int8),
        "flag_meanings": " ".join(CAPACITY_MEANINGS),
    }
    dims = (*PAIR, "damage_state")
    numbers = {"units": "1"}
    is_nested = design.own_structures > 0
    label = "number among the structures of a motion" if is_nested else "index of the drawn structure"
    of_structure = numbers | {"long_name": "index of the drawn structure", "sampling": scene.sampling_of_structures}
    text = f"{design.measure.name} at which the limit is first passed"
    of_limit = {
        "long_name": f"limit of {found.demand}; infinite: only collapse passes it",
        "units": _demand_units(found.demand, run),
        "demand": found.demand,
    }
    variables: dict[str, tuple] = {
        "capacity": (dims, capacity, {"long_name": text} | of_level),
        "capacity_lower": (dims, lower, {"long_name": f"{text}, lower end of the bracket"} | of_level),
        "capacity_upper": (dims, upper, {"long_name": f"{text}, upper end of the bracket"} | of_level),
        "capacity_status": (dims, status, {"long_name": "outcome of the search", "units": "1"} | flags),
        "resurrections": (
            dims,
            np.concatenate(found.resurrections).astype(np.int16),
            {"long_name": "levels above the capacity at which the demand is within the limit", "units": "1"},
        ),
        "damage_limit": ("damage_state", found.limit, of_limit),
        "motion_name": motion_names(design.motions),
    }
    if found.keep_curves:
        variables |= _levels_run(found, run, of_level, design.measure.attributes())
    return xr.Dataset(
        variables,
        coords={
            "structure": ("structure", np.arange(len(lower), dtype=np.int32), numbers | {"long_name": label}),
            "drawn_structure": (PAIR, np.concatenate(found.structures).astype(np.int32), of_structure),
            "motion": motion_numbers(len(design.motions)),
            "damage_state": ("damage_state", np.array(found.names), {"long_name": "damage state"}),
        },
        attrs=trace(scene.title, "capacities")
        | {
            "scene": scene.to_json(),
            **design.measure.attributes(),
            "demand": found.demand,
            "capacity_method": SOURCE,
            "tolerance": found.tolerance,
            "ladder": found.ladder,
            "highest": highest,
            "histories": found.histories,
            "launches": found.waves,
            "seed": run.model.seed,
            "method": integration.method,
            **({"method_chosen_because": integration.reason} if integration.reason else {}),
            "dtype": integration.dtype,
            "device": device_names(run.execution.devices),
            "kernel": run.model.kernel_name,
        },
    )


def _demand_units(demand: str, run: Run) -> str:
    return "1" if demand == DRIFT_RATIO else run.model.variables[demand].units


def _levels_run(found: Found, run: Run, of_level: dict[str, Any], measure: dict[str, object]) -> dict[str, tuple]:
    """Return the variables of all levels that were run (level, demand, status, indices), along `sample`, by name."""
    structure, motion, level, demand = (np.concatenate(column) for column in zip(*found.curves, strict=True))
    status = np.where(np.isnan(demand), DIVERGED, np.isposinf(demand)).astype(np.int8)
    meanings = STATUS_MEANINGS[: DIVERGED + 1]
    flags = {"flag_values": np.arange(len(meanings), dtype=np.int8), "flag_meanings": " ".join(meanings)}
    number = {"units": "1"}
    worst = f"{found.demand.replace('_', ' ')}, the worst of the structure; NaN after a collapse"
    return {
        "im_level": ("sample", level, {"long_name": label_of_levels(UNNAMED[1])} | measure | of_level),
        found.demand: (
            "sample",
            np.where(np.isfinite(demand), demand, np.nan),
            {"long_name": worst, "units": _demand_units(found.demand, run)},
        ),
        "status": ("sample", status, {"long_name": "outcome of the sample", "units": "1"} | flags),
        "structure_index": (
            "sample",
            structure.astype(np.int32),
            {"long_name": "index along the dimension structure"} | number,
        ),
        "motion_index": ("sample", motion.astype(np.int32), {"long_name": "index along the dimension motion"} | number),
    }
