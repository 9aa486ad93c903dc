"""The study of torsion: its file, and the order of the curves that statics requires."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from conftest import documented_commands, run_study
from labels import check_labels
from matplotlib import image


def test_study(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "studies/torsion.py" in c)
    done = run_study(f"{command} --structures 2", tmp_path)
    assert done.returncode == 0, done.stderr
    assert image.imread(tmp_path / "torsion.png").shape[0] > 500
    with xr.open_dataset(tmp_path / "torsion.nc") as result:
        assert result.sizes["model"] == 4
        assert result.sizes["sample"] == 2 * 22 * result.sizes["stripe"]
        check_labels(result)
        assert result.attrs["intensity_measure"].startswith("RotD50 Sa(")
        assert (result["status"] <= 1).all()
        median = result["fragility_median"]
        assert np.isfinite(median).all()
        assert (median.diff("damage_state") > 0).all()
        light = median.sel(damage_state="light")
        chain = float(light.sel(model="symmetric chain"))
        # Torsion raises the drift of the softer wall, but the floors also move in their other modes.
        assert 0.5 * chain < light.sel(model="torsional building") < 0.9 * chain
        assert abs(light.sel(model="symmetric building") / chain - 1) < 0.1
        drift = result["drift_ratio"].where(result["status"] == 0)
        edges, corners = (drift.sel(model=f"torsional building{more}") for more in ("", ", corners"))
        ratio = (corners / edges).values[np.isfinite(edges.values)]
        # A corner drifts at least as much as each of its edges, and at most the square root of 2 times as much.
        assert ratio.min() >= 1 - 1e-5
        assert ratio.max() <= np.sqrt(2) + 1e-5
        assert ratio.max() > 1.1
