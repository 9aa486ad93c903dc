"""Estimators of fragility curves from stripe counts, by name."""

from warpdyn.answers.fragility.estimators.table import (
    ESTIMATORS,
    FIT_MEANINGS,
    LOGLOGISTIC,
    LOGNORMAL,
    CurveShape,
    Estimator,
    estimator_of,
)

__all__ = ["ESTIMATORS", "FIT_MEANINGS", "LOGLOGISTIC", "LOGNORMAL", "CurveShape", "Estimator", "estimator_of"]
