"""The page from a Hazus type to annual loss: its numbers follow from its fragility curves, its hazard and its costs."""

import re
import warnings

import numpy as np
import pandas as pd
import pytest
from pages import RunPage, run_page
from scipy.stats import norm

import warpdyn as wd

# As the page has them, but for a point more: the hazard goes on with its last slope, to 1,000 g. The ratios of Hazus'
# RES3 are of the tables 15.2 to 15.4 of the Hazus-MH manual.
INTENSITY = [0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 1000.0]
RATE = [2.0e-1, 8.0e-2, 3.5e-2, 1.2e-2, 3.0e-3, 5.0e-4, 5.0e-5, 3.0e-6, 1.0e-7]
RATE.append(RATE[-1] * (INTENSITY[-1] / INTENSITY[-2]) ** (np.log(RATE[-1] / RATE[-2]) / np.log(2)))
LOSS_RATIOS = [0.02, 0.1, 0.413, 1.0]
STATES = ["slight", "moderate", "extensive", "complete"]
pytestmark = pytest.mark.as_shipped  # the page runs for seconds


@pytest.fixture(scope="module")
def page() -> RunPage:
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)  # the page warns of nothing
        return run_page("tutorials/hazus_to_loss.md")


def expected_rates(curves: pd.DataFrame) -> np.ndarray:
    """Return annual rates by the trapezoidal rule, from the hazard curve as straight lines of the logarithms."""
    level = np.geomspace(INTENSITY[0], INTENSITY[-1], 20_001)
    hazard = np.exp(np.interp(np.log(level), np.log(INTENSITY), np.log(RATE)))
    median, dispersion = curves["fragility_median_g"].values, curves["fragility_dispersion"].values
    exceeded = norm.cdf(np.log(level / median[:, None]) / dispersion[:, None])
    return -(0.5 * (exceeded[:, 1:] + exceeded[:, :-1]) * np.diff(hazard)).sum(axis=1)


def test_rates_and_losses_follow_from_curves_hazard_and_costs(page: RunPage) -> None:
    assert sum(hasattr(each, "savefig") for each in page.shown) == 4
    curves = pd.read_csv(page.variables["folder"] / "curves.csv").set_index("damage_state").loc[STATES]
    rate = expected_rates(curves)
    # The rule errs by a step of the logarithm squared, 3e-7, times curvatures of about 1 / 0.33^2, and the file has
    # six digits or more of each number.
    np.testing.assert_allclose(page.variables["rates"]["annual_rate"], rate, rtol=3e-5)
    for state, expected in zip(STATES, rate, strict=True):
        period, share = re.search(rf"{state} +once in +(\d+) years, +([\d.]+)% in 50 years", page.printed).groups()
        assert abs(float(period) - 1 / expected) < 0.5 + 1e-4 / expected
        assert abs(float(share) - 100 * -np.expm1(-50 * expected)) < 0.005 + 1e-4

    expected = 1e6 * (-np.diff(rate, append=0.0) @ LOSS_RATIOS)
    best, lower, upper = map(float, re.search(r"loss: (\d+) USD \((\d+) to (\d+)\)", page.printed).groups())
    assert abs(best - expected) < 0.5 + 1e-4 * expected  # printed to 1
    assert lower < best < upper
    # From the table of the vulnerability, which is linear between its intensities.
    assert float(re.search(r"from the table: (\d+)", page.printed)[1]) == pytest.approx(expected, rel=0.01)


def test_files_hold_the_page_s_curves(page: RunPage) -> None:
    folder, curves = page.variables["folder"], page.variables["curves"]
    # The engine interpolates linearly, which errs by at most an eighth of the step squared (0.165 in the logarithm)
    # times curvature and slope: (0.24 / b^2 + 0.4 / b) 0.165^2 / 8 = 0.012 for the least dispersion b of 0.33.
    (taxonomy,) = model = wd.read_nrml_fragility(folder / "fragility.xml")
    discrete = model[taxonomy]["exceedance_fraction"].interp(stripe=curves["fragility_median"].values).values.diagonal()
    np.testing.assert_allclose(discrete, 0.5, rtol=0, atol=0.012)
    assert wd.read_consequences(folder / "consequences.csv")[taxonomy]["extensive"] == LOSS_RATIOS[2]
    assert wd.read_pelicun_demands(folder / "demands.csv").sizes["sample"] == 44 * 8
