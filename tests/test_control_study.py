"""The study of control: its file and figure, and what delay does to controlled buildings."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr
from conftest import documented_commands, run_study
from labels import check_labels
from matplotlib import image


@pytest.mark.thorough  # ten kernels, one for each delay; the tests of control simulate the same loops
def test_study(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "studies/control.py" in c)
    done = run_study(f"{command} --structures 64", tmp_path)
    assert done.returncode == 0, done.stderr
    assert image.imread(tmp_path / "control.png").shape[0] > 400
    with xr.open_dataset(tmp_path / "control.nc") as result:
        check_labels(result)
        assert {"Conventions", "title", "history", "source", "seed", "method"} <= set(result.attrs)
        worse, unstable = result["probability_worse"], result["share_unstable"]
        assert (worse.isel(delay=0) < 0.05).all()
        assert (result["median_ratio"].isel(delay=0) < 0.7).all()
        # Weak motions: control makes the response worse where the elastic loop is unstable.
        assert (abs(worse.sel(motion_strength="weak motion") - unstable) < 0.2).all()
        assert worse.sel(motion_strength="weak motion").isel(delay=-1) > 0.95
