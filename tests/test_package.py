"""The package as it is handed on: one version, the self-test, a checkout without an installation, the recipe."""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from packaging.requirements import Requirement
from packaging.version import Version

import warpdyn as wd
from warpdyn.interfaces.command_line import self_test as test_of_devices
from warpdyn.interfaces.command_line.program import main

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
RECIPE = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text())
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
# What conda calls otherwise than PyPI.
OF_CONDA = {"netcdf4": "netCDF4", "matplotlib-base": "matplotlib"}

fast = pytest.mark.fast


@fast
def test_the_version_stands_in_one_place_and_its_copies_follow():
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert PROJECT["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "warpdyn.__version__"}
    assert wd.__version__ == CITATION["version"] == RECIPE["context"]["version"]


@fast
def test_the_changelog_begins_with_this_version_or_with_the_next():
    """After a release, the first section may be the next version's: it is unreleased, and the release follows it."""
    sections = re.findall(r"^## \[(.+)\] - (.+)$", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    if sections[0][1] == "unreleased":
        assert Version(sections[0][0]) > Version(wd.__version__)
        del sections[0]
    assert sections[0] == (wd.__version__, str(CITATION["date-released"]))


@fast
def test_the_recipe_asks_for_what_the_package_asks_for():
    project = PROJECT["project"]
    asked = {Requirement(line).name: str(Requirement(line).specifier) for line in project["dependencies"]}
    told = dict(line.split(" ", 1) for line in RECIPE["requirements"]["run"])
    assert told.pop("python") == project["requires-python"]
    assert {OF_CONDA.get(name, name): bound for name, bound in told.items()} == asked
    build = Requirement(PROJECT["build-system"]["requires"][0])
    assert f"{build.name} {build.specifier}" in RECIPE["requirements"]["host"]
    assert RECIPE["build"]["python"]["entry_points"] == [
        f"{name} = {function}" for name, function in project["scripts"].items()
    ]
    assert (RECIPE["about"]["summary"], RECIPE["about"]["license"]) == (project["description"], project["license"])


@fast
def test_the_citation_has_what_an_archive_asks_for():
    """The required keys of the schema, and what Zenodo takes over into a record with a DOI."""
    assert {"cff-version", "message", "title", "authors", "version", "license", "abstract", "keywords"} <= {*CITATION}
    assert CITATION["license"] == PROJECT["project"]["license"]


@pytest.fixture
def uninstalled(monkeypatch):
    """Have Python find no package `warpdyn`, as in a checkout that is not installed."""
    find = importlib.metadata.Distribution.from_name.__func__

    def from_name(cls, name):
        if name == "warpdyn":
            raise importlib.metadata.PackageNotFoundError(name)
        return find(cls, name)

    monkeypatch.setattr(importlib.metadata.Distribution, "from_name", classmethod(from_name))
    with pytest.raises(importlib.metadata.PackageNotFoundError):
        importlib.metadata.version("warpdyn")


def test_a_checkout_that_is_not_installed_runs_to_its_file(uninstalled, tmp_path):
    building = wd.ShearBuilding(2.0e5, 1.0e8, 3.0, damping="rayleigh", damping_ratio=0.05)
    motion = wd.GroundMotion(np.sin(np.arange(200) / 5), 0.01, "sine")
    path = tmp_path / "run.nc"
    run = wd.simulate(wd.Scene(building, wd.Cloud([motion]), recorders=("drift",)), path=path)
    with xr.open_dataset(path) as read:
        assert f"warpdyn {wd.__version__}, warp-lang 1." in read.attrs["source"]
    assert np.isfinite(run["peak_storey_drift"]).all()


def test_the_self_test_tests_every_device_and_fails_if_one_is_wrong(monkeypatch, capsys):
    assert main(["self-test"]) == 0
    printed = capsys.readouterr().out
    assert f"warpdyn      {wd.__version__}\n" in printed
    assert re.search(r"cpu, \d+ cores: passed, largest error \d\.\de-0[5-9] of at most 0\.0001, ", printed)
    assert re.search(r"kernel cache \S+: [1-9]\d* files, \d+\.\d MB\n", printed)
    assert "self-test: passed on " in printed
    # By hand: 1e5 kg at 0.3 m/s have 4,500 J; 500 J are elastic at 1e5 N and 10 mm; 4,000 J over 1e5 N are 40 mm more.
    exact = {name: values[16] for name, values in test_of_devices.EXACT.items()}
    assert test_of_devices.YIELD_FORCES[16] == 1e5
    assert exact == {"peak_storey_drift": pytest.approx(0.05), "hysteretic_energy": pytest.approx(4000.0)}
    wrong = test_of_devices.EXACT["peak_storey_drift"].copy()
    wrong[16] = 0.0501  # one of 64 structures
    monkeypatch.setitem(test_of_devices.EXACT, "peak_storey_drift", wrong)
    assert main(["self-test", "--device", "cpu"]) == 1
    printed = capsys.readouterr().out
    assert "FAILED, largest error 2.0e-03 of at most 0.0001" in printed
    assert "self-test: FAILED on 0 of 1 devices" in printed


def test_a_device_that_fails_is_told_and_makes_the_status_1(monkeypatch, capsys):
    def broken(device):
        raise RuntimeError("no driver")

    monkeypatch.setattr(test_of_devices, "largest_error", broken)
    assert main(["self-test"]) == 1
    assert "FAILED, RuntimeError: no driver" in capsys.readouterr().out


USER = """
import numpy as np
import warpdyn as wd

building = wd.ShearBuilding(2.0e5, 1.0e8, 3.0, law=wd.laws.Bilinear(yield_force=1e6, hardening_ratio=0.05))
motion = wd.GroundMotion(np.zeros(3), 0.01, "none")
run = wd.simulate(wd.Scene(building, wd.Cloud([motion])))
reveal_type(run)
wd.simulate(building)
"""


@pytest.mark.thorough  # mypy reads xarray, NumPy and pandas for ten seconds
def test_types_of_the_public_names_reach_a_users_program(tmp_path):
    """The stub and `py.typed` are in the package: mypy sees a run's type, and a mistake."""
    program = tmp_path / "program.py"
    program.write_text(USER)
    command = [sys.executable, "-m", "mypy", "--ignore-missing-imports", "--follow-imports=silent", program.name]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False).stdout
    assert 'Revealed type is "xarray.core.dataset.Dataset"' in told
    assert 'Argument 1 to "simulate" has incompatible type "ShearBuilding"; expected "Scene"' in told
    assert "Found 1 error in 1 file" in told
