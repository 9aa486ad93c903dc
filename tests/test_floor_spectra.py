"""Floor spectra: a reference building, separate oscillators in SciPy, statistics, and invalid input."""

import numpy as np
import pytest
from scipy.linalg import expm

import warpdyn as wd

PERIODS = [0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0]
# Floor spectra [m/s2] of floors 2 and 5 of the reference building, computed with exact state transitions. Those of the
# bilinear building go from event to event (yield and unloading of a storey, found by scipy.optimize.brentq), with peaks
# at each 0.00005 s; with peaks at each 0.0001 s they differ by at most 2.5e-6.
ELASTIC = {
    2: [7.52199, 7.73137, 8.09235, 9.6168, 11.4087, 18.997, 54.3872, 29.0101, 8.147, 4.25246, 1.80385, 1.14421],
    5: [17.1141, 17.6259, 18.5862, 20.1746, 25.8763, 45.9347, 125.391, 59.5943, 14.7531, 7.78538, 2.98946, 1.68442],
}
BILINEAR = {
    2: [3.88229, 7.33429, 6.01443, 8.07411, 3.50698, 5.65437, 11.6955, 6.1908, 3.39365, 2.14624, 1.31693, 0.883236],
    5: [4.50131, 6.2075, 8.23756, 8.19404, 6.10297, 10.0534, 25.7102, 12.0249, 5.52275, 3.31392, 1.70617, 1.11268],
}
YIELD_FORCES = np.array([1470997.5, 1368027.7, 1176798.0, 912018.45, 588399.0])  # N
RECORDERS = ("drift", "floor_spectra")


def reference_run(yield_forces):
    law = wd.laws.Bilinear(yield_force=yield_forces, hardening_ratio=0.03)
    stiffness = np.array([4.0, 3.6, 3.2, 2.8, 2.4]) * 1e8
    damped = dict(damping="rayleigh", damping_ratio=0.05, damping_modes=(1, 2))
    building = wd.ShearBuilding(np.full(5, 2e5), stiffness, 3.2, law=law, **damped)
    time = np.arange(4001) * 0.005
    pulse = wd.GroundMotion(3.0 * np.sin(2 * np.pi * time / 0.5) * np.exp(-0.35 * time), 0.005, "P2")
    asked = dict(recorders=RECORDERS, floor_spectra=wd.FloorSpectra(PERIODS), tail=2.0)
    scene = wd.Scene(building, wd.Cloud([pulse]), **asked)
    run = wd.simulate(scene, device="cpu", method="rk4", dtype="float64", step=0.0005)
    return run["peak_floor_spectral_acceleration"]


@pytest.mark.parametrize(("factor", "reference"), [(10.0, ELASTIC), (1.0, BILINEAR)], ids=["elastic", "bilinear"])
def test_the_reference_building(factor, reference):
    # The same kernel: with 10 times the strength the building stays elastic.
    spectra = reference_run(factor * YIELD_FORCES)
    # Largest differences at this step: 2e-5 (elastic), 7.5e-5 (bilinear, at 0.05 s). At 0.0001 s: 2e-6 (bilinear).
    for floor, values in reference.items():
        np.testing.assert_allclose(spectra.sel(floor=floor).values[0], values, rtol=1e-4)


T = (0.1, 0.3, 1.0)
STEP = 0.001


def oscillator_peak(acceleration, step, period, *, absolute, start=0):
    """Return the peak of an oscillator by matrix exponentials, at 40 points within each step [m/s2]."""
    omega, zeta = 2 * np.pi / period, 0.05
    matrix = np.zeros((4, 4))  # state: displacement, velocity, base acceleration and its slope
    matrix[0, 1], matrix[1, :3], matrix[2, 3] = 1.0, (-(omega**2), -2 * zeta * omega, -1.0), 1.0
    whole = expm(matrix * step)
    states = np.zeros((acceleration.size, 4))
    states[:, 2], states[:-1, 3] = acceleration, np.diff(acceleration) / step
    for i in range(acceleration.size - 1):
        states[i + 1, :2] = (whole @ states[i])[:2]
    force = np.array([omega**2, 2 * zeta * omega if absolute else 0.0, 0.0, 0.0])
    within = states[start:-1]
    return max(np.abs(within @ (force @ expm(matrix * step * i / 40))).max() for i in range(41))


def three_storeys(**law):
    rows = np.full(3, 2e5), np.array([4e8, 3e8, 2e8]), 3.2
    return wd.ShearBuilding(*rows, damping="rayleigh", damping_ratio=0.05, **law)


@pytest.fixture(scope="module")
def motions():
    time, random = np.arange(0, 3, 0.01), np.random.default_rng(0)
    shape = np.sin(2 * np.pi * time / 0.45) * np.exp(-0.3 * time)
    return [wd.GroundMotion(a * shape + 0.3 * random.normal(size=time.size), 0.01, f"{a}") for a in (2.0, 6.0)]


def scene_of(structure, motions, quantity="pseudo_acceleration", **more):
    spectra = wd.FloorSpectra(T, 0.05, quantity)
    given = dict(recorders=("floor_spectra",), floor_spectra=spectra, tail=0.3) | more
    return wd.Scene(structure, wd.Cloud(motions), **given)


def compare_with_oscillators(scene, method, *, absolute=False, start=0.0):
    """Compare all spectra with separate oscillators under the recorded floor histories; return the run."""
    run = wd.simulate(scene, device="cpu", dtype="float64", method=method, step=STEP, histories=wd.Histories([0, 1]))
    name = next(str(each) for each in run if str(each).endswith("spectral_acceleration"))
    for sample in range(2):
        history = run["acceleration"].values[sample]
        known = np.isfinite(history[:, 0])
        if "time_of_collapse" in run:
            known &= ~(run["time"].values > run["time_of_collapse"].values[sample])
        for floor, row in enumerate(history[known].T):
            first = round(start / STEP)
            expected = [oscillator_peak(row, STEP, each, absolute=absolute, start=first) for each in T]
            # The bound is that of the points within a step and of the cubic interpolation in warpdyn.
            np.testing.assert_allclose(run[name].values[sample, floor], expected, rtol=1e-6)
    return run


@pytest.mark.parametrize(
    "quantity", ["pseudo_acceleration", pytest.param("absolute_acceleration", marks=pytest.mark.thorough)]
)
def test_separate_oscillators_of_a_yielding_building_that_collapses(motions, quantity):
    building = three_storeys(law="bilinear", yield_force=8e5, hardening_ratio=0.03)
    scene = scene_of(building, motions, quantity, collapse_drift_ratio=0.006)
    # The kernel of kutta3 keeps the slopes of its stages; that of rk4, in the test above, sums them up.
    run = compare_with_oscillators(scene, "kutta3", absolute=quantity == "absolute_acceleration")
    assert run["status"].values.tolist() == [0, 1]


def test_separate_oscillators_with_the_exact_method_and_from_a_later_time(motions):
    compare_with_oscillators(scene_of(three_storeys(), motions, record_from=1.0), "exact", start=1.0)


@pytest.mark.thorough
def test_separate_oscillators_of_a_lumped_structure(motions):
    run = compare_with_oscillators(scene_of(wd.lumped_chain(three_storeys()), motions), "rk4")
    assert run["peak_spectral_acceleration"].dims == ("sample", "dof", "period")


def test_statistics_and_the_description_of_a_scene(motions):
    building = three_storeys(law="bilinear", yield_force=8e5, hardening_ratio=0.03)
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    scene = scene_of(building, motions[:1], scatter=scatter, collapse_drift_ratio=0.006)  # the kernel of a test above
    again = wd.Scene.from_json(scene.to_json(), motions)
    assert (again.recorders, again.floor_spectra) == (scene.recorders, scene.floor_spectra)
    name, how = "peak_floor_spectral_acceleration", dict(structures=4, device="cpu", method="kutta3", dtype="float64")
    whole = wd.simulate(scene, **how)[name]
    assert whole.attrs["damping_ratio"] == 0.05
    assert whole["period"].values.tolist() == list(T)
    moments = wd.simulate(scene, **how, statistics=wd.DemandMoments(name, each_place=True))
    np.testing.assert_allclose(moments[f"floor_{name}_mean"], whole.mean("sample"), rtol=1e-12)
    np.testing.assert_allclose(moments[f"floor_{name}_variance"], whole.var("sample", ddof=1), rtol=1e-9)
    with pytest.raises(ValueError, match="several periods"):
        wd.simulate(scene, **how, statistics=wd.DemandHistogram(name, edges=[1.0, 2.0]))


def test_text_of_kernels_without_the_recorder_has_no_oscillators(motions):
    for structure, method in ((three_storeys(), "exact"), (three_storeys(), "rk4")):
        scene = wd.Scene(structure, wd.Cloud(motions))
        assert "floor_spectra" not in scene.recorders
        assert "oscillat" not in wd.kernels.source(scene, method=method, device="cpu")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (dict(periods=[]), "increasing periods above 0 s"),
        (dict(periods=[0.2, 0.1]), "increasing periods above 0 s"),
        (dict(periods=[0.0, 0.1]), "recorder 'acceleration'"),
        (dict(periods=[0.1], damping_ratio=1.0), "up to but not including 1"),
        (dict(periods=[0.1], damping_ratio=-0.1), "at least 0"),
        (dict(periods=[0.1], quantity="acceleration"), "unknown FloorSpectra.quantity"),
    ],
)
def test_settings_that_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        wd.FloorSpectra(**given)


def test_implausible_settings_warn():
    with pytest.warns(UserWarning, match="not in ms or Hz"):
        wd.FloorSpectra([100.0, 500.0])
    with pytest.warns(UserWarning, match="5 % is 0.05"):
        wd.FloorSpectra([0.1], damping_ratio=0.7)


def test_scenes_and_steps_that_are_refused(motions):
    building = three_storeys()
    spectra = wd.FloorSpectra([0.02, 0.1])
    with pytest.raises(ValueError, match=r"give floor_spectra=wd\.FloorSpectra"):
        wd.Scene(building, wd.Cloud(motions), recorders=("floor_spectra",))
    with pytest.raises(ValueError, match="add 'floor_spectra' to recorders="):
        wd.Scene(building, wd.Cloud(motions), recorders=("drift",), floor_spectra=spectra)
    with pytest.raises(TypeError, match="must be FloorSpectra"):
        wd.Scene(building, wd.Cloud(motions), floor_spectra=[0.1, 0.2])
    with pytest.raises(ValueError, match="give fewer periods"):
        wd.Scene(building, wd.Cloud(motions), floor_spectra=wd.FloorSpectra(np.linspace(0.1, 3.0, 2000)))
    with pytest.raises(ValueError, match="Portfolio"):
        wd.Scene(wd.Portfolio({"a": wd.Archetype(building, 2)}), wd.Cloud(motions), floor_spectra=spectra)
    scene = wd.Scene(building, wd.Cloud(motions), floor_spectra=spectra)
    with pytest.raises(ValueError, match=r"cannot resolve it: give step=0\.001"):
        wd.simulate(scene, device="cpu", method="rk4", step=0.005)
    with pytest.raises(ValueError, match="equal steps"):
        wd.simulate(scene, device="cpu", method="dormand_prince54")
    with pytest.warns(UserWarning, match=r"up to 3.2 % too small: give step=0.001"):
        spectra.check_step(0.002)


def test_answers_that_need_one_period_or_other_recorders(motions):
    stripes = wd.Stripes(motions, [0.2, 0.4], wd.PeakGroundAcceleration())
    asked = dict(recorders=("drift", "floor_spectra"), floor_spectra=wd.FloorSpectra(T))
    scene = wd.Scene(three_storeys(), stripes, {"mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}, **asked)
    found = wd.capacities(scene, {"a": 0.002}, structures=2, device="cpu", method="rk4")
    assert np.isfinite(found["capacity"]).all()
    with pytest.raises(ValueError, match="unknown demand"):
        wd.capacities(scene, {"a": 5.0}, structures=2, demand="peak_floor_spectral_acceleration", device="cpu")
