"""Problems of random vibration: variances of 8,192 to 16,384 histories compared with covariance equations."""

from __future__ import annotations

import numpy as np

import warpdyn as wd

from . import random_truth as truth
from .chains_truth import SEED
from .problem import SCIPY, Outcome, Problem, Row, series
from .runs import AS_GIVEN, storey

GROUP = "Random vibration"
REASON = (
    "The difference is divided by the standard error of a sample variance, s²√(2/n). The tolerance of 4 standard "
    "errors is "
    "exceeded by 1 of 16,000 correct results; the seed is fixed."
)


@AS_GIVEN
def variances(structure, spectrum, duration: float, samples: int, every: int) -> np.ndarray:
    """Return the mean squares of the displacements of all samples, shape [time, dof]; method rk4 at the nodes."""
    noise = wd.FilteredNoise(spectrum, duration, truth.INTERVAL)
    histories = wd.Histories(range(samples), every=every)
    run = wd.simulate(
        wd.Scene(structure, noise, recorders=(), tail=0.0),
        structures=samples, seed=1, method="rk4", step=truth.INTERVAL, dtype="float64", histories=histories,
        device="cpu",
    )  # fmt: skip
    return (run["displacement"].values ** 2).mean(axis=0)


def oscillator() -> wd.ShearBuilding:
    """Return the oscillator of 1 Hz with 5 % damping."""
    return storey(1.0, truth.OMEGA**2, damping="storey", damping_coefficient=2 * truth.RATIO * truth.OMEGA)


def white_noise() -> Outcome:
    """`FilteredNoise(WhiteNoise(0.01))`."""
    found = variances(oscillator(), wd.WhiteNoise(truth.INTENSITY), 10.0, truth.SAMPLES, 25)[:, 0]
    times = 0.5 * np.arange(1, 21)
    return Outcome([found[round(t / 0.5)] for t in truth.TIMES], {"variance": (times, found[1:21])})


def kanai_tajimi() -> Outcome:
    """`FilteredNoise(KanaiTajimi(0.01, 15, 0.6))` after 12 s, when the transient is below 1e-3."""
    spectrum = wd.KanaiTajimi(truth.INTENSITY, *truth.GROUND)
    return Outcome([variances(oscillator(), spectrum, 12.0, truth.SAMPLES, 600)[1, 0]])


def seed_frame() -> Outcome:
    """Three storeys under `WhiteNoise(0.01)` after 20 s."""
    building = wd.ShearBuilding(SEED["mass"], 20e3, 3.0, damping="storey", damping_coefficient=30.0)
    return Outcome(variances(building, wd.WhiteNoise(truth.INTENSITY), truth.SEED_TIME, truth.SEED_SAMPLES, 1000)[1])


NOISE = ("intensity S₀ (two-sided, over circular frequency)", "0.01", "m²/s³")
PROBLEMS = (
    Problem(
        "V49",
        "Oscillator under white noise from rest",
        GROUP,
        SCIPY,
        "Covariance recursion with matrix exponentials. The stationary variance under ideal white noise is "
        "πS₀/(2ζω³) = 1.2665e-3 m²; noise that is linear between nodes at 0.02 s has 0.9974 of it.",
        "Variance of the displacement of 16,384 oscillators under different motions.",
        (
            ("circular frequency", "2π", "rad/s"),
            ("damping ratio", "0.05", ""),
            NOISE,
            ("method and step", "rk4, 0.02 s", ""),
        ),
        series("variance of u({} s)", truth.TIMES, "m²"),
        ("oscillator", {"damper": True, "load": "a_g(t)"}),
        truth.white_noise,
        white_noise,
        4.0,
        REASON,
        scale="error",
        axes={"variance": ("time [s]", "variance of the displacement [m²]")},
    ),
    Problem(
        "V50",
        "Oscillator under Kanai and Tajimi's ground motion",
        GROUP,
        SCIPY,
        "Lyapunov equation of ground filter and oscillator (scipy.linalg.solve_continuous_lyapunov): 1.6825e-3 m².",
        "Variance of the displacement in the stationary state.",
        (
            ("circular frequency", "2π", "rad/s"),
            ("damping ratio", "0.05", ""),
            NOISE,
            ("ground frequency and damping", "15 rad/s, 0.6", ""),
            ("method and step", "rk4, 0.02 s", ""),
        ),
        [Row("stationary variance of u", "m²")],
        ("oscillator", {"damper": True, "load": "a_g(t)"}),
        truth.kanai_tajimi,
        kanai_tajimi,
        4.0,
        REASON,
        scale="error",
    ),
    Problem(
        "V51",
        "Three-storey frame under white noise",
        GROUP,
        SCIPY,
        "Covariance recursion with matrix exponentials. The stationary standard deviations are 0.0953, 0.1610 and "
        "0.1902 m.",
        "The frame of problem V18 under a random base acceleration; variances after 20 s, before the stationary state.",
        (
            ("masses", "200, 150, 100", "kg"),
            ("storey stiffness and dampers", "20000 N/m, 30 N s/m", ""),
            NOISE,
            ("method and step", "rk4, 0.02 s", ""),
        ),
        [Row(f"variance of u{dof}(20 s)", "m²") for dof in (1, 2, 3)],
        ("chain", {"masses": 3, "motion": True}),
        truth.seed_frame,
        seed_frame,
        4.0,
        REASON,
        scale="error",
    ),
)
