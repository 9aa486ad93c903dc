"""Independent results of the problems on torsion, soil, equipment and Hazus chains; no warpdyn here."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eig, eigh

from .problem import Outcome
from .solvers import chain, linear_history, modal_damping, peak, refined

PULSE_STEP = 0.01
DECK = {"mass": 27215.5422, "inertia": 273910.716, "a": 1094542.72, "b": 583756.117, "e": 0.4572, "d": 3.048}
TORSION_MASS = np.diag([DECK["mass"], DECK["mass"], DECK["inertia"]])
TORSION_STIFFNESS = np.array(
    [
        [2 * DECK["b"], 0, 0],
        [0, DECK["a"], DECK["a"] * DECK["e"]],
        [0, DECK["a"] * DECK["e"], DECK["a"] * DECK["e"] ** 2 + 2 * DECK["b"] * DECK["d"] ** 2],
    ]
)
SOIL = {"m": 500e3, "h": 12.0, "k": 123370055.0, "mf": 150e3, "i": 2.0e6, "kx": 1.80526547e9, "kr": 7.61376826e10}
SOIL |= {"cx": 64783675.5, "cr": 207438885.0}
EQUIPMENT = (0.001, 0.01)  # mass of the equipment over that of a floor
DESIGN_FORCE = (8964693.22, 8367047.01, 7171754.58, 5378815.93, 2988231.07)


def pulse(size: float, period: float, decay: float, seconds: float) -> np.ndarray:
    """Return A sin(2 pi t / T) exp(-b t) at 0.01 s, shape [time]."""
    time = PULSE_STEP * np.arange(round(seconds / PULSE_STEP) + 1)
    return size * np.sin(2 * np.pi * time / period) * np.exp(-decay * time)


def sway_rocking():
    """Return M, C and K of structure, base sway and rocking."""
    p = SOIL
    m, h = p["m"], p["h"]
    mass = np.array([[m, m, m * h], [m, m + p["mf"], m * h], [m * h, m * h, m * h**2 + p["i"]]])
    damping = np.diag([2 * 0.05 * np.sqrt(p["k"] * m), p["cx"], p["cr"]])
    return mass, damping, np.diag([p["k"], p["kx"], p["kr"]])


def equipped(share: float):
    """Return mass, damping and stiffness of two storeys with tuned equipment on the second floor."""
    mass, stiffness = np.full(2, 100e3), chain(np.full(2, 50e6))
    w = np.sqrt(eigh(stiffness, np.diag(mass), eigvals_only=True)[0])
    own = share * 100e3
    joint = np.array([0, -1.0, 1.0])
    big_k, big_c = np.zeros((3, 3)), np.zeros((3, 3))
    big_k[:2, :2], big_c[:2, :2] = stiffness, modal_damping(mass, stiffness, 0.05)
    big_k += own * w**2 * np.outer(joint, joint)
    big_c += 2 * 0.01 * own * w * np.outer(joint, joint)
    return np.append(mass, own), big_c, big_k


def respond(mass, damping, stiffness, influence, base):
    """Return times and exact displacements [time, dof] under a base acceleration, 20 steps per sample."""
    mass = np.diag(mass) if np.ndim(mass) == 1 else mass
    force = refined(-np.outer(base, mass @ influence), 20)
    return PULSE_STEP / 20 * np.arange(len(force)), linear_history(mass, damping, stiffness, force, PULSE_STEP / 20)[0]


def torsion() -> Outcome:
    """Eigenvalues by scipy, response by matrix exponentials."""
    eigenvalues = eigh(TORSION_STIFFNESS, TORSION_MASS, eigvals_only=True)
    damping = modal_damping(TORSION_MASS, TORSION_STIFFNESS, 0.05)
    time, u = respond(TORSION_MASS, damping, TORSION_STIFFNESS, np.array([0, 1.0, 0]), pulse(3.0, 1.0, 0.5, 10.0))
    frame_a = u[:, 1] + DECK["e"] * u[:, 2]
    values = [*np.sqrt(eigenvalues), peak(u[:, 1]), peak(frame_a), peak(DECK["d"] * u[:, 2]), peak(u[:, 2])]
    return Outcome(values, {"rotation": (time[::10], u[::10, 2])})


def soil_structure() -> Outcome:
    """Complex modes of the state matrix, response by matrix exponentials."""
    mass, damping, stiffness = sway_rocking()
    n, inverse = 3, np.linalg.inv(mass)
    roots = eig(np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]]))[0]
    first = min((root for root in roots if root.imag > 0), key=abs)
    time, u = respond(mass, damping, stiffness, np.array([0, 1.0, 0]), pulse(3.0, 0.5, 0.5, 8.0))
    total = u[:, 0] + u[:, 1] + SOIL["h"] * u[:, 2]
    values = [
        2 * np.pi / abs(first),
        -first.real / abs(first),
        *(peak(each) for each in u.T[:2]),
        peak(total),
        peak(u[:, 2]),
    ]
    return Outcome(values, {"structural deformation": (time[::10], u[::10, 0])})


def tuned_equipment() -> Outcome:
    """Response by matrix exponentials."""
    values, curves = [], {}
    for share in EQUIPMENT:
        time, u = respond(*equipped(share), np.ones(3), pulse(2.0, 0.5, 0.4, 12.0))
        values += [peak(u[:, 1]), peak(u[:, 2] - u[:, 1])]
        if share == EQUIPMENT[0]:
            curves["equipment"] = (time[::10], (u[:, 2] - u[:, 1])[::10])
    return Outcome(values, curves)


def hazus_chain() -> Outcome:
    """K0 = 4 pi^2 lambda m / T^2, lambda = 1/(4 sin^2(pi/22)); V_i = SAy alpha1 m g N (1 - i (i - 1)/(N (N + 1)))."""
    count, mass, period = 5, 1e6, 0.75
    stiffness = 4 * np.pi**2 * mass / period**2 / (4 * np.sin(np.pi / (4 * count + 2)) ** 2)
    below = np.arange(1, count + 1)
    shares = 1 - below * (below - 1) / (count * (count + 1))
    return Outcome([stiffness, *(DESIGN_FORCE[0] * shares), period])
