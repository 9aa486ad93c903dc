"""Hostile arguments in a small sample of `tests/random_calls.py`, of the calls that compile nothing."""

import numpy as np
import pytest
import random_calls
from sound_calls import without_runs

pytestmark = [pytest.mark.fast, pytest.mark.filterwarnings("ignore")]
SOUND = ("refused by name", "accepted", "accepted with a warning")


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    return without_runs(tmp_path_factory.mktemp("files"))


def test_many_functions_are_called(calls):
    assert len({call[0] for call in calls.values()}) >= 80


def test_sound_calls_are_accepted(calls):
    for function, arguments in calls.values():
        function(**arguments)


@pytest.mark.parametrize("start", range(0, 1000, 250))
def test_each_call_is_accepted_or_refused_by_the_name_of_an_argument(calls, start):
    found = [each for each in random_calls.trials(calls, start, start + 250) if "outcome" in each]
    assert len(found) == 250
    assert not [each for each in found if each["outcome"] not in SOUND]


@pytest.mark.parametrize("name", ["masked array", "complex array", "list of bools", "list with nan", "object array"])
def test_no_law_takes_values_that_are_no_numbers(calls, name):
    """The acceptances that would change a result: a mask, an imaginary part or a truth value that is dropped."""
    for of in ("laws.Bilinear", "laws.Gap", "laws.FrictionPendulum", "ShearBuilding", "GroundMotion", "GivenValues"):
        function, arguments = calls[of]
        for argument, given in arguments.items():
            if isinstance(given, float | list | np.ndarray):
                spoilt = arguments | {argument: random_calls.HOSTILE[name]()}
                assert random_calls.outcome((function, spoilt), spoilt, [argument])[0] == "refused by name"
