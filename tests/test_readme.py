"""Every command and program in the README, and in the pages that took them over, runs.

`.ci/run` runs the install steps in front of the README's two commands, and the programs of pages that show what they
print, when it builds the site.
"""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT, documented_commands, run_study

from warpdyn.campaigns.integration import stability_guard
from warpdyn.engine.kernels.composing.user_recorders import USERS
from warpdyn.engine.kernels.output_table import ADAPTIVE, HISTORY, RECORDERS
from warpdyn.foundations.core.output_variables import STATUS_MEANINGS


@pytest.mark.fast
def test_first_screen_holds_the_two_commands() -> None:
    first_screen = (ROOT / "README.md").read_text().splitlines()[:25]
    commands = [line for line in first_screen if line.startswith("python3 -m venv .venv && .venv/bin/pip install")]
    assert commands == documented_commands()[:2]
    assert commands[0].endswith("python studies/p695_fragility.py --out results")
    assert commands[1].endswith("python -m pytest")


# Pages whose programs are run here, one after the other in one process; each begins anew.
PAGES = (
    "README.md",
    "docs/index.md",
    "docs/getting_started.md",
    "docs/how_to/answers.md",
    "docs/how_to/command_line.md",
    "docs/how_to/control.md",
    "docs/how_to/live.md",
    "docs/how_to/loads_and_designs.md",
    "docs/how_to/built_structures.md",
    "docs/how_to/portfolios_and_files.md",
    "docs/how_to/record_selection.md",
    "docs/how_to/records.md",
    "docs/how_to/synthetic_motions.md",
    "docs/how_to/scatter.md",
    "docs/how_to/reproduce.md",
)
# Run by hand, and named in the page of studies without a command: what the last four write is held by other tests.
BY_HAND = {"clusters", "default_methods", "gpu_scaling", "law_cycles", "law_methods", "validation", "verification"}


@pytest.mark.fast
def test_every_command_is_known_here() -> None:
    # The main job is run by the fixture `main_job`, the tests by this very run, the seed frame below; the others by
    # tests of their own, on fewer samples.
    scripts = [re.search(r"studies/\w+\.py", c)[0] for c in documented_commands() if "studies/" in c]
    names = {
        "p695_fragility",
        "seed_frame",
        "stability",
        "accuracy_speed",
        "analyses",
        "decision",
        "benchmark",
        "growth",
        "hazard_consistent",
        "portfolio",
        "rare_collapse",
        "metropolis",
        "isolation",
        "calibrate_column",
        "control",
        "live_damage",
        "laws",
        "simcenter",
        "torsion",
        "four_storey_frame",
        "frame_methods",
        "torsional_speed",
    }
    assert sorted(scripts) == sorted(f"studies/{name}.py" for name in names)
    page = (ROOT / "docs/how_to/studies.md").read_text()
    studies = {file.stem for file in (ROOT / "studies").glob("*.py")}
    assert studies == names | BY_HAND
    assert all(f"studies/{name}.py" in page for name in studies)


@pytest.mark.thorough  # test_seed_frame.py runs the study
def test_seed_frame_command(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "seed_frame" in c)
    done = run_study(command, tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "seed_frame.nc").stat().st_size > 0


def program_of(page: str) -> str:
    """Return the program of a page: its blocks of Python, and the cells that the site runs."""
    fences = r"^```(?:python|\{code-cell\} ipython3)\n(?::[^\n]*\n)*(.*?)^```$"
    blocks = re.findall(fences, (ROOT / page).read_text(), flags=re.DOTALL | re.MULTILINE)
    assert blocks, f"{page} has no program"
    return "".join(blocks)


@pytest.mark.fast
def test_every_page_with_a_program_is_run() -> None:
    # The site runs the cells of a page that begins with `file_format: mystnb`; a block of plain Python runs here.
    plain = {
        str(page.relative_to(ROOT))
        for folder in ("how_to", "explanation", "extending")
        for page in (ROOT / "docs" / folder).glob("*.md")
        if re.search(r"^```python\n", page.read_text(), flags=re.MULTILINE)
    }
    # Another machine's cluster, and steps of changes to warpdyn itself.
    elsewhere = {"docs/how_to/clusters.md", *(page for page in plain if page.startswith("docs/extending/"))}
    assert plain - elsewhere <= set(PAGES)


@pytest.mark.fast
def test_every_variable_of_a_run_is_in_the_contract() -> None:
    page = (ROOT / "docs/reference/dataset.md").read_text()
    # Without recorders that users, tests or filters have defined in this process.
    own = [row for rows in RECORDERS.values() for recorder, row in rows.items() if recorder not in USERS]
    recorded = [name for row in own for name in row]
    missing = [name for name in (*recorded, *HISTORY, *ADAPTIVE, *STATUS_MEANINGS) if f"`{name}`" not in page]
    assert not missing


@pytest.mark.fast
def test_every_warning_of_a_run_is_told() -> None:
    # A word of each warning of an integration, from the code that gives it.
    page = (ROOT / "docs/how_to/trust.md").read_text()
    source = inspect.getsource(stability_guard.StabilityFindings.warn)
    words = (
        "stability limit",
        "diverged",
        "unstable_step",
        "not_converged",
        "than half of the capacity",
        "first period",
    )
    words += (
        "estimated error",
        "sensitive",
        "largest number of their type",
        "whether a storey unloads",
        "`unreliable`",
        "energy balance",
    )
    assert source.count("messages.append(") + source.count("messages += [") == 12  # the page explains each
    assert all(word in source and word in page for word in words)


def test_programs_of_pages(tmp_path: Path) -> None:
    # One process compiles and imports once for all; each page has names of its own.
    calls = [f"exec(compile({program_of(page)!r}, {page!r}, 'exec'), {{'__name__': '__main__'}})\n" for page in PAGES]
    command = [sys.executable, "-W", "error::UserWarning", "-W", "error::RuntimeWarning", "-c", "".join(calls)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(tmp_path / "own_building.nc") as result:
        assert result.sizes["sample"] == 3 * 40 * 8  # structures per motion, motions, levels
        assert (result["status"] == 0).all()
        median = result["fragility_median"].values
        assert 0 < median[0] < median[1] < 3.2
        for bound in ("lower", "upper"):
            assert np.isfinite(result[f"fragility_median_{bound}"]).all()
            assert np.isfinite(result[f"fragility_dispersion_{bound}"]).all()
