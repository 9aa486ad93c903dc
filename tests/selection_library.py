"""A synthetic library of 2,000 spectra, and a target without a ground-motion model.

The selected records in `test_record_selection.py` were computed from this library by an independent program that
follows the published code of Baker and Lee (github.com/bakerjw/CS_Selection).
"""

import numpy as np

import warpdyn as wd

PERIODS = np.round(np.geomspace(0.05, 5.0, 20), 6)
PERIODS[13] = 1.0


def median(period):
    return 0.30 * (1 + 1.3 * np.exp(-((np.log(period / 0.2) / 0.7) ** 2))) / (1 + (period / 0.9) ** 1.5)


def sigma(period):
    return 0.60 + 0.05 * np.log(period)


def ln_library():
    """Return ln Sa of 2,000 records, with Sa in g, shape [record, period]."""
    random = np.random.Generator(np.random.PCG64(20251125))
    correlation = wd.spectral_correlation(PERIODS[:, None], PERIODS[None, :])
    factor = np.linalg.cholesky(correlation + 1e-9 * np.eye(20))
    level = 0.8 * random.standard_normal((2000, 1))
    tilt = 0.3 * random.standard_normal((2000, 1)) * np.log(PERIODS)
    residuals = (random.standard_normal((2000, 20)) @ factor.T) * sigma(PERIODS)
    return np.log(0.5 * median(PERIODS)) + level + tilt + residuals
