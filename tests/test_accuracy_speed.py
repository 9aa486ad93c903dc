"""The study of accuracy against speed: its references, its curves, its promises, its file and figures."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT
from matplotlib import image

from warpdyn.truth import bilinear_chain_response, bouc_wen_chain_response, harmonic_response

sys.path.insert(0, str(ROOT / "studies"))
points, scenes_of, promises, figures, chart = (
    importlib.import_module(f"parts.accuracy_speed.{part}")
    for part in ("points", "scenes", "promises", "figures", "chart_of_methods")
)
study, command_line = (importlib.import_module(name) for name in ("accuracy_speed", "parts.command_line"))

METHODS = ("rk4", "newmark_average")
RECORDS = slice(-4, -2)  # the two shortest of 0.01 s
SETTINGS = points.Settings(samples=16, device="cpu", seed=3)


@pytest.fixture(scope="module")
def scenes() -> dict:
    """The study's seed frame, bilinear and Bouc-Wen ensembles; the latter two under two short records."""
    small = {}
    for name, charted in scenes_of.build_scenes().items():
        if charted.motions > 1:
            excitation = charted.scene.excitation
            motions = [replace(m, acceleration=m.acceleration[:500]) for m in excitation.motions[RECORDS]]
            scene = replace(charted.scene, excitation=replace(excitation, motions=motions))
            charted = replace(charted, scene=scene, motions=len(motions))
        small[name] = replace(charted, dearest=np.inf)  # so that no timing decides what is charted
    return {name: small[name] for name in ("seed_frame", "bilinear", "bouc_wen")}


@pytest.fixture(scope="module")
def result(scenes: dict) -> xr.Dataset:
    """The study's dataset of two ensembles, with two methods and a few steps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(points, "fitting_methods", lambda forces: METHODS)
        patch.setattr(points, "STEPS", points.STEPS[:6])
        patch.setattr(points, "TIMED_RUNS", 1)
        patch.setattr(study, "STEPS", points.STEPS)
        for module in ("points", "plan"):
            where = points if module == "points" else importlib.import_module("warpdyn.campaigns.accuracy.pilot")
            patch.setattr(where, "CANDIDATES", ("rk4",))
        patch.setattr(promises, "TARGETS", (1e-2, 1e-3))
        patch.setattr(study, "TARGETS", (1e-2, 1e-3))
        return study.build_dataset({name: scenes[name] for name in ("seed_frame", "bilinear")}, SETTINGS)


def first_sample(charted: object) -> tuple[np.ndarray, dict]:
    """Return the reference's peak drifts of the first sample [m], and what its structure is made of."""
    run, _ = points.make_run(charted, "rk4", "float64", charted.reference_step, SETTINGS)
    parameters = dict(charted.scene.structure.parameters)
    for name, values in run.drawn.items():
        parameters[name] = values[0]
    return run.integrate(np.arange(1))["peak_storey_drift"][:, 0], parameters


def rayleigh(parameters: dict, modes: tuple[int, int]) -> np.ndarray:
    """Return the damping matrix with a ratio at two modes: a M + b K."""
    mass, stiffness = np.diag(parameters["mass"]), stiffness_matrix(parameters["stiffness"])
    omega = np.sqrt(np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(parameters["mass"], parameters["mass"]))))
    low, high = omega[modes[0] - 1], omega[modes[1] - 1]
    ratio = float(parameters["damping_ratio"])
    return 2 * ratio / (low + high) * (low * high * mass + stiffness)


def stiffness_matrix(storeys: np.ndarray) -> np.ndarray:
    drifts = np.eye(storeys.size) - np.eye(storeys.size, k=-1)
    return drifts.T @ np.diag(storeys) @ drifts


def test_reference_of_the_seed_frame_is_exact(scenes: dict) -> None:
    peak, p = first_sample(scenes["seed_frame"])
    load = scenes["seed_frame"].scene.excitation
    matrices = np.diag(p["mass"]), stiffness_matrix(p["damping_coefficient"]), stiffness_matrix(p["stiffness"])
    time = np.linspace(0, load.duration, 200_001)
    moved = harmonic_response(*matrices, load.amplitude, load.circular_frequency, load.phase, time)[0]
    exact = np.abs(np.diff(moved, axis=1, prepend=0)).max(axis=0)
    # Peaks between steps of 7.8e-5 s: (w h / 2)^2 / 2 is 1e-7 of the part of frequency w, at most 21 rad/s.
    np.testing.assert_allclose(peak, exact, rtol=1e-6)


@pytest.mark.parametrize("name", ["bilinear", "bouc_wen"])
def test_reference_of_yielding_buildings_is_exact(scenes: dict, name: str) -> None:
    charted = scenes[name]
    peak, p = first_sample(charted)
    excitation = charted.scene.excitation
    motion = excitation.motions[0]
    scale = excitation.assign([0], SETTINGS.seed).scale[0]
    ground = np.concatenate([motion.acceleration * scale, np.zeros(int(1.0 / motion.step))])
    force = -np.outer(ground, p["mass"])
    force[motion.acceleration.size :] = 0
    damping = rayleigh(p, charted.scene.structure.damping_modes)
    law = p["mass"], p["stiffness"], p["yield_force"], p["hardening_ratio"], damping, force, motion.step
    if name == "bilinear":
        exact = bilinear_chain_response(*law)
    else:
        own = {parameter: p[parameter] for parameter in ("beta", "gamma", "exponent")}
        exact = bouc_wen_chain_response(*law, **own)
    # Peaks between steps, and the corners of a bilinear storey, put the reference off by 1e-7 at 95 % of the ensemble.
    np.testing.assert_allclose(peak, exact.peak_storey_drift, rtol=2e-6)
    assert np.max(exact.peak_storey_drift * p["stiffness"] / p["yield_force"]) > 1.5  # it yields


def test_errors_fall_along_every_curve(result: xr.Dataset) -> None:
    for scene in result["scene"].values:
        for method in METHODS:
            row = result.sel({"scene": scene, "method": method, "dtype": "float32", "demand": "peak_storey_drift"})
            for statistic in row["statistic"].values:
                error = row["error"].sel(statistic=statistic).dropna("step")
                if scene == "bilinear":
                    error = error.sel(step=error["step"][error["step"] <= 0.01])  # its records' own, and so at 0.02 s
                assert error.sizes["step"] >= 3
                # By about 4 a halving; peaks seen at steps alone lie where they may, so that one halving can give less.
                assert (error.values[1:] < 0.8 * error.values[:-1]).all()
                order = np.log(error[0] / error[-1]) / np.log(error["step"][0] / error["step"][-1])
                assert 1.3 < order < 4.5


def test_what_is_not_charted_is_blank(result: xr.Dataset) -> None:
    charted = np.isfinite(result["seconds_per_sample"])
    assert not charted.sel({"method": "exact"}).any()
    assert not charted.sel(scene="bilinear", step=[0.08, 0.04]).any()
    errors = np.isfinite(result["error"])
    assert (errors.sel(demand="peak_storey_drift").all("statistic") == charted).all()
    residual = errors.sel(demand="residual_drift_ratio").any(["method", "dtype", "step", "statistic"])
    assert residual.values.tolist() == [False, True]
    assert (result["seconds_per_sample"].where(charted, 1) > 0).all()


def test_check_and_plan_keep_their_word(result: xr.Dataset) -> None:
    ratio, within = promises.agreement(result)
    assert ratio.size >= 30
    assert within >= 0.9
    assert (result["plan_error"] <= result["target"]).all()
    assert set(result["plan_method"].values.ravel()) == {"rk4"}
    assert (result["plan_seconds_per_sample"] > 0).all()


def test_agreement_counts_factors_of_two() -> None:
    true = [1.0, 1.0, 1.0, 1.0, np.nan, 1.0]
    estimated = [0.5, 2.0, 0.49, 2.1, 1.0, np.nan]
    ratio, within = promises.agreement(xr.Dataset({"error": ("x", true), "estimated_error": ("x", estimated)}))
    assert ratio.tolist() == [0.5, 2.0, 0.49, 2.1]
    assert within == 0.5


def test_a_failed_sample_is_an_infinite_error() -> None:
    errors = {"peak_storey_drift": np.array([0.1] * 9 + [np.nan])}
    table = points.statistics(errors)
    assert table[0].tolist() == [0.1, np.inf]
    assert np.isnan(table[1]).all()


@pytest.mark.fast
def test_every_method_has_a_colour_and_a_marker() -> None:
    registry = importlib.import_module("warpdyn.engine.methods.table").METHODS
    charted = set(registry) - {"leapfrog"}  # a method of lumped structures; the study has none
    assert set(figures.LOOKS) == charted
    assert len(set(figures.LOOKS.values())) == len(charted)


def test_file_and_figures_are_written(result: xr.Dataset, tmp_path: Path) -> None:
    study.netcdf.write(result, tmp_path / "accuracy_speed.nc")
    with xr.open_dataset(tmp_path / "accuracy_speed.nc") as dataset:
        read = dataset.load()
    for name, variable in read.variables.items():
        assert {"long_name", "units"} <= set(variable.attrs), name
    assert {"scene", "method", "dtype", "step", "demand", "statistic", "target"} <= set(read.coords)
    drawn = {name: getattr(figures, name)(read) for name in ("work_precision", "residual_drift", "promises")}
    drawn["methods"] = chart.chart_of_methods(read)
    command_line.save_figures(drawn, tmp_path)
    for name in drawn:
        pixels = image.imread(tmp_path / f"{name}.png")
        assert min(pixels.shape[:2]) > 400
        assert np.mean(pixels[..., :3].min(axis=2) < 0.9) > 0.02  # ink on the paper


def test_report_names_every_target(result: xr.Dataset, capsys: pytest.CaptureFixture) -> None:
    study.print_report(result)
    told = capsys.readouterr().out
    assert told.count("seed_frame") == told.count("bilinear") == 2
    assert "within a factor of 2" in told
