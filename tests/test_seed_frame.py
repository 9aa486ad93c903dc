"""The study of the published frame, run as a reader runs it: its file, its figures and what it prints."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.image import imread
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

ROOT = Path(__file__).parents[1]
MASS = np.diag([200.0, 150.0, 100.0])
DAMPING = np.array([[60.0, -30.0, 0.0], [-30.0, 60.0, -30.0], [0.0, -30.0, 30.0]])
STIFFNESS = np.array([[40000.0, -20000.0, 0.0], [-20000.0, 40000.0, -20000.0], [0.0, -20000.0, 20000.0]])
FORCE, FREQUENCY = np.array([0.0, 100.0, 0.0]), 10.0

# From 40-digit matrix exponentials, not from warpdyn.
EXACT_DISPLACEMENT = {
    0.809: (-0.00702758581267502, -0.00930618290619974, -0.01405517162535004),
    1.26: (0.002678734361208542, 0.003996141703614245, 0.005357468722417084),
    2.013: (-0.006899736223066759, -0.009352193222127857, -0.01379947244613352),
    10.0: (-0.001782384277182722, -0.004092775468027168, -0.003564768554365444),
}
EXACT_PEAK = (0.0070275945603231, 0.009352205768429, 0.014055189120646)
EXACT_TIME_OF_PEAK = (0.8091918791077, 2.012739324485, 0.8091918791077)
STEADY_STATE_AMPLITUDE = (0.0028568608687658, 0.0028578246798358, 0.0057137217375316)
RK4_LARGEST_ERROR = {0.01: 2.191e-7, 0.005: 1.370e-8, 0.002: 3.504e-10, 0.001: 2.190e-11, 0.0005: 1.369e-12}


def run_study(out: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the study with this interpreter from the root of the checkout."""
    command = [sys.executable, "studies/seed_frame.py", "--out", str(out), "--device", "cpu", *arguments]
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, env=os.environ | {"MPLBACKEND": "agg"}, check=False
    )


def opened(out: Path) -> xr.Dataset:
    with xr.open_dataset(out / "seed_frame.nc") as dataset:
        return dataset.load()


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    out = tmp_path_factory.mktemp("seed_frame") / "made" / "by the study"
    done = run_study(out, "--samples", "40", "--seed", "3")
    assert done.returncode == 0, done.stderr
    return out, done.stdout


@pytest.fixture(scope="module")
def result(study: tuple[Path, str]) -> xr.Dataset:
    return opened(study[0])


def test_every_variable_is_labelled_and_in_double_precision(result: xr.Dataset) -> None:
    for name, variable in result.variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs["units"], name
        assert variable.dtype == np.float64 or name in ("dof", "storey", "mode", "sample", "structure", "status"), name
        assert np.isfinite(variable).sum() >= variable.size - (name == "observed_order"), name
    sizes = {"time": 10_001, "dof": 3, "storey": 3, "mode": 3, "step": 5, "sample": 40}
    assert dict(result.sizes) == sizes
    for name in ("displacement", "exact_displacement", "velocity", "acceleration"):
        assert result[name].dims == ("time", "dof")
    for name in ("peak_displacement", "time_of_peak", "published_peak_displacement", "published_time_of_peak"):
        assert result[name].dims == ("dof",)
    assert result["storey_drift"].dims == ("time", "storey")
    assert result.attrs["seed"] == 3


def test_exact_solution(result: xr.Dataset) -> None:
    for time, displacement in EXACT_DISPLACEMENT.items():
        row = result["exact_displacement"].sel(time=time, method="nearest")
        assert float(row["time"]) == pytest.approx(time, abs=1e-12)
        # Rounding of double precision over a hundred products of matrices.
        np.testing.assert_allclose(row, displacement, rtol=0, atol=1e-15)
    # A peak is flat: its height is good to rounding, its time to the root finder's tolerance.
    np.testing.assert_allclose(result["exact_peak_displacement"], EXACT_PEAK, rtol=1e-12)
    np.testing.assert_allclose(result["exact_time_of_peak"], EXACT_TIME_OF_PEAK, rtol=0, atol=1e-11)


def test_rk4_has_the_error_of_its_order(result: xr.Dataset) -> None:
    error = np.abs(result["displacement"] - result["exact_displacement"]).max()
    assert float(error) == pytest.approx(2.19e-11, rel=0.02)
    # Four digits are known; the least of them is ten thousand roundings of a displacement.
    np.testing.assert_allclose(result["step"], list(RK4_LARGEST_ERROR))
    np.testing.assert_allclose(result["convergence"], list(RK4_LARGEST_ERROR.values()), rtol=0.02)
    np.testing.assert_allclose(result["observed_order"][1:], 4.0, atol=0.02)
    for name, limit in (("velocity", 1e-9), ("acceleration", 2e-8)):
        # Bounds of the displacement's error times the highest frequency, 20.9 rad/s, and its square.
        assert np.abs(result[name] - result[f"exact_{name}"]).max() < limit


def test_third_floor_moves_twice_as_far_as_the_first(result: xr.Dataset) -> None:
    for name in ("displacement", "exact_displacement"):
        displacement = result[name].values
        assert np.abs(displacement[:, 2] - 2 * displacement[:, 0]).max() < 1e-15
    drift, displacement = result["storey_drift"].values, result["displacement"].values
    np.testing.assert_allclose(drift.cumsum(axis=1), displacement, rtol=0, atol=1e-17)
    np.testing.assert_array_equal(result["peak_storey_drift"], np.abs(drift).max(axis=0))


def test_peaks_beside_the_published_ones(result: xr.Dataset) -> None:
    # On its steps RK4 misses a peak by at most acceleration times (step/2)^2/2, 1.2e-7 m.
    np.testing.assert_allclose(result["peak_displacement"], EXACT_PEAK, rtol=0, atol=1.2e-7)
    np.testing.assert_allclose(result["time_of_peak"], EXACT_TIME_OF_PEAK, rtol=0, atol=0.0005001)
    assert result["published_peak_displacement"].values.tolist() == [0.0038, 0.0051, 0.0042]
    assert result["published_time_of_peak"].values.tolist() == [1.27, 1.26, 1.26]


def test_static_and_steady_shapes(result: xr.Dataset) -> None:
    np.testing.assert_allclose(result["static_displacement"], [0.005, 0.01, 0.01], rtol=1e-12)
    np.testing.assert_allclose(result["steady_state_amplitude"], STEADY_STATE_AMPLITUDE, rtol=1e-12)
    # Damping is light: nearly all of the steady state is in phase, and against the force above the first frequency.
    np.testing.assert_allclose(result["steady_state_in_phase"], -np.array(STEADY_STATE_AMPLITUDE), rtol=1e-3)


def test_energies_against_an_adaptive_integration_of_the_balance(result: xr.Dataset) -> None:
    inverse = np.linalg.inv(MASS)

    def rates(time: float, state: np.ndarray) -> np.ndarray:
        u, v = state[:3], state[3:6]
        force = FORCE * np.sin(FREQUENCY * time)
        return np.concatenate([v, inverse @ (force - DAMPING @ v - STIFFNESS @ u), [force @ v, v @ DAMPING @ v]])

    time = result["time"].values
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
    state = solve_ivp(rates, (0, time[-1]), np.zeros(8), t_eval=time, **options).y
    expected = {
        "input_energy": state[6],
        "viscous_energy": state[7],
        "kinetic_energy": np.einsum("it,ij,jt->t", state[3:6], MASS, state[3:6]) / 2,
        "strain_energy": np.einsum("it,ij,jt->t", state[:3], STIFFNESS, state[:3]) / 2,
    }
    for name, values in expected.items():
        # Energies reach 1.3 J; Simpson's rule at 1 ms is good to some 1e-9 of it.
        np.testing.assert_allclose(result[name], values, rtol=0, atol=1e-8, err_msg=name)
    assert np.abs(result["energy_balance_residual"]).max() < 1e-8


def oscillator_from_rest(omega: float, ratio: float, force: float, time: np.ndarray) -> np.ndarray:
    """Displacement of a unit mass from rest under force sin(w t), in closed form (Chopra, section 3.2)."""
    stretch, damped = omega**2 - FREQUENCY**2, omega * np.sqrt(1 - ratio**2)
    size = stretch**2 + (2 * ratio * omega * FREQUENCY) ** 2
    sine, cosine = force * stretch / size, -force * 2 * ratio * omega * FREQUENCY / size
    start = -(FREQUENCY * sine + ratio * omega * cosine) / damped
    free = np.exp(-ratio * omega * time) * (-cosine * np.cos(damped * time) + start * np.sin(damped * time))
    return sine * np.sin(FREQUENCY * time) + cosine * np.cos(FREQUENCY * time) + free


def test_modal_shares_and_their_srss_against_closed_forms(result: xr.Dataset) -> None:
    eigenvalue, shape = eigh(STIFFNESS, MASS)
    omega = np.sqrt(eigenvalue)
    ratio = 0.0015 * omega / 2  # C = 0.0015 K
    np.testing.assert_allclose(result["period"], 2 * np.pi / omega, rtol=1e-12)
    time = result["time"].values
    shares = np.stack(
        [
            oscillator_from_rest(w, z, phi @ FORCE, time)[:, None] * phi
            for w, z, phi in zip(omega, ratio, shape.T, strict=True)
        ],
        axis=1,
    )
    # Closed forms in double precision; the largest share is 0.014 m.
    np.testing.assert_allclose(result["modal_displacement"], shares, rtol=0, atol=1e-14)
    np.testing.assert_allclose(result["modal_displacement"].sum("mode"), result["exact_displacement"], atol=1e-14)
    srss = np.sqrt((np.abs(shares).max(axis=0) ** 2).sum(axis=0))
    np.testing.assert_allclose(result["srss_peak_displacement"], srss, rtol=1e-10)
    assert np.abs(shares[:, 1]).max() < 1e-15  # the second mode has a node at the loaded degree of freedom


def test_no_scatter_of_damping_and_stiffness_makes_the_published_ratio(result: xr.Dataset) -> None:
    peak = result["ensemble_peak_displacement"].values
    assert np.unique(peak[:, 0]).size == 40
    # The scaled matrices keep the proof to their own rounding.
    np.testing.assert_allclose(peak[:, 2] / peak[:, 0], 2.0, rtol=1e-11)
    assert (result["status"] == 0).all()
    assert result["damping_factor"].std() > 0.1
    assert result["stiffness_factor"].std() > 0.03


@pytest.mark.thorough  # test_simulate.py shows it of simulate
def test_the_seed_decides_the_ensemble_and_nothing_else(result: xr.Dataset, tmp_path: Path) -> None:
    for seed, is_same in (("3", True), ("4", False)):
        done = run_study(tmp_path / seed, "--samples", "7", "--seed", seed)
        assert done.returncode == 0, done.stderr
        again = opened(tmp_path / seed)
        for name, variable in again.variables.items():
            of_ensemble = "sample" in variable.dims and name not in ("sample", "structure", "status")
            before = result[name].values[:7] if "sample" in variable.dims else result[name].values
            identical = np.array_equal(variable.values, before, equal_nan=name == "observed_order")
            assert identical == (is_same or not of_ensemble), name


def test_what_it_prints(study: tuple[Path, str], result: xr.Dataset) -> None:
    printed = " ".join(study[1].split())
    for words in (
        "u1 7.02759 at 0.8090 7.02759 at 0.8092 3.8 at 1.2700",
        "u2 9.35219 at 2.0130 9.35221 at 2.0127 5.1 at 1.2600",
        "u3 14.0552 at 0.8090 14.0552 at 0.8092 4.2 at 1.2600",
        "u3 / u1 2.0000 2.0000 1.1053",
        "The published peaks do not follow from the published parameters.",
        "So u3 = 2 u1 at all times",
        "the published peaks have u3 = 1.105 u1",
        "2.19e-11 m at 0.001 s",
        "4.000, 4.000, 4.000, 4.000",
        "published: 0.94 s",
    ):
        assert words in printed
    assert result.attrs["statement"] in printed
    seconds = result.attrs["seconds_single_simulation"]
    assert result.attrs["seconds_per_simulation_in_ensemble"] > 0
    # A single history takes some 10 ms on a slow core; a second would mean that compilation was timed.
    assert 0 < seconds < 0.94 == result.attrs["published_seconds_per_simulation"]


@pytest.mark.parametrize("name", ["seed_frame", "seed_frame_convergence"])
def test_figures_show_something(study: tuple[Path, str], name: str) -> None:
    pixels = imread(study[0] / f"{name}.png")[..., :3]
    assert min(pixels.shape[:2]) > 500
    assert 0.02 < (pixels.min(axis=2) < 0.9).mean() < 0.6  # curves and bars, but not a filled sheet


def test_data_file_says_where_it_comes_from_and_what_is_wrong() -> None:
    frame = json.loads((ROOT / "data" / "seed_frame.json").read_text())
    np.testing.assert_array_equal(frame["mass"], MASS)
    np.testing.assert_array_equal(frame["damping"], DAMPING)
    np.testing.assert_array_equal(frame["stiffness"], STIFFNESS)
    np.testing.assert_array_equal(frame["force_amplitude"], FORCE)
    assert (frame["circular_frequency"], frame["step"], frame["duration"]) == (10, 0.001, 10)
    assert "Table 1" in frame["source"]
    assert "do not follow" in frame["note"]


@pytest.mark.thorough  # as test_p695_fragility.py shows of its study
def test_a_folder_that_cannot_be_written_is_said_before_the_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    # The run would stop at a number of samples that is not allowed; it is never reached.
    done = run_study(tmp_path / "file", "--samples", "0")
    assert done.returncode != 0
    assert "cannot write" in done.stderr
    assert "choose another folder" in done.stderr
    assert "samples must be" not in done.stderr
