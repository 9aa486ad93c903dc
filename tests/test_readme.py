"""Every command and program in the README runs. `.ci/run` runs the install steps in front of them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT, readme_commands, run_study


@pytest.mark.fast
def test_first_screen_holds_the_two_commands() -> None:
    first_screen = (ROOT / "README.md").read_text().splitlines()[:25]
    commands = [line for line in first_screen if line.startswith("python3 -m venv .venv && .venv/bin/pip install")]
    assert commands == readme_commands()[:2]
    assert commands[0].endswith("python studies/p695_fragility.py --out results")
    assert commands[1].endswith("python -m pytest")


@pytest.mark.fast
def test_every_command_is_known_here() -> None:
    # The main job is run by the fixture `main_job`, the tests by this very run, the seed frame below; the others by
    # tests of their own, on fewer samples.
    scripts = {re.search(r"studies/\w+\.py", c)[0] for c in readme_commands() if "studies/" in c}
    names = (
        "p695_fragility",
        "seed_frame",
        "stability",
        "accuracy_speed",
        "decision",
        "benchmark",
        "portfolio",
        "metropolis",
        "isolation",
        "laws",
        "simcenter",
    )
    assert scripts == {f"studies/{name}.py" for name in names}


@pytest.mark.thorough  # test_seed_frame.py runs the study
def test_seed_frame_command(tmp_path: Path) -> None:
    (command,) = (c for c in readme_commands() if "seed_frame" in c)
    done = run_study(command, tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "seed_frame.nc").stat().st_size > 0


def test_program_for_ones_own_building(tmp_path: Path) -> None:
    # One program after the other: the second goes on from the first.
    program = "".join(re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL))
    command = [sys.executable, "-W", "error::UserWarning", "-W", "error::RuntimeWarning", "-c", program]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(tmp_path / "own_building.nc") as result:
        assert result.sizes["sample"] == 32 * 40 * 8
        assert (result["status"] == 0).all()
        median = result["fragility_median"].values
        assert 0 < median[0] < median[1] < 3.2
        for bound in ("lower", "upper"):
            assert np.isfinite(result[f"fragility_median_{bound}"]).all()
            assert np.isfinite(result[f"fragility_dispersion_{bound}"]).all()
