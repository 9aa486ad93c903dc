"""Wood-frame shear walls (SAWS): OpenSees' loops, rules where OpenSees is wrong, energy, and a system under a pulse."""

import numpy as np
import pytest
from law_cases import SAMPLING, cases, material_of, path_of, run_pulse
from opensees import chain_drifts, finer, growing, material_forces, ratcheting, wandering
from storey_steps import steps
from validation import difference

import warpdyn as wd

WALLS = {  # numbers of OpenSees' SAWS
    "first": [70281.28, 2424.7, 0.02644013, 27991540.0, 0.1022018, -0.0324118, 1.0, 0.0692553, 0.8, 1.1],
    "second": [8000.0, 1200.0, 0.015, 5.0e6, 0.058, -0.05, 1.0, 0.02, 0.6, 1.1],
    "stiff unloading": [8000.0, 1200.0, 0.015, 5.0e6, 0.058, -0.05, 1.45, 0.02, 0.8, 1.2],
}


def wall(f0, fi, du, s0, r1, r2, r3, r4, alpha, beta):
    """Return the storey's stiffness and its law from the numbers of OpenSees' SAWS."""
    return s0, wd.laws.Saws(
        yield_force=f0,
        pinching_force_ratio=fi / f0,
        drift_at_peak_force=du,
        hardening_ratio=r1,
        softening_ratio=-r2,
        unloading_stiffness_ratio=r3,
        pinching_stiffness_ratio=r4,
        reloading_exponent=alpha,
        reloading_drift_ratio=beta,
    )


def storey_of(numbers):
    stiffness, law = wall(*numbers)
    return wd.ShearBuilding(1.0, stiffness, 3.0, law=law)


def forces(numbers, drift):
    return wd.storey_hysteresis(storey_of(numbers), drift)["storey_force"].values[:, 0]


def envelope(numbers, drift):
    """Return the envelope's force at drifts of at least 0 (Folz and Filiatrault 2001, by hand)."""
    f0, _fi, du, s0, r1, r2, *_ = numbers
    curve = (f0 + r1 * s0 * drift) * (1 - np.exp(-s0 * drift / f0))
    peak = (f0 + r1 * s0 * du) * (1 - np.exp(-s0 * du / f0))
    return np.where(drift <= du, curve, peak + r2 * s0 * (drift - du))


@pytest.mark.fast
@pytest.mark.parametrize("name", ["saws_1", "saws_2"])
def test_forces_are_those_of_opensees_loops(name, measured):
    case = cases("loops")[name]
    numbers, expected = material_of(case), np.array(case["force"])
    f0, s0, beta = numbers[0], numbers[3], numbers[9]
    # OpenSees differs where it passes above its envelope, or reloads more steeply than it unloads.
    drift, at = path_of(case, 100)
    size, force = np.abs(drift[at]), np.abs(expected)
    pinched = numbers[1] + numbers[7] * s0 * size
    aim = beta * np.abs([0, 0, *case["turning_points"][:-2]])[:, None]  # on the side that each segment leads to
    is_above = force > np.maximum(envelope(numbers, size), pinched) + 1e-6 * f0
    is_steep = (aim < f0 / s0) & (size < aim) & (force > pinched + 1e-6 * f0) & (expected * drift[at] > 0)
    same = ~is_above & ~is_steep
    assert (~same).sum() <= 3
    errors = [
        np.abs(forces(numbers, path)[places] - expected)[same].max() / np.abs(expected).max()
        for path, places in (path_of(case, steps) for steps in (100, 2000))
    ]
    measured(
        "forces of storeys of law `saws` along growing cycles, over the largest force, where OpenSees stays below its "
        "envelope",
        truth="OpenSees' SAWS, 20,000 steps for each segment",
        value=max(errors),
        bound=2e-5,
    )


@pytest.mark.fast
@pytest.mark.parametrize("name", WALLS)
def test_one_push_is_the_envelope_until_failure(name):
    numbers = WALLS[name]
    _f0, fi, du, s0, _r1, r2, _r3, r4, *_ = numbers
    peak = float(envelope(numbers, np.array(du)))
    failure = min(du - peak / (r2 * s0), (peak + fi - r2 * s0 * du) / (s0 * (r4 - r2)))
    drift = np.linspace(0, 1.2 * failure, 1201)
    for sign in (1, -1):
        found = sign * forces(numbers, sign * drift)
        expected = np.where(drift < failure, envelope(numbers, drift), 0.0)
        near = np.abs(drift - failure) < 1e-6 * failure
        np.testing.assert_allclose(found[~near], expected[~near], rtol=0, atol=1e-9 * peak)
    # A failed wall has no force again.
    assert np.all(forces(numbers, np.append(drift, [0.5 * du, 0.0, -0.5 * du]))[-3:] == 0)


@pytest.mark.fast
@pytest.mark.parametrize("name", WALLS)
def test_a_partial_unloading_leads_back_to_the_envelope(name):
    # OpenSees overshoots the envelope by one step here.
    numbers = WALLS[name]
    du, s0, r3 = numbers[2], numbers[3], numbers[6]
    top, back = 0.6 * du, 0.57 * du
    drift = np.concatenate(
        [np.linspace(0, top, 50), np.linspace(top, back, 10)[1:], np.linspace(back, 0.8 * du, 60)[1:]]
    )
    found = forces(numbers, drift)
    expected = np.minimum(envelope(numbers, np.array(top)) - r3 * s0 * (top - drift), envelope(numbers, drift))
    expected[:50] = envelope(numbers, drift[:50])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * numbers[0])
    theirs = material_forces("SAWS", numbers, drift)
    assert np.abs(theirs - expected).max() > 1e-3 * numbers[0]


@pytest.mark.fast
@pytest.mark.parametrize("name", WALLS)
def test_reloading_follows_the_pinched_line_through_zero_drift(name):
    # It holds as long as it lies above the envelope.
    numbers = WALLS[name]
    f0, fi, du, s0, *_, r4, _alpha, _beta = numbers
    reloading = np.linspace(-0.02 * du, 0.02 * du, 2001)
    drift = np.concatenate([[0, 0.4 * du, 0.8 * du, 0, -0.8 * du, -0.4 * du], reloading])
    line = fi + r4 * s0 * reloading
    is_above = (reloading < 0) | (line > envelope(numbers, np.abs(reloading)))
    assert is_above.sum() > 1100
    found = forces(numbers, drift)[-reloading.size :]
    np.testing.assert_allclose(found[is_above], line[is_above], rtol=0, atol=1e-9 * f0)


@pytest.mark.fast
@pytest.mark.parametrize("name", WALLS)
def test_forces_do_not_depend_on_the_step_and_are_continuous(name):
    numbers = WALLS[name]
    drift = wandering(1.3 * numbers[2], 60, 37, seed=4)
    coarse, fine = forces(numbers, drift), forces(numbers, finer(drift, 16))
    np.testing.assert_allclose(fine[15::16], coarse, rtol=0, atol=2e-3 * numbers[0])
    stiffest = numbers[3] * numbers[6]
    rises = np.diff(fine, prepend=0.0)
    assert np.all(np.abs(rises) <= stiffest * np.abs(np.diff(finer(drift, 16), prepend=0.0)) + 1e-9 * numbers[0])


@pytest.mark.fast
@pytest.mark.parametrize("name", WALLS)
@pytest.mark.parametrize(
    "path", [growing(np.linspace(0.1, 1.6, 8), 300), wandering(1.3, 40, 300, seed=2), ratcheting(1.0, 8, 0.4, 300)]
)
def test_energy_is_never_gained(name, path):
    numbers = WALLS[name]
    found = wd.storey_hysteresis(storey_of(numbers), path * numbers[2])
    force, dissipated = found["storey_force"].values[:, 0], found["dissipated_energy"].values[:, 0]
    drift = path * numbers[2]
    work = np.cumsum((force + np.append(0, force[:-1])) / 2 * np.diff(drift, prepend=0.0))
    unit = numbers[0] ** 2 / numbers[3]
    assert work.min() > -1e-6 * unit
    assert np.all(dissipated > -1e-5 * unit)  # of the trapezoidal rule along the envelope
    assert dissipated[-1] > unit
    # At zero force nothing is stored.
    still = np.abs(force) < 1e-9 * numbers[0]
    np.testing.assert_allclose(dissipated[still], work[still], rtol=1e-6, atol=1e-6 * unit)


@pytest.mark.fast
@pytest.mark.parametrize("name", WALLS)
def test_trials_tangents_and_precision(name):
    numbers = WALLS[name]
    building, drift = storey_of(numbers), wandering(1.3 * numbers[2], 60, 37, seed=4)
    double, single = steps(building, drift), steps(building, drift, "float32")
    np.testing.assert_allclose(double.trial_force, double.force, rtol=0, atol=1e-12 * numbers[0])
    np.testing.assert_allclose(single.force, double.force, rtol=0, atol=1e-3 * numbers[0])
    assert (np.abs(double.tangent - double.chord) < 1e-5 * numbers[3]).mean() > 0.98


@pytest.mark.fast
def test_names_and_bad_input():
    values = {name: value for name, value in wall(*WALLS["second"])[1].values().items()}
    assert wd.ShearBuilding(1.0, 5.0e6, 3.0, law="SAWS", **values).law == "saws"
    with pytest.raises(ValueError, match=r"softening_ratio is -0\.05; it must be finite and above 0"):
        wd.laws.Saws(**values | {"softening_ratio": -0.05})
    with pytest.raises(ValueError, match=r"pinching_force_ratio is 0\.9 at storey 1; it must be below .*peak"):
        wd.ShearBuilding(
            1.0, 5.0e6, 3.0, law="saws", **values | {"pinching_force_ratio": 0.9, "pinching_stiffness_ratio": 0.2}
        )


@pytest.mark.parametrize("alpha", [0.4, 0.6])
def test_a_system_under_a_pulse(alpha, measured):
    # With the case's own exponent of 0.8, OpenSees' reloading jumps above its envelope.
    case = cases("dynamic")["dynamic_saws"]
    numbers = [*material_of(case)[:8], alpha, material_of(case)[9]]
    stiffness, law = wall(*numbers)
    time = np.arange(0, case["duration"] + SAMPLING / 2, SAMPLING)
    pulse = case["A"] * np.sin(2 * np.pi * time / case["Tp"]) * np.exp(-case["b"] * time)
    theirs = chain_drifts(
        [case["mass"]],
        [("SAWS", numbers)],
        (0.0, [case["damping_coefficient"]]),
        [0.0],
        pulse,
        SAMPLING,
        time.size - 1,
        20,
    )[:, 0]
    assert np.abs(theirs).max() > 1.3 * numbers[2]
    ours = run_pulse(case, stiffness, law=law)["displacement"].values[0, :, 0]
    found, expected = (np.array([u.max(), u.min(), u[-1]]) for u in (ours, theirs))
    measured(
        "peak and last drifts of a `saws` storey under a pulse, over the largest drift",
        truth="OpenSees' SAWS, Newmark's average acceleration, step 0.25 ms",
        value=difference(found, expected) / np.abs(expected).max(),
        bound=2e-3,
    )
