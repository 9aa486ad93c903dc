"""Response spectra of pairs of horizontal components: geometric mean, larger component, RotD50 and RotD100.

`GeometricMean` and `RotatedSpectralAcceleration` are the same quantities at one period, as intensity measures.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import real_numbers
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.ground_motions.measures.pairs import rotated_motions
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.plausibility import warn_of_implausible_motions
from warpdyn.model.ground_motions.records.components.pairing import pairs
from warpdyn.model.ground_motions.response_spectra import checked_periods, spectral_displacements

PERCENTILES = (50.0, 100.0)  # RotD50 and RotD100


@suggests_names
def pair_response_spectra(
    motions: Sequence[GroundMotion],
    periods: ArrayLike,
    damping_ratio: float = 0.05,
    *,
    percentiles: ArrayLike = PERCENTILES,
    device: str | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Return the response spectra of pairs of horizontal components, combined in several ways.

    The rotated spectra are percentiles over the directions 0, 1, ..., 179 degrees from the first component, at each
    period separately. If the azimuths are known and not 90 degrees apart, the component perpendicular to the first one
    is computed before.

    Source: Boore (2010), "Orientation-independent, nongeometric-mean measures of seismic intensity from two horizontal
    components of motion".

    Args:
        motions: The motions; two motions with the same `record` are a pair (see `records.pairs`).
        periods: Undamped natural periods [s], one value or a 1-D array.
        damping_ratio: Viscous damping as a fraction of critical [1], from 0 up to but not including 1.
        percentiles: Percentiles over the directions [%]: 50 for RotD50, 100 for RotD100, 0 for RotD00.
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU.
        threads: Number of CPU threads; None: all cores that this process may use.

    Returns:
        Dataset of pseudo-spectral accelerations [m/s2] with the dimensions (record, period): `components` (with the
        dimension `component`: first and second), `geometric_mean`, `larger_component`, and `rotated` (with the
        dimension `percentile`).

    Raises:
        ValueError: If motions are not pairs, the components of a pair have different steps, a period is not finite and
            positive, the damping ratio is outside [0, 1), or a percentile is outside 0 to 100.
        TypeError: If a motion is not a GroundMotion.

    Example:
        >>> from warpdyn.model.ground_motions.measures import rotd
        >>> both = dict(step=0.02, record="quake")
        >>> components = [wd.GroundMotion(noise[i], **both, component="NE"[i]) for i in (0, 1)]
        >>> spectra = rotd.pair_response_spectra(components, [0.5, 1.0])
        >>> spectra["rotated"].sel(percentile=100, record="quake").values.round(1)
        array([5.6, 5. ])
    """
    both = pairs(motions)
    periods = np.atleast_1d(checked_periods(periods, "periods"))
    if periods.ndim != 1 or periods.size == 0:
        raise ValueError(f"periods must be one value or a 1-D array of values, got shape {periods.shape}")
    ratio = real_numbers("damping_ratio", damping_ratio)
    if ratio.shape != () or not 0 <= ratio < 1:
        raise ValueError(f"damping_ratio must be one number from 0 up to but not including 1, got {damping_ratio!r}")
    percents = np.atleast_1d(real_numbers("percentiles", percentiles))
    if percents.ndim != 1 or not np.all((percents >= 0) & (percents <= 100)):
        raise ValueError(f"percentiles must be one row of numbers from 0 to 100, got {percentiles!r}")
    warn_of_implausible_motions([motion for pair in both for motion in pair], periods)
    square = (2 * np.pi / periods) ** 2
    ratios = np.atleast_1d(ratio)
    how: dict[str, Any] = {"device": device, "threads": threads}
    components = np.empty((len(both), 2, periods.size))
    rotated = np.empty((len(both), percents.size, periods.size))
    for place, (first, second) in enumerate(both):
        components[place] = square * spectral_displacements([first, second], periods, ratios, **how)[:, 0]
        directions = square * spectral_displacements(rotated_motions(first, second), periods, ratios, **how)[:, 0]
        rotated[place] = np.percentile(directions, percents, axis=0)
    columns = {
        "components": (("record", "component", "period"), components, "of each component"),
        "geometric_mean": (("record", "period"), np.sqrt(components.prod(axis=1)), "geometric mean of the components"),
        "larger_component": (("record", "period"), components.max(axis=1), "larger of the components"),
        "rotated": (("record", "percentile", "period"), rotated, "percentile over horizontal directions"),
    }
    variables = {
        name: (dimensions, values, {"long_name": f"pseudo-spectral acceleration, {words}", "units": "m s-2"})
        for name, (dimensions, values, words) in columns.items()
    }
    return xr.Dataset(
        variables,
        coords={
            "record": ("record", [first.record for first, _ in both], {"long_name": "name of the record"}),
            "percentile": ("percentile", percents, {"long_name": "percentile over the directions", "units": "%"}),
            "period": ("period", periods, {"long_name": "undamped natural period", "units": "s"}),
        },
        attrs=trace("Response spectra of pairs of components", "pair_response_spectra")
        | {"damping_ratio": float(ratio)},
    )
