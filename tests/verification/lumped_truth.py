"""Independent results of the problems on lumped structures: SciPy and closed forms; nothing here uses warpdyn."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eig, eigh

from .phases import Phases, Spring
from .problem import Outcome
from .solvers import linear_history, modal_damping, refined

STEP, PARTS = 0.01, 20  # s, of a sample of the motions; steps in it
GRAVITY = 9.80665


def pulse(amplitude: float, period: float, decay: float, duration: float = 8.0) -> np.ndarray:
    """Return a decaying sine that ends after 8 s or before, sampled at 10 ms."""
    time = STEP * np.arange(round(duration / STEP) + 1)
    return np.where(time < 8.005, amplitude * np.sin(2 * np.pi * time / period) * np.exp(-decay * time), 0.0)


def rayleigh(mass, stiffness, ratio: float, modes: tuple[int, int]) -> np.ndarray:
    """Return a0 M + a1 K with a damping ratio in two modes, counted from 1."""
    first, second = (np.sqrt(eigh(stiffness, mass, eigvals_only=True))[mode - 1] for mode in modes)
    return 2 * ratio / (first + second) * (first * second * mass + stiffness)


def peak_of(values: np.ndarray) -> float:
    """Return the largest absolute value at the steps."""
    return float(np.abs(values).max())


def shaken(mass, damping, stiffness, pull, motion, parts: int = PARTS, step: float = STEP):
    """Return displacements and total accelerations [time, dof] of a linear structure at the steps of 0.5 ms.

    Args:
        mass, damping, stiffness: Matrices.
        pull: Load mass times influence vectors, shape [dof] or [dof, component].
        motion: Base accelerations at the samples, shape [time] or [time, component].
        parts: Steps in a sample.
        step: Time between samples.
    """
    pull = np.asarray(pull, float).reshape(len(mass), -1)
    dense = refined(np.asarray(motion, float).reshape(len(motion), -1), parts)
    u, v = linear_history(mass, damping, stiffness, -dense @ pull.T, step / parts)
    relative = np.linalg.solve(mass, (-dense @ pull.T - v @ damping.T - u @ stiffness.T).T).T
    return u, relative, dense


# V63
DECK = {"mass": 27215.5422, "width": 9.144, "depth": 6.096, "arm": 0.4572, "a": 1094542.72, "b": 583756.117}


def torsional_storey() -> Outcome:
    """Frequencies by the quadratic of y and theta; history by matrix exponentials."""
    m, half = DECK["mass"], DECK["depth"] / 2
    inertia = m * (DECK["width"] ** 2 + DECK["depth"] ** 2) / 12
    a, b, e = DECK["a"], DECK["b"], DECK["arm"]
    kyy, kyt, ktt = a / m, a * e / np.sqrt(m * inertia), (a * e**2 + 2 * b * half**2) / inertia
    middle, swing = (kyy + ktt) / 2, np.hypot((kyy - ktt) / 2, kyt)
    frequencies = np.sqrt(np.sort([2 * b / m, middle - swing, middle + swing]))
    mass = np.diag([m, m, inertia])
    stiffness = np.array([[2 * b, 0, 0], [0, a, a * e], [0, a * e, a * e**2 + 2 * b * half**2]])
    u, _, _ = shaken(mass, modal_damping(mass, stiffness, 0.05), stiffness, [0, m, 0], pulse(3.0, 1.0, 0.5, 10.0))
    frames = u @ np.array([[0, 1, e], [1, 0, -half]]).T
    values = [*frequencies, peak_of(u[:, 1]), peak_of(u[:, 2]), *(peak_of(each) for each in frames.T)]
    time = STEP / PARTS * np.arange(len(u))
    return Outcome(values, {"displacement in y": (time, u[:, 1])})


# V64
FLOORS = (150e3, 150e3, 120e3)
FRAMES = (("x", 5.0, 60e6, 900e3), ("x", -5.0, 40e6, 600e3), ("y", -9.0, 90e6, 1200e3), ("y", 0.0, 30e6, 400e3))
FRAMES = (*FRAMES, ("y", 9.0, 30e6, 400e3))
SHARES = (1.0, 0.85, 0.65)
RADIUS_SQUARED = (20**2 + 12**2) / 12


def torsional_building() -> Outcome:
    """Bilinear frames: matrix exponentials between located yield and unloading events."""
    mass = np.diag([part for m in FLOORS for part in (m, m, m * RADIUS_SQUARED)])
    springs = []
    for storey, share in enumerate(SHARES):
        for axis, place, k, force in FRAMES:
            row = np.zeros(9)
            own = [1.0, 0.0, -place] if axis == "x" else [0.0, 1.0, place]
            row[3 * storey : 3 * storey + 3] = own
            if storey:
                row[3 * storey - 3 : 3 * storey] = [-each for each in own]
            springs.append(Spring(tuple(row), share * k, share * force, 0.05))
    rows = np.array([spring.row for spring in springs])
    stiffness = rows.T @ np.diag([spring.stiffness for spring in springs]) @ rows
    damping = rayleigh(mass, stiffness, 0.05, (1, 5))
    both = refined(np.stack([pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5)], axis=1), PARTS)
    pull = mass @ np.tile(np.eye(3)[:, :2], (3, 1))
    u, _, forces = Phases(mass, damping, springs).history(-both @ pull.T, STEP / PARTS)
    deformation = u @ rows.T
    frequencies = np.sqrt(eigh(stiffness, mass, eigvals_only=True))
    values = [frequencies[0], frequencies[8], *(peak_of(u[:, dof]) for dof in (6, 7, 8))]
    values += [peak_of(deformation[:, each]) for each in (0, 2, 4)]
    values += [peak_of(forces[:, 4]), peak_of(forces[:, :2].sum(axis=1)), peak_of(forces[:, 2:5].sum(axis=1))]
    time = STEP / PARTS * np.arange(len(u))
    return Outcome(values, {"deformation of the frame at x = 9 m": (time, deformation[:, 4])})


# V65
TOWER = {"storeys": 20, "height": 3.0, "mass": 400e3, "period": 2.0, "alpha0": 4.0}


def hermite_stick(bending: float, shear: float) -> np.ndarray:
    """Return the lateral stiffness of beam elements and shear springs, rotations condensed, shape [floor, floor]."""
    n, h = TOWER["storeys"], TOWER["height"]
    beam = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2]])
    beam = bending / h**3 * np.vstack([beam, -beam[:1], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])
    whole = np.zeros((2 * n + 2, 2 * n + 2))
    for storey in range(n):
        whole[2 * storey : 2 * storey + 4, 2 * storey : 2 * storey + 4] += beam
        ends = [2 * storey, 2 * storey + 2]
        whole[np.ix_(ends, ends)] += shear / h * np.array([[1, -1], [-1, 1]])
    free = whole[2:, 2:]
    lateral, turning = free[::2, ::2], free[1::2, 1::2]
    return lateral - free[::2, 1::2] @ np.linalg.solve(turning, free[1::2, ::2])


def tower() -> Outcome:
    """Hermite beams and shear springs, scaled so that the first period is 2 s; history by matrix exponentials."""
    n, m, top = TOWER["storeys"], TOWER["mass"], TOWER["storeys"] * TOWER["height"]
    mass, unit = m * np.eye(n), hermite_stick(1e11, 1e11 * (TOWER["alpha0"] / top) ** 2)
    scale = (2 * np.pi / TOWER["period"]) ** 2 / eigh(unit, mass, eigvals_only=True)[0]
    stiffness = scale * unit
    periods = 2 * np.pi / np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:5])
    u, relative, ground = shaken(
        mass, modal_damping(mass, stiffness, 0.03), stiffness, np.full(n, m), pulse(2.0, 1.2, 0.4, 12.0)
    )
    drifts = np.diff(u, axis=1, prepend=0.0)
    values = [1e11 * scale, *periods, peak_of(u[:, -1]), peak_of(drifts), peak_of((relative + ground)[:, 9])]
    time = STEP / PARTS * np.arange(len(u))
    return Outcome(values, {"displacement of the top": (time, u[:, -1])})


# V66
OSCILLATORS = ((200e3, 0.8), (350e3, 0.45))
CONTACT = {"stiffness": 93.5e6, "gap": 0.02}
CONTACT_PARTS = 100  # steps of 0.1 ms


def pounding() -> Outcome:
    """Linear contact: matrix exponentials between located touches and separations."""
    masses = np.array([m for m, _ in OSCILLATORS])
    stiffness = np.array([m * (2 * np.pi / period) ** 2 for m, period in OSCILLATORS])
    springs = [Spring(tuple(np.eye(2)[place]), k) for place, k in enumerate(stiffness)]
    springs.append(Spring((1.0, -1.0), CONTACT["stiffness"], gap=CONTACT["gap"]))
    damping = np.diag(2 * 0.05 * np.sqrt(stiffness * masses))
    dense = refined(pulse(6.0, 0.7, 0.4)[:, None], CONTACT_PARTS)
    u, v, forces = Phases(np.diag(masses), damping, springs).history(-dense * masses, STEP / CONTACT_PARTS)
    total = -(v @ damping + forces @ np.array([spring.row for spring in springs])) / masses
    values = [peak_of(u[:, 0]), peak_of(u[:, 1]), peak_of(forces[:, 2]), peak_of(total[:, 0]), peak_of(total[:, 1])]
    time = STEP / CONTACT_PARTS * np.arange(len(u))
    return Outcome(values, {"gap closed by u1 - u2": (time, u[:, 0] - u[:, 1])})


# V67
BRIDGE = {"pier": (40e6, 0.8e6, 0.03), "bearing": (20e6, 0.4e6, 0.10), "abutments": 6e6, "gap": 0.05, "stop": 150e6}


def bridge() -> Outcome:
    """Bilinear pier and bearing, two abutment gaps: matrix exponentials between located events."""
    mass = np.diag([60e3, 800e3])
    springs = [
        Spring((1.0, 0.0), *BRIDGE["pier"]),
        Spring((-1.0, 1.0), *BRIDGE["bearing"]),
        Spring((0.0, 1.0), BRIDGE["abutments"]),
        Spring((0.0, 1.0), BRIDGE["stop"], gap=BRIDGE["gap"]),
        Spring((0.0, -1.0), BRIDGE["stop"], gap=BRIDGE["gap"]),
    ]
    rows = np.array([spring.row for spring in springs])
    initial = np.diag([0.0 if spring.gap else spring.stiffness for spring in springs])
    damping = rayleigh(mass, rows.T @ initial @ rows, 0.05, (1, 2))
    dense = refined(pulse(5.0, 0.9, 0.35, 10.0)[:, None], PARTS)
    u, v, forces = Phases(mass, damping, springs).history(-dense * np.diag(mass), STEP / PARTS)
    total = -(v @ damping + forces @ rows) / np.diag(mass)
    values = [
        peak_of(u[:, 0]),
        peak_of(u[:, 1]),
        peak_of(u @ rows[1]),
        *(peak_of(f) for f in forces[:, [0, 1, 3, 4]].T),
    ]
    time = STEP / PARTS * np.arange(len(u))
    return Outcome([*values, peak_of(total[:, 1])], {"displacement of the deck": (time, u[:, 1])})


# V68
SOIL = {"mass": 500e3, "height": 12.0, "stiffness": 123370055.0, "foundation": 150e3, "inertia": 2.0e6}
SOIL |= {"Kx": 1.80526547e9, "Kr": 7.61376826e10, "cx": 64783675.5, "cr": 207438885.0}


def sway_and_rocking() -> Outcome:
    """Complex modes of the matrices; history by matrix exponentials."""
    m, h, mf, k = (SOIL[name] for name in ("mass", "height", "foundation", "stiffness"))
    mass = np.array([[m, m, m * h], [m, m + mf, m * h], [m * h, m * h, m * h**2 + SOIL["inertia"]]])
    stiffness = np.diag([k, SOIL["Kx"], SOIL["Kr"]])
    damping = np.diag([2 * 0.05 * np.sqrt(k * m), SOIL["cx"], SOIL["cr"]])
    zero, one, inverse = np.zeros((3, 3)), np.eye(3), np.linalg.inv(mass)
    roots = eig(np.block([[zero, one], [-inverse @ stiffness, -inverse @ damping]]))[0]
    first = min(roots[roots.imag > 0], key=abs)
    period = 2 * np.pi / np.sqrt(eigh(stiffness, mass, eigvals_only=True)[0])
    u, _, _ = shaken(mass, damping, stiffness, mass[1], pulse(3.0, 0.5, 0.5))
    peaks = [peak_of(each) for each in u.T]
    values = [period, -first.real / abs(first), *peaks, peak_of(u @ [1, 1, h])]
    time = STEP / PARTS * np.arange(len(u))
    return Outcome(values, {"displacement of the floor": (time, u @ [1, 1, h])})


# V69
BEARING = {"Q": 150e3, "k2": 1.0e6, "uy": 0.04, "radius": 0.1}
PLACES = (1.0, 1.125, 1.25, 1.5, 1.75, 2.0, 2.3, 3.0)  # end of the straight line, then turns of the circle


def isolator_path(form: str) -> np.ndarray:
    """Return the forces [N] of a form of the biaxial Bouc-Wen law at PLACES, shape [place, 2], by DOP853."""
    uy, radius = BEARING["uy"], BEARING["radius"]

    def place(s):
        return np.array([s, 0.0]) if s <= 1 else np.array([np.cos(2 * np.pi * (s - 1)), np.sin(2 * np.pi * (s - 1))])

    def rate(s, z):
        if s <= 1:
            moved = np.array([radius, 0.0])
        else:
            q = 2 * np.pi * (s - 1)
            moved = 2 * np.pi * radius * np.array([-np.sin(q), np.cos(q)])
        if form == "isotropic":
            bracket = 0.5 * (abs(z @ moved) + z @ moved)
        else:
            bracket = 0.5 * (np.abs(z * moved) + z * moved).sum()
        return (moved - z * bracket) / uy

    straight = solve_ivp(rate, (0, 1), [0.0, 0.0], "DOP853", rtol=1e-11, atol=1e-13, max_step=0.01)
    turn = solve_ivp(
        rate, (1, 3), straight.y[:, -1], "DOP853", rtol=1e-11, atol=1e-13, max_step=0.005, dense_output=True
    )
    return np.array([BEARING["Q"] * turn.sol(s) + BEARING["k2"] * radius * place(s) for s in PLACES])


def isolator() -> Outcome:
    """DOP853 along the path; steady state of the isotropic form by its closed form."""
    both = [isolator_path(form) for form in ("isotropic", "park")]
    share = BEARING["uy"] / BEARING["radius"]
    steady = BEARING["Q"] * share + BEARING["k2"] * BEARING["radius"], BEARING["Q"] * np.sqrt(1 - share**2)
    return Outcome([*both[0].ravel(), *both[1].ravel(), *steady])


# V70
SLIDER = {"mass": 100e3, "radius": 2.0, "fast": 0.08, "slow": 0.03, "rate": 50.0, "uy": 0.001}


def friction_slider() -> Outcome:
    """DOP853 in each sample of the motion."""
    m, r, uy = SLIDER["mass"], SLIDER["radius"], SLIDER["uy"]
    weight = m * GRAVITY
    ground = np.stack([pulse(4.0, 1.2, 0.4), pulse(3.0, 0.8, 0.4)], axis=1)

    def friction(v, z):
        return (
            (SLIDER["fast"] - (SLIDER["fast"] - SLIDER["slow"]) * np.exp(-SLIDER["rate"] * np.hypot(*v))) * weight * z
        )

    def rate(t, y, start, slope):
        u, v, z = y[:2], y[2:4], y[4:]
        force = friction(v, z) + weight / r * u
        work = z @ v
        return np.concatenate([v, -force / m - start - slope * t, (v - z * 0.5 * (abs(work) + work)) / uy])

    y, found = np.zeros(6), [np.zeros(6)]
    grid = STEP / PARTS * np.arange(1, PARTS + 1)
    for start, end in itertools.pairwise(ground):
        run = solve_ivp(
            rate, (0, STEP), y, "LSODA", t_eval=grid, rtol=1e-9, atol=1e-12, args=(start, (end - start) / STEP)
        )
        found += list(run.y.T)
        y = run.y[:, -1]
    u, v, z = (np.array(found)[:, part] for part in (slice(0, 2), slice(2, 4), slice(4, 6)))
    force = np.array([friction(speed, each) for speed, each in zip(v, z, strict=True)]) + weight / r * u
    values = [peak_of(u[:, 0]), peak_of(u[:, 1]), peak_of(np.hypot(*u.T)), peak_of(force[:, 0]), peak_of(force[:, 1])]
    return Outcome(values, {"path of the slider": (u[:, 0], u[:, 1])})


# V71
CAR = {"ms": 300.0, "mu": 60.0, "ks": 16000.0, "kt": 190000.0, "cs": 1000.0}
BUMP = {"height": 0.08, "length": 2.0, "speed": 10.0}
CAR_STEP = 0.001


def bump(duration: float = 3.0) -> np.ndarray:
    """Return the vertical acceleration of the road below a wheel that drives over h sin^4(pi x / L), at 1 ms."""
    time = CAR_STEP * np.arange(round(duration / CAR_STEP) + 1)
    q = np.pi * BUMP["speed"] * time / BUMP["length"]
    size = BUMP["height"] * (np.pi * BUMP["speed"] / BUMP["length"]) ** 2
    return np.where(q < np.pi * (1 + 1e-9), size * (2 * np.cos(2 * q) - 2 * np.cos(4 * q)), 0.0)


def quarter_car() -> Outcome:
    """Frequencies of the matrices; history by matrix exponentials."""
    p = CAR
    mass = np.diag([p["ms"], p["mu"]])
    stiffness = np.array([[p["ks"], -p["ks"]], [-p["ks"], p["ks"] + p["kt"]]])
    damping = p["cs"] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    frequencies = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    u, relative, ground = shaken(mass, damping, stiffness, np.diag(mass), bump(), 2, CAR_STEP)
    values = [*frequencies, peak_of((relative + ground)[:, 0]), peak_of(u[:, 0] - u[:, 1]), peak_of(u[:, 1])]
    time = CAR_STEP / 2 * np.arange(len(u))
    return Outcome(values, {"suspension travel": (time, u[:, 0] - u[:, 1])})


# V72
INERTER = {"mass": 1000e3, "period": 2.0, "ratio": 0.02, "mu": 0.02, "beta": 0.1}


def inerter() -> Outcome:
    """Closed form of the optimum; history by matrix exponentials, with the inertance in the mass matrix only."""
    m, mu, beta = INERTER["mass"], INERTER["mu"], INERTER["beta"]
    w = 2 * np.pi / INERTER["period"]
    f = np.sqrt((beta * (1 - mu) + (2 - mu) * (1 + mu)) / (2 * (1 + mu))) / (1 + beta + mu)
    top = (beta + mu) * (beta * (3 - mu) + (4 - mu) * (1 + mu))
    zeta = 0.5 * np.sqrt(top / (2 * (1 + beta + mu) * (beta * (1 - mu) + (2 - mu) * (1 + mu))))
    own = (mu + beta) * m
    kt, ct = own * (f * w) ** 2, 2 * zeta * f * w * own
    k, c = m * w**2, 2 * INERTER["ratio"] * w * m
    mass = np.diag([m, own])
    stiffness, damping = np.array([[k + kt, -kt], [-kt, kt]]), np.array([[c + ct, -ct], [-ct, ct]])
    time = STEP * np.arange(2001)
    motion = np.sin(2 * np.pi * time / 2) * np.exp(-0.1 * time)
    u, relative, ground = shaken(mass, damping, stiffness, [m, mu * m], motion)
    values = [
        kt,
        ct,
        peak_of(u[:, 0]),
        peak_of(u[:, 1]),
        peak_of(u[:, 1] - u[:, 0]),
        peak_of((relative + ground)[:, 0]),
    ]
    return Outcome(values, {"displacement of the structure": (STEP / PARTS * np.arange(len(u)), u[:, 0])})


# V73
ANGLES = (0.0, 30.0, 75.0, 120.0, 210.0)  # degrees
OSCILLATOR = {"mass": 1e5, "stiffness": 2e7, "damping": 1e5}


def angles() -> Outcome:
    """Responses to both components, turned: u_x = cos t u1 + sin t u2, u_y = cos t u2 - sin t u1."""
    p = OSCILLATOR
    one = [np.array([[p[name]]]) for name in ("mass", "damping", "stiffness")]
    u1, u2 = (shaken(*one, [p["mass"]], each)[0][:, 0] for each in (pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5)))
    values, curve = [], []
    for angle in np.radians(ANGLES):
        x, y = np.cos(angle) * u1 + np.sin(angle) * u2, np.cos(angle) * u2 - np.sin(angle) * u1
        values += [peak_of(x), peak_of(y)]
    values.append(peak_of(np.hypot(u1, u2)))
    for angle in np.radians(np.arange(0, 181, 5)):
        curve.append(peak_of(np.cos(angle) * u1 + np.sin(angle) * u2))
    return Outcome(values, {"peak displacement in x": (np.arange(0.0, 181.0, 5.0), np.array(curve))})


# V74
TANK = {"radius": 10.0, "depth": 8.0, "period": 0.15}


def tank() -> Outcome:
    """Housner's formulas; history by matrix exponentials."""
    r, h = TANK["radius"], TANK["depth"]
    liquid = 1000 * np.pi * r**2 * h
    x, y = 0.866 * 2 * r / h, 3.68 * h / (2 * r)
    mi, mc = liquid * np.tanh(x) / x, liquid * 0.230 * 2 * r / h * np.tanh(y)
    hc = h * (1 - (np.cosh(y) - 1) / (y * np.sinh(y)))
    hi = 0.375 * h  # 2 R / H is at least 1.333
    wi, wc = 2 * np.pi / TANK["period"], np.sqrt(3.68 * GRAVITY / (2 * r) * np.tanh(y))
    mass, stiffness = np.diag([mi, mc]), np.diag([mi * wi**2, mc * wc**2])
    damping = np.diag([2 * 0.05 * wi * mi, 2 * 0.005 * wc * mc])
    time = STEP * np.arange(2001)
    u, _, _ = shaken(mass, damping, stiffness, [mi, mc], 2.0 * np.sin(2 * np.pi * time / 4) * np.exp(-0.2 * time))
    shear = u @ stiffness
    values = [mi, mc, hi, hc, 2 * np.pi / wc, peak_of(u[:, 0]), peak_of(u[:, 1])]
    values += [peak_of(shear.sum(axis=1)), peak_of(shear @ [hi, hc])]
    return Outcome(values, {"displacement of the sloshing mass": (STEP / PARTS * np.arange(len(u)), u[:, 1])})
