"""The study of hazard-consistent motions: its files, and the effect of the selection at large drifts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import documented_commands, run_study
from matplotlib import image


@pytest.mark.thorough
def test_study(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "studies/hazard_consistent.py" in c)
    done = run_study(f"{command} --structures 8", tmp_path)
    assert done.returncode == 0, done.stderr
    for name in ("hazard_consistent", "hazard_consistent_selection"):
        assert image.imread(tmp_path / f"{name}.png").shape[0] > 300
    with xr.open_dataset(tmp_path / "hazard_consistent.nc") as result:
        median = result["fragility_median"]
        selected, far_field, synthetic = (median.isel(motions=place) for place in range(3))
        assert np.isfinite(median.sel(damage_state=["slight", "moderate", "extensive"])).all()
        # Small drifts depend on Sa(T1) alone; the curves of moderate damage differ by less than their intervals.
        assert np.allclose(selected.sel(damage_state="moderate"), far_field.sel(damage_state="moderate"), rtol=0.15)
        # At large drifts, the spectrum at longer periods counts, and it is lower after the selection.
        for other in (far_field, synthetic):
            assert selected.sel(damage_state="extensive") > 1.02 * other.sel(damage_state="extensive")
