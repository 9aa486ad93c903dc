"""Tornado analysis: change of a demand or fragility median if one random parameter is low or high."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy.special import ndtri

from warpdyn.answers.fragility.intervals.student_t import jackknife_half_width
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.sensitivity.inputs import inputs_of
from warpdyn.answers.sensitivity.structure_outputs import outputs_of
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.reductions.limits import DRIFT, Limit
from warpdyn.campaigns.running.simulate import simulate
from warpdyn.foundations.core.checks import finite_numbers, shortened
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.scene.distributions.closed_form import Lognormal
from warpdyn.model.scene.scatter import RandomScatter
from warpdyn.model.scene.scene import Scene

BOUNDS = ("low", "high")


@suggests_names
def tornado(
    scene: Scene,
    *,
    demand: str = DRIFT,
    limits: Mapping[str, Limit] | None = None,
    quantiles: Sequence[float] = (0.05, 0.95),
    confidence: float = 0.95,
    integration: Integration | None = None,
    execution: Execution | None = None,
) -> xr.Dataset:
    """Run a scene with one random parameter at a time at a low and a high quantile; return the change of the output.

    All other parameters have their medians. The output of a structure is its mean demand over all motions, at each
    level, or, with `limits`, its fragility median for each damage state. The structures are the median structure and
    two per input: 1 + 2 * inputs structures, each under every motion. A parameter with `per="storey"` and without
    storey correlation is one input per storey; with storey correlation, all storeys have the quantile together.

    Source: Porter, Beck and Shaikhutdinov (2002), "Sensitivity of building loss estimates to major uncertain
    variables", Earthquake Spectra 18(4). Intervals: jackknife over motions with Student's t, of the logarithm of the
    ratio.

    Args:
        scene: The scene: one structure with random parameters, under a Cloud, Stripes or one motion.
        demand: Name of the demand; the worst storey or floor counts.
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand], for the change of
            fragility medians; the scene needs Stripes. None: change of the demand.
        quantiles: Low and high cumulative probability of a parameter [1]; 0 and 1 are the bounds of a distribution that
            has bounds.
        confidence: Probability that the intervals cover the true value [1].
        integration: How samples are integrated; None: the defaults of `simulate`.
        execution: Where samples are integrated; None: the defaults of `simulate`.

    Returns:
        `output(input, bound)` and `median_output` [units of the demand, or of the intensity]; `ratio(input, bound)`,
        output divided by the output of the median structure [1], with `_lower` and `_upper` (NaN for one motion), and
        `swing(input)`, the largest minus the smallest of the two outputs and the median output. With the median output,
        a parameter that increases (or decreases) the output at both bounds has a swing, too. With the dimension
        `stripe` for a demand on stripes, or `damage_state` for medians.

    Raises:
        TypeError: If `scene` is not a Scene of one structure under a Cloud, Stripes or one motion.
        ValueError: If parameters are correlated or given, no parameter is random, quantiles are not increasing from 0
            to 1, a quantile is 0 or 1 and a distribution has no such bound, samples failed, samples collapsed and
            `limits` is None, or a structure has no fragility curve.

    Example:
        >>> swings = wd.tornado(scene, quantiles=(0.1, 0.9))
        >>> swings["ratio"].sel(input="yield_force", stripe=1.4).round(2).values
        array([1.12, 0.88])
    """
    check_confidence(confidence)
    levels = finite_numbers("quantiles", quantiles)
    if levels.shape != (2,) or not 0 <= levels[0] < levels[1] <= 1:
        raise ValueError(
            f"quantiles must be a low and a high probability, such as (0.05, 0.95), got {shortened(quantiles)}"
        )
    inputs = inputs_of("tornado", scene)
    _check_bounds(scene, levels)
    normals = np.zeros((inputs.variables, 1 + 2 * len(inputs.names)))
    for place, rows in enumerate(inputs.rows):
        normals[rows, 1 + 2 * place : 3 + 2 * place] = ndtri(levels)
    # Without the factor of the correlation matrix: all storeys of a correlated input have the same quantile.
    run = simulate(inputs.scene_of(normals), integration=integration, execution=execution)
    outputs = outputs_of("tornado", run, demand, limits)
    values = outputs.values
    both = values[1:].reshape(len(inputs.names), 2, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = both / values[0]
    motions = outputs.counts[1]
    bounds = np.full((2, *ratio.shape), np.nan)
    if motions > 1:
        left = []
        for motion in range(motions):
            each = outputs.without(motion)
            with np.errstate(divide="ignore", invalid="ignore"):
                left.append(np.log(each[1:].reshape(both.shape) / each[0]))
        half = jackknife_half_width(left, confidence)
        bounds = np.array([ratio * np.exp(-half), ratio * np.exp(half)])
    of_output, name = {"units": outputs.attributes["units"]}, outputs.attributes["long_name"]
    dims = "input", "bound"
    return xr.Dataset(
        {
            "output": outputs.dataset_of(both, *dims, name=name, **of_output),
            "median_output": outputs.dataset_of(values[0], name=f"{name}, median structure", **of_output),
            "ratio": outputs.dataset_of(ratio, *dims, name="output over output of the median structure"),
            "ratio_lower": outputs.dataset_of(bounds[0], *dims, name="ratio, lower bound"),
            "ratio_upper": outputs.dataset_of(bounds[1], *dims, name="ratio, upper bound"),
            "swing": outputs.dataset_of(
                np.ptp([both[:, 0], both[:, 1], np.broadcast_to(values[0], both[:, 0].shape)], axis=0),
                "input",
                name=f"{name}, range of the outputs at both bounds and at the median",
                **of_output,
            ),
        },
        {
            "input": ("input", np.array(inputs.names), {"long_name": "random parameter"}),
            "bound": ("bound", np.array(BOUNDS), {"long_name": "low or high quantile of the parameter"}),
            "quantile": ("bound", levels, {"long_name": "cumulative probability of the parameter", "units": "1"}),
            **outputs.coordinates,
        },
        {
            "analysis": "tornado",
            "demand": demand,
            "confidence": float(confidence),
            "interval_method": "jackknife over motions of ln(ratio), Student's t",
        },
    )


def _check_bounds(scene: Scene, quantiles: np.ndarray) -> None:
    """Raise a ValueError if a quantile is 0 or 1, and the distribution of a parameter has no bound there."""
    for quantile in quantiles[(quantiles == 0) | (quantiles == 1)]:
        side = "lower" if quantile == 0 else "upper"
        for name, spread in scene.scatter.items():
            assert isinstance(spread, RandomScatter)
            (bound,) = spread.distribution.from_standard_normal(ndtri([quantile]))
            if not np.isfinite(bound) or (bound == 0 and isinstance(spread.distribution, Lognormal)):
                raise ValueError(
                    f"tornado: the distribution of {name!r}, {spread.distribution!r}, has no {side} bound, so that "
                    f"its quantile {quantile:g} is {bound:g}: give quantiles= above 0 and below 1, such as "
                    "quantiles=(0.05, 0.95)"
                )
