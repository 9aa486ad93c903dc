"""The result file of the main job: its variables, and curves that agree with its samples."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest
import warp as wp
import xarray as xr
from conftest import ROOT
from matplotlib import image
from nbclient import NotebookClient
from scipy.optimize import minimize
from scipy.stats import norm

import warpdyn as wd

STATES = ["slight", "moderate", "extensive", "complete"]


@pytest.fixture(scope="module")
def result(main_job: tuple[Path, str]) -> xr.Dataset:
    with xr.open_dataset(main_job[0] / "p695_fragility.nc") as dataset:
        return dataset.load()


def test_samples_are_flat_and_traceable(result: xr.Dataset) -> None:
    for name in ("motion_index", "im_level", "structure", "status"):
        assert result[name].dims == ("sample",)
    assert result.sizes["sample"] >= 21_120
    cells = np.unique(np.stack([result["motion_index"], result["im_level"]]), axis=1, return_counts=True)
    assert cells[0].shape[1] == 44 * np.unique(result["im_level"]).size
    assert np.unique(result["im_level"]).size >= 12
    assert cells[1].min() >= 40
    for name in ("mass", "stiffness", "yield_force", "damping_ratio"):
        assert result[name].dims[0] == "sample"
        assert result[name].std() > 0


def test_status_is_a_flag_variable_without_failures(result: xr.Dataset) -> None:
    assert result["status"].attrs["flag_meanings"] == "ok collapsed diverged unstable_step not_converged control_failed"
    assert np.array_equal(result["status"].attrs["flag_values"], [0, 1, 2, 3, 4, 5])
    assert result["status"].max() <= 1
    assert np.isfinite(result["peak_storey_drift_ratio"]).all()


def test_energy_balances_in_every_sample(result: xr.Dataset) -> None:
    # On a CPU the default method of this building is stoermer, whose energies are trapezoidal sums over whole steps.
    # Largest measured error: 3.6e-3, and 1/7 of it with half the step. RK4, the default on a GPU: 2e-4.
    assert np.abs(result["energy_balance_error"]).max() < (1e-3 if result.attrs["method"] == "rk4" else 5e-3)


def test_curves_are_ordered_and_bounded(result: xr.Dataset) -> None:
    assert result["damage_state"].values.tolist() == STATES
    median, dispersion = result["fragility_median"].values, result["fragility_dispersion"].values
    assert result["fragility_median"].attrs["units"] == "g"
    assert np.all(np.diff(median) > 0)
    # Lognormal curves with different dispersions cross. These cross only where both differ from 0 or 1 by rounding.
    assert np.all(np.diff(result["fragility_curve"].values, axis=0) <= 1e-12)
    for name, value in (("fragility_median", median), ("fragility_dispersion", dispersion)):
        assert np.all(result[f"{name}_lower"] < value)
        assert np.all(value < result[f"{name}_upper"])
    last = result["exceedance_fraction"].sel(damage_state="complete").values[-1]
    assert last > 0.95  # at the highest level, nearly all samples exceed the last limit


def test_curves_fit_the_samples(result: xr.Dataset) -> None:
    """Count the exceedances and fit the curves by SciPy, without functions of warpdyn."""
    worst = result["peak_storey_drift_ratio"].max("storey").values
    levels, stripe = np.unique(result["im_level"], return_inverse=True)
    for state, limit in zip(STATES, (0.0033, 0.0067, 0.02, 0.0533), strict=True):
        total = np.bincount(stripe)
        exceeding = np.bincount(stripe, (worst > limit) | (result["status"].values == 1))

        def loss(x: np.ndarray, k: np.ndarray = exceeding, n: np.ndarray = total) -> float:
            z = (np.log(levels) - x[0]) / np.exp(x[1])
            return -np.sum(k * norm.logcdf(z) + (n - k) * norm.logsf(z))

        fit = minimize(loss, [0.0, -1.0], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-10}).x
        row = result.sel(damage_state=state)
        assert float(row["fragility_median"]) == pytest.approx(np.exp(fit[0]), rel=1e-5)  # tolerance of Nelder-Mead
        assert float(row["fragility_dispersion"]) == pytest.approx(np.exp(fit[1]), rel=1e-5)


def test_elastic_stripe_follows_the_spectrum(result: xr.Dataset) -> None:
    """At 0.05 g the building is elastic. Its first storey drift is Sd(T1) times the share of this storey in mode 1."""
    weak = result.isel(sample=np.flatnonzero(np.isclose(result["im_level"], 0.05)))
    drift = weak["peak_storey_drift"].sel(storey=1).values
    spectral_displacement = 0.05 * 9.80665 * (0.75 / (2 * np.pi)) ** 2
    # First mode of a uniform chain of five storeys: shape sin(i pi / 11); participation factor at the top floor: 1.252.
    shape = np.sin(np.arange(1, 6) * np.pi / 11)
    expected = shape.sum() / (shape @ shape) * shape[0] * spectral_displacement
    # The building has 7 % damping (spectrum: 5 %), higher modes and random periods: only the median is compared.
    assert np.median(drift) == pytest.approx(expected, rel=0.15)


@pytest.mark.as_shipped
def test_default_step_errs_as_little_as_the_readme_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference is float64 at half of the shortest record step; its error is about 1/10 of that of the default."""
    monkeypatch.syspath_prepend(ROOT / "studies")
    scene = importlib.import_module("p695_fragility").build_scene()
    default, fine = (
        wd.simulate(scene, structures=2, device="cpu", **how) for how in ({}, {"step": 0.00125, "dtype": "float64"})
    )
    np.testing.assert_array_equal(default["storey_of_collapse"], fine["storey_of_collapse"])
    error = np.abs(default["peak_storey_drift_ratio"] / fine["peak_storey_drift_ratio"] - 1)
    assert error.quantile(0.95) < 0.0007
    # The largest errors are in other storeys of buildings that collapse 0.3 ms too early or too late: 0.0048; without
    # these buildings 0.003.
    assert error.max() < 0.0055


def test_figures_are_drawn(main_job: tuple[Path, str]) -> None:
    kinds = ("drift_over_height", "drift_against_intensity", "fragility", "hysteresis", "ida_curves", "residual_drifts")
    for name in (f"p695_{kind}" for kind in kinds):
        pixels = image.imread(main_job[0] / f"{name}.png")
        assert min(pixels.shape[:2]) > 400
        assert np.mean(pixels[..., :3].min(axis=2) < 0.9) > 0.02  # the figure is not empty


FIGURES = {
    "fragility_curves": "run",
    "fragility_comparison": "{'as it is': run, 'again': run}",
    "drift_over_height": "run",
    "drift_against_intensity": "run",
    "residual_drifts": "run",
    "drift_distributions": "{'as it is': run}, level=4.0",
    "ida_curves": "run",
    "histories": "run",
    "hysteresis": "run",
    "building": "building",
    "pushover_curve": "wd.pushover(building, np.linspace(0.01, 0.3, 30))",
    "ground_motions": "motion",
    "spectra": "wd.response_spectra(motion, [0.1, 0.5, 1.0], device='cpu')",
    "capacities": "wd.capacities(scene_of_low, {'slight': 0.003}, device='cpu')",
    "cloud_regression": "run, wd.fragility_of_cloud(run.isel(sample=slice(0, None, 29)), {'slight': 0.005})",
    "hazard_and_rates": "run, hazard",
    "disaggregation": "wd.disaggregate(run, hazard)",
    "vulnerability": "wd.vulnerability(run, wd.hazus_loss_ratios('RES3'))",
    "damage_map": "results, 'extensive'",
    "loss_exceedance": "wd.annual_losses(run, hazard, wd.hazus_loss_ratios('RES3'))",
}


WITH_PYPLOT = pytest.param("import matplotlib.pyplot as plt", marks=pytest.mark.thorough)


@pytest.mark.parametrize("pyplot", ["", WITH_PYPLOT])
def test_figures_show_once_where_they_are_the_last_line(main_job: tuple[Path, str], pyplot: str) -> None:
    assert set(FIGURES) == set(wd.plots.__all__) - {
        "animate",
        "frame",
        "fragility_surface",
        "record_selection",
        "sensitivity",
        "state_dependent_fragility",
    }  # an animation; figures of frames and of other datasets than those of the main job, which their own tests draw
    lines = [
        "import numpy as np, pandas as pd, xarray as xr, warp as wp, warpdyn as wd\n"
        f"wp.config.optimization_level = {wp.config.optimization_level}\n{pyplot}",  # as in other tests
        f"run = xr.open_dataset({str(main_job[0] / 'p695_fragility.nc')!r})\n"
        "building, low = wd.ShearBuilding.from_hazus('C1M', 'high', 5), wd.ShearBuilding.from_hazus('W1', 'high', 1)\n"
        "motion = wd.GroundMotion(np.sin(np.arange(200.0) / 9), 0.01)\n"
        "scene_of_low = wd.Scene(low, wd.Cloud([motion]), recorders=('drift',))\n"
        "hazard = wd.HazardCurve([0.02, 0.1, 0.5, 2.0, 10.0], [0.3, 0.05, 3e-3, 1e-4, 1e-6], measure='')\n"
        "columns = ['longitude', 'latitude', 'number', 'probability_extensive', 'standard_error_extensive']\n"
        "results = pd.DataFrame([[-122.3, 37.8, 1, 0.1, 0.1], [-122.2, 37.9, 1, 0.4, 0.1]], columns=columns)",
        *(f"wd.plots.{name}({arguments})" for name, arguments in FIGURES.items()),
        "building",
        "wd.summary(run)",
    ]
    if pyplot:
        lines.append("axes = plt.subplots()[1]\nwd.plots.ida_curves(run, ax=axes)")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(line) for line in lines])
    NotebookClient(notebook, timeout=300).execute()
    drawn = [[kind for output in cell.outputs for kind in output.get("data", ())] for cell in notebook.cells]
    figures = drawn[2 : 2 + len(FIGURES)]
    for name, kinds in zip(FIGURES, figures, strict=True):
        assert kinds.count("image/png") == 1, name
    assert sum(kinds.count("image/png") for kinds in drawn) == len(FIGURES) + bool(pyplot)
    tables = drawn[2 + len(FIGURES) :][:2]
    assert all("text/html" in kinds for kinds in tables)


def test_unwritable_output_is_said_before_the_run(tmp_path: Path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("not a folder")
    command = [sys.executable, "studies/p695_fragility.py", "--out", str(blocker / "results")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=os.environ.copy(), check=False)
    assert done.returncode != 0
    assert "cannot write" in done.stderr
    assert "samples:" not in done.stdout


def test_table_in_the_documentation_is_what_the_main_job_prints(main_job: tuple[Path, str]) -> None:
    # The tolerance is 1 %, because float32 sums differ in the last digits between processors.
    def numbers(text: str) -> list[list[float]]:
        rows = re.findall(r"^(?:slight|moderate|extensive|complete) .*$", text, flags=re.MULTILINE)
        return [[float(n) for n in re.findall(r"\d+\.\d+", row)] for row in rows]

    told, printed = numbers((ROOT / "docs/getting_started.md").read_text()), numbers(main_job[1])
    assert len(told) == 4
    for told_row, printed_row in zip(told, printed, strict=True):
        assert len(told_row) == len(printed_row) == 7
        assert all(abs(a - b) <= 0.01 * b + 0.002 for a, b in zip(told_row, printed_row, strict=True))
