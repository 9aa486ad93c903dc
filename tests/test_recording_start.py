"""`record_from`: peaks from a given time on, against closed-form steady states and against whole histories."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import warpdyn as wd
from warpdyn.engine.kernels import build

MASS, PERIOD, RATIO = 1000.0, 0.5, 0.05
STIFFNESS = MASS * (2 * np.pi / PERIOD) ** 2
FORCE = np.array([0.0, 500.0])
CHAIN = wd.ShearBuilding([MASS, MASS], [STIFFNESS] * 2, 3.0, damping="rayleigh", damping_ratio=RATIO)
STEP = 5e-3


def matrices():
    """Mass, Rayleigh damping and stiffness matrix of the two-storey chain."""
    mass = MASS * np.eye(2)
    stiffness = STIFFNESS * np.array([[2.0, -1.0], [-1.0, 1.0]])
    low, high = np.sqrt(np.sort(np.linalg.eigvals(stiffness / MASS).real))
    return mass, 2 * RATIO * (low * high * mass + stiffness) / (low + high), stiffness, low


def steady_state(frequency):
    """Complex amplitudes of the displacements under FORCE at a circular frequency, by the impedance matrix."""
    mass, damping, stiffness, _ = matrices()
    return np.linalg.solve(stiffness - frequency**2 * mass + 1j * frequency * damping, FORCE)


@pytest.mark.parametrize(
    ("kind", "method", "step"),
    [
        ("chain", "rk4", STEP),
        ("chain", "newmark_average", STEP),
        ("chain", "exact", STEP),
        ("chain", "dormand_prince54", None),
        ("dense", "rk4", STEP),
        ("dense", "newmark_average", STEP),
        ("dense", "exact", STEP),
    ],
)
def test_peaks_of_the_steady_state_match_the_impedance(kind, method, step):
    mass, damping, stiffness, first = matrices()
    frequency = 0.9 * first
    amplitude = steady_state(frequency)
    structure = CHAIN if kind == "chain" else wd.LinearSystem(mass, damping, stiffness)
    # After 30 s the transient has decayed to exp(-0.05 * 7.8 * 30) = 1e-5.
    scene = wd.Scene(structure, wd.HarmonicForce(FORCE, frequency, 40.0), record_from=30.0)
    run = wd.simulate(scene, structures=1, method=method, step=step, dtype="float64", device="cpu")
    # Peaks are those at steps: (w h)^2 / 8 = 2e-4 below the amplitude at most; Newmark's average acceleration also
    # changes frequencies by (w h)^2 / 12 = 1.4e-4 in the first mode, 1.2 % in the second, which contributes little; at
    # 0.9 of resonance, displacements change by 1 / (1 - 0.9^2) = 5 times as much.
    bound = 2e-3 if method == "newmark_average" else 2e-4 + 2e-5
    if kind == "chain":
        drift = np.abs([amplitude[0], amplitude[1] - amplitude[0]])
        np.testing.assert_allclose(run["peak_storey_drift"][0], drift, rtol=bound)
        np.testing.assert_allclose(run["peak_base_shear"][0], STIFFNESS * drift[0], rtol=bound)
        np.testing.assert_allclose(run["peak_floor_acceleration"][0], frequency**2 * np.abs(amplitude), rtol=bound)
        assert 30.0 <= run["time_of_peak_drift"][0] <= 40.0
    else:
        np.testing.assert_allclose(run["peak_displacement"][0], np.abs(amplitude), rtol=bound)
        np.testing.assert_allclose(run["peak_acceleration"][0], frequency**2 * np.abs(amplitude), rtol=bound)
        assert np.all((run["time_of_peak_displacement"] >= 30.0) & (run["time_of_peak_displacement"] <= 40.0))


def test_probability_of_exceedance_in_the_steady_state():
    # The amplitude F / |k - m w^2 + i c w| passes a limit if k is within h = sqrt((F / limit)^2 - (c w)^2) of m w^2,
    # which has a probability in closed form if k is lognormal.
    frequency, damping, dispersion = 2 * np.pi / PERIOD, 0.04 * STIFFNESS / (2 * np.pi / PERIOD), 0.1
    limit = 500.0 / np.hypot(0.077, 0.04) / STIFFNESS
    storey = {"damping": "storey", "damping_coefficient": damping}
    oscillator = wd.ShearBuilding(MASS, STIFFNESS, 3.0, **storey)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, dispersion))}
    load = wd.HarmonicForce([500.0], frequency, 60.0)

    def probability(start):
        scene = wd.Scene(oscillator, load, scatter, recorders=("drift",), record_from=start)
        run = wd.simulate(scene, structures=1024, method="rk4", step=STEP, dtype="float64", seed=3, device="cpu")
        return float((run["peak_storey_drift"] > limit).mean())

    expected = np.diff(norm.cdf(np.log([1 - 0.077, 1 + 0.077]) / dispersion))[0]
    # One scrambled Sobol dimension has one point in each of 1024 equal parts: 1 / 1024 at each of the two ends, and as
    # much again as peaks at steps are up to 1e-4 below the amplitude.
    assert probability(50.0) == pytest.approx(expected, abs=4 / 1024)
    assert probability(0.0) > expected + 0.1  # beats of the transient pass the limit, too


def decaying(seed, *shape):
    """Random numbers that decay, so that the largest response comes before the recorders start."""
    values = np.random.default_rng(seed).standard_normal(shape)
    return values * np.exp(-0.02 * np.arange(shape[0]) / 1.5).reshape(-1, *[1] * (len(shape) - 1))


MOTIONS = [
    wd.GroundMotion(4.0 * decaying(number, count), 0.02, f"noise {number}")
    for number, count in ((1, 251), (2, 401), (3, 301))
]
NOISE = wd.FilteredNoise(wd.WhiteNoise(0.01), duration=8.0, interval=0.02)
PULSE = wd.ForceHistory(3e3 * decaying(4, 301, 2), 0.02)
YIELDING = wd.ShearBuilding(
    [MASS] * 2, [STIFFNESS] * 2, 3.0, law="bilinear", yield_force=2e3, hardening_ratio=0.05, damping_ratio=RATIO,
    damping="rayleigh",
)  # fmt: skip
LINEAR = wd.LinearSystem(*(matrices()[:3]))


@pytest.mark.parametrize(
    ("structure", "excitation", "method"),
    [
        (YIELDING, wd.Cloud(MOTIONS), "rk4"),
        (YIELDING, wd.Cloud(MOTIONS), "newmark_average"),
        (CHAIN, wd.Cloud(MOTIONS), "exact"),
        (YIELDING, NOISE, "rk4"),
        (YIELDING, PULSE, "rk4"),
        (LINEAR, wd.Cloud(MOTIONS), "rk4"),
        (LINEAR, wd.Cloud(MOTIONS), "exact"),
        (YIELDING, wd.FreeVibration(6.0, velocity=[0.3, 0.5]), "rk4"),
    ],
)
def test_peaks_are_those_of_the_history_from_then_on(structure, excitation, method):
    start = 2.513  # between two steps: the first state from then on is at 2.515 s
    how = {"structures": 1, "method": method, "step": STEP, "dtype": "float64", "device": "cpu"}
    scenes = [wd.Scene(structure, excitation, record_from=time) for time in (start, 0.0)]
    samples = scenes[0].excitation.samples_per_structure
    run = wd.simulate(scenes[0], **how, histories=wd.Histories(range(samples)))
    whole = wd.simulate(scenes[1], **how)
    late = run.isel(time=np.flatnonzero(run["time"] > start))
    # Histories and demands come from two kernels of one method, which round differently: 1e-13 in thousands of steps.
    close = {"rtol": 1e-9, "atol": 1e-12}
    displacement = late["displacement"].values
    if structure is LINEAR:
        demands = ("peak_displacement", "peak_acceleration")
        np.testing.assert_allclose(run["peak_displacement"], np.nanmax(np.abs(displacement), axis=1), **close)
        np.testing.assert_allclose(run["peak_acceleration"], np.nanmax(np.abs(late["acceleration"]), axis=1), **close)
        when = late["time"].values[np.nanargmax(np.abs(displacement), axis=1)]
        np.testing.assert_allclose(run["time_of_peak_displacement"], when, rtol=1e-9)
    else:
        demands = ("peak_storey_drift", "peak_floor_acceleration", "peak_base_shear")
        drift = np.abs(np.diff(displacement, axis=2, prepend=0.0))
        np.testing.assert_allclose(run["peak_storey_drift"], np.nanmax(drift, axis=1), **close)
        acceleration = np.nanmax(np.abs(late["acceleration"].values), axis=1)
        np.testing.assert_allclose(run["peak_floor_acceleration"], acceleration, **close)
        shear = np.nanmax(np.abs(late["storey_force"].values[:, :, 0]), axis=1)
        np.testing.assert_allclose(run["peak_base_shear"], shear, **close)
        when = late["time"].values[np.nanargmax(np.nan_to_num(drift).max(axis=2), axis=1)]
        np.testing.assert_allclose(run["time_of_peak_drift"], when, rtol=1e-9)
        np.testing.assert_allclose(run["residual_drift_ratio"], whole["residual_drift_ratio"], **close)
    for name in ("input_energy", "viscous_energy"):  # of the whole run
        np.testing.assert_allclose(run[name], whole[name], rtol=1e-9)
    for name in demands:
        assert run[name].attrs["comment"] == "of the states from record_from = 2.513 s on"
    assert "comment" not in run["input_energy"].attrs
    assert all((run[name] <= whole[name] * (1 + 1e-9)).all() for name in demands)
    if excitation is not NOISE:  # which may have its peak at any time
        assert any((run[name] < 0.99 * whole[name]).any() for name in demands)


@pytest.mark.parametrize("method", ["rk4", "newmark_average", "exact"])
def test_a_sample_that_collapses_before_keeps_its_peaks(method):
    push = np.zeros((301, 2))
    push[10:60, 1] = 5e4  # passes the limit within the first second
    scenes = [
        wd.Scene(CHAIN, wd.ForceHistory(scale * push, 0.02), collapse_drift_ratio=0.05, record_from=start)
        for scale in (1.0, 1e-2)
        for start in (0.0, 3.0)
    ]
    how = {"structures": 1, "method": method, "step": STEP, "dtype": "float64", "device": "cpu"}
    collapsed, collapsed_late, standing, standing_late = (wd.simulate(scene, **how) for scene in scenes)
    assert collapsed["time_of_collapse"] == collapsed_late["time_of_collapse"] < 1.0
    for name in ("peak_storey_drift", "peak_floor_acceleration", "peak_base_shear", "time_of_peak_drift"):
        # Two kernels of one method, which round differently.
        np.testing.assert_allclose(collapsed_late[name], collapsed[name], rtol=1e-9)
    assert (standing_late["peak_storey_drift"] < standing["peak_storey_drift"]).all()
    assert (standing_late["peak_storey_drift"] > 0).all()


def test_a_sample_alone_in_its_thread_records_from_then_on(monkeypatch):
    # As on a GPU, where the loop over steps has another shape.
    how = {"structures": 1, "method": "rk4", "step": STEP, "dtype": "float64", "device": "cpu"}
    scenes = [
        wd.Scene(YIELDING, wd.Cloud(MOTIONS), recorders=recorders, record_from=2.513, collapse_drift_ratio=limit)
        for recorders in (("drift",), ("acceleration", "drift"))
        for limit in (None, 0.5)
    ]
    many = [wd.simulate(scene, **how) for scene in scenes]
    monkeypatch.setattr(build, "CPU_LANES", 1)
    for scene, expected in zip(scenes, many, strict=True):
        alone = wd.simulate(scene, **how)
        for name in ("peak_storey_drift", "peak_floor_acceleration"):
            if name in expected:
                # One method in two kernels, which round differently.
                np.testing.assert_allclose(alone[name], expected[name], rtol=1e-9)


def test_statistics_count_the_peaks_from_then_on():
    stripes = wd.Stripes(MOTIONS, [0.5, 1.0], wd.PeakGroundAcceleration())
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.3))}
    scene = wd.Scene(YIELDING, stripes, scatter, recorders=("drift",), record_from=4.0)
    limits = {"slight": 2e-3, "complete": 4e-3}
    how = {"structures": 8, "method": "rk4", "step": STEP, "seed": 5, "device": "cpu"}
    full = wd.simulate(scene, **how)
    reduced = wd.simulate(scene, **how, statistics=wd.DamageCounts(limits, over="stripe"))
    ratio = full["peak_storey_drift_ratio"].max("storey")
    expected = [[int(((ratio > low) & (ratio <= high) & (full["im_level"] == level)).sum()) for level in (0.5, 1.0)]
                for low, high in ((-1.0, 2e-3), (2e-3, 4e-3), (4e-3, np.inf))]  # fmt: skip
    np.testing.assert_array_equal(reduced["damage_count_by_stripe"].transpose("damage_state", "stripe"), expected)
    assert np.min(np.sum(expected, axis=1)) > 0


def test_runs_that_record_from_other_times_are_not_joined():
    stripes = wd.Stripes(MOTIONS, [0.5, 1.0], wd.PeakGroundAcceleration())
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.3))}
    how = {"structures": 8, "method": "rk4", "step": STEP, "device": "cpu"}
    scene = wd.Scene(YIELDING, stripes, scatter, recorders=("drift",), record_from=4.0)
    later, same = (wd.simulate(scene, **how, seed=seed) for seed in (5, 6))
    assert wd.join([later, same]).sizes["sample"] == 2 * later.sizes["sample"]
    earlier = wd.simulate(replace(scene, record_from=3.0), **how, seed=7)
    for other in (earlier, wd.join([earlier])):
        with pytest.raises(ValueError, match=r"run 1 is of the states from record_from = 3 s on.*the same record_from"):
            wd.join([later, other])


@pytest.mark.fast
@pytest.mark.parametrize(
    ("value", "message"),
    [
        (-1.0, "record_from .s. must be a finite number of at least 0"),
        (np.nan, "must be a finite number"),
        (np.inf, "must be a finite number"),
        ("10", "must be a finite number"),
        (True, "must be a finite number"),
        (5.0, "record_from is 5 s, but the shortest sample ends at 5 s"),
        (70.0, "the shortest sample ends at 5 s"),
    ],
)
def test_start_times_that_cannot_be_are_refused(value, message):
    with pytest.raises(ValueError, match=message):
        wd.Scene(CHAIN, wd.Cloud(MOTIONS), record_from=value)
    with pytest.raises(ValueError, match=r"must be a finite number|the shortest sample ends at 2 s"):
        wd.Scene(CHAIN, wd.HarmonicForce(FORCE, 5.0, 2.0), record_from=value)


@pytest.mark.fast
def test_a_given_tail_counts_and_a_short_rest_is_warned_of():
    scene = wd.Scene(CHAIN, wd.Cloud(MOTIONS), tail=2.0, record_from=6.0)
    assert scene.record_from == 6.0
    assert wd.Scene.from_json(scene.to_json(), MOTIONS).record_from == 6.0
    with pytest.raises(
        UserWarning, match=r"start time of the recorders, which leaves less than the first period of 0.809 s"
    ):
        wd.simulate(wd.Scene(CHAIN, wd.HarmonicForce(FORCE, 5.0, 2.0), record_from=1.9), structures=1)


@pytest.mark.fast
def test_the_kernel_of_other_scenes_stays_as_it_is():
    scene = wd.Scene(CHAIN, wd.Cloud(MOTIONS), record_from=0.0)
    text = wd.kernels.source(scene, device="cpu")
    assert "first_recorded" not in text
    assert "first_recorded" in wd.kernels.source(wd.Scene(CHAIN, wd.Cloud(MOTIONS), record_from=1.0), device="cpu")
