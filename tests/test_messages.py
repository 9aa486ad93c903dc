"""Warnings of a block that repeats some work."""

import warnings

import pytest

from warpdyn.foundations.core.messages import each_warning_once, no_warnings, warn_caller

pytestmark = pytest.mark.fast


def told(*messages: str) -> list[str]:
    """Return those of these warnings that are given within one block."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        with each_warning_once():
            for message in messages:
                warn_caller(message)
    return [str(each.message) for each in found]


def test_numbers_make_no_other_warning_but_names_do():
    first, again = "3 of 1,000 samples failed at 1.5e-03 s", "12 of 2,000 samples failed at 2e-05 s"
    assert told(first, again) == [first]
    of_states = [f"no level is placed for {name}" for name in ("'DS1'", "'DS2'", "'1'", "'2'")]
    assert told(*of_states, *of_states) == of_states


def test_suppressed_warnings_can_be_given_later():
    def tried_first() -> None:
        with each_warning_once():
            with no_warnings():
                warn_caller("afterwards")
            warn_caller("afterwards")

    with pytest.warns(UserWarning, match="afterwards") as found:
        tried_first()
    assert len(found) == 1
