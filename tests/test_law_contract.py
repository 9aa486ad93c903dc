"""The contract of storey laws and devices: what every class of `warpdyn.engine.laws` must fulfil.

Energy is in test_law_passivity.py, straight branches over long paths in test_law_branches.py, names and objects in
test_law_objects.py; all of them take every law of the table.
"""

import doctest
import importlib
import inspect
import re
import textwrap

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

import warpdyn as wd
from warpdyn import laws
from warpdyn.engine.laws import DEVICES, LAWS, springs
from warpdyn.engine.laws.law import StoreyElement
from warpdyn.engine.laws.springs import DEVICE_SPRINGS, SPRINGS

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


def test_every_row_belongs_to_a_law():
    assert set(SPRINGS) == {row for law in LAWS.values() for row in law.rows}
    assert set(DEVICE_SPRINGS) == {row for device in DEVICES.values() for row in device.rows}


@EVERY_ROW
def test_coefficients_are_what_the_device_functions_read(name, row):
    element = ELEMENTS[name]
    names, p = element.rows[row], drawn_storeys(name, row)
    assert len(set(names)) == len(names) == springs.spring_row(row).coefficients
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
    shorter = type("Shorter", (element,), {"named_coefficients": staticmethod(lambda p, row: lacking)})
    with pytest.raises(TypeError, match=f"differs in .*{names[-1]}"):
        shorter.coefficients(p, row)


def test_a_row_that_reads_another_number_of_coefficients_is_refused(monkeypatch):
    monkeypatch.setattr(LAWS["bilinear"], "rows", {"bilinear": ("hardening_stiffness", "yield_drift")})
    with pytest.raises(TypeError, match="row 'bilinear' reads 3 coefficients; 'bilinear' names 2"):
        springs._find_rows.__wrapped__("bilinear")  # the tables in use stay as they are


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
    spring = springs.spring_row(row)
    if spring.rate is None:
        np.testing.assert_allclose(found["trial"], found["force"], rtol=0, atol=ROUNDING)
    if spring.return_mapping is not None:
        assert found["unlike_advance"].max() == 0
    assert found["recoverable"].min() > -1e-9 * YIELD_FORCE * YIELD_DRIFT


@EVERY_ROW
def test_lines_are_the_rules_where_nothing_is_decided(name, row):
    found = answers(name, row)
    spring = springs.spring_row(row)
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
    limit = 2e-2 if springs.spring_row(row).rate is not None else 1e-4
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


PARAMETERS = '''
    """A toy law."""

    import enum

    from numpy.typing import ArrayLike

    from warpdyn.engine.laws.law import Law, Layout, parameter


    class Coefficient(Layout):
        """What the device functions read."""

        STIFFNESS = enum.auto()
        SOFTENING = enum.auto()


    class Cubic(Law):
        """A storey that softens with the cube of its drift, F = k d - s d^3.

        Example:
            >>> Cubic(softening=1e3)
            Cubic(softening=1000.0)
        """

        softening: ArrayLike = parameter("N m-3", "softening of the storey", low=0.0)

        rows = {"cubic": Coefficient.names()}

        @staticmethod
        def named_coefficients(p, row):
            return {"stiffness": p["stiffness"], "softening": p["softening"]}
'''
DEVICE_FUNCTIONS = '''
    """Device functions of a toy law."""

    from typing import Any

    import warp as wp

    from warpdyn.engine.laws.cubic.parameters import Coefficient as C
    from warpdyn.engine.laws.spring import Spring


    @wp.func
    def cubic_force(drift: Any, memory: Any, c: Any):
        return c[C.STIFFNESS] * drift - c[C.SOFTENING] * drift * drift * drift


    @wp.func
    def cubic_recoverable(drift: Any, memory: Any, c: Any):
        half, quarter = type(drift)(0.5), type(drift)(0.25)
        return (half * c[C.STIFFNESS] - quarter * c[C.SOFTENING] * drift * drift) * drift * drift


    @wp.func
    def cubic_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        return c[C.STIFFNESS] - type(drift)(3.0) * c[C.SOFTENING] * drift * drift


    SPRINGS = {"cubic": Spring(cubic_force, None, cubic_recoverable, coefficients=len(C), tangent=cubic_tangent)}
'''


@pytest.mark.meant_as_given("no_damping", "strongest_motion")
def test_a_law_is_one_folder(tmp_path, monkeypatch):
    folder = tmp_path / "cubic"
    folder.mkdir()
    for name, text in {"__init__": "", "parameters": PARAMETERS, "device_functions": DEVICE_FUNCTIONS}.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(text).lstrip())
    monkeypatch.setattr(laws, "__path__", [*laws.__path__, str(tmp_path)])
    (new,) = set(laws.find(laws.Law)) - set(LAWS)
    monkeypatch.setitem(LAWS, new, laws.find(laws.Law)[new])
    monkeypatch.setitem(
        SPRINGS, new, importlib.import_module("warpdyn.engine.laws.cubic.device_functions").SPRINGS[new]
    )
    cubic = LAWS["cubic"]
    assert issubclass(cubic, StoreyElement)
    drift = np.array([0.0, 0.01, -0.02])
    building = wd.ShearBuilding([2e3, 1e3], 4e5, 3.0, law=cubic(softening=[1e8, 0.0]))
    force = wd.storey_hysteresis(building, drift).storey_force.values
    np.testing.assert_allclose(force[:, 0], 4e5 * drift - 1e8 * drift**3, rtol=1e-14)
    np.testing.assert_allclose(force[:, 1], 4e5 * drift, rtol=1e-14)
    motion = wd.GroundMotion(0.5 * np.sin(np.arange(100) * 0.2), 0.02)
    run = wd.simulate(wd.Scene(building, motion), structures=2, step=0.005, device="cpu")
    assert run.status.values.tolist() == [0, 0]


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
    # Springs side by side add up to the stiffness but for rounding.
    np.testing.assert_allclose(force, p["stiffness"] * drift, rtol=1e-9, atol=1e-9 * (p["stiffness"] * last).max())
