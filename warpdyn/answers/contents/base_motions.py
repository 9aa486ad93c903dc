"""Base motions of rigid blocks: ground motions, or the floor accelerations of a run with histories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.foundations.core.checks import finite_numbers, shortened, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.thread_pool import MOST_THREADS, cores
from warpdyn.model.ground_motions.motions import checked_motions, motion_names, motion_numbers

LONGEST_STEP = 0.05  # [s]; with longer steps the acceleration between two values is not known well
Floors = Sequence[int] | Sequence[str] | int | str | None


@dataclass(frozen=True, eq=False)
class BaseMotions:
    """Base accelerations of blocks.

    Args:
        arrays: Arrays of the kernel's struct BaseHistories: {field: array}.
        dims: Dimensions of the motions, such as ("motion",) or ("sample", "floor").
        shape: Their lengths.
        coordinates: Coordinates along these dimensions, for a dataset.
    """

    arrays: dict[str, np.ndarray]
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    coordinates: dict[str, Any]

    @property
    def count(self) -> int:
        """Number of motions."""
        return int(np.prod(self.shape))

    @property
    def peaks(self) -> np.ndarray:
        """Largest absolute acceleration of each motion [m/s2], shape [motion]."""
        return np.maximum.reduceat(np.abs(self.arrays["acceleration"]), self.arrays["first"])


def base_motions(function: str, excitation: Any, floors: Floors = None) -> BaseMotions:
    """Return the base accelerations of blocks from ground motions or from a run with histories.

    Args:
        function: Name of the public function, for messages.
        excitation: One ground motion or several, or a run of `simulate` with `histories=`.
        floors: Numbers of the floors of the run, or names of its degrees of freedom; None: all.
    """
    if isinstance(excitation, xr.Dataset):
        return _of_floors(function, excitation, floors)
    if floors is not None:
        raise ValueError(
            f"{function}: floors= needs a run with histories, but ground motions are given: remove floors=, or give "
            "the result of simulate(..., histories=wd.Histories(...))"
        )
    motions = checked_motions(excitation)
    coordinates = {"motion": motion_numbers(len(motions)), "motion_name": motion_names(motions)}
    rows = [motion.acceleration for motion in motions]
    return BaseMotions(_histories(function, rows, [m.step for m in motions]), ("motion",), (len(motions),), coordinates)


def _histories(function: str, rows: Sequence[np.ndarray], steps: Sequence[float]) -> dict[str, np.ndarray]:
    """Return the arrays of the struct BaseHistories from accelerations [m/s2] and their time steps [s]."""
    if max(steps) > LONGEST_STEP:
        warn_caller(
            f"{function}: the accelerations have a time step of {max(steps):.3g} s, and between two values they are "
            "linear: give motions (or Histories(every=1)) with shorter steps"
        )
    size = np.array([row.size for row in rows])
    return {
        "acceleration": np.concatenate(rows).astype(np.float64),
        "first": np.cumsum(size) - size,
        "intervals": size - 1,
        "step": np.array(steps, dtype=np.float64),
    }


def _of_floors(function: str, run: xr.Dataset, floors: Floors) -> BaseMotions:
    """Return the absolute floor accelerations of a run with histories; they end at a collapse."""
    if not {"acceleration", "time", "history_sample"} <= run.variables.keys():
        raise ValueError(
            f"{function}: the run has no histories of the floor accelerations: simulate(..., "
            "histories=wd.Histories(range(samples)))"
        )
    known = run["dof"].values
    is_named = known.dtype.kind in "UO"
    if floors is None:
        chosen = np.arange(known.size)
    else:
        given = [floors] if isinstance(floors, int | str | np.integer) else list(floors)
        chosen = np.array([_place(function, each, known.tolist(), is_named) for each in given])
        if not chosen.size or np.unique(chosen).size < chosen.size:
            raise ValueError(f"{function}: floors must be different floors, at least one, got {shortened(floors)}")
    for place in chosen if "dof_unit" in run.coords else ():
        if str(run["dof_unit"].values[place]) != "m":
            raise ValueError(
                f"{function}: degree of freedom {known[place]!r} is a rotation: give floors= that are displacements"
            )
    values = run["acceleration"].transpose("history", "dof", "time").values[:, chosen]
    step = float(run["time"].values[1] - run["time"].values[0])
    is_known = np.isfinite(values)
    last = np.where(is_known.any(axis=-1), is_known.shape[-1] - np.argmax(is_known[..., ::-1], axis=-1), 0)
    if (last < 2).any():
        sample = int(run["history_sample"].values[np.argwhere(last < 2)[0][0]])
        raise ValueError(f"{function}: the history of sample {sample} has fewer than 2 states: choose other samples")
    rows = [values[i, j, : last[i, j]] for i in range(values.shape[0]) for j in range(chosen.size)]
    if not all(np.isfinite(row).all() for row in rows):
        raise ValueError(f"{function}: an acceleration is not finite: give the run as simulate() returned it")
    floor = ("floor", known[chosen], {"long_name": "floor, or degree of freedom, on which the block stands"})
    samples = run["history_sample"].values
    coordinates = {"sample": ("sample", samples, {"long_name": "sample of the run"}), "floor": floor}
    return BaseMotions(_histories(function, rows, [step] * len(rows)), ("sample", "floor"), last.shape, coordinates)


def _place(function: str, floor: Any, known: list[Any], is_named: bool) -> int:
    """Return the index of a floor in the run; raise a ValueError if it is unknown."""
    if not is_named and not isinstance(floor, str):
        floor = whole_number(f"{function}: floors", floor, 1)
    if floor not in known:
        hint = did_you_mean(floor, known) if is_named else ""
        listed = ", ".join(map(repr, known)) if is_named else f"1 to {known[-1]}"
        raise ValueError(f"{function}: unknown floor {floor!r}{hint}; the run has {listed}")
    return known.index(floor)


def checked_factors(function: str, factors: Any) -> np.ndarray:
    """Return scale factors as a row after a check: finite and above 0."""
    row = np.atleast_1d(finite_numbers(f"{function}: scale_factors", factors))
    if row.ndim != 1 or not row.size or row.min() <= 0:
        raise ValueError(
            f"{function}: scale_factors must be a number or a row of numbers above 0, got {shortened(factors)}"
        )
    return row


def settings(function: str, device: str | None, threads: int | None) -> tuple[str, int]:
    """Return the device and the number of CPU threads after a check."""
    from warpdyn.engine.kernels.queues import checked_devices  # importing it imports Warp

    threads = cores() if threads is None else whole_number("threads", threads, 1, MOST_THREADS)
    first, *others = checked_devices(device)
    if others:
        raise ValueError(f"{function} runs on one device, got {device!r}: give device='cuda:0' or 'cpu'")
    return first, threads
