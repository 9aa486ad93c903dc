"""State-dependent fragility and damage in time agree with an independent reference, closed forms and a simulation.

The reference (counts of exceedances of 40,000 sequences, and curves) was computed by another program, for the same
oscillator and the same 4,000 motions; each run here pairs them at random, so that fractions differ by sampling errors.
"""

import functools
import sys
import warnings

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT
from scipy.stats import norm

import warpdyn as wd

sys.path.insert(0, str(ROOT / "studies"))
from parts.analyses.states import motions as noise_motions

G, PERIOD, HEIGHT, STRUCTURES = 9.80665, 0.5, 3.0, 2000
OMEGA = 2 * np.pi / PERIOD
YIELD = 0.2 * G / OMEGA**2  # yield displacement [m]
LEVELS = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.3, 1.7]  # g
PGA = wd.PeakGroundAcceleration()
# Reference: (state before, state reached): sequences, exceedances at the levels, median [g], dispersion.
P_DELTA = {
    (0, 1): (2708, [276, 2315, 2695, 2708, 2708, 2708, 2708, 2708, 2708, 2708], 0.145609, 0.292788),
    (0, 2): (2708, [0, 434, 1706, 2453, 2650, 2700, 2706, 2708, 2708, 2708], 0.270558, 0.300563),
    (0, 4): (2708, [0, 0, 95, 855, 1665, 2162, 2555, 2660, 2695, 2707], 0.473646, 0.311434),
    (1, 2): (8069, [391, 3823, 6331, 7489, 7933, 8048, 8068, 8069, 8069, 8069], 0.207694, 0.432222),
    (1, 3): (8069, [0, 524, 3365, 5719, 6924, 7480, 7938, 8032, 8066, 8069], 0.334011, 0.381991),
    (2, 4): (5604, [0, 488, 3315, 4700, 5146, 5336, 5496, 5560, 5598, 5603], 0.295698, 0.389342),
    (3, 4): (3874, [679, 3103, 3814, 3852, 3855, 3865, 3871, 3874, 3874, 3874], 0.143193, 0.400156),
}
BILINEAR = {
    (0, 1): (3616, [107, 2692, 3580, 3616, 3616, 3616, 3616, 3616, 3616, 3616], 0.166687, 0.264654),
    (0, 2): (3616, [0, 6, 468, 2079, 3190, 3538, 3616, 3616, 3616, 3616], 0.384255, 0.219928),
    (0, 3): (3616, [0, 0, 0, 5, 146, 533, 2160, 3228, 3581, 3612], 0.756845, 0.229017),
    (1, 2): (12657, [0, 59, 2012, 7516, 11216, 12417, 12657, 12657, 12657, 12657], 0.377444, 0.230438),
}
SHARES = {"p_delta": [0.0677, 0.201725, 0.1401, 0.09685], "bilinear": [0.0904, 0.316425, 0.298275]}


def motions() -> list[wd.GroundMotion]:
    found = noise_motions()
    assert sum(((motion.acceleration / G) ** 2).sum() for motion in found) == pytest.approx(270556.278, abs=1e-3)
    return found


def oscillator(hardening: float, p_delta: float) -> wd.ShearBuilding:
    mass = 1e5
    load = {"gravity_load": [p_delta * mass * OMEGA**2 * HEIGHT]} if p_delta else {}
    return wd.ShearBuilding(
        [mass],
        [mass * OMEGA**2],
        HEIGHT,
        law="bilinear",
        yield_force=[0.2 * G * mass],
        hardening_ratio=hardening,
        damping="storey",
        damping_coefficient=[2 * 0.05 * OMEGA * mass],
        **load,
    )


@functools.cache
def sequences(hardening: float, p_delta: float, structures: int = STRUCTURES, crossed: int = 0) -> xr.Dataset:
    """Return a run of a mainshock and stripes of 1,000 motions, or of `crossed` motions for all structures."""
    each, generator = motions(), np.random.default_rng(5)
    first = wd.OneMotionPerStructure(
        each[:2000],
        motion=generator.integers(0, 2000, structures),
        scale=np.exp(generator.uniform(np.log(0.15), np.log(1.5), structures)),
        measure=PGA,
    )
    second = wd.Stripes(each[2000:3000], LEVELS, PGA, structures_per_motion=2)
    if crossed:
        second = wd.Stripes(each[2000 : 2000 + crossed], LEVELS, PGA)
    events = wd.EventSequence({"main": first, "after": second})
    scene = wd.Scene(oscillator(hardening, p_delta), events, recorders=("drift",), tail=10.0)
    return wd.simulate(scene, structures=structures, seed=1, step=0.005, method="rk4")


def limits_of(*ductilities: float) -> dict[str, float]:
    return {f"DS{place}": each * YIELD / HEIGHT for place, each in enumerate(ductilities, 1)}


CASES = {
    "p_delta": (0.03, 0.08, limits_of(1.5, 3.0, 6.0, 12.0), P_DELTA),
    "bilinear": (0.05, 0.0, limits_of(1.5, 3.0, 6.0), BILINEAR),
}


def standard_errors(fractions: list, median: float, dispersion: float) -> np.ndarray:
    """Return the standard errors of ln(median) and ln(dispersion), times the root of the number of samples.

    The sandwich variance of a probit fit to fractions: each sample is run at all levels and exceeds the state from one
    level on, so that the covariance of exceedances at two levels is that of one threshold.
    """
    z = np.log(np.array(LEVELS) / median) / dispersion
    weight = norm.pdf(z) / (norm.cdf(z) * norm.sf(z))
    design = np.stack([-np.full_like(z, 1 / dispersion), -z])  # derivative of z by ln(median) and ln(dispersion)
    exact = np.array(fractions)
    covariance = np.minimum.outer(exact, exact) * (1 - np.maximum.outer(exact, exact))
    bread = np.linalg.inv((design * norm.pdf(z) * weight) @ design.T)
    return np.sqrt(np.diag(bread @ (design * weight) @ covariance @ (design * weight).T @ bread))


RUNS = (
    pytest.mark.as_shipped,  # slower kernels take 20 s more for 40,000 histories than is saved in compiling them
    pytest.mark.filterwarnings("ignore:.*unreliable"),
    pytest.mark.filterwarnings("ignore:state_dependent_fragility"),  # some curves have separated stripes
)


def of_runs(test):
    """Mark a test that uses the runs of `sequences`."""
    for mark in RUNS:
        test = mark(test)
    return test


@of_runs
@pytest.mark.parametrize("case", CASES)
def test_counts_and_curves_are_those_of_the_reference(case):
    hardening, p_delta, limits, reference = CASES[case]
    run = sequences(hardening, p_delta)
    found = wd.state_dependent_fragility(run, limits)
    shares = found["samples"].values / (STRUCTURES * len(LEVELS))
    error = np.sqrt(np.array(SHARES[case]) / STRUCTURES)
    assert (np.abs(shares - SHARES[case]) < 4 * error).all()
    for (before, reached), (number, counts, median, dispersion) in reference.items():
        curve = found.isel(from_state=before, damage_state=reached - 1)
        exact = np.array(counts) / number
        own = int(found["samples"][before]) / len(LEVELS)
        # Both counts are samples, and two structures share a motion here.
        slack = 4 * 1.2 * np.sqrt(exact * (1 - exact) * (1 / own + 1 / number)) + 2 / own
        assert (np.abs(curve["exceedance_fraction"].values - exact) < slack).all(), (before, reached)
        each = standard_errors(exact, median, dispersion)
        error = each * np.sqrt(1 / own + 1 / number)  # 3 standard errors: a probability of 0.3 % per value
        assert abs(np.log(float(curve["fragility_median"]) / median)) < 3 * error[0], (before, reached)
        assert abs(np.log(float(curve["fragility_dispersion"]) / dispersion)) < 3 * error[1], (before, reached)
        # A standard error of a jackknife over n structures has the relative standard error (2 n)^-0.5.
        width = np.log(float(curve["fragility_median_upper"] / curve["fragility_median_lower"])) / (2 * 1.96)
        assert width == pytest.approx(each[0] / np.sqrt(own), rel=4 / np.sqrt(2 * own)), (before, reached)
    heaviest = found["fragility_median"].sel(damage_state=list(limits)[-1]).values
    if case == "p_delta":
        assert heaviest[-1] < 0.4 * heaviest[0]
    else:
        assert heaviest[1] == pytest.approx(heaviest[0], rel=0.05)  # the standard error of their ratio is 2 %
    # Counts of the samples themselves, by NumPy.
    drift = run["peak_storey_drift_ratio"].values[..., 0]
    status, level = run["status"].values, run["im_level"].values[:, 1]
    damage = (drift[..., None] > np.array(list(limits.values()), np.float32)).sum(axis=-1)
    damage = np.where(status == 1, len(limits), damage)
    for before in range(len(limits)):
        begins = (damage[:, 0] == before) & np.isclose(level, 0.5)
        ends = damage[begins].max(axis=1)
        expected = [(ends == state).mean() for state in range(len(limits) + 1)]
        share = found["transition_probability"].isel(from_state=before).sel(stripe=0.5).values
        np.testing.assert_allclose(share, expected, atol=1e-12)


@of_runs
def test_draws_of_different_states_are_correlated_like_estimates_from_other_motions():
    """With 10 motions that are common to all states, the curves of all states rise or fall together."""
    run, sets = sequences(0.05, 0.0, structures=60, crossed=100), 10
    motion = run["motion_index"].values[:, 1]
    medians, of_draws = [], []
    for chosen in np.array_split(np.unique(motion), sets):
        found = wd.state_dependent_fragility(run.isel(sample=np.isin(motion, chosen)), limits_of(1.5, 3.0, 6.0))
        found = found[["fragility_median", "replicate_median"]].sel(damage_state="DS3", from_state=["DS1", "DS2"])
        found = np.log(found)
        medians.append(found["fragility_median"].values)
        of_draws.append(np.corrcoef(found["replicate_median"].transpose("from_state", "replicate").values)[0, 1])
    exact = np.corrcoef(np.array(medians).T)[0, 1]
    assert exact > 0.9
    # The standard error of arctanh(correlation) of n pairs is (n - 3)^-0.5.
    assert np.arctanh(np.mean(of_draws)) == pytest.approx(np.arctanh(exact), abs=3 / np.sqrt(sets - 3)), of_draws


@of_runs
def test_samples_that_failed_in_an_earlier_event_begin_in_no_state():
    run = sequences(0.05, 0.0).copy(deep=True)
    limits = limits_of(1.5, 3.0, 6.0)
    whole = wd.state_dependent_fragility(run, limits)["samples"].values
    failed = np.arange(0, 20_000, 200)  # 0.5 %
    drift = run["peak_storey_drift_ratio"].values[failed, 0, 0]
    lost = np.histogram(drift, [0, *limits.values()])[0]
    run["status"].values[failed] = 2  # diverged
    np.testing.assert_array_equal(wd.state_dependent_fragility(run, limits)["samples"], whole - lost)
    run["status"].values[::50] = 2
    with pytest.raises(ValueError, match=r"at most 1 % may"):
        wd.state_dependent_fragility(run, limits)


@of_runs
def test_warnings_name_the_true_reason_once_and_the_undamaged_state_has_no_limit():
    run = sequences(0.05, 0.0)
    with pytest.raises(ValueError, match="'none' is the name of the undamaged state"):
        wd.state_dependent_fragility(run, {"none": 0.006, "complete": 0.02})
    with pytest.warns(UserWarning, match="implausible input") as caught:
        wd.state_dependent_fragility(run, {"slight": 0.5, "complete": 2.0})  # percent
    texts = [str(each.message) for each in caught]
    assert sum(text.count("implausible input") for text in texts) == 1, texts
    # Of the samples that the mainshock did not damage, two are left, at one level.
    limits = limits_of(1.5, 3.0)
    drift = run["peak_storey_drift_ratio"].values[:, 0, 0]
    is_kept = drift > limits["DS1"]
    is_kept[np.flatnonzero(~is_kept & np.isclose(run["im_level"].values[:, 1], 0.2))[:2]] = True
    reason = r"only 2 samples begin in state 'none': no curves from this state \(all samples are on the stripe of 0.2"
    with pytest.warns(UserWarning, match=reason):
        wd.state_dependent_fragility(run.isel(sample=is_kept), limits)


def curves(medians: list, dispersions: list, states: list[str]) -> xr.Dataset:
    dims = ("from_state", "damage_state")
    values = {"fragility_median": (dims, medians, {"units": "g"}), "fragility_dispersion": (dims, dispersions)}
    return xr.Dataset(values, {"from_state": ["none", *states[:-1]], "damage_state": states})


LEVEL = np.geomspace(0.025, 20.0, 30)
HAZARD = wd.HazardCurve(LEVEL, 4e-5 * LEVEL**-2.6)  # g, 1/year: lambda(x) = k0 x^-k
NAN = np.nan


def exact_rate(median: float, dispersion: float) -> float:
    return 4e-5 * median**-2.6 * np.exp(2.6**2 * dispersion**2 / 2)


@pytest.mark.fast
def test_probabilities_of_two_damage_states_are_the_closed_form():
    found = wd.damage_in_time(curves([[0.22, 0.85], [NAN, 0.5]], [[0.45, 0.45], [NAN, 0.5]], ["a", "b"]), HAZARD)
    first, both, second = exact_rate(0.22, 0.45), exact_rate(0.85, 0.45), exact_rate(0.5, 0.5)
    years = found["years"].values
    np.testing.assert_allclose(found["transition_rate"], [[0, first - both, both], [0, 0, second]], rtol=2e-4)
    from_none = found["probability"].sel(from_state="none").values
    stays = np.exp(-first * years)
    light = (first - both) / (first - second) * (np.exp(-second * years) - stays)
    np.testing.assert_allclose(from_none, [stays, light, 1 - stays - light], rtol=1e-3)
    time = [1 / first + (first - both) / first / second, 1 / second]
    np.testing.assert_allclose(found["mean_time_to_heaviest"], time, rtol=2e-4)
    assert np.isnan(found["probability_lower"]).all()


@pytest.mark.fast
def test_probabilities_after_years_are_those_of_simulated_events():
    medians = np.array([[0.15, 0.3, 0.6], [NAN, 0.2, 0.5], [NAN, NAN, 0.25]])
    dispersions = np.where(np.isnan(medians), NAN, 0.4)
    found = wd.damage_in_time(curves(medians, dispersions, ["a", "b", "c"]), HAZARD, years=[100.0])
    generator, lives = np.random.default_rng(2), 40_000
    rate = 4e-5 * 0.04**-2.6  # of events above 0.04 g; weaker ones cause no damage
    state = np.zeros(lives, int)
    number = generator.poisson(rate * 100, lives)
    for event in range(number.max()):
        alive = number > event
        level = 0.04 * generator.random(lives) ** (-1 / 2.6)
        uniform = generator.random(lives)
        with np.errstate(invalid="ignore"):
            reached = norm.cdf(np.log(level[:, None] / medians[np.minimum(state, 2)]) / 0.4) > uniform[:, None]
        new = np.where(reached, np.arange(1, 4), 0).max(axis=1)
        state = np.where(alive & (state < 3), np.maximum(state, new), state)
    share = np.bincount(state, minlength=4) / lives
    exact = found["probability"].sel(from_state="none").values[:, 0]
    assert (np.abs(share - exact) < 4 * np.sqrt(exact * (1 - exact) / lives) + 1e-4).all(), (share, exact)


@pytest.mark.fast
def test_intervals_follow_from_the_replicates():
    given = curves([[0.22, 0.85], [NAN, 0.5]], [[0.45, 0.45], [NAN, 0.5]], ["a", "b"])
    drawn = np.exp(np.random.default_rng(3).normal(0.0, 0.1, (2, 400, 2))) * given["fragility_median"].values[:, None]
    dims = ("from_state", "replicate", "damage_state")
    given["replicate_median"] = dims, drawn
    given["replicate_dispersion"] = dims, np.broadcast_to(given["fragility_dispersion"].values[:, None], drawn.shape)
    found = wd.damage_in_time(given, HAZARD, years=[50.0], confidence=0.9)
    staying = np.exp(-50 * exact_rate(drawn[0, :, 0], 0.45))  # "a" is always more probable than "b"
    low, high = np.quantile(staying, [0.05, 0.95], method="hazen")
    own = found.sel(from_state="none", to_state="none", years=50.0)
    assert float(own["probability_lower"]) == pytest.approx(low, rel=1e-3)
    assert float(own["probability_upper"]) == pytest.approx(high, rel=1e-3)


@pytest.mark.fast
def test_runs_without_an_earlier_event_and_unordered_states_are_refused():
    motion = wd.GroundMotion(np.sin(np.arange(0, 6, 0.02)), 0.02)
    building = wd.ShearBuilding.from_hazus("W1", "high", 1)
    alone = wd.simulate(wd.Scene(building, wd.Stripes([motion], [0.1, 0.2], PGA), recorders=("drift",)))
    with pytest.raises(ValueError, match="the run has no earlier event"):
        wd.state_dependent_fragility(alone, {"slight": 0.01})
    both = wd.EventSequence({"main": wd.Cloud([motion]), "after": wd.Cloud([motion])})
    run = wd.simulate(wd.Scene(building, both, recorders=("drift",)))
    with pytest.raises(ValueError, match="event 'after' has no stripes"):
        wd.state_dependent_fragility(run, {"slight": 0.01})
    with pytest.raises(ValueError, match="name of an event of the run"):
        wd.state_dependent_fragility(run, {"slight": 0.01}, event="main")
    wrong = curves([[0.2, 0.5], [NAN, 0.4]], [[0.4, 0.4], [NAN, 0.4]], ["a", "b"])
    with pytest.raises(ValueError, match="from_state must be the undamaged state"):
        wd.damage_in_time(wrong.isel(from_state=[1, 0]), HAZARD)
    with pytest.raises(ValueError, match="no curve from state 'a' to state 'b'"):
        wd.damage_in_time(wrong.where(wrong["from_state"] == "none"), HAZARD)
    with pytest.raises(ValueError, match=r"state_dependent_fragility\(run, .*if state != 'a'\}\)"):
        wd.damage_in_time(wrong.where(wrong["from_state"] == "none"), HAZARD)
    with pytest.raises(ValueError, match=r"from state 'none' to state 'b'.*if state != 'b'\}\)"):
        wd.damage_in_time(curves([[0.2, NAN], [NAN, 0.4]], [[0.4, NAN], [NAN, 0.4]], ["a", "b"]), HAZARD)
    with pytest.raises(ValueError, match="years must be a row of years above 0"):
        wd.damage_in_time(wrong, HAZARD, years=[0.0])


@pytest.mark.fast
def test_damage_in_time_warns_if_the_hazard_is_extrapolated():
    given = curves([[0.22, 0.85], [NAN, 0.5]], [[0.45, 0.45], [NAN, 0.5]], ["a", "b"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        complete = wd.damage_in_time(given, HAZARD)
    few = HAZARD.intensity > 0.5
    short = wd.HazardCurve(HAZARD.intensity[few], HAZARD.annual_rate[few])  # the same power law
    # Share of the integral of the lognormal curve times the density of the hazard that is below its first point.
    level = np.geomspace(1e-3, 1e2, 400_001)
    part = norm.cdf(np.log(level / 0.22) / 0.45) * level**-2.6
    share = part[level < short.intensity[0]].sum() / part.sum()
    with pytest.warns(UserWarning, match="below the first point of the hazard curve") as caught:
        found = wd.damage_in_time(given, short)
    assert f"{float(f'{100 * share:.2g}'):g} % of the rate from 'none' to 'a'" in str(caught[0].message)
    np.testing.assert_allclose(found["transition_rate"], complete["transition_rate"], rtol=1e-3)
