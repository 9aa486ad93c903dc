"""The notebook for a hosted GPU runs on the CPU, too; without warpdyn, it asks for the wheel."""

from __future__ import annotations

import os
from typing import Any

import nbformat
import pytest
import xarray as xr
from conftest import ROOT
from nbclient import NotebookClient

NOTEBOOK = ROOT / "docs" / "tutorials" / "hosted_gpu.ipynb"


def read() -> Any:
    return nbformat.read(NOTEBOOK, as_version=4)


@pytest.mark.fast
def test_the_notebook_has_no_results_and_names_the_missing_wheel(tmp_path, monkeypatch):
    notebook = read()
    programs = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in programs)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(FileNotFoundError, match=r"upload warpdyn-\*\.whl into the folder of this notebook"):
        exec(programs[0].source, {})


def test_the_notebook_runs_on_the_cpu_too(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")
    notebook = read()
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    printed = "".join(each.get("text", "") for cell in notebook.cells for each in cell.get("outputs", []))
    assert "self-test: passed on " in printed
    assert "again: 14,080 histories in " in printed
    with xr.open_dataset(tmp_path / "fragility_on_gpu.nc") as result:
        medians = result["fragility_median"].values
        assert result.sizes["sample"] == 14_080
        assert (result["fragility_median_lower"].values < medians).all()
        assert (medians < result["fragility_median_upper"].values).all()
    # The first study (Getting started) has the same building and records, more histories and more random parameters.
    assert medians == pytest.approx([0.21, 0.41, 1.12, 2.6], rel=0.1)
