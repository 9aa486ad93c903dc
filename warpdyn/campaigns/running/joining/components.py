"""Public function `larger_of_components`: the larger demand of two components that were analysed separately."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.output_variables import COLLAPSED, OK
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions, motion_numbers
from warpdyn.model.ground_motions.records.components.pairing import pairs

FUNCTION = "larger_of_components"
DEMANDS = ("peak_", "residual_", "hysteretic_energy", "input_energy", "viscous_energy")  # beginnings of names
OF_COLLAPSE = ("time_of_collapse", "storey_of_collapse", "spring_of_collapse")
UNRELIABLE = "unreliable"
CROSSED = 'give the design as Stripes(..., structures_per_motion="crossed"), or call simulate(..., structures=N)'


def larger_of_components(run: xr.Dataset, motions: Sequence[GroundMotion]) -> xr.Dataset:
    """Return a run with one sample per pair of components, whose demand is the larger one of both components.

    Both horizontal components of a record act separately on the same structures, as on a model in one plane. The
    result has one sample for each structure, record and level, for `fragility` and other functions. Their intervals
    then count a record once, although it has two components.

    - A demand (peaks, residual drifts, energies) is the one with the larger absolute value, at each storey separately.
    - If a component collapses, the sample has collapsed, with the time and the storey of the earlier collapse.
      If a component failed numerically and the other one did not collapse, the sample has failed. Demands of such
      samples are missing if they are missing for one of the components.
    - Variables with equal values in both samples, such as drawn parameters, stay. Others, such as times of peaks, are
      removed.

    Args:
        run: A run, as `simulate` returned it, in which every motion acts on every structure (crossed design).
        motions: The motions of the design, in its order. Two motions with the same `record` are a pair.

    Returns:
        The run, in which `motion_index` is the index of the pair and `motion_name` the name of its record.

    Raises:
        ValueError: If the motions are not pairs or not those of the run; if a component has no sample of the same
            structure and level as the other one; or if the run has several events.
        TypeError: If `run` is not a Dataset, or a motion is not a GroundMotion.

    Example:
        >>> from dataclasses import replace
        >>> components = [replace(motions[i], record=f"{i // 2}", component="NE"[i % 2]) for i in range(8)]
        >>> measure = wd.GeometricMean(wd.PeakGroundAcceleration())
        >>> both = wd.Stripes(components, [0.15, 0.25, 0.4, 0.6, 0.9, 1.4], measure)
        >>> run = wd.simulate(wd.Scene(building, both, scatter, recorders=("drift",)), structures=3, seed=1)
        >>> larger = wd.larger_of_components(run, components)
        >>> run.sizes["sample"], larger.sizes["sample"]
        (144, 72)
        >>> wd.fragility(larger, {"slight": 0.005})["fragility_median"].shape
        (1,)
    """
    check_dataset(FUNCTION, run, advice="give the result of simulate()", argument="run")
    both = pairs(checked_motions(motions))
    first, second = _partners(run, _places(run, motions, both))
    found = run.isel(sample=first)
    other = run.isel(sample=second)
    status = _status(run["status"].values[first], run["status"].values[second])
    leading = _collapses_first(run, first, second)
    removed = []
    for name, values in found.variables.items():
        if "sample" not in values.dims or name in ("sample", "status", "motion_index"):
            continue
        a, b = (each[name].transpose("sample", ...) for each in (found, other))
        if str(name) in OF_COLLAPSE:
            found[name] = a.copy(data=np.where(leading, a.values, b.values))
        elif str(name) == UNRELIABLE:
            found[name] = a.copy(data=_unreliable(a.values, b.values))
        elif not _are_equal(a.values, b.values):
            if str(name).startswith(DEMANDS):
                found[name] = a.copy(data=_larger(a.values, b.values))
            else:
                removed.append(name)
    found = found.drop_vars(removed)
    found["status"] = found["status"].copy(data=status)
    found = found.assign_coords(sample=("sample", np.arange(first.size, dtype=np.int32), run["sample"].attrs))
    return _of_pairs(found, run, motions, both)


def _places(
    run: xr.Dataset, motions: Sequence[GroundMotion], both: Sequence[tuple[GroundMotion, GroundMotion]]
) -> np.ndarray:
    """Return the indices of both components of each pair among the motions of the run, shape [pair, 2]."""
    if "event" in run.dims:
        raise ValueError(f"{FUNCTION}: the run has several events: select one by select_event(run, name)")
    for name in ("motion_index", "motion_name", "status", "sample"):
        if name not in run.variables:
            raise ValueError(f"{FUNCTION}: run has no {name!r}: give the run as simulate() returned it")
    names = run["motion_name"].values.astype(str).tolist()
    if [motion.name for motion in motions] != names:
        raise ValueError(
            f"{FUNCTION}: motions has {amount_of(len(motions), 'motion')} that are not those of the run, "
            f"{', '.join(map(repr, names[:4]))}{', ...' if len(names) > 4 else ''}: give the motions of its design, in "
            "the same order"
        )
    place = {id(motion): index for index, motion in enumerate(motions)}
    return np.array([[place[id(motion)] for motion in pair] for pair in both])


def _partners(run: xr.Dataset, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples of the first and of the second component of all pairs that are in the run, in one order."""
    motion = run["motion_index"].values
    pair, component = np.full(motion.max() + 1, -1), np.zeros(motion.max() + 1, dtype=int)
    for number, members in enumerate(places):
        for place in (0, 1):
            if members[place] < pair.size:
                pair[members[place]], component[members[place]] = number, place
    label = next((name for name in ("structure", "building") if name in run.coords), None)
    keys = {"pair": pair[motion], "structure": run[label].values if label else np.zeros(motion.size)}
    if "im_level" in run.coords:
        keys["im_level"] = run["im_level"].values
    table = pd.DataFrame(keys | {"component": component[motion], "sample": np.arange(motion.size)})
    table = table[table["pair"] >= 0]
    wide = table.groupby(list(keys), sort=False)["sample"].agg(["min", "max", "count"])
    halves = table.groupby(list(keys), sort=False)["component"].sum()
    lonely = np.flatnonzero((wide["count"] != 2) | (halves != 1))
    if lonely.size:
        number, structure = wide.index[lonely[0]][:2]
        level = f" at {wide.index[lonely[0]][2]:.6g}" if "im_level" in keys else ""
        names = run["motion_name"].values[places[int(number)]].tolist()
        raise ValueError(
            f"{FUNCTION}: structure {structure}{level} has not one sample for each of the components {names[0]!r} and "
            f"{names[1]!r}. If each motion has its own structures, {CROSSED}. If the levels of the components differ, "
            "use a measure of pairs, such as GeometricMean(measure)"
        )
    samples = wide[["min", "max"]].to_numpy()
    is_second = component[motion[samples[:, 0]]] == 1
    first = np.where(is_second, samples[:, 1], samples[:, 0])
    second = np.where(is_second, samples[:, 0], samples[:, 1])
    order = np.argsort(first, kind="stable")
    return first[order], second[order]


def _status(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the status of both components together: collapsed if one of them is, otherwise the worse one."""
    return np.where((a == COLLAPSED) | (b == COLLAPSED), COLLAPSED, np.where(a == OK, b, a)).astype(a.dtype)


def _collapses_first(run: xr.Dataset, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return whether the first component collapses before the second one, or alone, shape [sample]."""
    if OF_COLLAPSE[0] not in run.variables:
        return np.ones(first.size, dtype=bool)
    times = run[OF_COLLAPSE[0]].values
    a, b = (np.where(np.isnan(times[each]), np.inf, times[each]) for each in (first, second))
    return np.asarray(a <= b)


def _unreliable(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return 1 if a component is unreliable, otherwise -1 if one of them was not checked, otherwise 0."""
    return np.where((a == 1) | (b == 1), 1, np.minimum(a, b)).astype(a.dtype)


def _are_equal(a: np.ndarray, b: np.ndarray) -> bool:
    return np.array_equal(a, b, equal_nan=np.issubdtype(a.dtype, np.floating))


def _larger(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the values with the larger absolute value; NaN where one of them is NaN."""
    larger = np.where(np.abs(a) >= np.abs(b), a, b)
    return np.where(np.isnan(a) | np.isnan(b), np.array(np.nan, dtype=a.dtype), larger)


def _of_pairs(
    found: xr.Dataset,
    run: xr.Dataset,
    motions: Sequence[GroundMotion],
    both: Sequence[tuple[GroundMotion, GroundMotion]],
) -> xr.Dataset:
    """Return the result with pairs along `motion`, and without attributes of the run that do not describe it."""
    number = {id(motion): index for index, pair in enumerate(both) for motion in pair}
    of_pair = np.array([number.get(id(motion), -1) for motion in motions], dtype=np.int32)
    index = found["motion_index"]
    columns = {
        "motion_name": ("motion", np.array([first.record for first, _ in both]), {"long_name": "name of the record"}),
    }
    if "motion_peak_acceleration" in run:
        peaks = np.array([max(each.peak_ground_acceleration for each in pair) for pair in both])
        columns["motion_peak_acceleration"] = ("motion", peaks, run["motion_peak_acceleration"].attrs)
    found = found.drop_dims("motion").assign(columns)
    found = found.assign_coords(
        motion_index=("sample", of_pair[index.values], index.attrs), motion=motion_numbers(len(both))
    )
    made = trace(str(run.attrs.get("title", "")), FUNCTION)["history"]
    # The scene and its fingerprint describe samples of single components.
    kept = {name: value for name, value in run.attrs.items() if name not in ("scene", "fingerprint")}
    found.attrs = kept | {"history": f"{run.attrs.get('history', '')}\n{made}".strip()}
    return found
