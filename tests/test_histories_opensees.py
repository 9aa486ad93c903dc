"""Whole histories beside OpenSees': one of each building, far beyond yield; `opensees_histories.py` runs all."""

import pytest
from method_sources import thorough_unless
from opensees_histories import BUILDINGS, compare

pytestmark = pytest.mark.as_shipped
STEP = 2e-3  # s, of OpenSees: four times that of the whole table


# Force by force, the other laws are held to OpenSees by default.
BY_DEFAULT = ("bilinear, 1 storey", "peak-oriented, 5 storeys")


@pytest.mark.parametrize("name", [thorough_unless(name in BY_DEFAULT, name) for name in BUILDINGS])
@pytest.mark.meant_as_given("lowest_intensity_level", "yield_drift_ratio")  # one level; storeys of GEM's curve
def test_a_yielding_history(name, measured):
    compared = BUILDINGS[name]()
    outcome = compare(compared, record=0, level=compared.levels[1], theirs=STEP)
    p = compared.building.parameters
    assert outcome.theirs.max() > 2 * (p["yield_force"] / p["stiffness"] / p["height"]).max()
    assert outcome.collapses == (False, False)
    # What OpenSees' step leaves. Its Bouc-Wen storeys are of first order in it: 0.3 % and 0.5 % at this one, a quarter
    # of that at a quarter of it.
    measured(
        "peak storey drifts of yielding buildings of 1 to 20 storeys under records",
        truth="the same buildings in OpenSeesPy, whole histories",
        value=outcome.peak_error,
        bound=0.005,
    )
    measured(
        "residual drifts of yielding buildings of 1 to 20 storeys under records, over the peaks",
        truth="the same buildings in OpenSeesPy, whole histories",
        value=outcome.residual_error,
        bound=0.008,
    )
