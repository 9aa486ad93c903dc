"""A small sample of the random scenes; `python tests/random_scenes.py` runs all of them."""

import pytest
from random_scenes import count_case


@pytest.mark.thorough
@pytest.mark.as_shipped
@pytest.mark.meant_as_given(
    "first_period_over_height", "yield_drift_ratio", "yield_base_shear_coefficient", "damping_ratio", "first_period"
)
def test_wrong_samples_are_flagged():
    # Case 11: hysteretic storeys with damage; 6 of its 240 samples were more than 5 % wrong.
    text, counts, silent = count_case(11)
    assert counts["scenes"] == 240, text
    assert counts["more than 5 % wrong"] > 0
    assert counts["flagged"] < 60
    assert not silent
