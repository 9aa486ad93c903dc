"""Exchange of demand samples between warpdyn and pelicun.

    python docs/coming_from/scripts/with_pelicun.py

It needs warpdyn with the extra ".[records]", and pelicun. It writes results/pelicun.csv and .json in about ten seconds.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import xarray as xr
from pelicun.assessment import DLCalculationAssessment
from provenance import provenance, write_csv, write_json

import warpdyn as wd

LIMIT = 0.1  # drift ratio of a collapse


# [write]
def run_and_write(path: Path) -> xr.Dataset:
    """Run five-storey concrete buildings at three levels, and write the demands of one level."""
    building = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5)
    measure = wd.SpectralAcceleration(building.fundamental_period)
    stripes = wd.Stripes(wd.records.far_field(), [0.6, 1.2, 2.4], measure)
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    recorders = ("drift", "acceleration", "residual")
    scene = wd.Scene(building, stripes, scatter, recorders=recorders, collapse_drift_ratio=LIMIT)
    run = wd.simulate(scene, structures=16, seed=1)
    wd.write_pelicun_demands(run, path, level=2.4)
    return run


# [end]
def main() -> None:
    """Write demands, let pelicun read, sample and save them, and read the file of pelicun."""
    with tempfile.TemporaryDirectory() as folder:
        path, saved = Path(folder) / "demands.csv", Path(folder) / "saved.csv"
        run = run_and_write(path)
        assessment = DLCalculationAssessment({"PrintLog": False, "LogFile": str(Path(folder) / "log.txt")})
        assessment.demand.load_sample(str(path))
        theirs = assessment.demand.sample
        assessment.demand.save_sample(str(saved))
        back = wd.read_pelicun_demands(saved)
        first_lines = path.read_text().splitlines()[:3]
    run = run.isel(sample=np.flatnonzero(run["im_level"].values == 2.4))
    rows = []
    for kind, variable, unit, places in (
        ("PID", "peak_storey_drift_ratio", "rad", range(1, 6)),
        ("RID", "residual_drift_ratio", "rad", range(1, 6)),
        ("PFA", "peak_floor_acceleration", "m/s2", range(1, 6)),
    ):
        for i in places:
            ours = np.nanmedian(np.abs(run[variable].values[:, i - 1]))
            read = np.nanmedian(back[variable].values[:, i - 1 + (kind == "PFA" and back.sizes.get("floor", 0) == 6)])
            rows.append([f"1-{kind}-{i}-1", f"`{variable}`", unit, *(f"{v:.5g}" for v in (
                ours, np.nanmedian(theirs[kind, str(i), "1"]), read))])  # fmt: skip
    write_csv(
        "pelicun",
        ["column", "variable", "unit", "median, warpdyn", "in pelicun", "read back from pelicun's file"],
        rows,
    )
    collapsed = int((run["status"].values == 1).sum())
    reached = int((theirs["PID"].max(axis=1) >= LIMIT).sum())
    write_json(
        "pelicun",
        {
            "measured_with": provenance("pelicun"),
            "samples": {"warpdyn": run.sizes["sample"], "pelicun": len(theirs)},
            "collapses": {"warpdyn": collapsed, "pelicun, by the limit": reached},
            "first lines of the file": first_lines,
        },
    )


if __name__ == "__main__":
    main()
