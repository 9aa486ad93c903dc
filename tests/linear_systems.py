"""Linear structures and loads whose exact responses are known, for tests of methods."""

import numpy as np
from matrices import chain_matrix, modal_damping_matrix

import warpdyn as wd
from warpdyn.truth import piecewise_linear_response

# Three storeys of 9, 29 and 45 rad/s, and their matrices; the storeys' dampers are not proportional to anything.
MASS, STIFFNESS, DAMPER = np.array([2e3, 1.5e3, 1e3]), np.array([1.2e6, 9e5, 5e5]), np.array([2e4, 1e3, 9e3])


MATRIX = chain_matrix(STIFFNESS)
OMEGA = np.sqrt(np.linalg.eigvals(MATRIX / MASS[:, None]).real)
OMEGA.sort()
PERIOD = 2 * np.pi / OMEGA[0]
RAYLEIGH = 0.1 / (OMEGA[0] + OMEGA[1]) * (OMEGA[0] * OMEGA[1] * np.diag(MASS) + MATRIX)
CHAINS = {
    "none": ({}, np.zeros((3, 3))),
    "storey": ({"damping_coefficient": DAMPER}, chain_matrix(DAMPER)),
    "rayleigh": ({"damping_ratio": 0.05}, RAYLEIGH),
    "modal": ({"damping_ratio": 0.05}, modal_damping_matrix(MASS, MATRIX, 0.05)),
}
# In storey drifts for displacements M, C and K are full or of other entries, and base motion acts on the first alone.
DRIFTS = np.tril(np.ones((3, 3)))


def chain(damping):
    return wd.ShearBuilding(MASS, STIFFNESS, 3.0, damping=damping, **CHAINS[damping][0])


def dense(damping, transform=DRIFTS):
    matrices = (transform.T @ matrix @ transform for matrix in (np.diag(MASS), CHAINS[damping][1], MATRIX))
    return wd.LinearSystem(*matrices, influence=np.linalg.solve(transform, np.ones(3)))


def oscillator(omega, ratio):
    return wd.LinearSystem([[2.0]], [[4 * ratio * omega]], [[2 * omega**2]])


def simulate(structure, excitation, step, method="exact", dtype="float64", every=1, **scene):
    """Return a run of one sample with its whole history, and its displacement, velocity and acceleration."""
    scene = wd.Scene(structure, excitation, **scene)
    kept = wd.Histories((0,), every)
    run = wd.simulate(scene, step=step, method=method, dtype=dtype, device="cpu", histories=kept)
    assert run.status.item() == 0
    return run, [run[name].values[0] for name in ("displacement", "velocity", "acceleration")]


def close(values, exact, tolerance, largest=None):
    """Compare values with exact ones, relative to a scale, which is the largest exact value by default."""
    np.testing.assert_allclose(values, exact, rtol=0, atol=tolerance * (largest or np.abs(exact).max()))


INTERVAL, TAIL = 0.05, 1.0
NOISE = np.random.default_rng(5).normal(size=(41, 3))
FORCE = {"base": -np.outer(NOISE[:, 0], MASS), "force": 1e3 * NOISE, "free": np.zeros((41, 3))}
START = np.array([0.01, -0.02, 0.04]), np.array([0.5, -0.2, 0.3])


def sampled_load(kind, transform):
    return {
        "base": wd.GroundMotion(NOISE[:, 0], INTERVAL),
        "force": wd.ForceHistory(FORCE["force"] @ transform, INTERVAL),
        "free": wd.FreeVibration(2.0 + TAIL, *(np.linalg.solve(transform, values) for values in START)),
    }[kind]


def exact_with_tail(damping, kind, step):
    """Return exact displacement and velocity under a load that drops to zero at its end, and in free vibration then."""
    at = np.linspace(0, 2.0, round(2.0 / step) + 1)
    force = np.stack([np.interp(at, INTERVAL * np.arange(41), column) for column in FORCE[kind].T], axis=1)
    start = START if kind == "free" else ()
    driven = piecewise_linear_response(MASS, damping, MATRIX, force, step, *start)
    rest = np.zeros((round(TAIL / step) + 1, 3))
    free = piecewise_linear_response(MASS, damping, MATRIX, rest, step, driven[0][-1], driven[1][-1])
    return [np.concatenate([a[:-1], b]) for a, b in zip(driven[:2], free[:2], strict=True)], force
