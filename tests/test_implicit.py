"""Implicit methods on chains against published tables, full matrices and exact linear responses."""

from itertools import product

import numpy as np
import pytest
from method_sources import thorough_unless
from three_storeys import (
    AMPLITUDE,
    DAMPING_MATRIX,
    FIRST,
    FREQUENCY,
    HARDENING,
    HEIGHT,
    IMPLICIT,
    MASS,
    PHASE,
    START,
    STIFFNESS,
    STRENGTH,
    TAIL,
    YIELDING_DAMPING,
    building,
    chain_matrix,
    histories,
    loading,
    march,
    simulate,
)

import warpdyn as wd
from warpdyn.engine.methods.table import METHODS
from warpdyn.truth import harmonic_response, piecewise_linear_response

every_method = pytest.mark.parametrize("method", IMPLICIT)

# Chopra, Dynamics of Structures, E5.1 to E5.5: displacement at 0.1, 0.2 ... 1.0 s.
CHOPRA = {
    ("newmark_average", "elastic"): ".0436669 .2326189 .6120711 1.0825427 1.4309539 "
    "1.4230782 .9621755 .1907760 -.6043799 -1.1441953",
    ("newmark_linear", "elastic"): ".0299842 .2193335 .6166103 1.1130160 1.4782094 "
    "1.4624861 .9514301 .1273056 -.6954310 -1.2208304",
    ("central_difference", "elastic"): "0 .1913819 .6293343 1.1824847 1.5808089 "
    "1.5411733 .9140468 -.0247402 -.8968682 -1.3725788",
    ("newmark_average", "bilinear"): ".0436669 .2326189 .6120711 1.1143640 1.6214618 "
    "1.9891569 2.0952251 1.9241312 1.5603173 1.1415914",
}


# Every table with one damping, and each other damping once.
CHOPRA_DAMPINGS = [("storey", *next(iter(CHOPRA))), ("modal", *list(CHOPRA)[3])]


@pytest.mark.parametrize(
    ("damping", "method", "law"),
    [
        thorough_unless(damping == "rayleigh" or (damping, *case) in CHOPRA_DAMPINGS, damping, *case)
        for damping, case in product(("rayleigh", "storey", "modal"), CHOPRA)
    ],
)
def test_chopra(method, law, damping):
    # With one storey every kind of damping is 5 % of the critical 2 sqrt(k m).
    ratio = {"damping_ratio": 0.05}
    if damping == "storey":
        ratio = {"damping_coefficient": 0.1 * np.sqrt(10 * 0.2533)}
    strength = {"yield_force": 7.5, "hardening_ratio": 0.0} if law == "bilinear" else {}
    oscillator = wd.ShearBuilding(0.2533, 10.0, 1.0, law=law, damping=damping, **ratio, **strength)
    time = 0.1 * np.arange(11)
    force = np.where(time < 0.65, 10 * np.sin(np.pi * time / 0.6), 0)
    run = histories(oscillator, wd.ForceHistory(force[:, None], 0.1), 0.1, method, tail=0.0)
    expected = [float(digits) for digits in CHOPRA[method, law].split()]
    np.testing.assert_allclose(run.displacement[1:, 0], expected, rtol=0, atol=0.51e-7)


@every_method
@pytest.mark.parametrize("ratio", [0.0, 0.05, 0.4])
def test_oscillators_are_amplified_as_the_method_says(method, ratio):
    start = np.array([0.02, -0.3])
    for x in (0.1, 1.0):
        frequency = x / 0.01
        oscillator = wd.ShearBuilding(2.0, 2 * frequency**2, 1.0, damping="rayleigh", damping_ratio=ratio)
        run = histories(oscillator, wd.FreeVibration(0.5, *start), 0.01, method)
        acceleration = -2 * ratio * frequency * start[1] - frequency**2 * start[0]
        state = np.array([start[0], 0.01 * start[1], 1e-4 * acceleration])
        states = [state]
        for _ in range(50):
            states.append(METHODS[method].amplification(x, ratio) @ states[-1])
        # Rounding of fifty steps.
        scale = np.abs(states).max()
        np.testing.assert_allclose(run.displacement[:, 0], np.array(states)[:, 0], rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(0.01 * run.velocity[:, 0], np.array(states)[:, 1], rtol=0, atol=1e-12 * scale)


CASES = [
    *((name, "elastic", *(("rayleigh", "base"), ("storey", "harmonic"))[i % 2]) for i, name in enumerate(IMPLICIT)),
    *((name, "bilinear", damping, "base") for name, damping in YIELDING_DAMPING.items()),
    ("central_difference", "elastic", "modal", "free"),
    ("hht_alpha", "elastic", "modal", "free"),
    ("newmark_linear", "elastic", "none", "free"),
    ("generalised_alpha", "bilinear", "modal", "force"),
    ("wilson_theta", "bilinear", "none", "force"),
]
# Run by default: one method of each source, every damping and every load.
SHOWN = [
    ("newmark_average", "bilinear", "storey", "base"),
    ("newmark_average", "elastic", "storey", "harmonic"),
    ("central_difference", "bilinear", "modal", "base"),
    ("hht_alpha", "elastic", "modal", "free"),
    ("newmark_linear", "bilinear", "rayleigh", "base"),
    ("generalised_alpha", "bilinear", "modal", "force"),
    ("wilson_theta", "bilinear", "none", "force"),
]
assert set(SHOWN) <= set(CASES)


@pytest.mark.filterwarnings("ignore:the energy balance")  # the step is long on purpose
@pytest.mark.parametrize(
    ("method", "law", "damping", "load"), [thorough_unless(case in SHOWN, *case) for case in CASES]
)
def test_chains_and_their_recorders_against_full_matrices(method, law, damping, load):
    step = 0.0125
    excitation, loads = loading(load, step)
    tail = {"tail": TAIL} if load in ("base", "force") else {}
    run = simulate(building(law, damping), excitation, step, method, **tail)
    start = START if load == "free" else (np.zeros(3), np.zeros(3))
    expected = march(method, law, damping, loads, step, *start)
    viscous = DAMPING_MATRIX[damping]
    drift = np.diff(expected.u, axis=1, prepend=0)
    if law == "bilinear":
        assert (np.abs(drift).max(axis=0) > 1.5 * STRENGTH / STIFFNESS).all()
    # A history's last force acts at its instant, and not after it: peaks see both.
    is_nodal = load in ("force", "harmonic")
    nodal = np.concatenate([loads[:1, 0], loads[:, 1]]) if is_nodal else 0
    afterwards = np.concatenate([loads[:, 0], loads[-1:, 1]]) if is_nodal else 0
    spring = expected.force - np.append(expected.force[:, 1:], np.zeros((len(drift), 1)), axis=1)
    acceleration, then = ((each - spring - expected.v @ viscous) / MASS for each in (nodal, afterwards))
    power = np.einsum("ti,ij,tj->t", expected.v, viscous, expected.v)
    work = 0.5 * ((expected.force[1:] + expected.force[:-1]) * np.diff(drift, axis=0)).sum(axis=0)
    work += 0.5 * STIFFNESS * drift[0] ** 2
    hardening, strength = (HARDENING, STRENGTH) if law == "bilinear" else (0.0, np.inf)
    elastic = (expected.force[-1] - hardening * STIFFNESS * drift[-1]) / (1 - hardening) / STIFFNESS
    stored = 0.5 * STIFFNESS * (hardening * drift[-1] ** 2 + (1 - hardening) * elastic**2)
    assert (np.abs(elastic) <= strength / STIFFNESS * (1 + 1e-9)).all()

    def check(name, value, scale=None):
        # What the search may leave in each of 200 steps, 1e-12 of the forces, and as much again of scipy's.
        scale = np.abs(value).max() if scale is None else scale
        np.testing.assert_allclose(run[name][0], value, rtol=0, atol=1e-9 * scale, err_msg=name)

    check("displacement", expected.u)
    check("velocity", expected.v)
    check("acceleration", acceleration)
    check("storey_force", expected.force)
    check("peak_storey_drift", np.abs(drift).max(axis=0))
    ratio = np.abs(drift) / HEIGHT
    assert run.storey_of_peak_drift.item() == ratio.max(axis=0).argmax() + 1
    assert run.time_of_peak_drift.item() == pytest.approx(step * ratio.max(axis=1).argmax(), abs=1e-9)
    check("peak_floor_acceleration", np.abs([acceleration, then]).max(axis=(0, 1)))
    check("peak_base_shear", np.abs(expected.force[:, 0]).max())
    # The residual is averaged over three periods, or over the tail where that is shorter.
    count = round((TAIL if load in ("base", "force") else 6 * np.pi / FIRST) / step)
    hann = (1 - np.cos(2 * np.pi * (np.arange(count) + 0.5) / count)) / count
    check("residual_drift_ratio", hann @ drift[-count:] / HEIGHT, ratio.max())
    velocity_load = 0.5 * step * ((loads[:, 0] * expected.v[:-1]).sum() + (loads[:, 1] * expected.v[1:]).sum())
    supplied = max(abs(velocity_load), 1e-3)
    check("input_energy", velocity_load, supplied)
    check("viscous_energy", step * (power.sum() - (power[0] + power[-1]) / 2), supplied + power.max())
    check("hysteretic_energy", work - stored, supplied)


@pytest.mark.parametrize("method", [thorough_unless(name == "newmark_average", name) for name in IMPLICIT])
def test_order(method):
    """Smooth load, and a base motion that is cut off: what follows it is free vibration, and must not cost an order."""
    viscous, stiffness = DAMPING_MATRIX["rayleigh"], chain_matrix(STIFFNESS)
    for load in ("harmonic", "base"):
        errors = []
        for step in (0.0025, 0.00125):
            excitation, loads = loading(load, step)
            tail = {"tail": TAIL} if load == "base" else {}
            # All is recorded, as in the tests of the energy balance, so that a kernel serves both.
            run = simulate(building("elastic", "rayleigh"), excitation, step, method, **tail)
            if load == "harmonic":
                exact = harmonic_response(MASS, viscous, stiffness, AMPLITUDE, FREQUENCY, PHASE, run.time.values)[0]
            else:
                cut = len(loads) - round(TAIL / step)
                force = np.concatenate([loads[:cut, 0], loads[cut - 1 : cut, 1]])
                shaken, moving, _ = piecewise_linear_response(MASS, viscous, stiffness, force, step)
                quiet = np.zeros((len(loads) - cut + 1, 3))
                free = piecewise_linear_response(MASS, viscous, stiffness, quiet, step, shaken[-1], moving[-1])[0]
                exact = np.concatenate([shaken, free[1:]])
            errors.append(np.abs(run.displacement.values[0] - exact).max())
        assert errors[0] < 0.01 * np.abs(exact).max()
        assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.05)
