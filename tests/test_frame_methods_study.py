"""The study of methods for frames with hinges: elastic errors are those of the recurrence of each method."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT, documented_commands, run_study
from labels import check_labels
from matplotlib import image
from scipy.linalg import expm

import warpdyn as wd

sys.path.insert(0, str(ROOT / "studies"))
from parts.four_storey_frame.frame import COEFFICIENTS, MASSES, frame_and_hinges

END, LEVEL, INTERVAL = 2.0, 0.3, 0.01  # s, factor of the record at the level "elastic", s
FLOORS = len(MASSES)


class LinearFrame:
    """The floors of the frame with its initial stiffness, u'' = -C u' - K u - a(t), at rest at the start."""

    def __init__(self) -> None:
        frame, _ = frame_and_hinges()
        plain, softened = (frame.lumped(p_delta=p_delta) for p_delta in (False, True))
        given = {name: values[None] for name, values in plain.parameters.items()}
        mass = np.diag(MASSES)
        damping = COEFFICIENTS[0] * mass + COEFFICIENTS[1] * plain.stiffness_matrices(given)[0]
        stiffness = softened.central_matrices(dict(softened.parameters))["stiffness"]
        self.damping, self.stiffness = np.linalg.solve(mass, damping), np.linalg.solve(mass, stiffness)
        [record] = [each for each in wd.records.far_field() if "LOS270" in each.name]
        self.load = LEVEL * record.values[: round(END / record.step) + 1]

    def acceleration(self, u: np.ndarray, v: np.ndarray, load: float) -> np.ndarray:
        return -self.stiffness @ u - self.damping @ v - load

    def slope(self, x: np.ndarray, load: float) -> np.ndarray:
        return np.concatenate([x[FLOORS:], self.acceleration(x[:FLOORS], x[FLOORS:], load)])

    def drifts(self, method: Callable[..., Iterator[np.ndarray]], step: float) -> np.ndarray:
        """Return the storey drifts at multiples of INTERVAL, shape [time, storey]."""
        loads = np.interp(np.arange(0, END + step / 4, step / 2), INTERVAL * np.arange(len(self.load)), self.load)
        found = [u for u, _ in zip(method(self, loads, step), range(round(END / step)), strict=False)]
        return np.diff(np.array(found)[round(INTERVAL / step) - 1 :: round(INTERVAL / step)], axis=1, prepend=0.0)

    def exact_drifts(self) -> np.ndarray:
        """Return the storey drifts at multiples of INTERVAL by the matrix exponential; the load is linear between."""
        size = 2 * FLOORS
        whole = np.zeros((size + 2, size + 2))
        whole[:size, :size] = np.stack([self.slope(unit, 0.0) for unit in np.eye(size)], axis=1)
        whole[FLOORS:size, size], whole[size, size + 1] = -1.0, 1.0
        step, x, found = expm(INTERVAL * whole), np.zeros(size), []
        for load, following in zip(self.load[:-1], self.load[1:], strict=True):
            x = (step @ np.concatenate([x, [load, (following - load) / INTERVAL]]))[:size]
            found.append(x[:FLOORS])
        return np.diff(np.array(found), axis=1, prepend=0.0)


def rk4(frame: LinearFrame, loads: np.ndarray, h: float) -> Iterator[np.ndarray]:
    x = np.zeros(2 * FLOORS)
    for first, middle, last in zip(loads[:-2:2], loads[1:-1:2], loads[2::2], strict=True):
        k1 = frame.slope(x, first)
        k2 = frame.slope(x + h / 2 * k1, middle)
        k3 = frame.slope(x + h / 2 * k2, middle)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + frame.slope(x + h * k3, last))
        yield x[:FLOORS]


def heun(frame: LinearFrame, loads: np.ndarray, h: float) -> Iterator[np.ndarray]:
    x = np.zeros(2 * FLOORS)
    for first, last in zip(loads[:-2:2], loads[2::2], strict=True):
        k1 = frame.slope(x, first)
        x = x + h / 2 * (k1 + frame.slope(x + h * k1, last))
        yield x[:FLOORS]


def velocity_verlet(frame: LinearFrame, loads: np.ndarray, h: float) -> Iterator[np.ndarray]:
    u = v = np.zeros(FLOORS)
    for first, last in zip(loads[:-2:2], loads[2::2], strict=True):
        a = frame.acceleration(u, v, first)
        u = u + h * v + h**2 / 2 * a
        v = v + h / 2 * (a + frame.acceleration(u, v + h * a, last))
        yield u


def leapfrog(frame: LinearFrame, loads: np.ndarray, h: float) -> Iterator[np.ndarray]:
    u = np.zeros(FLOORS)
    change = h**2 / 2 * frame.acceleration(u, u, loads[0])
    before = -change
    for load in loads[2::2]:
        u = u + change
        yield u
        a = frame.acceleration(u, (1.5 * change - 0.5 * before) / h, load)
        before, change = change, change + h**2 * a


def newmark(frame: LinearFrame, loads: np.ndarray, h: float) -> Iterator[np.ndarray]:
    u = v = a = np.zeros(FLOORS)  # OpenSees starts with the acceleration 0, also if the load is not 0 at the start
    solved = np.eye(FLOORS) + h / 2 * frame.damping + h**2 / 4 * frame.stiffness
    for last in loads[2::2]:
        u, v = u + h * v + h**2 / 4 * a, v + h / 2 * a
        a = np.linalg.solve(solved, frame.acceleration(u, v, last))
        u, v = u + h**2 / 4 * a, v + h / 2 * a
        yield u


RECURRENCES = {
    "rk4": rk4,
    "rk4, float32": rk4,
    "heun": heun,
    "velocity_verlet": velocity_verlet,
    "leapfrog": leapfrog,
    "Newmark (OpenSees)": newmark,
}
# Errors are drifts over the largest drift. float64: the study's reference is rk4 with a step 32 times as short as
# 0.005 s, at which its error is 2e-5, so the error of the reference is 2e-5 / 32^4 = 2e-11. float32: 400 steps round by
# 6e-8 each, which adds up to 1.2e-6 if the signs are random. OpenSees: the iterations end with increments of 1e-7 m,
# and the largest drift is 3.5e-4 m.
TOLERANCES = {"rk4, float32": 1.5e-6, "Newmark (OpenSees)": 3e-4}


@pytest.mark.thorough  # it compiles ten kernels
def test_study(tmp_path: Path) -> None:
    (command,) = (c for c in documented_commands() if "studies/frame_methods.py" in c)
    done = run_study(f"{command} --end {END:g} --steps 2", tmp_path, has_device=False)
    assert done.returncode == 0, done.stderr
    assert image.imread(tmp_path / "frame_methods.png").shape[0] > 500
    frame = LinearFrame()
    exact = frame.exact_drifts()
    with xr.open_dataset(tmp_path / "frame_methods.nc") as result:
        check_labels(result)
        assert (result["seconds_per_history"] > 0).all()
        elastic = result["error"].sel(level="elastic").to_pandas()
    assert set(elastic.index) == set(RECURRENCES)
    for method, recurrence in RECURRENCES.items():
        due = [np.abs(frame.drifts(recurrence, h) - exact).max() / np.abs(exact).max() for h in elastic.columns]
        np.testing.assert_allclose(elastic.loc[method], due, rtol=0, atol=TOLERANCES.get(method, 1e-10), err_msg=method)


@pytest.mark.fast
@pytest.mark.parametrize(("method", "order"), [(rk4, 4), (heun, 2), (velocity_verlet, 2), (leapfrog, 2)])
def test_the_recurrences_have_the_orders_of_their_methods(
    method: Callable[..., Iterator[np.ndarray]], order: int
) -> None:
    frame = LinearFrame()
    exact = frame.exact_drifts()
    coarse, fine = (np.abs(frame.drifts(method, h) - exact).max() for h in (0.00125, 0.000625))
    # The next term of an error is smaller by up to w h = 0.056 (highest mode), and half of this at half the step, so
    # that the logarithm of the ratio of the errors changes by up to 0.028 / ln(2).
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.04)
