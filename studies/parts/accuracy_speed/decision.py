"""Errors of a fragility curve from the step and from the sample size, separately."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr
from p695_fragility import DRIFT_LIMITS, build_scene

import warpdyn as wd
from parts.accuracy_speed.points import Settings
from warpdyn.statistics.lognormal_fit import fit_stripes

LEVELS_IN_G = (0.1, 0.2, 0.3, 0.4, 0.6, 0.9, 1.3, 1.9, 2.8, 4.2)
STRUCTURES = 32
# A method without a stability limit, and records resampled at the step, so that steps can have any length.
METHOD = "newmark_average"
STEPS = (0.16, 0.08, 0.04, 0.02, 0.01, 0.005)
STEP_OF_SAMPLING = 0.01  # at which the designs of fewer structures or records are run
REFERENCE_STEP = 0.000625
STRUCTURE_COUNTS, RECORD_COUNTS = (1, 2, 4, 8, 16, 32), (5, 11, 22, 44)
REPLICATES = 400
LIMITS = np.array(list(DRIFT_LIMITS.values()))


def decision_scene() -> wd.Scene:
    """Return the main job's scene on fewer stripes, with independent structures and the drift alone."""
    scene = build_scene()
    stripes = wd.Stripes(scene.excitation.motions, LEVELS_IN_G, scene.excitation.measure)
    return replace(scene, excitation=stripes, sampling="monte_carlo", recorders=("drift",))


def exceedances(run: xr.Dataset, records: int) -> np.ndarray:
    """Return which samples exceed each damage state, shape [state, structure, record, level]; collapses exceed all."""
    drift = run["peak_storey_drift_ratio"].max("storey").values
    exceeding = (drift > LIMITS[:, None]) | (run["status"].values == 1)
    return exceeding.reshape(LIMITS.size, -1, records, len(LEVELS_IN_G))


def fitted(counts: np.ndarray, total: int) -> np.ndarray:
    """Return the logarithm of the median and the dispersion of counts [..., level], shape [2, ...]."""
    median, dispersion, _ = fit_stripes(np.array(LEVELS_IN_G), counts, total)
    return np.stack([np.log(median), dispersion])


def sampling_error(exceeding: np.ndarray, structures: int, records: int, seed: int) -> np.ndarray:
    """Return the standard error of the log median and the dispersion, relative, shape [2, state].

    Either structures or records are drawn with replacement, and all of the others are kept, so that the bootstrap gives
    the error of each separately.

    Args:
        exceeding: As `exceedances` returns it.
        structures: Number of structures in a design; 0 to keep all.
        records: Number of records in a design; 0 to keep all.
        seed: Seed of the draws.
    """
    generator = np.random.default_rng(seed)
    axis, count = (1, structures) if structures else (2, records)
    drawn = generator.integers(exceeding.shape[axis], size=(REPLICATES, count))
    kept = exceeding.sum(axis=3 - axis)  # [state, drawn from, level]
    counts = np.moveaxis(kept[:, drawn].sum(axis=2), 0, 1)  # [replicate, state, level]
    replicates = fitted(counts, count * exceeding.shape[3 - axis])
    spread = np.nanstd(replicates, axis=1)
    spread[1] /= fitted(kept.sum(axis=1), exceeding.shape[1] * exceeding.shape[2])[1]
    return spread


def decision(settings: Settings) -> xr.Dataset:
    """Return the errors of the fragility's median and dispersion by step, by structures and by records, and their cost.

    Args:
        settings: Device and seed; the sample size is the design's own.
    """
    scene = decision_scene()
    records = len(scene.excitation.motions)

    def run(**terms: object) -> xr.Dataset:
        return wd.simulate(scene, structures=STRUCTURES, device=settings.device, seed=settings.seed, **terms)

    total = STRUCTURES * records
    reference = run(longest_step=REFERENCE_STEP, method="rk4", dtype="float64")
    best = fitted(exceedances(reference, records).sum(axis=(1, 2)), total)
    errors, seconds, exceeding = [], [], {}
    for step in STEPS:
        runs = [run(step=step, resample=True, method=METHOD) for _ in range(2)]
        exceeding[step] = exceedances(runs[0], records)
        at_step = fitted(exceeding[step].sum(axis=(1, 2)), total)
        errors.append(np.abs(at_step - best) / [np.ones_like(best[1]), best[1]])
        seconds.append(min(each.attrs["seconds_integrating"] for each in runs))
    drawn_from, all_seconds = exceeding[STEP_OF_SAMPLING], seconds[STEPS.index(STEP_OF_SAMPLING)]
    counts = [n for n in STRUCTURE_COUNTS if n <= STRUCTURES]
    by_structures = [sampling_error(drawn_from, n, 0, settings.seed) for n in counts]
    by_records = [sampling_error(drawn_from, 0, n, settings.seed) for n in RECORD_COUNTS]
    dims = {"decision_step": errors, "design_structures": by_structures, "design_records": by_records}
    text = {
        "decision_step": "discretisation error of the fragility",
        "design_structures": "sampling error of the fragility by structures",
        "design_records": "sampling error of the fragility by records",
    }
    cost = {
        "decision_step": seconds,
        "design_structures": [all_seconds * n / STRUCTURES for n in counts],
        "design_records": [all_seconds * n / records for n in RECORD_COUNTS],
    }
    variables = {}
    for name, values in dims.items():
        kind = "discretisation_error" if name == "decision_step" else f"sampling_error_by_{name.split('_')[1]}"
        attributes = {
            "long_name": text[name],
            "units": "1",
            "comment": "relative: of the median |d ln|, of the dispersion |d| over it; sampling errors are standard "
            "errors by a bootstrap over the one, with all of the other",
        }
        variables[kind] = ((name, "parameter", "damage_state"), np.array(values), attributes)
        variables[f"{kind}_seconds"] = (name, np.array(cost[name]), {"long_name": "integration time", "units": "s"})
    coordinates = {
        "decision_step": ("decision_step", list(STEPS), {"long_name": "longest integration step", "units": "s"}),
        "design_structures": ("design_structures", counts, {"long_name": "structures drawn", "units": "1"}),
        "design_records": ("design_records", list(RECORD_COUNTS), {"long_name": "records", "units": "1"}),
        "parameter": ("parameter", ["median", "dispersion"], {"long_name": "parameter of the curve", "units": "1"}),
        "damage_state": ("damage_state", list(DRIFT_LIMITS), {"long_name": "damage state", "units": "1"}),
    }
    dataset = xr.Dataset(variables, coords=coordinates)
    dataset.attrs = {
        "decision_method": METHOD,
        "decision_structures": STRUCTURES,
        "decision_records": records,
        "decision_stripes_in_g": list(LEVELS_IN_G),
        "decision_step_of_sampling": STEP_OF_SAMPLING,
    }
    return dataset
