"""The study of methods for frames with hinges: orders of convergence, and OpenSees that converges to the reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import documented_commands, run_study
from labels import check_labels
from matplotlib import image


@pytest.mark.thorough  # it compiles ten kernels
def test_study(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "studies/frame_methods.py" in c)
    done = run_study(f"{command} --end 2 --steps 2", tmp_path)
    assert done.returncode == 0, done.stderr
    assert image.imread(tmp_path / "frame_methods.png").shape[0] > 500
    with xr.open_dataset(tmp_path / "frame_methods.nc") as result:
        check_labels(result)
        assert (result["seconds_per_history"] > 0).all()
        elastic = result["error"].sel(level="elastic")
        orders = np.log2(elastic[:, 0] / elastic[:, 1])
        assert orders.sel(method="rk4").item() == pytest.approx(4, abs=0.3)
        for method in ("heun", "velocity_verlet", "leapfrog", "Newmark (OpenSees)"):
            assert orders.sel(method=method).item() == pytest.approx(2, abs=0.4), method
