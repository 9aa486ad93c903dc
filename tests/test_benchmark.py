"""The study benchmark: peers of the same building agree, those that are not there are named, and none stops the run."""

from __future__ import annotations

import importlib
import importlib.util
import io
import shutil
import sys
import warnings
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT
from matplotlib import image
from method_sources import thorough_unless

import warpdyn as wd

needs_compiler = pytest.mark.skipif(shutil.which("g++") is None, reason="the C++ peer is compiled by g++")
STUDIES = ROOT / "studies"
# The whole study starts a process for each peer, which compiles; peers that fail are met by default.
whole_study = pytest.mark.thorough


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(STUDIES)
        yield importlib.import_module("benchmark")


def known_starts(devices: list[str]) -> list[dict]:
    """What starts cost, as told once: measuring it compiles with an empty cache in a process of its own."""
    first = {"device": devices[0], "start": "empty cache", "process": 9.0, "importing": 1.5, "first_run": 5.0}
    return [
        first | {"second_run": 0.1},
        first | {"start": "later", "process": 4.0, "first_run": 0.5, "second_run": 0.1},
    ]


@pytest.fixture(scope="module")
def result(study: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> tuple[xr.Dataset, Path, str]:
    """The study in its quick mode, but for the starts: its dataset, its folder and what it printed."""
    out, printed = tmp_path_factory.mktemp("benchmark"), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
        patch.setattr(sys, "argv", ["benchmark.py", "--out", str(out), "--device", "cpu", "--quick"])
        patch.setattr(study, "measure_starts", known_starts)
        study.main()
    with xr.open_dataset(out / "benchmark.nc") as dataset:
        return dataset.load(), out, printed.getvalue()


def rows_of(dataset: xr.Dataset, **chosen: object) -> xr.Dataset:
    held = np.ones(dataset.sizes["measurement"], bool)
    for name, value in chosen.items():
        held &= dataset[name].values == value
    return dataset.isel(measurement=np.flatnonzero(held))


def peer_case(study: ModuleType, peer: str, **own: object) -> dict:
    size = study.cases.QUICK | {"storeys": (own.get("storeys", 3),)}
    case = study.cases.scaling_case("cpu", 256, size) | {"part": "kernels", "peer": peer, "threads": 1}
    return case | own | {"run_samples": 64}


@needs_compiler
@whole_study
@pytest.mark.parametrize("law", ["elastic", "bouc_wen"])
def test_cpp_integrates_the_same_building(study: ModuleType, law: str) -> None:
    """Code that shares nothing with the engine's kernels, in the engine's own precision."""
    cases = [peer_case(study, "cpp_vectors", law=law, storeys=n, dtype="float64") for n in (1, 5)]
    for row in study.measure_peers(cases, 120):
        assert row["status"] == "measured", row["note"]
        assert row["peak_drift_difference"] < 1e-10  # rounding of 200 steps, summed in another order. Seen: 1e-14


@needs_compiler
def test_a_compiled_peer_leaves_numbers_below_the_least_normal_one(study: ModuleType) -> None:
    """A library linked with -ffast-math would turn them to 0 in all code of the process that runs later."""
    compiled, peer = (importlib.import_module(f"peers.{name}") for name in ("compiled", "cpp_vectors"))
    ensemble = study.cases.draw_ensemble(1, 8, 20)
    terms = {"law": "elastic", "dtype": "float64", "device": "cpu", "substeps": 1, "recorders": "drift"}
    case = study.cases.build_peer_case(ensemble, terms, np.arange(8))
    assert compiled.load("g++", peer.FLAGS, "shear_chain.cpp", **compiled.macros_of(case), LANES=8).shear_chain
    least = np.finfo(np.float64).smallest_normal
    assert np.float64(least) / np.float64(2) * np.float64(2) == least


@needs_compiler
@pytest.mark.parametrize(
    ("law", "storeys"),
    [("elastic", 1), thorough_unless(False, "bilinear", 1), thorough_unless(False, "bilinear", 5)],
)
def test_cpp_by_stoermer_integrates_the_same_building(study: ModuleType, law: str, storeys: int) -> None:
    """With warpdyn's extrapolation of the velocity; and at the start the motion and its rate are 0, as in the peer."""
    peer = importlib.import_module("peers.cpp_stoermer")
    time = study.cases.STEP * np.arange(401)
    waves = (np.sin(9 * time) + np.sin(28 * time)) * np.minimum(time, 1) ** 4
    motion = wd.GroundMotion(waves, study.cases.STEP, "two sines")
    ensemble = replace(study.cases.draw_ensemble(storeys, 8, 400), motion=motion)
    chosen = np.arange(8)
    scene = study.cases.build_scene(ensemble, law, "drift", chosen)
    with warnings.catch_warnings(action="ignore"):
        settings = {"method": "stoermer", "dtype": "float64", "step": study.cases.STEP, "device": "cpu"}
        own = wd.simulate(scene, structures=8, **settings)
    terms = {"law": law, "dtype": "float64", "device": "cpu", "substeps": 1, "recorders": "drift"}
    case = study.cases.build_peer_case(ensemble, terms, chosen)
    options = peer.macros_of(case) | {"ADAMS_BASHFORTH": 1}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peer, "macros_of", lambda _: options)
        found = peer.measure(case).peak_storey_drift
    # Rounding of 400 steps. Seen: 1e-13.
    np.testing.assert_allclose(found, own["peak_storey_drift"].values, rtol=1e-10)
    assert found.max() > 0.01  # the yield drift


@whole_study
def test_peers_that_are_there_agree(result: tuple[xr.Dataset, Path, str]) -> None:
    dataset = result[0]
    if shutil.which("g++"):
        row = rows_of(dataset, peer="cpp_vectors")
        assert row["status"].values.tolist() == ["measured"]
        assert row["peak_drift_difference"].item() < 2e-5  # float32 over 200 steps of 4 stages. Seen: 1e-6
        row = rows_of(dataset, peer="cpp_stoermer")
        assert row["status"].values.tolist() == ["measured"]
        assert row["peak_drift_difference"].item() < 2e-3  # other formulas of the second and third order. Seen: 8e-4
    if importlib.util.find_spec("openseespy"):
        assert (rows_of(dataset, peer="opensees_newmark", part="laws")["status"] == "measured").all()
        assert set(rows_of(dataset, peer="warpdyn", part="laws")["method"].values) == {"rk4", "velocity_verlet"}
        row = rows_of(dataset, peer="opensees_newmark", part="kernels")
        assert row["status"].values.tolist() == ["measured"]
        assert row["peak_drift_difference"].item() < 0.01  # it integrates z by a method of first order
        assert row["substeps"].item() == 8
    own = rows_of(dataset, peer="warpdyn")
    assert (own["status"] == "measured").all()
    # Rounding of RK4 in single precision; velocity Verlet's own error, of second order. Seen: 2e-6 and 4e-5.
    for method, limit in {"rk4": 2e-5, "velocity_verlet": 2e-4, "stoermer": 2e-5}.items():
        assert (rows_of(dataset, peer="warpdyn", method=method)["peak_drift_difference"] < limit).all()
    assert own["peak_drift_difference"].max() > 0  # float32 beside float64


@whole_study
def test_peers_that_are_not_there_are_named(study: ModuleType, result: tuple[xr.Dataset, Path, str]) -> None:
    dataset, _, printed = result
    for row in study.cases.PEERS:
        device = "cpu" if row["device"] == "cpu" else "none"
        found = rows_of(dataset, peer=row["peer"], device=device)
        assert found.sizes["measurement"] > 0, row["peer"]
        absent = found["status"].values == "missing"
        assert (np.isnan(found["seconds"]) == ~np.isin(found["status"], ("measured", "disagrees"))).all()
        assert (found["note"].values[absent] != "").all()
        if device == "none":
            assert absent.all()
        if absent.any():
            assert study.cases.LABELS[row["peer"]] in printed


@needs_compiler
def test_a_broken_peer_stops_nothing(
    study: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture
) -> None:
    broken = {
        "raises": "def measure(case): raise ValueError('no such law')",
        "dies": "import os\ndef measure(case): os.abort()",
        "hangs": "import time\ndef measure(case): time.sleep(600)",
        "lacks": "import a_package_that_nobody_wrote",
        "errs": "import numpy as np\nfrom peers.case import Measured\n"
        "def measure(case): return Measured(1.0, np.full((case.samples, case.storeys), 1e-3))",
    }
    for name, text in broken.items():
        (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    rows = study.measure_peers([peer_case(study, name) for name in broken], 5)
    told = {row["peer"]: (row["status"], row["note"]) for row in rows}
    assert told["raises"] == ("failed", "ValueError: no such law")
    assert told["dies"] == ("failed", "its process ended with -6")
    assert told["hangs"] == ("failed", "stopped after 5 s")
    assert told["lacks"] == ("missing", "No module named 'a_package_that_nobody_wrote'")
    assert told["errs"][0] == "disagrees"
    assert np.isfinite([row["seconds"] for row in rows]).tolist() == [False] * 4 + [True]


@whole_study
def test_one_method_is_measured_alone(
    study: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ["--out", str(tmp_path), "--device", "cpu", "--quick", "--method", "stoermer"]
    monkeypatch.setattr(sys, "argv", ["benchmark.py", *arguments])
    study.main()
    with xr.open_dataset(tmp_path / "benchmark_stoermer.nc") as dataset:
        assert set(dataset["method"].values) == {"stoermer"}
        assert {"warpdyn", "cpp_stoermer", "cuda_stoermer"} == set(dataset["peer"].values)
    assert study.cases.LABELS["cpp_stoermer"] in capsys.readouterr().out


@whole_study
def test_dof_steps_are_counted(result: tuple[xr.Dataset, Path, str]) -> None:
    rows = result[0].isel(measurement=np.flatnonzero(np.isfinite(result[0]["seconds"])))
    done = rows["run_samples"] * rows["storeys"] * rows["steps"] * rows["substeps"]
    np.testing.assert_allclose(rows["dof_steps_per_second"] * rows["seconds"], done)
    assert set(rows["part"].values) == {"kernels", "laws", "samples", "threads"}


@whole_study
def test_parts_of_the_main_job_add_up(result: tuple[xr.Dataset, Path, str]) -> None:
    dataset = result[0]
    parts = dataset["seconds_of_part"]
    assert (parts.sel(job_part=["sampling", "kernels", "statistics", "writing"]) > 0).all()
    assert (parts >= 0).all()
    kernels, whole = parts.sel(job_part="kernels"), dataset["seconds_of_simulate"]
    before = parts.sel(job_part=["sampling", "kernels", "packing and transfer", "labelling"]).sum("job_part")
    assert (before >= 0.999 * whole).all()
    np.testing.assert_allclose(dataset["ratio_to_dataset"], whole / kernels)
    np.testing.assert_allclose(dataset["ratio_to_netcdf"], (whole + parts.sel(job_part="writing")) / kernels)
    assert dataset["start_first_run"].values.tolist() == [5.0, 0.5]


@pytest.mark.thorough  # the other tests give the study what is measured here
def test_a_start_compiles_once(study: ModuleType) -> None:
    empty, later = study.measure_starts(["cpu"])
    for row in (empty, later):
        assert row.keys() == known_starts(["cpu"])[0].keys()
        assert row["process"] > row["importing"] + row["first_run"] > row["first_run"] > row["second_run"] > 0
    assert empty["first_run"] > later["first_run"]  # which finds the kernel compiled


@whole_study
def test_file_and_figure_are_written(result: tuple[xr.Dataset, Path, str]) -> None:
    dataset, out, _ = result
    for name, variable in dataset.variables.items():
        assert {"long_name", "units"} <= set(variable.attrs), name
    assert "cores" in dataset.attrs["processor"]
    assert "warp-lang" in dataset.attrs["source"]
    for name in ("benchmark", "benchmark_scaling", "benchmark_start"):
        pixels = image.imread(out / f"{name}.png")
        assert min(pixels.shape[:2]) > 300
        assert np.mean(pixels[..., :3].min(axis=2) < 0.9) > 0.01  # ink on the paper


@pytest.mark.fast
def test_a_peer_at_shorter_steps_is_compared_over_the_whole_motion(study: ModuleType) -> None:
    """OpenSees at an eighth of warpdyn's step takes eight times as many steps for the same motion."""
    from parts.benchmark.figure import speed_of_others

    common = {"part": "kernels", "law": "bouc_wen", "dtype": "float32", "recorders": "drift", "status": "measured"}
    common |= {"storeys": 5, "device": "cpu"}
    rows = [
        common | {"peer": "warpdyn", "method": "rk4", "substeps": 1, "dof_steps_per_second": 7.4e8},
        common | {"peer": "warpdyn", "method": "rk4", "substeps": 8, "dof_steps_per_second": 8e8},
        common | {"peer": "opensees_newmark", "substeps": 8, "dof_steps_per_second": 1.9e5},
    ]
    result = study.label_rows(rows).assign_attrs(gpu="none", processor="a processor")
    figure = speed_of_others(result)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert "31,000" in texts  # 8 x 7.4e8 / 1.9e5 = 31,158
    assert "31,000 times" in figure.get_suptitle()
