"""Implicit methods on linear systems: step by step in physical coordinates, and against printed tables."""

import numpy as np
import pytest
from linear_systems import (
    CHAINS,
    DRIFTS,
    FORCE,
    INTERVAL,
    MASS,
    MATRIX,
    START,
    TAIL,
    close,
    dense,
    sampled_load,
    simulate,
)

import warpdyn as wd
from warpdyn.engine.methods.table import METHODS
from warpdyn.truth import harmonic_response

# Steps of several a period, in which a few per cent of the energy go astray.
pytestmark = [pytest.mark.filterwarnings("ignore:the energy balance"), pytest.mark.meant_as_given("record_step")]
IMPLICIT = [name for name, method in METHODS.items() if method.kind == "implicit"]


def step_by_step(method, matrices, load, step, u, v):
    """Walk an implicit method in physical coordinates, as its docstring says; load is [time, 2 ends, dof]."""
    mass, damping, stiffness = matrices
    a = np.linalg.solve(mass, load[0, 0] - damping @ v - stiffness @ u)
    states, end, h = [(u, v)], 1 - method.force_lag, method.extension * step
    for first, last in load:
        at_end = first + method.extension * (last - first)
        new_u, new_v = u + h * v + h**2 * (0.5 - method.beta) * a, v + h * (1 - method.gamma) * a  # but for a's part
        matrix = (1 - method.mass_lag) * mass + end * (method.gamma * h * damping + method.beta * h**2 * stiffness)
        force = end * at_end + method.force_lag * first - method.mass_lag * mass @ a
        force -= damping @ (end * new_v + method.force_lag * v) + stiffness @ (end * new_u + method.force_lag * u)
        new = a + (np.linalg.solve(matrix, force) - a) / method.extension
        u = u + step * v + step**2 * ((0.5 - method.beta) * a + method.beta * new)
        v = v + step * ((1 - method.gamma) * a + method.gamma * new)
        a = new
        states.append((u, v))
    return [np.array(part) for part in zip(*states, strict=True)]


# The compiled kernel differs by method and by load, but not by how they meet.
@pytest.mark.parametrize(
    ("method", "kinds"),
    [(name, ["harmonic"]) for name in IMPLICIT if name not in ("hht_alpha", "wilson_theta")]
    + [
        ("hht_alpha", ["harmonic", "base", "force"]),
        pytest.param("wilson_theta", ["harmonic", "free", "force"], marks=pytest.mark.thorough),
    ],
)
def test_implicit_methods_step_by_step(method, kinds):
    step, matrices = 0.025, (np.diag(MASS), CHAINS["storey"][1], MATRIX)
    turned = [DRIFTS.T @ matrix @ DRIFTS for matrix in matrices]
    amplitude = np.array([3e3, 0, 2e3])
    for kind in kinds:
        time = step * np.arange(121)
        if kind == "harmonic":
            values = np.sin(12 * time + 0.4)[:, None] * amplitude
            load = wd.HarmonicForce(amplitude @ DRIFTS, 12.0, 3.0, 0.4)
        else:
            force = np.vstack([FORCE[kind], np.zeros((20, 3))])
            values = np.stack([np.interp(time, INTERVAL * np.arange(61), column) for column in force.T], axis=1)
            values[80:] = 0
            load = sampled_load(kind, DRIFTS)
        ends = np.stack([values[:-1], values[1:]], axis=1)
        if kind in ("base", "force"):
            ends[79, 1] = FORCE[kind][-1]  # before it drops to zero
        start = START if kind == "free" else np.zeros((2, 3))
        u, v = step_by_step(METHODS[method], matrices, ends, step, *start)
        u, v = (np.linalg.solve(DRIFTS, part.T).T for part in (u, v))
        nodal = values @ DRIFTS if kind in ("force", "harmonic") else np.zeros_like(u)
        felt = np.linalg.solve(turned[0], (nodal - v @ turned[1] - u @ turned[2]).T).T
        seen = felt
        if kind == "force":  # the last force acts at its instant, and not after it
            seen = np.vstack([felt, felt[80]])
            seen[80] += np.linalg.solve(turned[0], FORCE[kind][-1] @ DRIFTS)
            felt = seen[:-1]
        tail = {} if kind in ("free", "harmonic") else {"tail": TAIL}
        run, histories = simulate(dense("storey"), load, step, method, **tail)
        for values, expected in zip(histories, (u, v, felt), strict=True):
            close(values, expected, 1e-12)  # rounding of 120 steps
        close(run.peak_displacement.values[0], np.abs(u).max(axis=0), 1e-12)
        close(run.peak_acceleration.values[0], np.abs(seen).max(axis=0), 1e-12)


# Chopra, Dynamics of Structures, examples 5.1 to 5.4: displacements at 0.1, 0.2, ... 1 s.
CHOPRA = """
newmark_average .0436669 .2326189 .6120711 1.0825427 1.4309539 1.4230782 .9621755 .1907760 -.6043799 -1.1441953
newmark_linear .0299842 .2193335 .6166103 1.1130160 1.4782094 1.4624861 .9514301 .1273056 -.6954310 -1.2208304
central_difference 0 .1913819 .6293343 1.1824847 1.5808089 1.5411733 .9140468 -.0247402 -.8968682 -1.3725788
exact .0327976 .2331704 .6487396 1.1604948 1.5241545 1.4813518 .9245131 .0593134 -.7751554 -1.2718291
"""


@pytest.mark.parametrize("line", CHOPRA.strip().splitlines())
def test_chopra_5_1_to_5_4(line):
    method, *printed = line.split()
    system = wd.LinearSystem([[0.2533]], [[0.1 * np.sqrt(2.533)]], [[10.0]])
    # The printed exact response is to the half-sine itself, not to straight lines between its samples.
    pulse = wd.HarmonicForce([10.0], np.pi / 0.6, 0.6)
    if method != "exact":
        at = np.arange(11)
        pulse = wd.ForceHistory(np.where(at <= 6, 10 * np.sin(np.pi * at / 6), 0.0)[:, None], 0.1)
    tail = {} if method == "exact" else {"tail": 0.0}
    _, (u, v, _) = simulate(system, pulse, 0.1, method, recorders=(), **tail)
    if method == "exact":
        rest = simulate(system, wd.FreeVibration(0.4, u[-1], v[-1]), 0.1, recorders=())[1][0]
        u = np.concatenate([u, rest[1:]])
    np.testing.assert_allclose(u[1:, 0], np.array(printed, dtype=float), rtol=0, atol=0.51e-7)


@pytest.mark.parametrize("method", IMPLICIT)
def test_implicit_methods_are_of_order_2(method):
    errors = []
    for step in (0.002, 0.001):
        load = wd.HarmonicForce([3e3, 0, 2e3], 12.0, 2.0)
        run, (u, v, _) = simulate(dense("storey", np.eye(3)), load, step, method)
        exact = harmonic_response(MASS, CHAINS["storey"][1], MATRIX, [3e3, 0, 2e3], 12.0, 0.0, run.time.values)
        errors.append([np.abs(values - part).max() for values, part in zip((u, v), exact[:2], strict=True)])
    np.testing.assert_allclose(np.log2(np.divide(*errors)), 2, atol=0.05)
