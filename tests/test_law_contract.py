"""The contract of storey laws and devices: what every class of `warpdyn.engine.laws` must fulfil.

Energy is in test_law_passivity.py, straight branches over long paths in test_law_branches.py, names and objects in
test_law_objects.py; all of them take every law of the table.
"""

import doctest
import importlib
import inspect
import re
from dataclasses import replace

import numpy as np
import pytest
from law_contract import (
    CHORD,
    ELEMENTS,
    NOISE,
    ROWS,
    STIFFNESS,
    STOREYS,
    YIELD_DRIFT,
    YIELD_FORCE,
    answers,
    change_by_noise,
    coefficients_of,
    coefficients_read,
    drawn_building,
    drawn_storeys,
    paths,
)
from law_rows import VARIANTS

import warpdyn as wd
from warpdyn import laws
from warpdyn.engine.laws import LAWS
from warpdyn.engine.laws.springs import spring_row

UNITS = re.compile(r"1|(N|m|s|kg|rad)(-?\d)?( (N|m|s|kg|rad)(-?\d)?)*")
EVERY = pytest.mark.parametrize("name", ELEMENTS)
EVERY_ROW = pytest.mark.parametrize(("name", "row"), ROWS)
LAW_ROWS = pytest.mark.parametrize(("name", "row"), [pair for pair in ROWS if pair[0] in LAWS])
# Forces are rounded where lines begin, up to a hundred yield drifts away.
ROUNDING = 1e-9 * YIELD_FORCE


@LAW_ROWS
def test_rows_that_noise_changes_count_reversals(name, row):
    # A path no steeper than the first part of the backbone changes its force by no more than the noise; steeper
    # reloading and exponents magnify it, to 31 times (pinching4). Reversals that are counted change what follows.
    if not LAWS[name].counts_reversals(drawn_storeys(name, row)):
        assert change_by_noise(name, row) < 100 * NOISE


@pytest.mark.parametrize("name", [name for name, law in LAWS.items() if "counts_reversals" in vars(law)])
def test_laws_that_count_reversals_are_changed_by_noise(name):
    counting = [row for row in LAWS[name].rows if LAWS[name].counts_reversals(drawn_storeys(name, row))]
    assert max(change_by_noise(name, row) for row in counting) > 100 * NOISE
    assert all(LAWS[name].is_sensitive(drawn_storeys(name, row)) for row in counting)


@EVERY
def test_parameters_are_described(name):
    element = ELEMENTS[name]
    for key, parameter in element.parameters.items():
        assert UNITS.fullmatch(parameter.units)
        assert len(parameter.long_name) > 3
        assert not parameter.long_name.endswith(".")
        assert parameter.low <= parameter.high
        if parameter.default is not None:
            assert not parameter.violations(np.array([parameter.default])).any(), f"default of {key}"
        assert f"    {key}: " in element.__doc__
    names = [parameter.long_name for parameter in element.parameters.values()]
    assert len(set(names)) == len(names)


@EVERY
def test_the_class_is_documented(name):
    element = ELEMENTS[name]
    assert getattr(laws, element.__name__) is element
    summary = inspect.getdoc(element).splitlines()[0]
    assert summary.endswith(".")
    assert "Example:" in element.__doc__
    module = importlib.import_module(element.__module__)
    runner = doctest.DocTestRunner()
    for test in doctest.DocTestFinder().find(element, globs=vars(module) | {"wd": wd}):
        runner.run(test)
    assert runner.summarize().failed == 0
    assert runner.summarize().attempted > 0


@EVERY_ROW
def test_coefficients_are_what_the_device_functions_read(name, row):
    element = ELEMENTS[name]
    names, p = element.rows[row], drawn_storeys(name, row)
    assert len(set(names)) == len(names) == spring_row(VARIANTS[row]).coefficients
    read = coefficients_read(row)
    if read is not None:
        assert read <= set(range(len(names))), "coefficients are read that are not given"
        of_other_rows = [coefficients_read(other) for other in element.rows if other != row]
        unread = set(range(len(names))) - read
        assert all(any(place in (other or ()) for other in of_other_rows) for place in unread), "some are never read"
    found = coefficients_of(element, p, row)
    assert found.shape == (len(names), STOREYS)
    assert not np.isnan(found).any()
    lacking = {key: value for key, value in element.named_coefficients(p, row).items() if key != names[-1]}
    shorter = type("_Shorter", (element,), {"named_coefficients": staticmethod(lambda p, row: lacking)})
    with pytest.raises(TypeError, match=f"differs in .*{names[-1]}"):
        shorter.coefficients(p, row)


def test_device_functions_that_read_another_number_of_coefficients_are_refused():
    fewer = replace(VARIANTS["bilinear"], coefficients=("hardening_stiffness", "yield_drift"))
    with pytest.raises(TypeError, match="'bilinear' read 3 coefficients; their law names hardening_stiffness, yield"):
        spring_row(fewer)


@LAW_ROWS
def test_a_small_drift_is_elastic(name, row):
    drift = 1e-9 * YIELD_DRIFT
    force = wd.storey_hysteresis(drawn_building(name, row), [drift, -drift, 0]).storey_force.values
    # What a power of such a drift leaves of the slope.
    np.testing.assert_allclose(force[:2].T, STIFFNESS * drift * np.array([[1, -1]] * STOREYS), rtol=1e-2)


@EVERY_ROW
def test_all_is_finite_and_forces_agree(name, row):
    found = answers(name, row)
    for key, values in found.items():
        assert np.isfinite(values).all(), key
    # Kept force, and the trial force of laws that map their memory, are the force of the accepted step.
    np.testing.assert_allclose(found["held"], found["force"], rtol=0, atol=ROUNDING)
    spring = spring_row(VARIANTS[row])
    if spring.rate is None:
        np.testing.assert_allclose(found["trial"], found["force"], rtol=0, atol=ROUNDING)
    if spring.return_mapping is not None:
        assert found["unlike_advance"].max() == 0
    assert found["recoverable"].min() > -1e-9 * YIELD_FORCE * YIELD_DRIFT


@EVERY_ROW
def test_lines_are_the_rules_where_nothing_is_decided(name, row):
    found = answers(name, row)
    spring = spring_row(VARIANTS[row])
    assert (spring.memory_on_line is None) == (spring.leaves_line is None) == (spring.tangent_on_line is None)
    if spring.memory_on_line is None:
        return
    lines = found["leaves_line"] == 0
    assert lines.mean() > 0.3
    assert found["unlike_mapping"][lines].max() < 1e-9
    # Where a line begins or ends in a step, each of the two slopes there may be given.
    missed = np.abs(found["tangent_on_line"] - found["tangent"])[lines]
    assert (missed < 1e-6 * STIFFNESS).mean() > 0.999


@EVERY_ROW
def test_force_is_continuous(name, row):
    """No step is stiffer than the law says, and falls come from softening alone: shorter steps are smaller."""
    element, found = ELEMENTS[name], answers(name, row)
    stiffest = np.broadcast_to(element.stiffest(drawn_storeys(name, row)), (1, STOREYS))
    steps = np.diff(found["drift"], axis=0)
    rises = np.diff(found["force"], axis=0) * np.sign(steps)
    rises[found["force"][1:] == 0] = 0  # a storey that is exhausted loses its force at once
    assert (rises - stiffest * np.abs(steps)).max() < 1e-3 * YIELD_FORCE
    chord = np.abs(found["force"] - found["behind"])
    chord[found["force"] == 0] = 0
    assert np.quantile(chord, 0.999) < 100 * STIFFNESS * CHORD


@EVERY_ROW
def test_tangents_are_slopes(name, row):
    found = answers(name, row)
    way = np.where(np.diff(found["drift"], axis=0, prepend=0.0) < 0, -CHORD, CHORD)
    slope = (found["force"] - found["behind"]) / way
    missed = np.abs(found["tangent"] - slope) / STIFFNESS
    # Chords lose to rounding, and a step that ends on a corner has another slope behind. A rate law's tangent is that
    # of its equation, the chord that of one step of RK4 along it.
    limit = 2e-2 if spring_row(VARIANTS[row]).rate is not None else 1e-4
    assert (missed < limit).mean() > 0.97
    assert np.median(missed) < 1e-5


@EVERY_ROW
def test_the_public_face_shows_the_same_forces(name, row):
    building = drawn_building(name, row)
    found = wd.storey_hysteresis(building, paths())
    beside = 0.0 if name in LAWS else STIFFNESS * paths()
    np.testing.assert_allclose(
        found.storey_force - beside, answers(name, row)["force"], rtol=0, atol=1e-6 * YIELD_FORCE
    )
    assert np.isfinite(found.dissipated_energy).all()


@pytest.mark.parametrize(
    ("name", "row"), [pair for pair in ROWS if pair[0] in LAWS and LAWS[pair[0]].is_linear_until_yield]
)
def test_a_law_that_says_so_is_linear_until_it_yields(name, row):
    building = drawn_building(name, row)
    p = building.parameters
    last = p["yield_force"] / p["stiffness"] if "yield_force" in p else np.full(building.storeys, YIELD_DRIFT)
    drift = 0.999 * last * np.sin(np.arange(200) * 0.37)[:, None] * np.linspace(0.1, 1, 200)[:, None]
    force = wd.storey_hysteresis(building, drift)["storey_force"].values
    # Springs side by side add up to the stiffness but for rounding.
    np.testing.assert_allclose(force, p["stiffness"] * drift, rtol=1e-9, atol=1e-9 * (p["stiffness"] * last).max())
