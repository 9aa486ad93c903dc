"""Independent results of the problems on chains of masses; nothing here uses warpdyn."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eig, eigh, expm

from .el_centro import STEP, el_centro
from .problem import Outcome
from .solvers import chain, linear_history, modal_damping, peak, refined, top

EIGHT_MASS, EIGHT_SPRING = 10.0, 1e5
FREQUENCIES = (5.0, 5.5, 6.0, 6.5, 7.0, 7.5, 8.0, 40.0)  # Hz
PULSE_TIMES = (
    0.09, 0.184, 0.272, 0.365, 0.455, 0.544, 0.633, 0.724, 0.812, 0.904, 0.993, 1.089, 1.182, 1.271, 1.362, 1.452,
)  # fmt: skip
UNEQUAL = np.array([250.0, *[50.0] * 7, 25.0])
SQUARE_TIMES = (0.02, 0.04, 0.05, 0.06, 0.08, 0.1)
FLOOR, STOREY, HEIGHT, GRAVITY = 45e3, 5.482e6, 4.0, 9.81


def fixed_chain(springs) -> np.ndarray:
    """Return the matrix of a chain between two fixed ends, with one spring more than masses."""
    k = np.asarray(springs, float)
    return np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)


EIGHT = fixed_chain(np.full(9, EIGHT_SPRING))


def eight_masses() -> Outcome:
    """(1/pi) sqrt(k/m) sin(i pi/18)."""
    return Outcome(np.sqrt(EIGHT_SPRING / EIGHT_MASS) / np.pi * np.sin(np.arange(1, 9) * np.pi / 18))


def harmonic_response() -> Outcome:
    """Direct solution of the complex system at each frequency."""
    force = np.eye(8)[3]
    found = []
    for f in FREQUENCIES:
        w = 2 * np.pi * f
        found.append(np.linalg.solve(EIGHT - w**2 * EIGHT_MASS * np.eye(8) + 1j * w * EIGHT / 2000, force)[3])
    grid = np.linspace(4, 9, 201)
    curve = []
    for f in grid:
        w = 2 * np.pi * f
        curve.append(abs(np.linalg.solve(EIGHT - w**2 * EIGHT_MASS * np.eye(8) + 1j * w * EIGHT / 2000, force)[3]))
    values = [part for each in found for part in (each.real, each.imag)]
    return Outcome(values, {"amplitude": (grid, np.array(curve))})


def rectangular_pulse() -> Outcome:
    """One matrix exponential per time: constant force up to 1 s, then free vibration."""
    n = 8
    system = np.zeros((2 * n + 1, 2 * n + 1))
    system[:n, n : 2 * n] = np.eye(n)
    system[n : 2 * n, :n], system[n : 2 * n, n : 2 * n] = -EIGHT / EIGHT_MASS, -EIGHT / 2000 / EIGHT_MASS
    system[n + 3, -1] = 1 / EIGHT_MASS
    loaded = np.append(np.zeros(2 * n), 1.0)
    end = expm(system)[: 2 * n] @ loaded

    def u4(t):
        if t <= 1:
            return (expm(system * t) @ loaded)[3]
        return (expm(system[: 2 * n, : 2 * n] * (t - 1)) @ end)[3]

    time = np.arange(301) * 0.005
    return Outcome([u4(t) for t in PULSE_TIMES], {"displacement of mass 4": (time, np.array([u4(t) for t in time]))})


def complex_modes():
    """Return eigenvalues with positive imaginary parts, and shapes [dof, mode], of the chain with unequal dampers."""
    n, dampers = 8, fixed_chain(UNEQUAL)
    system = np.block([[np.zeros((n, n)), np.eye(n)], [-EIGHT / EIGHT_MASS, -dampers / EIGHT_MASS]])
    roots, shapes = eig(system)
    order = np.argsort(roots.imag)[-n:]
    return roots[order], shapes[:n, order]


def unequal_dampers() -> Outcome:
    """Eigenvalues of the state matrix."""
    roots, _ = complex_modes()
    return Outcome([*(roots.imag / (2 * np.pi)), *(-roots.real / np.abs(roots))])


def square_acceleration() -> Outcome:
    """Modal closed form: q = -G A [(t^2 - 2/w^2)/w^2 + 2 cos(w t)/w^4] for the base acceleration A t^2."""
    eigenvalues, shapes = eigh(chain(np.full(3, 1000.0)))
    w, share = np.sqrt(eigenvalues), shapes.sum(axis=0) * shapes[2]

    def u3(t):
        t = np.asarray(t)[..., None]
        return -(share * 2e5 * ((t**2 - 2 / w**2) / w**2 + 2 * np.cos(w * t) / w**4)).sum(axis=-1)

    time = np.arange(201) * 5e-4
    return Outcome([*(w / (2 * np.pi)), *u3(np.array(SQUARE_TIMES))], {"displacement of the top": (time, u3(time))})


def uniform_modes():
    """Return w, shapes [dof, mode] with mass-normalisation, of five uniform storeys."""
    eigenvalues, shapes = eigh(chain(np.full(5, STOREY)), FLOOR * np.eye(5))
    return np.sqrt(eigenvalues), shapes


def five_storey_modes() -> Outcome:
    """w = 2 sqrt(k/m) sin((2i-1) pi/22), shapes sin((2i-1) j pi/11)."""
    i, j = np.arange(1, 6)[:, None], np.arange(1, 6)
    w = 2 * np.sin((2 * i[:, 0] - 1) * np.pi / 22)
    shapes = np.sin((2 * i - 1) * j * np.pi / 11)
    mass = shapes.sum(axis=1) ** 2 / (shapes**2).sum(axis=1)
    height = (shapes * j).sum(axis=1) / shapes.sum(axis=1)
    return Outcome([*(2 * np.pi / (w * np.sqrt(STOREY / FLOOR))), *w, *mass, *height])


def modal_deformations(w, ratio, gravity=GRAVITY, seconds=15.0):
    """Return times, and D_n(t) of each mode [time, mode] under El Centro, 40 exact steps in each interval."""
    base = refined(gravity * el_centro()[: round(seconds / STEP) + 1, None], 20)
    found = [linear_history([[1.0]], [[2 * ratio * each]], [[each**2]], -base, STEP / 20)[0][:, 0] for each in w]
    return STEP / 20 * np.arange(len(base)), np.stack(found, axis=1)


def modal_peaks(mass, stiffness, heights, ratio):
    """Return peaks of roof, top storey, base shear and moment for each mode and for all of them, and the roof."""
    mass = np.asarray(mass, float)
    eigenvalues, shapes = eigh(chain(stiffness), np.diag(mass))
    w, share = np.sqrt(eigenvalues), shapes.T @ mass
    time, deformation = modal_deformations(w, ratio)
    floors = deformation[:, None] * shapes * share  # [time, floor, mode]
    forces = floors * mass[:, None] * w**2
    responses = (floors[:, -1], forces[:, -1], forces.sum(axis=1), np.einsum("tfm,f->tm", forces, heights))
    table = [[*(peak(each[:, m]) for m in range(len(w))), peak(each.sum(axis=1))] for each in responses]
    return w, np.array(table), (time, responses[0].sum(axis=1))


def five_storey_histories() -> Outcome:
    """Exact modal histories, summed."""
    _, table, (time, roof) = modal_peaks(np.full(5, FLOOR), np.full(5, STOREY), HEIGHT * np.arange(1, 6), 0.05)
    table *= np.array([100, 1e-3, 1e-3, 1e-3])[:, None]
    return Outcome(table.ravel(), {"roof displacement": (time[::5], roof[::5])})


def combinations(w, ratio: float, parts: np.ndarray) -> list[float]:
    """Return SRSS, CQC (Der Kiureghian's coefficient for equal damping ratios) and the absolute sum of modal values."""
    r = w[:, None] / w
    rho = 8 * ratio**2 * (1 + r) * r**1.5 / ((1 - r**2) ** 2 + 4 * ratio**2 * r * (1 + r) ** 2)
    return [float(np.sqrt((parts**2).sum())), float(np.sqrt(parts @ rho @ parts)), float(np.abs(parts).sum())]


def five_storey_spectrum() -> Outcome:
    """Spectral displacements between samples; modal base shears M* w^2 D and their combinations [kN]."""
    w, shapes = uniform_modes()
    deformation = modal_deformations(w, 0.05, seconds=30.0)[1]
    peaks = np.array([peak(each) for each in deformation.T])
    parts = (shapes.sum(axis=0) * FLOOR) ** 2 * w**2 * peaks / 1e3
    return Outcome([*peaks, *combinations(w, 0.05, parts)])


def modal_damping_matrix() -> Outcome:
    """M P diag(2 zeta w) P^T M with scipy's eigenvectors [kN s/cm]."""
    found = modal_damping([2e5, 2e5, 1e5], chain(np.full(3, 1e8)), 0.05) / 1e5
    return Outcome([found[i, j] for i in range(3) for j in range(i, 3)])


def two_storeys() -> Outcome:
    """Exact modal histories of the two-storey building."""
    w, table, (time, top_floor) = modal_peaks([5000.0, 2500.0], [394784.0, 197392.0], np.zeros(2), 0.02)
    values = [*w, *table[0], *(table[2] / 1e3)]
    return Outcome(values, {"top displacement": (time[::5], top_floor[::5])})


SEED = {"mass": np.array([200.0, 150.0, 100.0]), "stiffness": chain(np.full(3, 20e3)), "force": np.array([0, 100.0, 0])}
SEED_TIMES = (0.809, 1.26, 2.013, 10.0)
SEED_STEPS = (1e-2, 5e-3, 1e-3)


def seed_exact(step: float, duration: float = 10.0) -> np.ndarray:
    """Return the displacements [time, dof] by the exponential of state, sin(w t) and cos(w t)."""
    n, w = 3, 10.0
    system = np.zeros((8, 8))
    system[:n, n:6] = np.eye(n)
    system[n:6, :n] = -SEED["stiffness"] / SEED["mass"][:, None]
    system[n:6, n:6] = 0.0015 * system[n:6, :n]
    system[n:6, 6] = SEED["force"] / SEED["mass"]
    system[6, 7], system[7, 6] = w, -w
    over, state = expm(system * step), np.append(np.zeros(7), 1.0)
    found = [state]
    for _ in range(round(duration / step)):
        found.append(over @ found[-1])
    return np.array(found)[:, :n]


def seed_rk4(step: float, duration: float = 10.0) -> np.ndarray:
    """Return the displacements [time, dof] by the classical Runge-Kutta method in NumPy."""
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-SEED["stiffness"] / SEED["mass"][:, None], np.zeros((3, 3))]])
    a[3:, 3:] = 0.0015 * a[3:, :3]
    b = np.append(np.zeros(3), SEED["force"] / SEED["mass"])
    state, found = np.zeros(6), [np.zeros(6)]
    for i in range(round(duration / step)):
        t = i * step
        start, middle, end = (b * np.sin(10 * each) for each in (t, t + step / 2, t + step))
        k1 = a @ state + start
        k2 = a @ (state + step / 2 * k1) + middle
        k3 = a @ (state + step / 2 * k2) + middle
        k4 = a @ (state + step * k3) + end
        state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        found.append(state)
    return np.array(found)[:, :3]


def seed_frame() -> Outcome:
    """Matrix exponentials; errors of a Runge-Kutta method in NumPy."""
    exact = seed_exact(1e-3)
    time = 1e-3 * np.arange(len(exact))
    tops = [top(time, exact[:, dof]) for dof in range(3)]
    at = [exact[round(t / 1e-3), dof] for t in SEED_TIMES for dof in range(3)]
    errors = [np.abs(seed_rk4(step) - seed_exact(step)).max() * 1e6 for step in SEED_STEPS]
    values = [*at, *(abs(u) for _, u in tops), *(t for t, _ in tops), tops[2][1] / tops[0][1], *errors]
    return Outcome(values, {f"displacement u{dof + 1}": (time[:3001:5], exact[:3001:5, dof]) for dof in (0, 2)})
