"""Calibration to measured loops of a magnetorheological damper, against least squares by SciPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import warpdyn as wd

DATA = Path(__file__).parent / "data"
ERRORS = 4.0  # standard errors
UNITS = np.array([1e6, 60.0, 800.0, 10.0])  # N/m, N, N s/m, N


def dahl(parameters: np.ndarray, displacement: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Forces [N] of Dahl's friction with the given stiffness and strength, a dashpot and an offset, in closed form.

    Dahl's law is that of Bouc and Wen with n = 1, beta = 1 and gamma = 0.
    """
    stiffness, strength, dashpot, offset = parameters
    z, friction = 0.0, []
    for change in np.diff(displacement, prepend=0.0):
        side = np.sign(change)
        z = side + (z - side) * np.exp(-stiffness / strength * abs(change)) if change else z
        friction.append(strength * z)
    return np.array(friction) + dashpot * velocity + offset


@pytest.mark.thorough
@pytest.mark.parametrize("voltage", ["0V", "0.88V"])
def test_posterior_of_a_measured_loop_is_around_the_least_squares(voltage):
    table = np.loadtxt(DATA / f"mr_damper_loop_{voltage}.csv", delimiter=",", skiprows=3)
    displacement, velocity, force = 1e-3 * table[:, 0], 1e-3 * table[:, 1], table[:, 2]

    def misfit(scaled: np.ndarray) -> np.ndarray:
        return dahl(scaled * UNITS, displacement, velocity) - force

    fit = least_squares(misfit, [1.0, 1.0, 1.0, 0.1])
    best, deviation = fit.x * UNITS, np.sqrt(2 * fit.cost / len(force))
    spread = UNITS * deviation * np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
    if voltage == "0V":  # parameters of the authors of the measurement: 57.42 N, 27.45 / mm and 0.7682 N s/mm
        published = np.array([57.42 * 27.45e3, 57.42, 768.2, 0.0])
        of_authors = np.sqrt(np.mean(np.square(dahl(published, displacement, velocity) - force)))
        assert deviation < of_authors < 1.2 * deviation  # 10.1 and 11.5 N
    law = wd.laws.BoucWen(yield_force=best[1], hardening_ratio=0.0, beta=1.0, gamma=0.0)
    device = {"devices": ("viscous_damper",), "damper_coefficient": best[2], "velocity_exponent": 1.0}
    names = ("stiffness", "yield_force", "damper_coefficient")
    priors = {name: wd.Lognormal(middle, 0.3) for name, middle in zip(names, best[:3], strict=True)}
    found = wd.calibrate(
        wd.ShearBuilding(1.0, best[0], 1.0, law=law, **device),
        wd.MeasuredLoop(displacement, force, velocity=velocity),
        priors,
        noise=wd.Lognormal(20.0, 0.7),
        offset=wd.Normal(0.0, 30.0),
        candidates=200,
    )
    for name, mean, width in zip((*names, "sensor_offset[1]"), best, spread, strict=True):
        one = found.sel(parameter=name)
        # Priors and curvature shift the mean from the least squares by a fraction of the deviation.
        error = ERRORS * float(one["posterior_mean_standard_error"]) + 0.25 * width
        assert float(one["posterior_mean"]) == pytest.approx(mean, abs=error), name
        # The relative error of a deviation of 200 samples is 5 %.
        assert float(one["posterior_standard_deviation"]) == pytest.approx(width, rel=ERRORS * 0.05), name
    noise = found.sel(parameter="noise_standard_deviation")
    assert float(noise["posterior_mean"]) == pytest.approx(deviation, rel=0.03)
