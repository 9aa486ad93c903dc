"""The study of the decision: errors of fragility medians against seconds."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd

sys.path.insert(0, str(Path(__file__).parents[1] / "studies"))
errors, figure = (importlib.import_module(f"parts.decision.{part}") for part in ("errors", "figure"))

CHOICES = errors.Choices(
    methods=("rk4",),
    steps=(0.02, 0.01),
    dtypes=("float32",),
    structures=(4, 8),
    structures_per_motion=(4,),
    replications=2,
    structures_of_truth=16,
    step_of_truth=0.01,
    structures_of_steps=2,
)


@pytest.fixture(scope="module")
def scene():
    """The study's building under four motions of filtered noise on a few stripes."""
    whole = errors.build_scene()
    generator, time = np.random.default_rng(1), 0.02 * np.arange(500)
    envelope = np.exp(-(((time - 3) / 2) ** 2))
    motions = [
        wd.GroundMotion(envelope * np.convolve(generator.normal(size=500), np.ones(9), "same"), 0.02, f"{i}")
        for i in range(8)
    ]
    levels = [0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4]
    stripes = wd.Stripes(motions, levels, wd.SpectralAcceleration(whole.structure.fundamental_period))
    return wd.Scene(whole.structure, stripes, whole.scatter, whole.correlation, collapse_drift_ratio=0.1)


@pytest.mark.as_shipped
@pytest.mark.filterwarnings("ignore:fragility|damage state")  # too few motions for intervals, which are not asked of it
def test_errors_and_their_figure(scene, monkeypatch, tmp_path):
    monkeypatch.setattr(errors, "build_scene", lambda: scene)
    result = errors.errors_of(CHOICES, "cpu", 0)
    assert result["histories"].values.tolist() == [224, 448, 224, 448, 224]
    assert dict(result["seconds"].sizes) == {"method": 1, "dtype": 1, "step": 2, "plan": 5}
    assert (result["seconds_in_kernels"] <= result["seconds"]).all()
    # The same truth is taken over from a file.
    again = errors.errors_of(CHOICES, "cpu", 0, result["true_log_median"].values)
    xr.testing.assert_equal(again["sampling_error"], result["sampling_error"])
    result["record_error"] = 0.2
    result.attrs["device"] = "cpu"
    path = tmp_path / "decision.png"
    figure.decision_chart([result]).savefig(path, dpi=60)
    assert path.stat().st_size > 10_000


@pytest.mark.fast
def test_frontier_and_size_of_errors():
    seconds, found = figure.frontier(np.array([3.0, 1.0, 2.0, 4.0]), np.array([0.1, 0.4, 0.5, 0.2]))
    assert seconds.tolist() == [1.0, 3.0]
    assert found.tolist() == [0.4, 0.1]
    assert errors.size_of(np.array([0.3, -0.4])) == pytest.approx(np.sqrt(0.125), rel=1e-12)
    assert errors.size_of(np.array([0.3, np.nan])) == np.inf
