"""Fragility curves of the same runs with pyFragility and with warpdyn.

    python docs/coming_from/scripts/with_pyfragility.py

It needs warpdyn with the extra ".[test]". It writes results/pyfragility.csv and .json in about ten seconds.
"""

from __future__ import annotations

import warnings

import numpy as np
import pyFragility
import xarray as xr
from provenance import provenance, write_csv, write_json

import warpdyn as wd

LIMITS = wd.hazus_drift_limits("C1M", "high")
LEVELS = [0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 0.8, 1.2, 1.6, 2.4, 3.2]  # g


# [run]
def run_stripes() -> xr.Dataset:
    """Return five-storey concrete buildings under 44 records at twelve levels."""
    building = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5)
    measure = wd.SpectralAcceleration(building.fundamental_period)
    stripes = wd.Stripes(wd.records.far_field(), LEVELS, measure)
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    scene = wd.Scene(building, stripes, scatter, recorders=("drift",))
    return wd.simulate(scene, structures=16, seed=1)


# [stripes]
def stripes_by_pyfragility(run: xr.Dataset, limit: float) -> pyFragility.FragilityFit:
    """Return the lognormal curve fitted to the stripes, with records as clusters."""
    exceeds = (run["peak_storey_drift_ratio"].max("storey") > limit) | (run["status"] == 1)
    table = exceeds.to_dataframe(name="exceeds").groupby(["im_level", "motion_index"])
    # Counts over all buildings under one record at one level.
    counts = table["exceeds"].agg(["sum", "size"]).reset_index()
    level, record = counts["im_level"], counts["motion_index"]
    return pyFragility.fit_msa(level, counts["sum"], counts["size"], cluster=record)


# [states]
def states_by_pyfragility(run: xr.Dataset) -> pyFragility.FragilityFit:
    """Return the curves of all damage states together, which cannot cross."""
    worst = run["peak_storey_drift_ratio"].max("storey").values
    worst = np.where(run["status"] == 1, np.inf, worst)
    state = np.searchsorted(list(LIMITS.values()), worst)
    level, record = run["im_level"].values, run["motion_index"].values
    return pyFragility.fit_damage_states(level, state, cluster=record)


# [end]
def main() -> None:
    """Fit with both programs, and write the curves."""
    warnings.filterwarnings("ignore", module="pyFragility")
    run = run_stripes()
    own = wd.fragility(run, LIMITS, intervals_over="records")
    ordinal = wd.fragility(run, LIMITS, estimator="ordinal", intervals_over="records")
    together = states_by_pyfragility(run)
    rows = []
    for i, (state, limit) in enumerate(LIMITS.items()):
        fit, row, joint = stripes_by_pyfragility(run, limit), own.isel(damage_state=i), ordinal.isel(damage_state=i)
        theta, beta = fit.params
        error = 1.96 * fit.summary()["se_sandwich"]["theta"] / theta  # of ln median
        low, high = theta * np.exp(-error), theta * np.exp(error)
        slope = together.params[-1]
        rows.append(
            [
                state, f"{theta:.4f}", f"{float(row['fragility_median']):.4f}",
                f"{beta:.4f}", f"{float(row['fragility_dispersion']):.4f}",
                f"{low:.3f} to {high:.3f}",
                f"{float(row['fragility_median_lower']):.3f} to {float(row['fragility_median_upper']):.3f}",
                f"{np.exp(-together.params[i] / slope):.4f}", f"{float(joint['fragility_median']):.4f}",
            ]
        )  # fmt: skip
    header = ["damage state", "median, pyFragility [g]", "median, warpdyn [g]", "dispersion, pyFragility"]
    header += ["dispersion, warpdyn", "95 % interval, pyFragility [g]", "95 % interval, warpdyn [g]"]
    header += ["ordinal median, pyFragility [g]", "ordinal median, warpdyn [g]"]
    write_csv("pyfragility", header, rows)
    write_json("pyfragility", {"measured_with": provenance("pyFragility"), "histories": run.sizes["sample"]})


if __name__ == "__main__":
    main()
