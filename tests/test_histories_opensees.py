"""Whole histories beside OpenSees': one of each kind; `opensees_histories.py` runs all."""

import pytest
from opensees_histories import BUILDINGS, compare


@pytest.mark.parametrize("name", BUILDINGS)
def test_a_yielding_history(name):
    outcome = compare(BUILDINGS[name](), record=9, level=1.5, longest_step=1e-3)
    assert outcome.theirs.max() > 0.002
    assert outcome.collapses == (False, False)
    # What is left by OpenSees' step of 1 ms, and by ours of 2.5 ms.
    assert outcome.peak_error < 0.002
    assert outcome.residual_error < 0.002
