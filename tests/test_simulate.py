"""The run: seeds, chunks, threads and lanes change nothing; designs, statuses, steps, histories and the dataset."""

import io
import sys

import numpy as np
import pytest
import xarray as xr
from labels import check_labels

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("collapse_drift_ratio", "force_over_weight", "no_damping", "storey_height")

GRAVITY = 9.80665
SEEDED = {
    "mass": wd.RandomFactor(wd.Lognormal(1, 0.1)),
    "yield_force": wd.RandomFactor(wd.Lognormal(1, 0.3), per="storey"),
}


def make_motion(step, values, seed):
    noise = np.random.default_rng(seed).standard_normal(values)
    return wd.GroundMotion(3.0 * noise * np.hanning(values), step, name=f"noise {seed}")


# Lengths, steps and the substeps that follow from them all differ.
MOTIONS = (make_motion(0.02, 60, 1), make_motion(0.005, 300, 2), make_motion(0.01, 90, 3))


def make_building(**changes):
    parameters = {"mass": [2e3, 1e3], "stiffness": [6e5, 4e5], "height": [3.5, 3.0], "law": "bilinear"}
    parameters |= {"yield_force": [4e3, 2e3], "hardening_ratio": 0.05, "damping": "storey", "damping_coefficient": 2e3}
    return wd.ShearBuilding(**(parameters | changes))


def make_scene(**changes):
    design = wd.Stripes(MOTIONS, [0.1, 0.4], wd.PeakGroundAcceleration())
    return wd.Scene(**({"structure": make_building(), "excitation": design, "scatter": SEEDED, "tail": 0.3} | changes))


def make_oscillator(**parameters):
    """Return the oscillator of mass 1 kg, stiffness 100 N/m and height 1 m, whose drift is its drift ratio."""
    return wd.ShearBuilding(1.0, 100.0, 1.0, **parameters)


def assert_same_bits(first, second, samples=slice(None)):
    """Check that two runs hold the same variables, coordinates included, to the last bit, NaN included."""
    assert set(first.variables) == set(second.variables)
    for name in first.variables:
        one, other = (
            run[name].isel(sample=samples) if "sample" in run[name].dims else run[name] for run in (first, second)
        )
        assert one.dtype.kind == other.dtype.kind, name
        assert one.dims == other.dims, name
        assert one.values.tobytes() == other.values.astype(one.dtype).tobytes(), name


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_one_seed_gives_one_result_also_through_a_file(dtype, tmp_path):
    runs = [wd.simulate(make_scene(), structures=4, seed=11, dtype=dtype, threads=2) for _ in range(2)]
    assert_same_bits(*runs)
    wd.write(runs[0], tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as read:
        assert_same_bits(read.load(), runs[1])
    other = wd.simulate(make_scene(), structures=4, seed=12, dtype=dtype)
    assert not np.array_equal(other["mass"], runs[0]["mass"])
    assert not np.array_equal(other["peak_storey_drift"], runs[0]["peak_storey_drift"])


def test_more_samples_leave_the_first_as_they_are():
    few, many = (wd.simulate(make_scene(), structures=n) for n in (2, 5))
    assert many.sizes["sample"] == 5 * 3 * 2
    assert_same_bits(few, many, slice(0, few.sizes["sample"]))
    drawn = {"excitation": wd.OneMotionPerStructure(MOTIONS)}  # the motion of each sample is drawn too
    few, many = (wd.simulate(make_scene(**drawn), structures=n) for n in (3, 30))
    assert_same_bits(few, many, slice(0, 3))
    assert set(many["motion_index"].values) == {0, 1, 2}


@pytest.mark.parametrize(
    ("law", "method"),
    [
        ("takeda", "rk4"),
        *(
            pytest.param(*case, marks=pytest.mark.thorough)
            for case in (("pinching4", "rk4"), ("takeda", "newmark_average"))
        ),
    ],
)
def test_a_storey_that_glides_does_not_see_whether_others_turn(law, method):
    backbone = {"ductility_2": 2.0, "force_ratio_2": 1.3, "ductility_3": 5.0, "force_ratio_3": 1.4}
    backbone |= {"ductility_4": 9.0, "force_ratio_4": 0.5}
    own = {"takeda": {"hardening_ratio": 0.05, "unloading_exponent": 0.4}, "pinching4": backbone}[law]
    building = wd.ShearBuilding([1e4] * 2, 4e6, 3.0, law=law, yield_force=4e4, **own)
    shaking = wd.GroundMotion(6 * np.sin(np.arange(400) * 0.07) * np.hanning(400), 0.01)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1, 0.3))}
    scene = wd.Scene(building, shaking, scatter=scatter)
    few, many = (wd.simulate(scene, structures=n, step=0.005, method=method) for n in (3, 40))
    assert np.ptp(many["hysteretic_energy"].values) > 0
    assert_same_bits(few, many, slice(0, 3))


@pytest.mark.meant_as_given("peak_ground_acceleration")
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_sample_is_the_same_alone_and_among_others(dtype):
    # Beside motions of other lengths, steps and substeps: lanes of one row go on after its end, with other steps.
    # Motions that grow to their end, and no tail, make a lane that runs on show in its peaks.
    growing = [(0.02, 50), (0.02, 23), (0.01, 90), (0.009, 70), (0.005, 300)]
    motions = [wd.GroundMotion(0.1 * np.arange(n) * np.sin(np.arange(n) ** 2), step) for step, n in growing]
    among = wd.simulate(make_scene(excitation=wd.Cloud(motions), scatter={}, tail=0.0), method="rk4", dtype=dtype)
    assert np.round(among["motion_step"].values / among["integration_step"].values).tolist() == [5, 5, 3, 2, 2]
    for index, motion in enumerate(motions):
        alone = wd.simulate(make_scene(excitation=motion, scatter={}, tail=0.0), method="rk4", dtype=dtype)
        for name in alone.data_vars:
            if "sample" in alone[name].dims:
                assert alone[name].values[0].tobytes() == among[name].values[index].tobytes(), name


def test_stripes_of_peak_ground_acceleration():
    levels = [0.1, 0.4]
    run = wd.simulate(make_scene(), structures=2)
    # Structure first, then motion, then level.
    assert run["structure"].values.tolist() == [0] * 6 + [1] * 6
    assert run["motion_index"].values.tolist() == [0, 0, 1, 1, 2, 2] * 2
    assert run["motion"].values.tolist() == [0, 1, 2]
    names = run["motion_name"].sel(motion=run["motion_index"])
    assert names.values.tolist() == [MOTIONS[index].name for index in run["motion_index"].values]
    assert run["im_level"].values.tolist() == levels * 6
    peaks = np.array([np.abs(motion.acceleration).max() for motion in MOTIONS])
    scaled = run["scale_factor_of_motion"] * peaks[run["motion_index"]] / GRAVITY
    np.testing.assert_allclose(scaled, run["im_level"], rtol=1e-14)


def test_stripes_of_spectral_acceleration_reach_their_level():
    # The oscillator of the measure itself: w^2 times its peak drift is the level. The run looks every d = 1 ms and
    # so misses d^2 |u''| / 8 of a peak u at most: 1.25e-5 of it where the base rests then, here eight times that.
    period, levels = 2 * np.pi / 10, np.array([0.2, 1.5])
    oscillator = make_oscillator(damping="rayleigh", damping_ratio=0.05)
    scene = wd.Scene(oscillator, wd.Stripes(MOTIONS, levels, wd.SpectralAcceleration(period)))
    run = wd.simulate(scene, step=1e-3, dtype="float64")
    np.testing.assert_allclose(100 * run["peak_storey_drift"][:, 0] / GRAVITY, np.tile(levels, 3), rtol=1e-4)


def test_cloud_and_individual():
    cloud = wd.simulate(make_scene(excitation=wd.Cloud(MOTIONS)), structures=2)
    peaks = [np.abs(motion.acceleration).max() / GRAVITY for motion in MOTIONS]
    np.testing.assert_allclose(cloud["im_level"], peaks * 2, rtol=1e-14)
    assert np.all(cloud["scale_factor_of_motion"] == 1)
    chosen = wd.OneMotionPerStructure(MOTIONS, motion=[2, 0], scale=[0.5, 2.0])
    run = wd.simulate(make_scene(excitation=chosen, scatter={}), structures=2)
    assert run["motion_index"].values.tolist() == [2, 0]
    np.testing.assert_allclose(run["im_level"], [0.5 * peaks[2], 2 * peaks[0]], rtol=1e-14)


def test_dataset_keeps_its_contract():
    scatter = SEEDED | {"stiffness": wd.RandomFactor(wd.Uniform(0.9, 1.1))}
    run = wd.simulate(make_scene(scatter=scatter), structures=2, seed=5, method="rk4", histories=wd.Histories((0, 1)))
    assert run["peak_storey_drift_ratio"].dims == ("sample", "storey")
    assert run["peak_floor_acceleration"].dims == ("sample", "floor")
    assert run["displacement"].dims == ("history", "time", "dof")
    assert run["peak_base_shear"].dims == ("sample",)
    for name in ("motion_index", "im_level", "structure"):
        assert run[name].dims == ("sample",)
        assert name in run.coords
    assert run["storey"].values.tolist() == run["floor"].values.tolist() == run["dof"].values.tolist() == [1, 2]
    check_labels(run)
    assert run["sample"].attrs["standard_name"] == "realization"
    assert run["status"].attrs["flag_values"].dtype == run["status"].dtype == np.int8
    assert run["status"].attrs["flag_values"].tolist() == [0, 1, 2, 3, 4, 5]
    assert run["status"].attrs["flag_meanings"] == "ok collapsed diverged unstable_step not_converged control_failed"
    assert {"Conventions", "title", "history", "source", "scene", "step", "device", "kernel"} <= set(run.attrs)
    assert (run.attrs["seed"], run.attrs["method"], run.attrs["dtype"]) == (5, "rk4", "float32")
    # The inputs drawn stand under their names, as the samples had them.
    assert {"mass", "stiffness", "yield_force"} <= set(run.data_vars)
    ratio = run["stiffness"].values / [6e5, 4e5]
    assert np.all((ratio > 0.9) & (ratio < 1.1))
    np.testing.assert_allclose(ratio[:, 0], ratio[:, 1], rtol=1e-6)  # one draw for the building, rounded to float32
    np.testing.assert_allclose(run["peak_storey_drift_ratio"], run["peak_storey_drift"] / [3.5, 3.0], rtol=1e-6)
    assert run["motion_name"].values.tolist() == [motion.name for motion in MOTIONS]
    np.testing.assert_allclose(run["motion_step"], [0.02, 0.005, 0.01], rtol=1e-15)


def test_histories_agree_with_what_was_recorded_while_it_ran():
    # No scatter: every sample of one motion has the same step, but motions 0 and 1 end at different times.
    scene = make_scene(excitation=wd.Cloud(MOTIONS[:2]), scatter={})
    run = wd.simulate(scene, step=0.0025, dtype="float64", histories=wd.Histories((1, 0)))
    assert run["history_sample"].values.tolist() == [1, 0]
    # Free vibration lasts as long as asked, to the next sample of the motion.
    ends = [round((299 * 0.005 + 0.3) / 0.0025), round((59 * 0.02 + 0.3) / 0.0025)]
    np.testing.assert_allclose(run["time"], 0.0025 * np.arange(max(ends) + 1), rtol=1e-15)
    for row, end in enumerate(ends):
        history, recorded = run.isel(history=row), run.isel(sample=[1, 0][row])
        values = history["displacement"].values
        assert np.all(np.isfinite(values[: end + 1]))
        assert np.all(np.isnan(values[end + 1 :]))
        drift = np.diff(values[: end + 1], axis=1, prepend=0)
        # The kernel of histories is another, so that roundings differ: 1e-15 a step, over 800 steps.
        close = {"rtol": 1e-11}
        np.testing.assert_allclose(np.abs(drift).max(axis=0), recorded["peak_storey_drift"], **close)
        worst = np.abs(drift / [3.5, 3.0])
        when, storey = np.unravel_index(worst.argmax(), worst.shape)
        assert float(recorded["time_of_peak_drift"]) == pytest.approx(when * 0.0025, rel=1e-14)
        assert int(recorded["storey_of_peak_drift"]) == storey + 1
        acceleration = np.abs(history["acceleration"].values[: end + 1]).max(axis=0)
        np.testing.assert_allclose(acceleration, recorded["peak_floor_acceleration"], **close)
        shear = np.abs(history["storey_force"].values[: end + 1, 0]).max()
        np.testing.assert_allclose(shear, recorded["peak_base_shear"], **close)


def test_histories_are_decimated():
    scene = make_scene(excitation=MOTIONS[0], scatter={})
    every, third = (
        wd.simulate(scene, step=0.005, dtype="float64", histories=wd.Histories((0,), every)) for every in (1, 3)
    )
    np.testing.assert_array_equal(third["time"], every["time"][::3])
    for name in ("displacement", "velocity", "acceleration", "storey_force"):
        np.testing.assert_array_equal(third[name], every[name][:, ::3])


def test_histories_of_other_steps_are_interpolated():
    motions = (MOTIONS[0], make_motion(0.007, 150, 4), make_motion(0.0025, 700, 5))
    scene = make_scene(excitation=wd.Cloud(motions), scatter={})
    settings = {"longest_step": 0.006, "dtype": "float64"}
    run = wd.simulate(scene, histories=wd.Histories((2, 1, 0), 2), **settings)
    # Steps of 0.02 / 4, 0.007 / 2 and 0.0025 s: the last divides the first, and the second is interpolated at it.
    np.testing.assert_allclose(run["integration_step"], [0.005, 0.0035, 0.0025], rtol=1e-12)
    np.testing.assert_allclose(np.diff(run["time"]), 0.01, rtol=1e-9)
    alone = [wd.simulate(scene, histories=wd.Histories((i,)), **settings) for i in range(3)]
    for row, (own, apart) in enumerate(zip(alone[::-1], (4, None, 2), strict=True)):
        for name in ("displacement", "velocity", "acceleration", "storey_force"):
            found, states = run[name].values[row], own[name].values[0]
            count = int(own["time"][-1] / 0.01 * (1 + 1e-9)) + 1
            assert np.isnan(found[count:]).all()
            for dof in range(2):
                times = run["time"][:count]
                expected = np.interp(times, own["time"], states[:, dof]) if apart is None else states[::apart, dof]
                # The same states; interpolated by other arithmetic, which errs by some roundings of the largest.
                atol = 0 if apart else 1e-12 * np.abs(states).max()
                np.testing.assert_allclose(found[:count, dof], expected[:count], rtol=0, atol=atol)


def test_residual_peak_and_dissipation_of_an_oscillator_that_yields_once():
    # Elastic-perfectly-plastic, v0 = 0.3, uy = 0.01: by hand, the largest drift is 0.05 at 0.316826403420031 s, 0.04 J
    # are dissipated, and it then moves about 0.04 for ever. Tolerances: 3 h^2 w^2 for the step in which it yields.
    period, step = 2 * np.pi / 10, 2 * np.pi / 10 / 1000
    load = wd.FreeVibration(5 * period, velocity=0.3)
    for count in (1, 3):  # the residual of lanes that repeat the last sample is not added to its own
        run = wd.simulate(
            wd.Scene(make_oscillator(law="bilinear", yield_force=1.0, hardening_ratio=0.0), load),
            step=step,
            structures=count,
            dtype="float64",
        )
        np.testing.assert_allclose(run["peak_storey_drift"], 0.05, rtol=1e-4)
        np.testing.assert_allclose(run["time_of_peak_drift"], 0.316826403420031, atol=step)
        np.testing.assert_allclose(run["hysteretic_energy"], 0.04, rtol=1e-4)
        np.testing.assert_allclose(run["residual_drift_ratio"], 0.04, rtol=1e-4)


def test_collapse_is_told_by_its_limit_alone():
    run = wd.simulate(make_scene(), structures=3)
    worst = run["peak_storey_drift_ratio"].max("storey").values
    limit = float(np.sort(worst)[9])  # of 18 samples
    limited = wd.simulate(make_scene(collapse_drift_ratio=limit * 1.0001), structures=3)
    assert limited["status"].values.tolist() == (worst > limit * 1.0001).astype(int).tolist()
    assert 0 < limited["status"].values.sum() < 18
    stands = limited["status"].values == 0
    recorded = set(run.data_vars) - {"status"}
    same = limited.isel(sample=stands)
    assert_same_bits(run[recorded].isel(sample=stands), same[recorded])
    assert np.isnan(same["time_of_collapse"]).all()
    assert (same["storey_of_collapse"] == -1).all()
    # Collapsed samples keep what they had when the limit was passed.
    fallen, whole = limited.isel(sample=~stands), run.isel(sample=~stands)
    np.testing.assert_allclose(fallen["peak_storey_drift_ratio"].max("storey"), limit * 1.0001, rtol=1e-6)
    assert (fallen["peak_storey_drift_ratio"] <= whole["peak_storey_drift_ratio"]).all()
    assert (fallen["time_of_collapse"] <= whole["time_of_peak_drift"]).all()
    assert (fallen["storey_of_collapse"] == fallen["storey_of_peak_drift"]).all()
    assert np.isnan(fallen["residual_drift_ratio"]).all()


def test_a_step_beyond_the_stability_limit_is_flagged_and_never_a_collapse():
    # RK4's limit without damping is 2.828427124746 / w; the scatter of mass puts it on both sides of the step.
    oscillator = make_oscillator()
    scatter = {"mass": wd.RandomFactor(wd.Uniform(0.5, 1.5))}
    scene = wd.Scene(oscillator, wd.FreeVibration(40.0, 0.1), scatter=scatter, collapse_drift_ratio=1e-3)
    with pytest.warns(UserWarning, match="stability limit of .* of 40 samples"):
        run = wd.simulate(scene, structures=40, step=0.25, dtype="float64", on_unstable="flag")
    limit = 2.828427124746 / np.sqrt(100 / run["mass"].values[:, 0])
    assert np.all(np.abs(limit / 0.25 - 1) > 3e-3)  # none so near that the engine's margin of 0.21 % decides
    assert run["status"].values.tolist() == np.where(limit < 0.25, 3, 1).tolist()
    assert set(run["status"].values) == {1, 3}
    failed = run["status"] == 3
    for name in ("peak_storey_drift", "peak_storey_drift_ratio", "residual_drift_ratio", "energy_balance_error"):
        assert np.all(np.isnan(run[name][failed])), name
        if name != "residual_drift_ratio":  # the others all collapse
            assert np.all(np.isfinite(run[name][~failed])), name
    assert np.all(np.isfinite(run["mass"]))  # what was drawn is told of failed samples too


@pytest.mark.meant_as_given("drift_ratio_of_force")
def test_a_blow_up_is_diverged_and_never_a_collapse():
    # At resonance the velocity grows by F / 2m = 5e37 m/s a second: float32 ends at 3.4e38, after 7 s.
    scene = wd.Scene(make_oscillator(), wd.HarmonicForce([1e38], 10.0, 60.0), collapse_drift_ratio=1e-3)
    with pytest.warns(UserWarning, match="2 of 2 samples are flagged diverged"):
        run = wd.simulate(scene, structures=2, dtype="float32", on_unstable="flag")  # and no shorter steps
    assert run["status"].values.tolist() == [2, 2]
    for name in ("peak_storey_drift", "peak_floor_acceleration", "input_energy", "hysteretic_energy"):
        assert np.all(np.isnan(run[name])), name
    # Finite, but thousands of storey heights: a blow-up as well. A drift that a structure may have is a collapse.
    with pytest.warns(UserWarning, match="1 of 1 samples is flagged diverged"):
        assert wd.simulate(scene, dtype="float64", on_unstable="flag")["status"].values.tolist() == [2]
    scene = wd.Scene(make_oscillator(), wd.HarmonicForce([1.0], 10.0, 60.0), collapse_drift_ratio=1e-3)
    assert wd.simulate(scene, dtype="float64")["status"].values.tolist() == [1]


@pytest.mark.meant_as_given("first_period_over_height", "yield_drift_ratio", "damping_ratio")
def test_default_step_divides_every_motion_and_resolves_the_structure():
    stiff, soft = make_building(), make_building(stiffness=[6e2, 4e2])
    for building in (stiff, soft):
        run = wd.simulate(make_scene(structure=building, scatter={}), method="rk4")
        ratio = run["motion_step"].values[run["motion_index"].values] / run["integration_step"].values
        np.testing.assert_allclose(ratio, np.round(ratio), rtol=1e-12)
        assert np.all(run["integration_step"] <= building.fundamental_period / 100 * (1 + 1e-9))
        assert np.all(run["status"] == 0)
    assert np.all(ratio == 1)  # a soft structure is integrated at the step of each motion, no finer


class Screen(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("stream", [io.StringIO, Screen])
def test_progress_shows_on_a_terminal_only(stream, monkeypatch):
    monkeypatch.setattr(sys, "stderr", shown := stream())
    monkeypatch.setattr(sys, "stdout", printed := io.StringIO())
    wd.simulate(make_scene(), structures=2)
    assert printed.getvalue() == ""
    assert ("12.0/12.0" in shown.getvalue()) == (stream is Screen)
