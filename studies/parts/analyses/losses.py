"""Annual rates of damage states and expected annual loss for a hazard curve that is a power law: closed forms."""

from __future__ import annotations

import numpy as np
import xarray as xr

import warpdyn as wd
from parts.analyses.rows import Row

STATES = ("slight", "moderate", "extensive", "complete")
MEDIANS, DISPERSIONS = np.array([0.22, 0.45, 0.85, 1.4]), np.array([0.45, 0.45, 0.5, 0.5])  # g, 1
RATIOS = np.array([0.02, 0.1, 0.5, 1.0])  # loss ratios
RATE, SLOPE = 4e-5, 2.6  # of the hazard curve: 4e-5 x^-2.6 per year, x in g


def closed_form() -> np.ndarray:
    """Return the annual rates of all damage states (Cornell et al. 2002)."""
    return RATE * MEDIANS**-SLOPE * np.exp(SLOPE**2 * DISPERSIONS**2 / 2)


def compared() -> tuple[list[Row], xr.Dataset]:
    """Return the rows of this analysis, and the fragility curves with their annual rates."""
    curves = xr.Dataset(
        {
            "fragility_median": ("damage_state", MEDIANS, {"units": "g"}),
            "fragility_dispersion": ("damage_state", DISPERSIONS),
        },
        {"damage_state": list(STATES)},
    )
    level = np.geomspace(0.025, 40.0, 20)
    hazard = wd.HazardCurve(level, RATE * level**-SLOPE)
    found = wd.annual_rates(curves, hazard)
    losses = wd.annual_losses(curves, hazard, dict(zip(STATES, RATIOS, strict=True)))
    exact = closed_form()
    rows = [
        Row("annual rates and losses", f"rate of {state} damage [1/year]", reference, value, 1e-6 * reference)
        for state, reference, value in zip(STATES, exact, found["annual_rate"].values.tolist(), strict=True)
    ]
    loss = float(np.diff(RATIOS, prepend=0.0) @ exact)
    own = float(losses["expected_annual_loss"])
    rows.append(Row("annual rates and losses", "expected annual loss [1/year]", loss, own, 1e-6 * loss))
    return rows, found.merge(curves, combine_attrs="override")
