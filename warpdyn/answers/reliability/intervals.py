"""Interval and variables of the probability of a rare event, for datasets."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ndtri

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.foundations.core.messages import warn_caller

LARGEST_VARIATION = 0.5  # coefficient of variation above which an interval rests on few independent samples


def lognormal_interval(probability: float, variation: float, confidence: float) -> tuple[float, float]:
    """Return the interval of a probability whose logarithm is normal, with a given coefficient of variation.

    Args:
        probability: The estimate [1].
        variation: Coefficient of variation of the estimate [1].
        confidence: Probability that the interval covers the true value [1].
    """
    half = float(ndtri(0.5 + confidence / 2) * np.sqrt(np.log1p(variation**2)))
    return probability * float(np.exp(-half)), min(1.0, probability * float(np.exp(half)))


def probability_variables(
    function: str, probability: float, variation: float, evaluations: int, confidence: float
) -> dict[str, Any]:
    """Return the variables of an estimate with its interval; warn if its coefficient of variation is above 0.5."""
    if variation > LARGEST_VARIATION:
        warn_caller(
            f"{function}: the coefficient of variation is {variation:.2f}, so that {probability:.2g} is only an order "
            f"of magnitude: give more samples=; {function} needs about {(variation / 0.2) ** 2:.0f} times as many for "
            "a coefficient of variation of 0.2"
        )
    low, high = lognormal_interval(probability, variation, confidence)
    bound = f"bound of the {100 * confidence:g} % interval"
    return {
        "probability": variable((), probability, "probability that the limit-state function is negative"),
        "probability_lower": variable((), low, f"probability, lower {bound}"),
        "probability_upper": variable((), high, f"probability, upper {bound}"),
        "coefficient_of_variation": variable((), variation, "coefficient of variation of the probability"),
        "evaluations": variable((), evaluations, "samples for which the limit-state function was evaluated"),
    }
