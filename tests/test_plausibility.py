"""Mistakes of units and inputs: each gives one warning or an error that names the quantity, before any kernel runs."""

import re
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor

import mistakes
import mistakes_of_devices
import mistakes_of_runs
import numpy as np
import pytest
from mistakes import (
    BUILDINGS,
    DAMPED,
    ISOLATORS,
    PGA,
    RECORDS,
    SHAKEN,
    TALL,
    UNIT_LAW,
    building,
    capacity,
    demands,
    elastic,
    factor,
    imk,
    noise,
    portfolio,
    run,
    scaled,
    sequence,
    strong,
)
from mistakes_of_runs import RUNS

import warpdyn as wd
from warpdyn.campaigns.accuracy import pilot
from warpdyn.campaigns.running import pushover, simulate as door
from warpdyn.engine.kernels import build, queues
from warpdyn.foundations.core.plausibility.table import CHECKS
from warpdyn.model.ground_motions.plausibility import warn_of_implausible_motions
from warpdyn.model.scene.building_plausibility import BuildingView

pytestmark = pytest.mark.fast


CASES = BUILDINGS | SHAKEN | RUNS | mistakes_of_devices.DEVICES


class Reached(Exception):
    """Raised by the first function after the check."""


@pytest.fixture(autouse=True)
def stop_after_the_check(monkeypatch):
    """Stop where the work begins: a mistake must be reported before it."""

    def reached(*arguments, **named):
        raise Reached

    monkeypatch.setattr(door, "Run", reached)
    monkeypatch.setattr(pilot, "choose_method", reached)
    monkeypatch.setattr(pushover, "spring_and_coefficients", reached)
    monkeypatch.setattr(build, "build_kernel", reached)
    monkeypatch.setattr(queues.CpuQueue, "launch", reached)


def findings_of(attempt):
    """Return the warnings of implausible input and the error of a call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            attempt()
        except Reached:
            error = None
        except Exception as refused:
            error = refused
        else:
            error = None
    return [w for w in caught if str(w.message).startswith("implausible input")], error


def test_the_table_is_large():
    assert len(CASES) >= 60


@pytest.mark.parametrize("case", CASES)
def test_no_mistake_is_silent(case):
    attempt, *parts = CASES[case]
    warned, error = findings_of(attempt)
    if isinstance(parts[0], type):
        assert isinstance(error, parts[0])
        text, parts = str(error), parts[1:]
    else:
        assert error is None, error
        (warning,) = warned  # one per run
        assert warning.category is UserWarning
        assert warning.filename in (
            mistakes.__file__,
            mistakes_of_devices.__file__,
            mistakes_of_runs.__file__,
        )  # the line of the user
        text = str(warning.message)
    for part in parts:
        assert part in text


MEANT = {
    "building": lambda: run(),
    "P-Delta": lambda: run(building(gravity_load=9.81 * 2e5), collapse_drift_ratio=0.1),
    "isolated": lambda: run(building().on_isolators(**ISOLATORS)),
    "with a tuned mass damper": lambda: run(building().with_tuned_mass_damper(0.05)),
    "unit oscillator": lambda: run(wd.ShearBuilding(1.0, 100.0, 3.0, **DAMPED)),
    "unit oscillator that yields": lambda: run(wd.ShearBuilding(1.0, 100.0, 3.0, **UNIT_LAW, **DAMPED)),
    "tall": lambda: run(elastic(**TALL)),
    "deteriorating": lambda: run(imk()),
    "stripes": lambda: run(None, wd.Stripes(RECORDS, [0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 6.5], PGA)),
    "stripes of a velocity": lambda: run(None, wd.Stripes(RECORDS, [0.05, 0.3, 1.0], wd.PeakGroundVelocity())),
    "weak aftershock": lambda: run(None, sequence(RECORDS[0], scaled(0.05))),
    "noise": lambda: run(None, noise(1.0)),
    "weak and strong": lambda: run(None, wd.Cloud(strong(0.03, 0.05, 0.08, 0.15, 0.2, 0.35, 0.6))),
    "a pulse": lambda: run(None, wd.GroundMotion(2 * np.sin(np.linspace(0, np.pi, 100)), 0.01)),
    "white noise": lambda: run(None, wd.GroundMotion(np.random.default_rng(1).normal(size=500), 0.01)),
    "a light roof": lambda: run(building(mass=[2e5, 2e5, 2e4])),
    "a penthouse": lambda: run(elastic(**TALL | {"mass": [2e5] * 9 + [2e5 / 60], "stiffness": [3e8] * 9 + [5e6]})),
    "a penthouse on a building that yields": lambda: run(building(mass=[2e5, 2e5, 2e5 / 60])),
    "a shaker": lambda: run(elastic(), wd.HarmonicForce([0.0, 1e4], 6.0, 5.0)),
    "undamped free vibration": lambda: run(wd.ShearBuilding(2e5, 2e8, 3.2), wd.FreeVibration(2.0, velocity=0.1)),
    "scatter": lambda: run(scatter={"mass": factor(1.0, 0.4), "damping_ratio": wd.RandomValue(wd.Uniform(0.02, 0.08))}),
    "98 % of the factors below 10": lambda: run(scatter={"mass": factor(1.0, 1.1)}),
    "portfolio": lambda: run(portfolio(), wd.Cloud(RECORDS)),
    "hazus": lambda: run(wd.ShearBuilding.from_hazus("C1M", "high", storeys=5)),
    "capacity": lambda: capacity(),
    "steps": lambda: run(settings={"step": 0.005}),
    "limits": lambda: wd.fragility(demands(), wd.hazus_drift_limits("W1", "high")),
    "pushover": lambda: wd.pushover(building(), [0.0, 0.3]),
}
MEANT |= mistakes_of_devices.SOUND


@pytest.mark.parametrize("case", MEANT)
def test_plausible_input_gives_no_warning(case):
    warned, error = findings_of(MEANT[case])
    assert error is None, error
    assert not warned


@pytest.mark.parametrize("type_", ["W1", "S1H", "C2L", "URMM", "PC2H", "MH"])
@pytest.mark.parametrize("level", ["high", "pre"])
def test_hazus_buildings_are_plausible(type_, level):
    storeys = {"L": 2, "M": 5, "H": 12}.get(type_[-1], 1) if type_ not in ("W1", "MH") else 1
    if type_ == "URMM":
        storeys = 3
    warned, error = findings_of(lambda: run(wd.ShearBuilding.from_hazus(type_, level, storeys)))
    assert error is None
    assert not warned


def test_periods_and_damping_ratios_are_those_of_a_uniform_chain():
    # Of n equal storeys with dashpots of a times their stiffness, a omega / 2 with omega by Rayleigh.
    n, mass, stiffness, a = 4, 2e5, 3e8, 0.008
    coefficient = a * stiffness
    chain = wd.ShearBuilding([mass] * n, stiffness, 3.2, damping="storey", damping_coefficient=coefficient)
    values = {name: np.asarray(value)[np.newaxis] for name, value in chain.parameters.items()}
    view = BuildingView(chain, values, is_shaken=True)
    omega = 2 * np.sqrt(stiffness / mass) * np.sin(np.pi / (2 * (2 * n + 1)))
    np.testing.assert_allclose(view.period, 2 * np.pi / omega, rtol=1e-12)
    np.testing.assert_allclose(view.damping_ratio, a * omega / 2, rtol=1e-12)
    assert not view.needs_damping


def test_meant_as_given_suppresses_the_warning_of_named_quantities():
    mistaken = building(height=3200.0)
    names = re.findall(r"'(\w+)'", str(findings_of(lambda: run(mistaken))[0][0].message).split("meant_as_given(")[1])
    assert "storey_height" in names
    assert set(names) <= set(CHECKS)
    with wd.meant_as_given(*names):
        assert not findings_of(lambda: run(mistaken))[0]
    with wd.meant_as_given("storey_height"):
        (warning,) = findings_of(lambda: run(mistaken))[0]
    assert "storey height" not in str(warning.message)
    assert findings_of(lambda: run(mistaken))[0]


def test_a_function_that_is_meant_as_given_runs_in_several_threads_at_once():
    entered, left = threading.Event(), threading.Event()

    @wd.meant_as_given("storey_height")
    def wait_within(for_what):
        entered.set()
        assert for_what.wait(10)

    second = threading.Event()
    with ThreadPoolExecutor(2) as threads:
        first_call = threads.submit(wait_within, second)
        assert entered.wait(10)
        entered.clear()
        second_call = threads.submit(wait_within, left)
        assert entered.wait(10)
        second.set()  # the block that was entered first is left first
        first_call.result()
        left.set()
        second_call.result()


def test_meant_as_given_needs_its_block():
    with pytest.warns(UserWarning, match=r"'no_damping'\) has no effect alone: write `with ") as caught:
        wd.meant_as_given("no_damping")
    assert caught[0].filename == __file__

    @wd.meant_as_given("storey_height")
    def attempt():
        return findings_of(lambda: run(building(height=3200.0)))[0]

    assert all("storey height at" not in str(attempt()[0].message) for _ in range(2))


def test_names_are_checked():
    with pytest.raises(ValueError, match=r"unknown quantity 'storey_heigth' \(did you mean 'storey_height'\?\)"):
        wd.meant_as_given("storey_heigth").__enter__()
    with pytest.raises(ValueError, match="takes the names of quantities"):
        wd.meant_as_given().__enter__()


def test_the_configuration_of_the_tests_hides_no_warning():
    # In other tests, too, implausible input is an error unless the test is marked.
    with pytest.raises(UserWarning, match="implausible input: storey height at storey 1 is 3200 m"):
        run(building(height=3200.0))


@pytest.mark.parametrize(
    ("factor", "fewest"),
    [
        (9.80665, 40),  # given in m/s2 and read as g: all but the weakest exceed 2 g
        (0.01, 44),
        (1 / 9.80665, 32),  # the strongest ones are then within the range of the others
    ],
)
def test_most_real_records_in_another_unit_are_reported(factor, fewest) -> None:
    records = wd.records.far_field()

    def is_reported(index: int) -> bool:
        motions = list(records)
        wrong = motions[index]
        motions[index] = wd.GroundMotion(factor * wrong.acceleration, wrong.step, wrong.name)
        with warnings.catch_warnings(record=True) as given:
            warnings.simplefilter("always")
            warn_of_implausible_motions(motions)
        return any("peak ground acceleration" in str(each.message) for each in given)

    assert sum(map(is_reported, range(len(records)))) >= fewest


@pytest.mark.parametrize("of", [wd.records.far_field, wd.records.near_field])
def test_real_records_give_no_warning(of) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_implausible_motions(of())
