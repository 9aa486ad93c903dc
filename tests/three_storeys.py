"""Three unequal storeys and their loads, and implicit methods in full matrices as a reference for the kernels."""

from types import SimpleNamespace

import numpy as np
from matrices import chain_matrix
from scipy.linalg import eigh
from scipy.optimize import root

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.engine.methods.table import METHODS

IMPLICIT = [name for name, method in METHODS.items() if method.kind == "implicit"]
# The damping that yielding chains under base motion have, by method.
YIELDING_DAMPING = {name: ("modal", "storey", "rayleigh")[i % 3] for i, name in enumerate(IMPLICIT)}


def simulate(structure, excitation, step, method, dtype="float64", **scene):
    """Return a run of one sample with its whole history."""
    scene = wd.Scene(structure, excitation, **scene)
    histories = wd.Histories((0,))
    run = wd.simulate(scene, step=step, method=method, dtype=dtype, device="cpu", histories=histories)
    assert run.status.item() == 0
    assert np.isclose(run.integration_step.item(), step)
    return run


def histories(structure, excitation, step, method, dtype="float64", **scene):
    """Return the time [s] and the whole histories of one sample, from the kernel of histories alone."""
    scene = wd.Scene(structure, excitation, **scene)
    run, _ = prepare(scene, structures=1, step=step, method=method, dtype=dtype, device="cpu")
    assert np.isclose(run.schedule.step.item(), step)
    time, kept = run.integrate_histories((0,), 1, step)
    assert all(np.isfinite(values).all() for values in kept.values())
    return SimpleNamespace(time=time, **{name: values[0] for name, values in kept.items()})


# Storeys of 9, 29 and 45 rad/s that yield to ductilities of 3 and more.
MASS, STIFFNESS = np.array([2000.0, 1500.0, 1000.0]), np.array([1.2e6, 9e5, 5e5])
HEIGHT, COEFFICIENT, RATIO = np.array([10.0, 3.0, 3.5]), np.array([4e3, 3e3, 2e3]), 0.05
STRENGTH, HARDENING = np.array([8e3, 5e3, 2.4e3]), np.array([0.05, 0.1, 0.15])
DAMPING = {
    "none": {},
    "storey": {"damping_coefficient": COEFFICIENT},
    "rayleigh": {"damping_ratio": RATIO},
    "modal": {"damping_ratio": RATIO},
}
# Ends with a jump, and what follows it is free vibration.
MOTION, INTERVAL, TAIL = 3 * np.sin(np.arange(41) * 0.7) * np.hanning(41) + 1.0, 0.05, 0.6
AMPLITUDE, FREQUENCY, PHASE = np.array([3e3, 0, 2e3]), 12.0, 0.3
START = np.array([0.01, 0.02, 0.04]), np.array([0.5, -0.2, 0.3])


def building(law, damping):
    strength = {"yield_force": STRENGTH, "hardening_ratio": HARDENING} if law != "elastic" else {}
    return wd.ShearBuilding(MASS, STIFFNESS, HEIGHT, law=law, damping=damping, **DAMPING[damping], **strength)


EIGENVALUE, SHAPES = eigh(chain_matrix(STIFFNESS), np.diag(MASS))
FIRST, SECOND, _ = OMEGA = np.sqrt(EIGENVALUE)
# By textbook formulas.
DAMPING_MATRIX = {
    "none": np.zeros((3, 3)),
    "storey": chain_matrix(COEFFICIENT),
    "rayleigh": 2 * RATIO / (FIRST + SECOND) * (FIRST * SECOND * np.diag(MASS) + chain_matrix(STIFFNESS)),
    "modal": (MASS[:, None] * SHAPES * (2 * RATIO * OMEGA)) @ (SHAPES.T * MASS),
}


def loading(load, step):
    """Return the excitation, and the nodal forces at the start and the end of each step [step, 2, dof]."""
    substeps, tail = round(INTERVAL / step), round(TAIL / step)
    if load in ("base", "force"):
        nodes = np.outer(MOTION, -MASS if load == "base" else [1e3, 2e3, 1e3])
        fine = np.arange(substeps * 40 + 1) / substeps
        force = np.stack([np.interp(fine, np.arange(41), column) for column in nodes.T], axis=1)
        steps = np.stack([force[:-1], force[1:]], axis=1)
        steps = np.concatenate([steps, np.zeros((tail, 2, 3))])
        excitation = wd.GroundMotion(MOTION, INTERVAL) if load == "base" else wd.ForceHistory(nodes, INTERVAL)
        return excitation, steps
    if load == "harmonic":
        time = step * np.arange(round(2 / step) + 1)
        force = np.outer(np.sin(FREQUENCY * time + PHASE), AMPLITUDE)
        return wd.HarmonicForce(AMPLITUDE, FREQUENCY, 2.0, PHASE), np.stack([force[:-1], force[1:]], axis=1)
    return wd.FreeVibration(2.0, *START), np.zeros((round(2 / step), 2, 3))


def march(name, law, damping, loads, step, u, v):
    """Return the response step by step in full matrices, with the acceleration at each step's end from scipy."""
    method, viscous = METHODS[name], DAMPING_MATRIX[damping]
    strength = STRENGTH if law == "bilinear" else np.full(3, np.inf)
    lag, reach, beta, gamma = method.force_lag, method.extension * step, method.beta, method.gamma

    def storeys(u, plastic):
        drift = np.diff(u, prepend=0)
        plastic = np.clip(plastic, drift - strength / STIFFNESS, drift + strength / STIFFNESS)
        hardening = HARDENING if law == "bilinear" else 0.0
        return STIFFNESS * (hardening * drift + (1 - hardening) * (drift - plastic)), plastic

    def resisting(u, v, plastic):
        force, _ = storeys(u, plastic)
        return force - np.append(force[1:], 0) + viscous @ v

    plastic = np.zeros(3)
    before = loads[0, 0]
    a = (before - resisting(u, v, plastic)) / MASS
    rows = [(u, v, storeys(u, plastic)[0])]
    for start, end in loads:
        a = a + (start - before) / MASS
        before, beyond = end, start + method.extension * (end - start)

        def state(a_end, reach, u=u, v=v, a=a):
            return u + reach * v + reach**2 * ((0.5 - beta) * a + beta * a_end), v + reach * (a + gamma * (a_end - a))

        def unbalanced(a_end, u=u, v=v, a=a, start=start, beyond=beyond, plastic=plastic, state=state):
            inertia = MASS * ((1 - method.mass_lag) * a_end + method.mass_lag * a)
            forces = (1 - lag) * (resisting(*state(a_end, reach), plastic) - beyond)
            return (inertia + forces + lag * (resisting(u, v, plastic) - start)) / MASS

        found = root(unbalanced, a, tol=1e-14).x
        assert np.abs(unbalanced(found)).max() < 1e-10 * max(1, np.abs(found).max())
        a_next = a + (found - a) / method.extension
        u, v = state(a_next, step)
        a = a_next
        force, plastic = storeys(u, plastic)
        rows.append((u, v, force))
    return SimpleNamespace(**dict(zip(("u", "v", "force"), map(np.array, zip(*rows, strict=True)), strict=True)))
