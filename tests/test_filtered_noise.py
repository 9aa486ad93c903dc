"""Random motions: their process against spectra and Van Loan, the kernels' against the host's, and their variances."""

import itertools

import numpy as np
import pytest
from matrices import modal_damping_matrix
from method_sources import thorough_unless
from noise_statistics import (
    KANAI_TAJIMI,
    KANAI_TAJIMI_ACCELERATION,
    PART_OF_WHITE_NOISE,
    STATIONARY,
    VARIANCES,
    WHITE,
    errors,
    oscillator_variances,
    paths,
    van_loan,
)
from scipy.integrate import quad

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.running import blocks

pytestmark = pytest.mark.meant_as_given("record_step")

CLOUGH_PENZIEN = wd.CloughPenzien(0.01, 15.0, 0.6, 1.5, 0.6)
SPECTRA = {"white": WHITE, "kanai_tajimi": KANAI_TAJIMI, "clough_penzien": CLOUGH_PENZIEN}
FILTERED = {name: spectrum for name, spectrum in SPECTRA.items() if name != "white"}
ENVELOPE = wd.JenningsEnvelope(rise=0.5, strong=0.4, decay=1.5)
by_filter = pytest.mark.parametrize("spectrum", FILTERED.values(), ids=FILTERED)


@pytest.mark.fast
@pytest.mark.parametrize("name", SPECTRA)
def test_frequencies_of_spectra_are_bounded(name):
    density = SPECTRA[name].spectral_density([0.0, -1e9, 1e9])  # rad/s
    assert np.isfinite(density).all()
    assert density[1] == density[2]
    with pytest.raises(ValueError, match="circular_frequency must be at most 1e\\+09 rad/s"):
        SPECTRA[name].spectral_density([1.0, -1.1e9])


def autocovariance(spectrum, lag):
    """Return the integral of the spectral density times cos(w lag) over all w."""
    inner = quad(lambda w: 2 * spectrum.spectral_density(w) * np.cos(w * lag), 0, 40, limit=500, epsabs=1e-13)[0]
    if lag == 0:
        return inner + quad(lambda w: 2 * spectrum.spectral_density(w), 40, np.inf, limit=500, epsabs=1e-13)[0]
    return inner + quad(lambda w: 2 * spectrum.spectral_density(w), 40, np.inf, weight="cos", wvar=lag, limlst=500)[0]


@by_filter
@pytest.mark.parametrize("interval", [0.005, 0.02, 0.3, 5.0])
def test_nodes_have_the_spectrums_autocovariance_at_any_interval(spectrum, interval):
    process = spectrum.recursion(interval)
    covariance = process.start @ process.start.T
    for lag in (0, 1, 2):
        found = process.output @ np.linalg.matrix_power(process.growth, lag) @ covariance @ process.output
        # The quadrature's own error over an infinite, oscillating range is the larger.
        assert found == pytest.approx(autocovariance(spectrum, lag * interval), abs=1e-7)
    # Stationary: what an interval takes from the covariance, it adds.
    kept = process.growth @ covariance @ process.growth.T + process.kick @ process.kick.T
    size = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(kept / np.outer(size, size), covariance / np.outer(size, size), rtol=0, atol=1e-13)
    if spectrum is KANAI_TAJIMI:
        assert process.output @ covariance @ process.output == pytest.approx(KANAI_TAJIMI_ACCELERATION, rel=1e-13)


@by_filter
@pytest.mark.parametrize("interval", [0.001, 0.02, 0.3])
def test_what_an_interval_adds_is_van_loans(spectrum, interval):
    matrix, noise, _ = spectrum.system()
    process = spectrum.recursion(interval)
    growth, added = van_loan(matrix, 2 * np.pi * spectrum.intensity * np.outer(noise, noise), interval)
    # Van Loan's product of growing and decaying exponentials loses some digits at the longest interval.
    np.testing.assert_allclose(process.kick @ process.kick.T, added, rtol=1e-9, atol=0)
    np.testing.assert_allclose(process.growth, growth, rtol=1e-12, atol=1e-14)


def test_white_noise_and_envelope():
    process = WHITE.recursion(0.02)
    assert process.start[0, 0] ** 2 == process.kick[0, 0] ** 2 == pytest.approx(2 * np.pi * 0.01 / 0.02, rel=1e-15)
    assert process.growth[0, 0] == 0
    time = np.array([0.0, 0.25, 0.5, 0.9, 1.9])
    np.testing.assert_allclose(ENVELOPE.at(time), [0, 0.25, 1, 1, np.exp(-1.5)], rtol=1e-14)
    np.testing.assert_allclose(wd.JenningsEnvelope(0.0, 1.0, 2.0).at(time), [1, 1, 1, 1, np.exp(-1.8)], rtol=1e-14)


@pytest.mark.parametrize(
    ("name", "dtype"),
    [
        thorough_unless((name, dtype) not in {("white", "float32"), ("clough_penzien", "float32")}, name, dtype)
        for name, dtype in itertools.product(SPECTRA, ("float32", "float64"))
    ],
)
def test_kernels_generate_the_hosts_motions(name, dtype):
    spectrum = SPECTRA[name]
    noise = wd.FilteredNoise(spectrum, 3.0, 0.02, ENVELOPE)
    for first, seed, run in ((0, 0, 0), (2**32 - 2, 2**63 - 1, 0), (5, 3, noise.intervals)):
        begin, change = paths(noise, 4, seed=seed, first=first, run=run, dtype=dtype)
        due = np.array([noise.motion(first + i, seed).acceleration for i in range(4)]).T
        # Normals of the two inverses agree to some 1e-15, and float32 rounds the motion once and its change once more.
        close = {"rtol": 0, "atol": (1e-6 if dtype == "float32" else 1e-13) * np.abs(due).max()}
        np.testing.assert_allclose(begin[:-1], due[:-1], **close)
        np.testing.assert_allclose(begin[:-1] + change[:-1], due[1:], **close)
        # A run that ends with the motion sees its last value; one that goes on sees none.
        np.testing.assert_allclose(begin[-1], due[-1] if run else np.zeros(4), **close)
        assert np.all(change[-1] == 0)


MASS, STIFFNESS = np.array([2e3, 1.5e3]), np.array([1.2e6, 9e5])
MATRIX = np.array([[2.1e6, -9e5], [-9e5, 9e5]])
CHAIN = {"mass": MASS, "stiffness": STIFFNESS, "height": 3.0, "damping": "rayleigh", "damping_ratio": 0.05}
STRUCTURES = {
    "chain": wd.ShearBuilding(**CHAIN),
    "yielding": wd.ShearBuilding(**CHAIN, law="bouc_wen", yield_force=2e3, hardening_ratio=0.05),
    "dense": wd.LinearSystem(MASS, modal_damping_matrix(MASS, MATRIX, 0.05), MATRIX),
}
KERNELS = [
    pytest.param("yielding", "rk4", "float64", "white", marks=pytest.mark.thorough),
    ("yielding", "rk4", "float32", "kanai_tajimi"),
    pytest.param("chain", "dormand_prince54", "float64", "clough_penzien", marks=pytest.mark.thorough),
    ("yielding", "newmark_average", "float64", "kanai_tajimi"),
    pytest.param("chain", "exact", "float64", "clough_penzien", marks=pytest.mark.thorough),
    ("dense", "rk4", "float64", "kanai_tajimi"),
    pytest.param("dense", "newmark_average", "float32", "white", marks=pytest.mark.thorough),
    ("dense", "exact", "float64", "kanai_tajimi"),
]
# Histories have their own kernel: one for each kind of method and family of structures is enough.
WITH_HISTORIES = {("yielding", "rk4"), ("dense", "newmark_average"), ("chain", "exact"), ("dense", "exact")}


@pytest.mark.usefixtures("unoptimised")  # one run is compared with another
@pytest.mark.filterwarnings("ignore:a tail of")
@pytest.mark.parametrize(("structure", "method", "dtype", "spectrum"), KERNELS)
def test_every_kernel_runs_as_under_the_same_records(structure, method, dtype, spectrum):
    noise = wd.FilteredNoise(SPECTRA[spectrum], 1.0, 0.02, ENVELOPE)
    samples, seed = 19, 7
    records = [noise.motion(sample, seed) for sample in range(samples)]
    scatter = {"mass" if structure == "dense" else "stiffness": wd.RandomFactor(wd.Lognormal(1, 0.1))}
    for step, tail in ((0.02, 0.0), (0.01, 0.4)):
        settings = {
            "structures": samples,
            "method": method,
            "dtype": dtype,
            "step": step,
            "seed": seed,
            "device": "cpu",
        }
        if (structure, method) in WITH_HISTORIES:
            settings["histories"] = wd.Histories((3, 18))
        generated, recorded = (
            wd.simulate(wd.Scene(STRUCTURES[structure], excitation, scatter=scatter, tail=tail), **settings)
            for excitation in (noise, wd.OneMotionPerStructure(records, motion=np.arange(samples)))
        )
        assert not np.any(generated["status"])
        for name in generated.data_vars:
            one, other = generated[name].values, recorded[name].values
            size = np.abs(other).max()
            # One rounding of the motion, and what some 150 steps of a yielding structure make of it; an adaptive method
            # may choose another step for it, and its steps err by 1e-6.
            tolerance = 1e-4 if dtype == "float32" else 1e-5 if method == "dormand_prince54" else 1e-10
            # The energies of a linear structure that ought to be 0 are nothing but rounding.
            if name not in ("energy_balance_error", "hysteretic_energy") or structure == "yielding":
                np.testing.assert_allclose(one, other, rtol=0, atol=tolerance * size, err_msg=name)
        assert {"motion_index", "scale_factor_of_motion"} <= set(recorded.coords) - set(generated.coords)


def test_a_samples_motion_is_its_own_however_it_is_run(monkeypatch):
    noise = wd.FilteredNoise(KANAI_TAJIMI, 1.0, 0.02)
    scene = wd.Scene(STRUCTURES["yielding"], noise)
    settings = {"structures": 50, "device": "cpu", "dtype": "float64"}
    run = wd.simulate(scene, seed=1, threads=1, **settings)
    drifts = run["peak_storey_drift"].values
    assert np.unique(drifts[:, 0]).size == 50
    with monkeypatch.context() as patched:
        patched.setattr(blocks, "CPU_BLOCK", 7)
        again = wd.simulate(scene, seed=1, threads=2, **settings)
    assert again["peak_storey_drift"].values.tobytes() == drifts.tobytes()
    fewer = wd.simulate(scene, seed=1, **(settings | {"structures": 20}))
    assert fewer["peak_storey_drift"].values.tobytes() == drifts[:20].tobytes()
    assert not np.any(wd.simulate(scene, seed=2, **settings)["peak_storey_drift"].values == drifts)
    # A rerun of some, as the guard does it, and at another step.
    ensemble, _ = prepare(scene, method="rk4", seed=1, **settings)
    some = np.array([31, 4, 49])
    part = ensemble.integrate(some)["peak_storey_drift"]
    assert part.tobytes() == np.ascontiguousarray(drifts[some].T).tobytes()
    ensemble.schedule = ensemble.schedule.with_substeps(some, 2 * ensemble.schedule.substeps[some])
    np.testing.assert_allclose(ensemble.integrate(some)["peak_storey_drift"], drifts[some].T, rtol=2e-3)
    # The estimate of the error is of a run at half the step: another motion would show as an error of the order of 1.
    checked = wd.simulate(scene, seed=1, checked_share=1.0, **settings)
    assert checked["estimated_relative_error"].sel(demand="peak_storey_drift", error_statistic="worst") < 5e-3


def test_a_plan_meets_its_target_under_noise():
    scene = wd.Scene(STRUCTURES["chain"], wd.FilteredNoise(KANAI_TAJIMI, 2.0, 0.02, ENVELOPE), recorders=("drift",))
    choice = wd.plan(scene, target_error=0.01, structures=100, device="cpu", method="rk4", dtype="float64")
    assert choice.table["error"].item() < 0.01
    assert choice.carried["state per sample [values]"] == 2 * 2 + 2


def test_the_scene_says_what_its_noise_is():
    noise = wd.FilteredNoise(CLOUGH_PENZIEN, 2.0, 0.02, ENVELOPE)
    told = wd.Scene(STRUCTURES["chain"], noise).to_json()
    for text in ("FilteredNoise", '"filter_frequency":1.5', '"interval":0.02', '"decay":1.5'):
        assert text in told
    motion = noise.motion(3, seed=1)
    assert (motion.name, motion.step, motion.duration) == ("filtered noise 3", 0.02, 2.0)


def test_the_oracle_of_variances_agrees_with_the_published_ones():
    # The closed forms are of the noise itself; a motion that is straight over 0.02 s has that part of it, from rest to
    # within 3e-5.
    found = oscillator_variances(WHITE, 0.02, 3000)
    assert found[-1] / STATIONARY == pytest.approx(PART_OF_WHITE_NOISE, rel=1e-9)
    for time, variance in VARIANCES.items():
        assert found[round(time / 0.02)] / variance == pytest.approx(PART_OF_WHITE_NOISE, rel=3e-5)


def test_variances_are_within_three_standard_errors(measured):
    found = errors(20_000)  # a standard error of a variance is 1 %
    measured(
        "variances of oscillators under filtered noise: errors in standard errors",
        truth="Lyapunov's equation, and published stationary variances",
        value=max(map(abs, found.values())),
        bound=3,
    )
    assert len(found) == 8


BAD = {
    "intensity": (lambda: wd.WhiteNoise(0.0), "WhiteNoise.intensity [m2/s3] must be a finite number above 0, got 0.0"),
    "frequency": (lambda: wd.KanaiTajimi(0.01, -15, 0.6), "KanaiTajimi.ground_frequency [rad/s] must be"),
    "damping": (
        lambda: wd.KanaiTajimi(0.01, 15, 0.0),
        "KanaiTajimi.ground_damping_ratio must be a finite number above 0",
    ),
    "filter": (lambda: wd.CloughPenzien(0.01, 15, 0.6, 1.5, -1), "CloughPenzien.filter_damping_ratio must be"),
    "rise": (lambda: wd.JenningsEnvelope(-1, 1, 1), "JenningsEnvelope.rise must be a finite number of at least 0"),
    "spectrum": (
        lambda: wd.FilteredNoise("white", 1.0, 0.1),
        "spectrum must be WhiteNoise, KanaiTajimi or CloughPenzien",
    ),
    "envelope": (
        lambda: wd.FilteredNoise(WHITE, 1.0, 0.1, 1.0),
        "envelope must be a JenningsEnvelope or None, got 1.0",
    ),
    "duration": (
        lambda: wd.FilteredNoise(WHITE, 0.0, 0.1),
        "FilteredNoise.duration [s] must be a finite number above 0",
    ),
    "interval": (lambda: wd.FilteredNoise(WHITE, 1.0, 0.03), "interval 0.03 s does not divide the duration, 1 s"),
    "longer interval": (
        lambda: wd.FilteredNoise(WHITE, 1.0, 2.0),
        "does not divide the duration, 1 s: give interval=1 or interval=0.5",
    ),
    "intervals": (lambda: wd.FilteredNoise(WHITE, 1e6, 1e-6), "into more than 1073741824 intervals"),
    "sample": (lambda: wd.FilteredNoise(WHITE, 1.0, 0.1).motion(-1), "sample must be a whole number of at least 0"),
    "step": (lambda: run_noise(step=0.03), "step 0.03 s does not divide the interval of the noise, 0.1 s"),
    "resample": (lambda: run_noise(step=0.03, resample=True), "resample needs sampled motions or forces"),
}


def run_noise(**settings):
    return wd.simulate(wd.Scene(STRUCTURES["chain"], wd.FilteredNoise(WHITE, 1.0, 0.1)), **settings)


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused(case):
    attempt, message = BAD[case]
    with pytest.raises((ValueError, TypeError)) as told:
        attempt()
    assert message in str(told.value)
