"""Sources of users' laws and recorders, which identify a run, and the names of parameters."""

import pytest

import warpdyn as wd
from warpdyn.foundations.core.sources import sources_read

LIMIT = 3.0


def reads_a_constant():
    return LIMIT


def reads_it_through_another():
    return reads_a_constant() + LIMIT


@pytest.mark.fast
def test_functions_that_a_function_calls_are_read_once():
    found = sources_read(reads_it_through_another)
    assert found[0].startswith("def reads_it_through_another")
    assert found[1:] == ["LIMIT = 3.0", "def reads_a_constant():\n    return LIMIT\n", "LIMIT = 3.0"]


def scaled(factor):
    """Return a law whose method reads a constant."""

    class _Scaled(wd.laws.Bilinear):
        @staticmethod
        def caution(p):
            return None if factor > 0 else "negative"

    return _Scaled


@pytest.mark.fast
def test_constants_that_a_law_reads_are_part_of_its_text():
    """A killed run must not resume with another value of a constant."""
    texts = [scaled(factor).written for factor in (1.0, 0.5)]
    assert texts[0] != texts[1]
    assert "factor = 0.5" in texts[1]
    assert "co_code" not in texts[1]
    assert "\\x" not in texts[1]  # no bytecode


@pytest.mark.fast
@pytest.mark.parametrize("name", ["gravity_load", "drift_capacity", "peak_storey_drift", "sample", "input_energy"])
def test_a_parameter_may_not_have_the_name_of_something_else(name):
    with pytest.raises(TypeError, match=f"parameter '{name}' has the name of a property of buildings"):
        type("Named", (wd.laws.Law,), {"__annotations__": {name: float}, name: wd.laws.parameter("N", "a force")})
