"""Table of the estimators that fit fragility curves to stripe counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from warpdyn.answers.fragility.estimators.binomial import (
    LOGIT,
    PENALISED,
    PROBIT,
    fit_logit,
    fit_probit,
    influences_of_cells,
)
from warpdyn.answers.fragility.estimators.ordinal import fit_ordinal, influences_of_cells as ordinal_influences
from warpdyn.answers.fragility.lognormal_fit import FIT_MEANINGS as UNPENALISED_MEANINGS, probability
from warpdyn.foundations.core.checks import one_of

FIT_MEANINGS = (*UNPENALISED_MEANINGS, "penalised", "undetermined")
assert FIT_MEANINGS.index("penalised") == PENALISED


@dataclass(frozen=True)
class CurveShape:
    """Shape of fragility curves: the probability of exceedance as a function of median and dispersion.

    Args:
        name: "lognormal" or "loglogistic", the attribute `fragility_shape` of curves.
        probability: Function of intensity, median and dispersion (arrays that broadcast) that returns the probability
            of exceedance. The dispersion is the standard deviation of ln(capacity).
    """

    name: str
    probability: Callable[[ArrayLike, ArrayLike, ArrayLike], np.ndarray]


def loglogistic_probability(intensity: ArrayLike, median: ArrayLike, dispersion: ArrayLike) -> np.ndarray:
    """Return the probability of exceedance by a loglogistic fragility curve; arguments: see `probability`."""
    with np.errstate(divide="ignore"):
        return expit(LOGIT.deviation * (np.log(intensity) - np.log(median)) / np.asarray(dispersion))


LOGNORMAL, LOGLOGISTIC = CurveShape("lognormal", probability), CurveShape("loglogistic", loglogistic_probability)


@dataclass(frozen=True)
class Estimator:
    """A method that fits fragility curves to stripe counts.

    Args:
        method: Text for the attribute `fragility_method` of the curves.
        shape: Shape of the curves.
        fit: Function that fits curves. Arguments: levels, shape [im_level]; numbers of exceeding samples, shape [...,
            damage_state, im_level]; numbers of samples, which broadcast with them; and start (median and dispersion, or
            None). It returns medians, dispersions and outcomes (indices into FIT_MEANINGS), each of shape [...,
            damage_state].
        influences: Function that returns the first-order contribution of each cell (one record and one group of
            structures) to ln(median) and ln(dispersion), shape [record, group, 2, ..., damage_state], and the variances
            of both if all samples were independent. Arguments: levels; numbers of exceeding samples, shape [record,
            group, im_level, ..., damage_state]; numbers of samples, shape [record, group, im_level]; medians;
            dispersions.
    """

    method: str
    shape: CurveShape
    fit: Callable[..., tuple[np.ndarray, np.ndarray, np.ndarray]]
    influences: Callable[..., tuple[np.ndarray, np.ndarray]]


_SEPARATED = "if stripes are separated, penalised by Jeffreys' prior (Firth 1993; Kosmidis and Firth 2021)"

ESTIMATORS = {
    "lognormal": Estimator(
        f"maximum binomial likelihood of a lognormal curve through stripes (Baker 2015); {_SEPARATED}",
        LOGNORMAL,
        fit_probit,
        partial(influences_of_cells, PROBIT),
    ),
    "logit": Estimator(
        f"maximum binomial likelihood of a loglogistic curve through stripes (logit of ln intensity); {_SEPARATED}",
        LOGLOGISTIC,
        fit_logit,
        partial(influences_of_cells, LOGIT),
    ),
    "ordinal": Estimator(
        "maximum multinomial likelihood of lognormal curves of one dispersion through stripes (cumulative probit, "
        "McCullagh 1980)",
        LOGNORMAL,
        fit_ordinal,
        ordinal_influences,
    ),
}


def estimator_of(name: str) -> Estimator:
    """Return the estimator with this name, or raise a ValueError that lists the allowed names.

    Example:
        >>> estimator_of("ordinal").shape.name
        'lognormal'
    """
    one_of("estimator", name, tuple(ESTIMATORS))
    return ESTIMATORS[name]
