"""The study of rare collapse runs with few samples, and its probabilities decrease with the intensity."""

import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr

STUDY = Path(__file__).parents[1] / "studies" / "rare_collapse.py"


@pytest.mark.thorough  # it compiles five kernels
def test_study_of_rare_collapse(tmp_path):
    command = [sys.executable, str(STUDY), "--out", str(tmp_path), "--device", "cpu", "--samples", "200"]
    subprocess.run(command, check=True, capture_output=True)
    table = xr.open_dataset(tmp_path / "rare_collapse.nc")
    of_building = table["probability"].values[table["problem"].values == "collapse, subset"]
    assert of_building[0] < 0.01 * of_building[-1]
    assert (tmp_path / "rare_collapse.png").stat().st_size > 0
