"""The study of isolation: what its file holds, and what protection does that theory says it must."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import xarray as xr
from conftest import documented_commands, run_study
from labels import check_labels
from matplotlib import image


def test_study(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "studies/isolation.py" in c)
    done = run_study(f"{command} --structures 2", tmp_path)
    assert done.returncode == 0, done.stderr
    assert image.imread(tmp_path / "isolation.png").shape[0] > 500
    with xr.open_dataset(tmp_path / "isolation.nc") as result:
        assert result["building"].values.tolist() == ["without devices", "tuned mass damper", "lead-rubber bearings"]
        assert result.sizes["storey"] == 5
        check_labels(result)
        assert {"Conventions", "title", "history", "source", "seed", "method"} <= set(result.attrs)
        assert "scene" not in result.attrs
        laws = [json.loads(str(scene))["structure"]["law"] for scene in result["scene"].values]
        assert [("lead_rubber_bearing" in law) for law in laws] == [False, False, True]
        assert (result["status"] <= 1).all()
        median = result["fragility_median"]
        assert np.isfinite(median).all()
        assert (median.diff("damage_state") > 0).all()
        # Bearings let little through while they hold: light damage needs twice the motion and more.
        slight = median.sel(damage_state="slight")
        assert slight.sel(building="lead-rubber bearings") > 2 * slight.sel(building="without devices")
        # While all is elastic, 5 % of mass tuned to the first mode takes a part of its motion.
        drift = result["peak_storey_drift_ratio"].where(result["im_level"] < 0.15).max("storey").mean("sample")
        alone, tuned = (float(drift.sel(building=name)) for name in ("without devices", "tuned mass damper"))
        assert 0.6 * alone < tuned < 0.97 * alone
