"""Errors of period, against closed forms; steps of a scatter's stiff samples, against the exact propagator."""

import warnings

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.engine.methods.period_error import accurate_step, error_of_a_cycle
from warpdyn.engine.methods.table import METHODS

# Leading terms of the relative period error over w h (Bathe and Wilson 1973; Hairer, Norsett and Wanner for RK4).
LEADING = {"central_difference": (2, 1 / 24), "newmark_average": (2, 1 / 12), "rk4": (4, 1 / 120)}


@pytest.mark.fast
@pytest.mark.parametrize("name", LEADING)
def test_period_errors(name):
    power, factor = LEADING[name]
    for x in (0.05, 0.1):
        # The next term is of x^2 relative to it; RK4's decay is x^5 / 144 of a cycle.
        expected = 2 * np.pi * factor * x**power
        assert error_of_a_cycle(METHODS[name], x) == pytest.approx(expected, rel=0.01)


@pytest.mark.fast
def test_accurate_steps():
    period, cycles = np.array([0.1, 0.1, 2.0]), np.array([10.0, 40.0, 10.0])
    steps = accurate_step(METHODS["newmark_average"], period, cycles, 0.05)
    # 2 pi n (w h)^2 / 12 = 0.05; tabulated steps are 2 % apart.
    np.testing.assert_allclose(steps, period / (2 * np.pi) * np.sqrt(0.6 / (2 * np.pi * cycles)), rtol=0.03)
    assert np.isinf(accurate_step(METHODS["exact"], period, cycles, 0.05)).all()


@pytest.mark.meant_as_given("no_damping")
def test_stiff_samples_of_a_wide_scatter():
    # The step of the middle, 5 ms, is too long for the shortest periods: 18 % off before, all with status ok.
    random = np.random.default_rng(0)
    time = np.arange(0, 30, 0.01)
    motion = wd.GroundMotion(random.normal(size=time.size) * np.exp(-(((time - 8) / 6) ** 2)), 0.01)
    period = 0.5 * np.exp(0.7 * random.normal(size=64))
    building = wd.ShearBuilding(1e5, 1e5 * (2 * np.pi / 0.5) ** 2, 3.0)
    scatter = {"stiffness": wd.GivenValues(1e5 * (2 * np.pi / period) ** 2)}
    scene = wd.Scene(building, motion, scatter=scatter, recorders=("drift",))
    settings = {"structures": period.size, "dtype": "float64", "device": "cpu"}
    exact = wd.simulate(scene, method="exact", longest_step=1e-3, **settings).peak_storey_drift

    def error(found):
        return float((np.abs(found.peak_storey_drift - exact) / exact).max())

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        divided = wd.simulate(scene, method="central_difference", **settings)
    assert np.unique(divided.integration_step).size > 1
    assert error(divided) < 0.05  # the phase error that is allowed
    with pytest.warns(
        UserWarning, match=r"too long for the first period of \d+ of 64 samples: the method's period error"
    ):
        given = wd.simulate(scene, method="central_difference", longest_step=0.005, **settings)
    assert error(given) > 0.1
