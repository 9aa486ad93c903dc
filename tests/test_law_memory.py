"""Laws with memories of several values: carried by every method as well as those with one, and as scipy does."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import warp as wp
from scipy.integrate import solve_ivp

import warpdyn as wd
from warpdyn.engine.laws import LAWS, Bilinear
from warpdyn.engine.laws.bilinear.device_functions import SPRINGS as BILINEAR_ROWS
from warpdyn.engine.laws.spring import Spring

MASS, STIFFNESS, STRENGTH = np.array([1e5, 1e5, 8e4]), np.array([8e7, 6e7, 5e7]), np.array([2.2e5, 1.8e5, 1.2e5])
SHAKE = wd.GroundMotion(2.5 * np.sin(np.arange(300) * 0.37) * np.random.default_rng(5).normal(size=300), 0.02)
FADING = 0.05  # how much weaker a storey is for each unit of energy lost, yield force times yield drift


# The bilinear storey with its plastic drift last, behind how far it ever flowed and how often it was asked.
@wp.func
def counting_evolve(drift: Any, memory: Any, c: Any):
    after = type(memory)()
    after[2] = wp.clamp(memory[2], drift - c[2], drift + c[2])
    after[1] = memory[1] + type(drift)(1.0)
    after[0] = memory[0] + wp.abs(after[2] - memory[2])
    return after


@wp.func
def counting_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift + c[1] * (drift - wp.clamp(memory[2], drift - c[2], drift + c[2]))


@wp.func
def counting_recoverable(drift: Any, memory: Any, c: Any):
    elastic = drift - memory[2]
    return type(drift)(0.5) * (c[0] * drift * drift + c[1] * elastic * elastic)


@wp.func
def counting_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return wp.where(wp.abs(drift - before[2]) < c[2], c[0] + c[1], c[0])


@wp.func
def counting_advance(drift: Any, increment: Any, memory: Any, c: Any):
    return counting_evolve(drift, memory, c)


# A Bouc-Wen storey, n = 1, that fades with the energy it lost: memory of that energy, then of z.
@wp.func
def fading_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift + c[1] * memory[1] / (type(drift)(1.0) + type(drift)(FADING) * memory[0])


@wp.func
def fading_rate(velocity: Any, memory: Any, c: Any):
    slope = type(memory)()
    slope[0] = c[2] * memory[1] * velocity
    slope[1] = c[2] * velocity - type(velocity)(0.5) * c[2] * (
        memory[1] * wp.abs(velocity) + wp.abs(memory[1]) * velocity
    )
    return slope


@wp.func
def fading_recoverable(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * c[0] * drift * drift


@wp.func
def fading_advance(drift: Any, increment: Any, memory: Any, c: Any):
    half = type(increment)(0.5)
    k1 = fading_rate(increment, memory, c)
    k2 = fading_rate(increment, memory + half * k1, c)
    k3 = fading_rate(increment, memory + half * k2, c)
    k4 = fading_rate(increment, memory + k3, c)
    return memory + (k1 + type(increment)(2.0) * (k2 + k3) + k4) / type(increment)(6.0)


@wp.func
def fading_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    direction = wp.where(increment < type(increment)(0.0), type(increment)(-1.0), type(increment)(1.0))
    slope = fading_rate(direction, after, c)
    return c[0] + c[1] * direction * slope[1] / (type(drift)(1.0) + type(drift)(FADING) * after[0])


SPRINGS = {
    "counting": Spring(counting_force, counting_evolve, counting_recoverable, 3, counting_tangent, 3, counting_advance),
    "fading": Spring(fading_force, None, fading_recoverable, 3, fading_tangent, 2, fading_advance, fading_rate),
}


class Counting(Bilinear):
    device_functions = __name__
    rows = {"counting": Bilinear.rows["bilinear"]}  # noqa: RUF012


class Fading(Bilinear):
    device_functions = __name__
    rows = {"fading": ("hardening_stiffness", "hysteretic_force", "rate")}  # noqa: RUF012

    @staticmethod
    def named_coefficients(p, row):
        stiffness, strength, hardening = p["stiffness"], p["yield_force"], p["hardening_ratio"]
        return {
            "hardening_stiffness": hardening * stiffness,
            "hysteretic_force": (1 - hardening) * strength,
            "rate": stiffness / strength,
        }


for law in (Counting, Fading):  # other tests take the laws of warpdyn alone
    del LAWS[law.name]


@pytest.fixture(autouse=True)
def rows(monkeypatch):
    for law in (Counting, Fading):
        monkeypatch.setitem(LAWS, law.name, law)


def run(law, method, step, dtype="float64"):
    building = wd.ShearBuilding(
        MASS, STIFFNESS, 3.0, law=law, yield_force=STRENGTH, hardening_ratio=0.05,
        damping="storey", damping_coefficient=2e5,
    )  # fmt: skip
    scene = wd.Scene(building, SHAKE, tail=0.0, recorders=("drift", "energy"))
    kept = wd.Histories((0,))
    return wd.simulate(scene, structures=3, method=method, step=step, dtype=dtype, device="cpu", histories=kept)


@pytest.mark.parametrize(
    ("method", "dtype"),
    [
        pytest.param("rk4", "float64", marks=pytest.mark.thorough),
        ("newmark_average", "float64"),
        pytest.param("dormand_prince54", "float64", marks=pytest.mark.thorough),
        pytest.param("central_difference", "float32", marks=pytest.mark.thorough),
        pytest.param("rk4", "float32", marks=pytest.mark.thorough),
        pytest.param("newmark_average", "float32", marks=pytest.mark.thorough),
        pytest.param("nystroem4", "float64", marks=pytest.mark.thorough),
    ],
)
def test_a_plastic_drift_among_other_values(method, dtype):
    one, other = (run(law, method, 0.002, dtype) for law in ("bilinear", "counting"))
    assert BILINEAR_ROWS["bilinear"].memory == 1
    # The same rules; only fused operations differ.
    tolerance = {"float32": 1e-4, "float64": 1e-12}[dtype] * np.abs(one.displacement).max().item()
    np.testing.assert_allclose(other.displacement, one.displacement, rtol=0, atol=tolerance)
    np.testing.assert_allclose(other.hysteretic_energy, one.hysteretic_energy, rtol={"float32": 1e-3}.get(dtype, 1e-9))
    assert other.status.values.tolist() == [0, 0, 0]
    assert (one.hysteretic_energy > 10).all()


@pytest.fixture(scope="module")
def by_scipy():
    """Displacements of fading storeys, sample by sample of the record, and the energy that each storey lost."""
    state, found = np.zeros(12), [np.zeros(3)]

    def rate(t, y, begin, end):
        u, v, lost, z = np.split(y, 4)
        drift, speed = np.diff(u, prepend=0.0), np.diff(v, prepend=0.0)
        force = 0.05 * STIFFNESS * drift + 0.95 * STRENGTH * z / (1 + FADING * lost) + 2e5 * speed
        base = begin + (end - begin) * t / SHAKE.step
        growth = STIFFNESS / STRENGTH * (speed - (z * np.abs(speed) + np.abs(z) * speed) / 2)
        loss = STIFFNESS / STRENGTH * z * speed
        return np.concatenate([v, np.diff(force, append=0.0) / MASS - base, loss, growth])

    for ends in pairwise(SHAKE.acceleration):
        state = solve_ivp(rate, (0, SHAKE.step), state, "DOP853", args=ends, rtol=1e-9, atol=1e-9).y[:, -1]
        found.append(state[:3])
    return np.array(found), state[6:9]


@pytest.mark.parametrize(
    ("method", "tolerance"),
    # Corners at each turn leave second order, of 70 rad/s in steps of 0.5 ms.
    [
        ("rk4", 5e-5),
        pytest.param("dormand_prince54", 5e-5, marks=pytest.mark.thorough),
        pytest.param("nystroem4", 5e-5, marks=pytest.mark.thorough),
        pytest.param("newmark_average", 2e-3, marks=pytest.mark.thorough),
    ],
)
def test_a_storey_that_fades_with_the_energy_it_lost(method, tolerance, by_scipy):
    expected, lost = by_scipy
    assert (FADING * lost > 0.25).all()  # it matters: a storey ends at four fifths of its strength or less
    found = run("fading", method, SHAKE.step if method == "dormand_prince54" else 5e-4)
    displacement = found.displacement.values[0]
    displacement = displacement[:: (len(displacement) - 1) // (len(expected) - 1)]
    error = np.abs(displacement - expected).max() / np.abs(expected).max()
    assert error < tolerance
    assert abs(found.energy_balance_error.values[0]) < 1e-3
