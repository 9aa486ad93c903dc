"""The study gpu_scaling: its measurements on a CPU, which stands for two GPUs, and its figure."""

import csv
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT

import warpdyn as wd

sys.path.insert(0, str(ROOT / "studies"))
import gpu_scaling


def run_on(monkeypatch, tmp_path, results):
    """Run the study with a simulate that returns the next of the results at each call."""
    given = []

    def simulate(scene, *, device, **settings):
        given.append((device, settings))
        times = {"seconds_in_kernels": 1.0 / len(device), "seconds_sampling": 0.1, "seconds_integrating": 0.2}
        return xr.Dataset({"counts": ("state", results(len(device)))}, attrs=times)

    region = SimpleNamespace(stock=SimpleNamespace(portfolio=SimpleNamespace(buildings=3)), scene=None, statistics=[])
    monkeypatch.setattr(gpu_scaling, "available_devices", lambda: ["cpu", "cuda:0", "cuda:1"])
    monkeypatch.setattr(gpu_scaling, "gpus", lambda devices: "a GPU")
    monkeypatch.setattr(gpu_scaling, "build_region", lambda buildings, seed: region)
    monkeypatch.setattr(wd, "simulate", simulate)
    # The study collects garbage before it measures: seconds each time, in a process with the objects of other tests.
    monkeypatch.setattr(gpu_scaling, "gc", SimpleNamespace(collect=lambda: None))
    monkeypatch.setattr(sys, "argv", ["gpu_scaling.py", "--out", str(tmp_path), "--samples", "64", "--repeats", "1"])
    gpu_scaling.main()
    return given


def test_the_study_measures_one_and_two_gpus(monkeypatch, tmp_path):
    given = run_on(monkeypatch, tmp_path, lambda count: np.arange(3))
    assert [len(device) for device, _ in given] == 3 * [1, 1, 2, 2]  # the first run of each pair loads the kernels
    rows = list(csv.DictReader((tmp_path / "gpu_scaling.csv").open()))
    assert [(row["run"], int(row["gpus"])) for row in rows] == [
        (name, count) for name in ("drifts", "counts", "city") for count in (1, 2)
    ]
    assert [float(row["kernels"]) for row in rows[:2]] == [1.0, 0.5]
    assert [int(row["histories"]) for row in rows[::2]] == [64, 64, 150]
    assert (tmp_path / "gpu_scaling.png").stat().st_size > 10_000


def test_results_that_depend_on_the_number_of_gpus_stop_the_study(monkeypatch, tmp_path):
    with pytest.raises(SystemExit, match="drifts: the results on 2 GPUs differ from those on one"):
        run_on(monkeypatch, tmp_path, lambda count: np.arange(3) + count)


def test_the_storeys_run_on_a_cpu():
    run = wd.simulate(gpu_scaling.storeys_scene(), structures=1, method="rk4", step=0.01, device="cpu")
    assert run.sizes["sample"] == gpu_scaling.MOTIONS
    assert (run["status"] == 0).all()


def test_a_machine_without_a_gpu_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr(gpu_scaling, "available_devices", lambda: ["cpu"])
    monkeypatch.setattr(sys, "argv", ["gpu_scaling.py", "--out", str(tmp_path)])
    with pytest.raises(SystemExit, match="needs at least one GPU"):
        gpu_scaling.main()
