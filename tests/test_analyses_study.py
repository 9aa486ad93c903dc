"""The study of analyses runs, and its results agree with the reference results."""

from pathlib import Path

import pytest
import xarray as xr
from conftest import documented_commands, run_study
from matplotlib import image

STUDIES = Path(__file__).parents[1] / "studies"


@pytest.mark.fast
def test_the_closed_forms_of_losses_agree(monkeypatch):
    monkeypatch.syspath_prepend(str(STUDIES))
    from parts.analyses import losses

    rows, _ = losses.compared()
    assert [row.reference for row in rows[:2]] == pytest.approx([0.00406456319, 0.000632354063], rel=1e-9)
    assert rows[-1].reference == pytest.approx(0.000208126024, rel=1e-8)
    assert max(row.share for row in rows) < 1


@pytest.mark.thorough  # it compiles six kernels
def test_study_of_analyses(tmp_path):
    (command,) = (each for each in documented_commands() if "studies/analyses.py" in each)
    done = run_study(f"{command} --structures 1000", tmp_path)
    assert done.returncode == 0, done.stderr
    assert image.imread(tmp_path / "analyses.png").shape[0] > 300
    with xr.open_dataset(tmp_path / "analyses.nc") as table:
        share = table["difference_over_tolerance"].values
    # 15 quantities have a 95 % interval as tolerance: more than 3 of them are outside with a probability of 0.6 %.
    assert (share > 1).sum() <= 3
    assert share.max() < 2
