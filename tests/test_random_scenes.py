"""A small sample of the random scenes; `python tests/random_scenes.py --divided` runs all of them."""

import pytest
from random_scenes import count_case

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.as_shipped,
    pytest.mark.meant_as_given(
        "first_period_over_height", "yield_drift_ratio", "yield_base_shear_coefficient", "damping_ratio", "first_period"
    ),
]


@pytest.mark.parametrize("methods", ["default", "stoermer"])
def test_wrong_samples_are_flagged(methods):
    # Case 11: hysteretic storeys with damage. Of its 240 samples, 2 are more than 5 % wrong by default (stoermer with 2
    # steps in each step of rk4), and 5 by stoermer with the steps of rk4.
    text, counts, silent = count_case(11, methods, is_divided=True)
    assert counts["scenes"] == 240, text
    assert counts["more than 5 % wrong"] > 0
    assert counts["flagged"] < 60
    assert not silent


@pytest.mark.parametrize("methods", ["default", "stoermer"])
def test_division_changes_no_bit_of_isolated_buildings(methods):
    # Case 14: isolators below storeys of a law with many values; the lane of a sample was seen in its energies.
    text, counts, silent = count_case(14, methods, is_divided=True)
    assert counts["scenes run in small blocks, too"] == 240, text
    assert not silent
