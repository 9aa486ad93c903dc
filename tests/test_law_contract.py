"""The contract of storey laws and devices, which every class of `warpdyn.engine.laws` must satisfy.

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
    ELEMENTS,
    NOISE,
    ROWS,
    STIFFNESS,
    STOREYS,
    YIELD_DRIFT,
    YIELD_FORCE,
    answers,
    change_by_noise,
    coefficients_read,
    drawn_building,
    drawn_storeys,
    storeys_of,
)
from law_rows import VARIANTS

import warpdyn as wd
from warpdyn import laws
from warpdyn.campaigns.running.certification.certify import certificate
from warpdyn.campaigns.running.certification.checks import Checks, path_checks
from warpdyn.campaigns.running.certification.paths import STEPS
from warpdyn.campaigns.running.pushing.loops import LONGEST_STEP
from warpdyn.engine.laws import LAWS
from warpdyn.engine.laws.springs import spring_row

UNITS = re.compile(r"1|(N|m|s|kg|rad)(-?\d)?( (N|m|s|kg|rad)(-?\d)?)*")
EVERY = pytest.mark.parametrize("name", ELEMENTS)
EVERY_ROW = pytest.mark.parametrize(("name", "row"), ROWS)
LAW_ROWS = pytest.mark.parametrize(("name", "row"), [pair for pair in ROWS if pair[0] in LAWS])
SHOWN = ("bilinear", "bouc_wen_1", "takeda", "gap")  # one for each kind of memory, and a device


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
    found = storeys_of(name, row).coefficients
    assert found.shape == (len(names), STOREYS)
    assert not np.isnan(found).any()
    lacking = {key: value for key, value in element.named_coefficients(p, row).items() if key != names[-1]}
    shorter = type("_Shorter", (element,), {"named_coefficients": staticmethod(lambda p, row: lacking)})
    with pytest.raises(TypeError, match=f"differs in .*{names[-1]}"):
        shorter.coefficients(p, row)


def test_device_functions_that_read_another_number_of_coefficients_are_refused():
    fewer = replace(VARIANTS["bilinear"], coefficients=("hardening_stiffness", "yield_drift"))
    with pytest.raises(TypeError, match="'bilinear' read 3 coefficients, but their law names 2"):
        spring_row(fewer)


@EVERY_ROW
def test_paths(name, row):
    storeys = storeys_of(name, row)
    checks = Checks(storeys.element)
    path_checks(storeys, checks)
    assert not [check.cells() for check in checks.found if not check.passed]
    if spring_row(storeys.rules).leaves_line is not None:
        assert (answers(name, row)["leaves_line"] == 0).mean() > 0.3  # lines are followed


@pytest.mark.parametrize(
    ("name", "row"), [pytest.param(*pair, marks=() if pair[1] in SHOWN else pytest.mark.thorough) for pair in ROWS]
)
def test_certificates(name, row):
    report = certificate(name, storeys_of(name, row))
    assert report.passed, str(report)


@EVERY_ROW
def test_the_public_face_shows_the_same_forces(name, row):
    building, storeys = drawn_building(name, row), storeys_of(name, row)
    path, expected = storeys.path(), answers(name, row)["force"]
    if name in LAWS and building.storey_law.forces().has_rate and "yield_force" in building.parameters:
        # Longer steps than a quarter of the yield drift are divided (test_hysteresis_steps.py), so take shorter ones.
        yield_drift = building.parameters["yield_force"] / building.parameters["stiffness"]
        longest = (np.abs(np.diff(path, axis=0)) / yield_drift).max()
        path = storeys.path(int(np.ceil(STEPS * longest / LONGEST_STEP)) + 1)
        expected = storeys.answers(path)["force"]
    found = wd.storey_hysteresis(building, path)
    beside = 0.0 if name in LAWS else STIFFNESS * path
    np.testing.assert_allclose(found.storey_force - beside, expected, rtol=0, atol=1e-6 * YIELD_FORCE)
    assert np.isfinite(found.dissipated_energy).all()


@pytest.mark.parametrize(
    ("name", "row"), [pair for pair in ROWS if pair[0] in LAWS and LAWS[pair[0]].is_linear_until_yield]
)
def test_a_law_that_says_so_is_linear_until_it_yields(name, row):
    building = drawn_building(name, row)
    p = building.parameters
    last = p["yield_force"] / p["stiffness"] if "yield_force" in p else np.full(building.storeys, YIELD_DRIFT)
    last = np.minimum(last, p.get("yield_force_negative", np.inf) / p["stiffness"])
    drift = 0.999 * last * np.sin(np.arange(200) * 0.37)[:, None] * np.linspace(0.1, 1, 200)[:, None]
    force = wd.storey_hysteresis(building, drift)["storey_force"].values
    # Parallel springs add up to the stiffness except for rounding.
    np.testing.assert_allclose(force, p["stiffness"] * drift, rtol=1e-9, atol=1e-9 * (p["stiffness"] * last).max())
