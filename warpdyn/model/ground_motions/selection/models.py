"""Medians and dispersions of spectral accelerations from ground-motion models of OpenQuake."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import checked_text, real_number, shortened
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names
from warpdyn.model.ground_motions.response_spectra import checked_periods

REMEDY = "install it as https://docs.openquake.org describes, or give median= and dispersion= yourself"


@suggests_names
def ground_motion_model(model: str, periods: ArrayLike, parameters: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the median [g] and the dispersion of Sa from a ground-motion model of OpenQuake (openquake.hazardlib).

    Give the result to `conditional_spectrum`. The package openquake.engine is not a dependency of warpdyn.

    Args:
        model: Name of the model in hazardlib, such as "BooreEtAl2014".
        periods: Natural periods [s], shape [period].
        parameters: All parameters that the model needs, with the names and units of OpenQuake, such as `mag`, `rake`
            [degrees], `rjb` [km] and `vs30` [m/s]. An error lists those that are missing.

    Returns:
        Median of Sa [g] and total standard deviation of ln Sa [1], each of shape [period].

    Raises:
        ModuleNotFoundError: If openquake.hazardlib is not installed.
        ValueError: If the model is unknown, a parameter is missing, unknown or not a finite number, or the model does
            not have one of the periods.
        TypeError: If `model` is not text, or `parameters` is not a dict.

    Example:
        >>> periods = [0.2, 0.5, 1.0]  # s
        >>> scenario = {"mag": 6.5, "rjb": 11.0, "vs30": 259.0, "rake": 0.0}
        >>> median, dispersion = wd.ground_motion_model("BooreEtAl2014", periods, scenario)  # doctest: +SKIP
    """
    checked_text("ground_motion_model: model", model)
    row = np.atleast_1d(checked_periods(periods, "ground_motion_model: periods"))
    if not isinstance(parameters, dict):
        raise TypeError(f"ground_motion_model: parameters must be a dict of numbers, got {shortened(parameters)}")
    given = {
        name: real_number(f"ground_motion_model: parameters[{name!r}]", value) for name, value in parameters.items()
    }
    try:
        from openquake.hazardlib import gsim, valid
        from openquake.hazardlib.contexts import simple_cmaker
    except ImportError as error:
        raise ModuleNotFoundError(f"ground_motion_model needs openquake.hazardlib ({error}): {REMEDY}") from None
    known = gsim.get_available_gsims()
    if model not in known:
        raise ValueError(f"unknown ground-motion model {model!r}{did_you_mean(model, list(known))}")
    chosen = valid.gsim(model)
    needed = set().union(
        chosen.REQUIRES_RUPTURE_PARAMETERS, chosen.REQUIRES_SITES_PARAMETERS, chosen.REQUIRES_DISTANCES
    )
    if needed - given.keys() or given.keys() - needed:
        wrong = ", ".join(sorted(needed ^ given.keys()))
        raise ValueError(
            f"ground_motion_model: {model} needs exactly the parameters {', '.join(sorted(needed))}; missing or "
            f"unknown: {wrong}"
        )
    maker = simple_cmaker([chosen], [f"SA({period!r})" for period in row.tolist()])
    context = maker.new_ctx(1)
    for name, value in given.items():
        context[name] = value
    try:
        values = maker.get_mean_stds([context])
    except KeyError as error:
        raise ValueError(f"ground_motion_model: {model} has no coefficients for {error}: change periods=") from None
    return np.exp(values[0, 0, :, 0]), values[1, 0, :, 0]
