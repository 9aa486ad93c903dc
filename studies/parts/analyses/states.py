"""State-dependent fragility of two oscillators under pairs of events: bilinear, and with P-Delta.

The reference was computed by another program from 40,000 sequences of the same oscillators and the same 4,000 motions;
here, other sequences are drawn, so that both results have sampling errors.
"""

from __future__ import annotations

import warnings

import numpy as np
import scipy.signal
import xarray as xr
from scipy.stats import norm

import warpdyn as wd
from parts.analyses.rows import Row

G, PERIOD, HEIGHT = 9.80665, 0.5, 3.0
OMEGA, MASS = 2 * np.pi / PERIOD, 1e5
YIELD = 0.2 * G / OMEGA**2  # yield displacement [m]
LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.3, 1.7)  # g, of the second event
PGA = wd.PeakGroundAcceleration()
# Oscillator: hardening ratio, stiffness of P-Delta over the initial one, ductilities of the damage states; and
# (state before, state reached): number of sequences, median [g], dispersion.
CASES = {
    "bilinear": (
        *(0.05, 0.0, (1.5, 3.0, 6.0)),
        {
            (0, 1): (3616, 0.166687, 0.264654),
            (0, 2): (3616, 0.384255, 0.219928),
            (0, 3): (3616, 0.756845, 0.229017),
            (1, 2): (12657, 0.377444, 0.230438),
        },
    ),
    "P-Delta": (
        *(0.03, 0.08, (1.5, 3.0, 6.0, 12.0)),
        {
            (0, 1): (2708, 0.145609, 0.292788),
            (0, 2): (2708, 0.270558, 0.300563),
            (0, 4): (2708, 0.473646, 0.311434),
            (1, 2): (8069, 0.207694, 0.432222),
            (1, 3): (8069, 0.334011, 0.381991),
            (2, 4): (5604, 0.295698, 0.389342),
            (3, 4): (3874, 0.143193, 0.400156),
        },
    ),
}


def motions() -> list[wd.GroundMotion]:
    """Return 4,000 random motions with a PGA of 1 g."""
    noise = np.random.Generator(np.random.PCG64(7)).standard_normal((4000, 1501))
    r, w = np.exp(-0.6 * 12.5 * 0.01), 12.5 * np.sqrt(1 - 0.6**2) * 0.01
    x = scipy.signal.lfilter([1.0, -1.0], [1.0, -2 * r * np.cos(w), r * r], noise, axis=1)
    t = 0.01 * np.arange(1501)
    x = x * np.where(t < 2, (t / 2) ** 2, np.where(t < 7, 1.0, np.exp(-0.6 * (t - 7))))
    x /= np.abs(x).max(axis=1, keepdims=True)
    return [wd.GroundMotion(G * row, 0.01, f"noise {place}") for place, row in enumerate(x)]


def sequences(
    each: list[wd.GroundMotion], hardening: float, p_delta: float, structures: int, seed: int, device: str | None
) -> xr.Dataset:
    """Return a run of a mainshock of random PGA, and of a second event at all levels."""
    generator = np.random.default_rng(seed)
    first = wd.OneMotionPerStructure(
        each[:2000],
        motion=generator.integers(0, 2000, structures),
        scale=np.exp(generator.uniform(np.log(0.15), np.log(1.5), structures)),
        measure=PGA,
    )
    fewest = -(-structures // 2000)  # 2,000 motions at most
    second = wd.Stripes(each[2000 : 2000 + structures // fewest], LEVELS, PGA, structures_per_motion=fewest)
    oscillator = wd.ShearBuilding(
        MASS,
        MASS * OMEGA**2,
        HEIGHT,
        law=wd.laws.Bilinear(yield_force=0.2 * G * MASS, hardening_ratio=hardening),
        damping="storey",
        damping_coefficient=2 * 0.05 * OMEGA * MASS,
        gravity_load=[p_delta * MASS * OMEGA**2 * HEIGHT] if p_delta else None,
    )
    events = wd.EventSequence({"first": first, "second": second})
    scene = wd.Scene(oscillator, events, recorders=("drift",), tail=10.0)
    integration = wd.Integration(method="rk4", step=0.005)
    return wd.simulate(scene, structures=structures, seed=seed, integration=integration, device=device)


def standard_errors(median: float, dispersion: float) -> np.ndarray:
    """Return the standard errors of ln(median) and ln(dispersion), times the root of the number of sequences.

    The sandwich variance of a probit fit: each sequence is run at all levels and exceeds the state from one level
    on, so that the covariance of exceedances at two levels is that of one threshold.
    """
    z = np.log(np.array(LEVELS) / median) / dispersion
    weight = norm.pdf(z) / np.maximum(norm.cdf(z) * norm.sf(z), 1e-300)
    design = np.stack([-np.full_like(z, 1 / dispersion), -z])  # derivative of z by ln(median) and ln(dispersion)
    exact = norm.cdf(z)
    covariance = np.minimum.outer(exact, exact) * (1 - np.maximum.outer(exact, exact))
    bread = np.linalg.inv((design * norm.pdf(z) * weight) @ design.T)
    return np.sqrt(np.diag(bread @ (design * weight) @ covariance @ (design * weight).T @ bread))


def compared(structures: int, seed: int, device: str | None) -> tuple[list[Row], dict[str, xr.Dataset]]:
    """Return the rows of this analysis, and the state-dependent curves of both oscillators."""
    rows, curves, each = [], {}, motions()
    for case, (hardening, p_delta, ductilities, references) in CASES.items():
        run = sequences(each, hardening, p_delta, structures, seed, device)
        limits = {f"DS{place}": ductility * YIELD / HEIGHT for place, ductility in enumerate(ductilities, 1)}
        with warnings.catch_warnings():
            # Some curves start where all samples exceed the state at the lowest level.
            warnings.filterwarnings("ignore", "state_dependent_fragility")
            found = curves[case] = wd.state_dependent_fragility(run, limits)
        for (before, reached), (number, *reference) in references.items():
            curve = found.isel(from_state=before, damage_state=reached - 1)
            own = int(found["samples"][before]) / len(LEVELS)
            # Three standard errors of both results.
            errors = 3 * standard_errors(*reference) * np.sqrt(1 / own + 1 / number)
            name = f"{case}, {curve['from_state'].item()} to {curve['damage_state'].item()}"
            quantities = zip(("median", "dispersion"), reference, errors.tolist(), strict=True)
            for quantity, value, error in quantities:
                got, unit = float(curve[f"fragility_{quantity}"]), " [g]" if quantity == "median" else ""
                rows.append(Row("state-dependent fragility", f"{quantity}{unit}, {name}", value, got, error * value))
    return rows, curves
