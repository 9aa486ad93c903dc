"""The study of the four-storey frame: its file, and models that agree with the frame where they must."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import documented_commands, run_study
from labels import check_labels
from matplotlib import image


@pytest.mark.thorough  # it compiles seven kernels
def test_study(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "studies/four_storey_frame.py" in c)
    done = run_study(f"{command} --frames 1", tmp_path)
    assert done.returncode == 0, done.stderr
    assert image.imread(tmp_path / "four_storey_frame.png").shape[0] > 500
    with xr.open_dataset(tmp_path / "four_storey_frame.nc") as result:
        assert result["model"].values.tolist() == ["frame", "fish-bone", "flexural-shear stick", "shear stick"]
        assert result.sizes["sample"] == 44 * result.sizes["stripe"]
        check_labels(result)
        assert (result["status"] <= 1).mean() > 0.99
        median = result["fragility_median"]
        assert np.isfinite(median).all()
        assert (median.diff("damage_state") > 0).all()
        bone = result.sel(model="fish-bone")
        # Elastic histories differ from those of the frame only by the shortening of columns and unequal rotations.
        ratio = bone["drift_over_frame"]
        assert np.abs(ratio[::3] - 1).max() < 0.1
        assert np.abs(ratio[1::3] - 1).max() < 0.15
        for model, hinges in (("frame", 56), ("fish-bone", 12)):
            rotation = result["hinge_rotation"].sel(model=model).dropna("hinge")
            assert rotation.sizes["hinge"] == hinges
            assert (rotation.diff("quantile") >= 0).all()
        # Columns that do not shorten change the drifts by 4.2 % at most, in an elastic history.
        assert np.abs(result["drift_over_frame"].sel(model="frame") - 1).max() < 0.05
