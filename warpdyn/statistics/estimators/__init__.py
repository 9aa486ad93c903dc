"""Estimators of fragility curves from stripe counts, by name."""

from warpdyn.statistics.estimators.table import CURVES, ESTIMATORS, FIT_MEANINGS, CurveShape, Estimator, estimator_of

__all__ = ["CURVES", "ESTIMATORS", "FIT_MEANINGS", "CurveShape", "Estimator", "estimator_of"]
