"""Intensity measures of two motions, and their efficiency for the drift of a bilinear oscillator.

The reference was computed by another program: integrals of motions that are linear between samples, spectral
accelerations by exact state transitions, and the oscillator by a Newmark integration.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

import warpdyn as wd
from parts.analyses.rows import Row
from warpdyn.model.ground_motions.records import far_field

G = 9.80665
WIDE, NARROW = (np.linspace(0.2, last, 10) for last in (3.0, 2.0))
FIV3 = wd.FilteredIncrementalVelocity(1.0, 0.7, 0.85)
AVERAGE = wd.AverageSpectralAcceleration(WIDE)
# Values of a pulse and of the first far-field record, in SI units.
VALUES = {
    "PGA [m/s2]": (wd.PeakGroundAcceleration(), 3.80492, 4.07744),
    "Sa(1 s) [m/s2]": (wd.SpectralAcceleration(1.0), 9.47904, 10.0024),
    "average Sa, 0.2 to 2 s [m/s2]": (wd.AverageSpectralAcceleration(NARROW), 5.51061, 6.46715),
    "average Sa, 0.2 to 3 s [m/s2]": (AVERAGE, 3.63415, 4.1753),
    "Arias intensity [m/s]": (wd.AriasIntensity(), 2.55748, 3.05637),
    "CAV [m/s]": (wd.CumulativeAbsoluteVelocity(), 10.1103, 14.2399),
    "duration, 5 to 95 % [s]": (wd.SignificantDuration(0.05, 0.95), 5.78618, 9.21229),
    "duration, 5 to 75 % [s]": (wd.SignificantDuration(0.05, 0.75), 2.55994, 6.08379),
    "FIV3 [m/s]": (FIV3, 0.131156, 0.92126),
}
# Slope, efficiency, proficiency and R squared of regressions of ln drift.
REGRESSIONS = {
    "PGA": (wd.PeakGroundAcceleration(), 0.770081, 0.432294, 0.561362, 0.32737),
    "Sa(1 s)": (wd.SpectralAcceleration(1.0), 0.885352, 0.254652, 0.287628, 0.766594),
    "average Sa": (AVERAGE, 1.08116, 0.277226, 0.256414, 0.723378),
    "FIV3": (FIV3, 0.820895, 0.349442, 0.425684, 0.560491),
    "CAV": (wd.CumulativeAbsoluteVelocity(), 0.660229, 0.423976, 0.642165, 0.353006),
}


def compared(device: str | None) -> tuple[list[Row], xr.Dataset]:
    """Return the rows of this analysis, and the regressions of all measures."""
    motions = list(far_field())
    time = np.arange(0, 20.005, 0.01)
    pulse = wd.GroundMotion(4.0 * np.sin(2 * np.pi * time / 0.8) * np.exp(-0.25 * time), 0.01, "pulse")
    rows = []
    for name, (measure, *references) in VALUES.items():
        values = measure.values([pulse, motions[0]])
        for motion, reference, value in zip(("pulse", "record"), references, values, strict=True):
            # The reference has six digits; its spectral peaks are those at 1/400 of the period.
            rows.append(Row("intensity measures", f"{name}, {motion}", reference, float(value), 5e-5 * reference))
    mass, omega = 1e5, 2 * np.pi
    oscillator = wd.ShearBuilding(
        mass,
        mass * omega**2,
        3.0,
        law=wd.laws.Bilinear(yield_force=0.1 * G * mass, hardening_ratio=0.05),
        damping="rayleigh",
        damping_ratio=0.05,
    )
    scene = wd.Scene(oscillator, wd.Cloud(motions), recorders=("drift",), tail=5.0)
    run = wd.simulate(scene, integration=wd.Integration(dtype="float64"), device=device)
    measures = [measure for measure, *_ in REGRESSIONS.values()]
    found = wd.compare_measures(run, motions, measures, demand="peak_storey_drift")
    found = found.assign_coords(measure=list(REGRESSIONS))
    for name, (_, *references) in REGRESSIONS.items():
        quantities = zip(("slope", "efficiency", "proficiency", "determination"), references, strict=True)
        for quantity, reference in quantities:
            value = float(found[quantity].sel(measure=name))
            # Peak drifts at the steps of two integrations differ by up to 0.5 %.
            rows.append(Row("efficiency of measures", f"{quantity}, {name}", reference, value, 4e-3 * reference))
    return rows, found
