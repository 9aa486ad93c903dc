"""Wind: spectra and coherence, random forces, response of a building, and stripes of wind speeds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate
from scipy.special import beta

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

FLOORS = 4.0 * np.arange(1, 11)  # m
SPEED = 28.0 * (FLOORS / 10) ** 0.22  # m/s
WIND = wd.WindForces(FLOORS, SPEED, 100.0, 1.3, wd.KaimalSpectrum(1.8))
# Root mean square displacement of each floor [m] and acceleration [m/s2] up to 12 Hz of the building below, computed by
# a separate program (integral of the spectral density of the response over the frequency).
DISPLACEMENT = np.array(
    [0.0019986, 0.00404231, 0.00609212, 0.00810975, 0.0100541, 0.0118782, 0.0135257, 0.0149258, 0.015988, 0.0165942]
)


def building():
    stiffness = np.linspace(1.6e8, 0.8e8, 10)
    damping = {"damping": "rayleigh", "damping_ratio": 0.015, "damping_modes": (1, 2)}
    return wd.ShearBuilding(3.0e5, stiffness, 4.0, **damping)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("spectrum", "expected", "variance"),
    [
        # Values of a separate program for 0.01, 0.1 and 1 Hz, 50 m and 30 m/s.
        (wd.KaimalSpectrum(1.5), [273.102, 18.1273, 0.462448], 6 * 1.5**2),
        # The integral of 4 / (1 + 70.8 x^2)^(5/6) over x is 2 B(1/2, 1/3) / 70.8^(1/2) = 0.99986.
        (wd.VonKarmanSpectrum(3.5, 120.0), [179.233, 24.1646, 0.558225], 3.5**2 * 2 * beta(1 / 2, 1 / 3) / 70.8**0.5),
        (wd.DavenportSpectrum(25.0, 0.005), [218.439, 41.5094, 0.94587], 6 * 0.005 * 25.0**2),
    ],
)
def test_spectra_have_the_values_and_the_variance_of_their_sources(spectrum, expected, variance):
    found = spectrum.spectral_density([0.01, 0.1, 1.0], 50.0, 30.0)
    np.testing.assert_allclose(found, expected, rtol=5e-6)  # the expected values have six digits

    def density(x):
        return np.exp(x) * float(spectrum.spectral_density(np.exp(x), 50.0, 30.0))

    # Over x = ln f, because the spectra are smooth in it. The part above exp(25) Hz is exp(-25 * 2 / 3) = 6e-8 of that
    # above 1 Hz, the part below exp(-30) Hz is smaller; the integral is computed to 1.5e-8.
    total = integrate.quad(density, -30, 25, limit=500, epsrel=1.5e-8)[0]
    assert total == pytest.approx(variance, rel=1e-7)
    # Both sides are the same function of f / U, so only the rounding of some ten operations differs.
    np.testing.assert_allclose(
        spectrum.scaled(2.0).spectral_density(0.2, 50.0, 60.0),
        2 * spectrum.spectral_density(0.1, 50.0, 30.0),
        rtol=1e-14,
    )


@pytest.mark.fast
def test_histories_have_the_spectrum_and_the_coherence():
    wind = wd.WindForces([10.0, 30.0], [25.0, 32.0], 80.0, 1.2, wd.KaimalSpectrum(1.7), decay_coefficient=8.0)
    step, samples, number = 0.25, 1024, 400
    histories = wind.force_histories(number, step * (samples - 1), step, seed=3, rise=0.0)
    of_speed = 1.25 * 1.2 * 80.0 * np.array([25.0, 32.0])
    turbulence = (np.array([each.values for each in histories]) - wind.mean_force) / of_speed
    waves = np.fft.rfft(turbulence, axis=1)[:, [4, 40, 200]] * np.sqrt(2 * step / samples)
    density = np.einsum("hki,hkj->kij", waves, waves.conj()).real / number
    frequency = np.array([4, 40, 200]) / (step * samples)
    x = frequency[:, None] * [10.0, 30.0] / [25.0, 32.0]
    root = np.sqrt(1.7**2 * 200 * x / (1 + 50 * x) ** (5 / 3) / frequency[:, None])
    coherence = np.exp(-8.0 * frequency * 20.0 / 28.5)
    # The mean of 400 squared amplitudes has a standard error of 5 %; 3 frequencies, 2 floors and their product. The
    # tolerance is four standard errors.
    size = density / (root[:, :, None] * root[:, None, :])
    np.testing.assert_allclose(size[:, [0, 1], [0, 1]], 1.0, atol=0.2)
    np.testing.assert_allclose(size[:, 0, 1], coherence, atol=0.2)
    # The exponents are up to 5, so that the rounding of some operations is multiplied by 5.
    np.testing.assert_allclose(wind.coherence(frequency)[:, 0, 1], coherence, rtol=1e-14)
    (again,) = wind.force_histories(1, step * (samples - 1), step, seed=3, first=7, rise=0.0)
    np.testing.assert_array_equal(again.values, histories[7].values)


def test_a_building_responds_to_wind_as_the_integral_over_the_frequency_predicts():
    duration, step = 600.0, 0.1
    stripes = WIND.stripes([28.0], 28.0, histories=24, duration=duration, step=step, seed=1, rise=0.0)
    np.testing.assert_allclose(WIND.mean_force[[0, 9]], [42564.3, 117232.0], rtol=5e-6)  # six digits
    scene = wd.Scene(building(), stripes, recorders=("drift",))
    run = wd.simulate(scene, histories=wd.Histories(range(24)), integration=wd.Integration(method="exact"))
    displacement = run["displacement"].sel(time=slice(60.0, 600.0)).transpose("history", "time", "dof").values
    mean = np.linalg.solve(stiffness_matrix(), WIND.mean_force)
    # The mean of each history over all 600 s is exact. Without its first 60 s, the mean of 24 histories has a standard
    # error of 0.22 %: 2 s / (9 U 24^(1/2)) with the standard deviation s of the mean speed U over 60 s. Four of them:
    np.testing.assert_allclose(displacement.mean(axis=(0, 1)), mean, rtol=0.009)
    found = np.sqrt(((displacement - mean) ** 2).mean(axis=(0, 1)))
    # The standard error of the root mean square of 24 histories of 540 s is 2 %: most of its square is of harmonics
    # below 0.05 Hz (27 each). The variance below 1 / 1200 Hz, 2 %, is missing, which is 1 % of the root. The tolerance
    # is the sum of this and two standard errors; the seed is fixed.
    np.testing.assert_allclose(found / DISPLACEMENT, 1.0, atol=0.05)


def stiffness_matrix():
    k = np.append(np.linspace(1.6e8, 0.8e8, 10), 0.0)
    return np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)


@pytest.mark.fast
def test_fragility_is_a_function_of_the_wind_speed():
    wind = wd.WindForces([4.0, 8.0], [22.0, 26.0], 60.0, 1.3, wd.KaimalSpectrum(1.8))
    tower = wd.ShearBuilding([2e4, 2e4], 2e6, 4.0, damping="rayleigh", damping_ratio=0.02)
    levels = [15.0, 20.0, 26.0, 34.0]
    stripes = wind.stripes(levels, 26.0, histories=4, duration=60.0, step=0.1, seed=2, structures_per_history=2)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    run = wd.simulate(wd.Scene(tower, stripes, scatter, recorders=("drift",)), seed=1)
    assert run.sizes["sample"] == 32
    # The first structures are under the first history of each level, and so on.
    assert run["motion_index"].values.reshape(8, 4)[[0, 1, 2]].tolist() == [[0, 4, 8, 12]] * 2 + [[1, 5, 9, 13]]
    assert run["im_level"].attrs["units"] == "m s-1"
    with pytest.warns(UserWarning, match="add levels between 15 and 20 m s-1 or between 20 and 26 m s-1"):
        curves = wd.fragility(run, {"serviceable": 0.013})
    assert curves["exceeding_samples"].values.tolist() == [[0, 2, 8, 8]]
    assert 20 < float(curves["fragility_median"][0]) < 26
    assert curves.attrs["intensity_measure"] == "mean wind speed"
    assert "in 4 sets, each at its own level" in curves.attrs["interval_method"]
    # Crossed: the same histories, one after the other; a demand is that of a run with one ForceHistory.
    crossed = wd.ForceStripes(stripes.histories, levels)
    whole = wd.simulate(wd.Scene(tower, crossed, recorders=("drift",)))
    alone = wd.simulate(wd.Scene(tower, stripes.histories[2][1], recorders=("drift",)))
    place = int(np.flatnonzero(whole["motion_index"] == 9)[0])
    # Both runs have the same kernel, in which the bits of a sample do not depend on its place among the samples.
    assert whole.attrs["kernel"] == alone.attrs["kernel"]
    np.testing.assert_array_equal(whole["peak_storey_drift"][place], alone["peak_storey_drift"][0])
    assert float(whole["im_level"][place]) == 26.0


@pytest.mark.fast
def test_each_structure_has_its_own_frequency_of_a_harmonic_force():
    frequencies, amplitude = np.array([4.0, 7.0, 11.0]), np.array([1e3, 2e3])  # rad/s, N
    histories = [wd.HarmonicForce(amplitude, each, 60.0).history(0.01) for each in frequencies]
    tower = wd.ShearBuilding([2e4, 2e4], 2e6, 4.0, damping="rayleigh", damping_ratio=0.05)
    design = wd.ForceStripes([histories], [1.0], "factor of the force", "1", structures_per_history=1)
    run = wd.simulate(
        wd.Scene(tower, design, recorders=("drift",), record_from=50.0, tail=0.0),
        integration=wd.Integration(dtype="float64"),
    )
    mass, stiffness = 2e4 * np.eye(2), 2e6 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    first, second = np.sqrt(1e2 * (3 - np.array([1, -1]) * np.sqrt(5)) / 2)
    damping = 2 * 0.05 * first * second / (first + second) * mass + 2 * 0.05 / (first + second) * stiffness
    for sample, w in enumerate(frequencies):
        u = np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, amplitude)
        # The peak at steps is lower by up to (w step)^2 / 8, the force between its samples by (w step)^2 / 12: 0.25 %.
        np.testing.assert_allclose(run["peak_storey_drift"][sample], np.abs([u[0], u[1] - u[0]]), rtol=2.6e-3)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: wd.KaimalSpectrum(-1.0), "friction_velocity .m/s. must be a finite number above 0"),
        (lambda: wd.WindForces([4.0, 8.0], [22.0], 60.0, 1.3, wd.KaimalSpectrum(1.8)), "one mean wind speed per floor"),
        (lambda: wd.WindForces([4.0], [22.0], 60.0, 1.3, "kaimal"), "must be a KaimalSpectrum, DavenportSpectrum or"),
        (lambda: wd.HarmonicForce([1.0], 20.0, 10.0).history(0.1), "step=0.1 s is too long.*at most 0.0157 s"),
        (lambda: WIND.force_history(60.0, 60.0), "duration over step is 1; it must be from 16"),
        (lambda: WIND.force_history(60.0, 0.1, rise=60.0), "rise=60 s must be shorter than duration=60 s"),
        (lambda: WIND.spectral_matrix([0.0]), "frequency .Hz. must be above 0"),
        (lambda: WIND.spectral_matrix([[1.0, 2.0]]), "frequency must be a row of values .Hz., got shape .1, 2."),
        (lambda: WIND.coherence([[1.0, 2.0]]), "frequency must be a row of values of at least 0 Hz"),
        (lambda: wd.KaimalSpectrum(1.8).spectral_density([1.0, 2.0], [1.0, 2.0, 3.0], 30.0), "cannot be broadcast"),
        (lambda: wd.KaimalSpectrum(1.8).scaled("2"), "factor must be a finite number above 0"),
        (lambda: wd.KaimalSpectrum(1e200), "friction_velocity must be at most 1e.09"),
        (lambda: WIND.stripes([[20.0, 30.0]], 28.0, 1, 60.0, 0.5), "levels must be a row of finite values above 0"),
        (lambda: WIND.stripes([20.0, 30.0], 28.0, 2**20, 6e4, 0.1), "2097152 force histories needs .* fewer levels="),
        (lambda: wd.ForceStripes([], []), "levels must be a row of finite values above 0"),
        (lambda: wd.ForceStripes(None, [1.0]), "one list of ForceHistory per level"),
        (lambda: wd.ForceStripes([WIND.force_history(60.0, 0.5)], [10.0]), "one list of ForceHistory per level"),
        (lambda: wd.ForceStripes({10.0: [WIND.force_history(60.0, 0.5)]}, [10.0]), "one list of ForceHistory per"),
        (lambda: wd.ForceStripes([[WIND.force_history(60.0, 0.5)]], [10.0], 3), "quantity must be text, got 3"),
        (lambda: wd.ForceStripes([[WIND.force_history(60.0, 0.5)]], [10.0], units=""), "units is empty"),
        (
            lambda: WIND.stripes([30.0, 20.0], 28.0, 1, 60.0, 0.5),
            "levels must increase, got .30.0, 20.0.: sort levels=",
        ),
        (lambda: WIND.stripes([-5.0, 20.0], 28.0, 1, 60.0, 0.5), "levels must be a row of finite values above 0 m s-1"),
        # 20 levels of 2^20 histories with 601 samples of 10 floors: 1e12 bytes
        (lambda: WIND.stripes(range(1, 21), 28.0, 2**20, 60.0, 0.1), "give fewer levels= or histories="),
        (lambda: WIND.force_history(1e6, 1e-3), "duration over step is 1,000,000,000"),
        (
            lambda: wd.WindForces([-4.0], [22.0], 60.0, 1.3, wd.KaimalSpectrum(1.8)),
            "height must be a row of values abo",
        ),
        (lambda: wd.ForceStripes([[WIND.force_history(60.0, 0.5)]], [10.0, 20.0]), "1 lists of histories and 2 levels"),
        (
            lambda: wd.Scene(
                wd.ShearBuilding(1e5, 1e8, 3.0), wd.ForceStripes([[WIND.force_history(60.0, 0.5)]], [10.0])
            ),
            "has 10 columns, but the structure has 1 degree of freedom",
        ),
    ],
)
def test_refused(call, message):
    with pytest.raises((TypeError, ValueError), match=message):
        call()


def wind(**changed):
    given = {"height": [4.0, 8.0, 12.0], "mean_speed": [22.0, 26.0, 29.0], "area": 100.0, "drag_coefficient": 1.3}
    return wd.WindForces(**given | {"spectrum": wd.KaimalSpectrum(1.8)} | changed)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: wind(mean_speed=[80.0, 94.0, 104.0]), "speed at floor 3 is 104 m/s .*given in km/h, it would be 28.9"),
        (lambda: wind(height=[4e3, 8e3, 12e3]), "height of the floor above the ground at floor 3.*given in mm"),
        (lambda: wind(height=[12.0, 8.0, 4.0]), "floors may be listed from the top down"),
        (
            lambda: wind(height=[22.0, 26.0, 29.0], mean_speed=[4.0, 8.0, 12.0]),
            "height and mean_speed may be exchanged",
        ),
        (lambda: wind(mean_speed=[29.0, 26.0, 22.0]), "mean_speed may be listed from the top down"),
        (lambda: wind(area=100e6), "area of the face of the floor.*given in mm2, it would be 100 m2"),
        (lambda: wind(area=1.3, drag_coefficient=100.0), "area and drag_coefficient may be exchanged"),
        (lambda: wind(drag_coefficient=130.0), "given in percent, it would be 1.3"),
        (lambda: wind(decay_coefficient=1e4), "decay coefficient of the coherence is 10000"),
        (lambda: wind(air_density=12.25), "N/m3 of weight, it would be 1.25 kg/m3"),
        (lambda: wind(spectrum=wd.KaimalSpectrum(28.0)), "parameters of the spectrum may be in another unit"),
        (lambda: wind(spectrum=wd.VonKarmanSpectrum(0.18, 120.0)), "friction_velocity instead of standard_deviation"),
        (lambda: wind(spectrum=wd.DavenportSpectrum(28.0, 1.3)), "standard deviation of the turbulence over the mean"),
        (lambda: wind(spectrum=wd.VonKarmanSpectrum(3.5, 0.12)), "given in km, it would be 120 m"),
        (
            lambda: wind().force_history(600.0, 10.0),
            "sampling step of the wind forces is 10 s.*in ms, it would be 0.01",
        ),
        (lambda: wind().force_history(3.0, 0.1), "given in minutes, it would be 180 s"),
        (lambda: wind().stripes([20.0, 30.0], 100.8, 1, 60.0, 0.5), "reference_speed given in km/h, it would be 0.966"),
        (
            lambda: wind().stripes([72.0, 108.0], 28.0, 1, 60.0, 0.5),
            "of levels is 108 m/s.*in km/h, it would be 30 m/s",
        ),
    ],
)
def test_an_implausible_wind_gets_one_warning(call, message):
    with pytest.warns(UserWarning, match=message) as record:
        call()
    assert len(record) == 1


@pytest.mark.fast
def test_stripes_with_a_step_that_is_too_long_for_the_first_period_get_a_warning():
    tower = wd.ShearBuilding([2e4] * 3, 2e7, 4.0, damping="rayleigh", damping_ratio=0.02)  # T = 0.45 s
    warn_of_implausible(wd.Scene(tower, wind().stripes([20.0, 30.0], 28.0, 1, 60.0, 0.1)))
    scene = wd.Scene(tower, wind().stripes([20.0, 30.0], 28.0, 1, 60.0, 0.5))
    with pytest.warns(
        UserWarning, match="step of the force histories over the first period of 0.446 s is 1.1.*shorter"
    ):
        warn_of_implausible(scene)


@pytest.mark.fast
def test_a_phase_in_degrees_gets_a_warning():
    wd.HarmonicForce([1.0], 20.0, 10.0, phase=-2 * np.pi)
    with pytest.warns(UserWarning, match="phase of the HarmonicForce is 90 rad .*in degrees, it would be 1.57 rad"):
        wd.HarmonicForce([1.0], 20.0, 10.0, phase=90.0)


@pytest.mark.fast
def test_histories_do_not_depend_on_the_signs_of_eigenvectors(monkeypatch):
    expected, eigh = wind().force_history(20.0, 0.5).values, np.linalg.eigh

    def turned(matrix):
        values, vectors = eigh(matrix)
        return values, vectors * np.array([-1.0, 1.0, -1.0])

    monkeypatch.setattr(np.linalg, "eigh", turned)
    # A force is a sum of 20 harmonics of 3 floors, which rounds by 60^(1/2) * 2e-16 = 2e-15 of the terms. It may be 500
    # times as small as they are.
    np.testing.assert_allclose(wind().force_history(20.0, 0.5).values, expected, rtol=1e-12)


@pytest.mark.fast
def test_a_usual_wind_gets_no_warning(recwarn):
    wind().stripes([15.0, 30.0, 60.0], 28.0, 1, 60.0, 0.5)
    wind(spectrum=wd.VonKarmanSpectrum(4.0, 120.0))
    wind(spectrum=wd.DavenportSpectrum(25.0, 0.005)).force_history(60.0, 0.1, rise=1e-320)
    assert not recwarn.list
