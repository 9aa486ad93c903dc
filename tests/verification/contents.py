"""Problems of floor spectra and of rigid blocks."""

from __future__ import annotations

import numpy as np

import warpdyn as wd

from . import contents_truth as truth
from .problem import CLOSED, SCIPY, Outcome, Problem, Row
from .runs import AS_GIVEN

GROUP = "Floors and contents"


@AS_GIVEN
def floor_spectra() -> Outcome:
    """Recorder "floor_spectra", rk4 at 0.25 ms."""
    k1, k2 = truth.STIFFNESS
    masses, stiffness = truth.MASS * np.eye(2), np.array([[k1 + k2, -k2], [-k2, k2]])
    matrix = truth.MASS_FACTOR * masses + truth.STIFFNESS_FACTOR * stiffness
    system = wd.LinearSystem(masses, matrix, stiffness)
    time = np.arange(round(truth.DURATION / truth.STEP) + 1) * truth.STEP
    motion = wd.GroundMotion(truth.base_acceleration(time), truth.STEP)
    spectra = wd.FloorSpectra(truth.PERIODS, damping_ratio=0.05)
    scene = wd.Scene(system, motion, recorders=("floor_spectra",), floor_spectra=spectra, tail=0.0)
    run = wd.simulate(scene, method="rk4", step=truth.STEP, dtype="float64", device="cpu")
    values = run["peak_spectral_acceleration"].values[0]
    return Outcome(values.ravel(), {"spectrum of floor 2": (np.array(truth.PERIODS), values[1])})


def rocking() -> Outcome:
    """`rocking_response`."""
    block = wd.RockingBlock(truth.HALF_WIDTH, truth.HALF_HEIGHT)
    w = truth.W_OVER_P * block.frequency
    time = np.linspace(0.0, 2 * np.pi / w, 8001)
    motion = wd.GroundMotion(block.static_acceleration * np.sin(w * time), time[1])
    found = wd.rocking_response(motion, block, truth.AMPLITUDES, device="cpu")
    return Outcome(found["peak_rotation_ratio"].values.ravel())


def sliding() -> Outcome:
    """`sliding_response`."""
    block = wd.SlidingBlock(truth.FRICTION)
    time = np.linspace(0.0, truth.PERIOD / 2, 8001)
    motion = wd.GroundMotion(block.resistance * np.sin(2 * np.pi * time / truth.PERIOD), time[1])
    return Outcome(
        wd.sliding_response(motion, block, truth.RATIOS, device="cpu")["peak_sliding_displacement"].values.ravel()
    )


PROBLEMS = (
    Problem(
        "V75",
        "Floor response spectra of two storeys",
        GROUP,
        SCIPY,
        "Matrix exponentials of the building and of each oscillator.",
        "Pseudo-accelerations of oscillators that the absolute accelerations of the floors drive.",
        (
            ("masses of the floors", "100, 100", "t"),
            ("stiffness of the storeys", "80, 60", "MN/m"),
            ("damping matrix", "0.5 M + 0.002 K", ""),
            ("damping ratio of the oscillators", "0.05", ""),
            ("base acceleration", "3 sin(2πt/0.4) exp(-0.5 t), 6 s", "m/s²"),
            ("method and step", "rk4, 0.25 ms", ""),
        ),
        [Row(f"floor {floor}, T = {period:g} s", "m/s²") for floor in (1, 2) for period in truth.PERIODS],
        ("chain", {"masses": 2, "motion": True, "equipment": True}),
        truth.floor_spectra,
        floor_spectra,
        1e-4,
        "The floor acceleration is linear between steps, whose error (ωh)²/12 is 2e-5 for the second mode.",
        axes={"spectrum of floor 2": ("period [s]", "pseudo-acceleration [m/s²]")},
    ),
    Problem(
        "V76",
        "Rocking block under a sine cycle",
        GROUP,
        SCIPY,
        "DOP853 between impacts, which are found as events.",
        "A nonlinear rocking block (Housner 1963) that returns to rest. The second amplitude leads to an impact at a "
        "large rotation.",
        (
            ("half width and half height", "0.25, 1.0", "m"),
            ("restitution", "1 - 1.5 sin² alpha = 0.911765", ""),
            ("base acceleration", "one cycle a sin(5 p t)", "m/s²"),
            ("amplitude a / (g tan alpha)", "1.5, 2.5", ""),
        ),
        [Row(f"largest rotation / alpha, amplitude {each:g}", "1") for each in truth.AMPLITUDES],
        ("oscillator", {"damper": False, "load": "a_g(t)"}),
        truth.rocking,
        rocking,
        1e-5,
        "The motion is sampled at 1/8000 of its period, and the peak of the reference is that of a parabola.",
        scale="value",
    ),
    Problem(
        "V77",
        "Block that slides under half a sine",
        GROUP,
        CLOSED,
        "Newmark (1965), integrated in closed form.",
        "Displacement of a block with Coulomb friction relative to its base.",
        (
            ("friction coefficient", "0.12", ""),
            ("base acceleration", "half a sine n μ g sin(2πt/0.8)", "m/s²"),
            ("n", "1.5, 3, 6", ""),
        ),
        [Row(f"displacement, n = {each:g}", "m") for each in truth.RATIOS],
        ("oscillator", {"damper": False, "load": "a_g(t)"}),
        truth.sliding,
        sliding,
        1e-6,
        "The motion is linear between 8,001 samples, whose error is below 1e-7.",
        scale="value",
    ),
)
