"""What comes before a run: its arguments are checked, its samples drawn, and their steps laid out."""

from __future__ import annotations

import os

import numpy as np

from warpdyn import pack
from warpdyn.checks import one_of, real_number, whole_number
from warpdyn.ensemble import Ensemble
from warpdyn.kernels.build import checked_device
from warpdyn.methods import METHODS, check_fits
from warpdyn.sample import draw
from warpdyn.scene import Scene
from warpdyn.timeline import Vibration, build_schedule, build_timeline

# Parameters drawn, and the vibration of the central structure and of each that was drawn, at a method's limit.
Drawn = tuple[dict[str, np.ndarray], Vibration, Vibration]
LEAST_TOLERANCE = {"float32": 1e-7, "float64": 1e-14}  # below it rounding is all that a step's estimate tells
DEFAULT_TOLERANCE = 1e-6  # of an adaptive method


def prepare(
    scene: Scene,
    *,
    samples: int,
    method: str,
    dtype: str,
    seed: int = 0,
    device: str | None = None,
    threads: int | None = None,
    step: float | None = None,
    longest_step: float | None = None,
    resample: bool = False,
    tolerance: float | None = None,
    known: dict[str, Drawn] | None = None,
) -> tuple[Ensemble, Vibration]:
    """Check a run's arguments (of `simulate`), draw its samples and lay out their steps.

    Whoever prepares many runs of the same samples of one scene passes the same `known` each time, at first empty: what
    was drawn and found of their vibration is kept there, by method.
    """
    if not isinstance(scene, Scene):
        raise TypeError(f"a run takes a Scene, got {type(scene).__name__}")
    check_fits(method, scene.structure.law)
    row = METHODS[method]
    one_of("dtype", dtype, ("float32", "float64"))
    samples, seed = whole_number("samples", samples, 1), whole_number("seed", seed, 0)
    threads = _cores() if threads is None else whole_number("threads", threads, 1)
    if tolerance is not None and not row.is_adaptive:
        adaptive = [name for name, other in METHODS.items() if other.is_adaptive]
        raise ValueError(f"method {method!r} takes no tolerance; these do: {', '.join(adaptive)}")
    if not isinstance(resample, bool):
        raise TypeError(f"resample must be True or False, got {resample!r}")
    if tolerance is None:
        tolerance = DEFAULT_TOLERANCE
    elif not LEAST_TOLERANCE[dtype] <= real_number("tolerance", tolerance, above=0) <= 1:
        raise ValueError(f"tolerance must be from {LEAST_TOLERANCE[dtype]:g} ({dtype}) to 1, got {tolerance:g}")
    device = checked_device(device)
    known = {} if known is None else known
    if method not in known:
        drawn = draw(scene.structure, scene.scatter, scene.correlation, scene.sampling, samples, seed)
        central = pack.vibration_of(scene, {n: v[None] for n, v in scene.central_parameters.items()}, row)
        known[method] = drawn, central, pack.vibration_of(scene, drawn, row)
    drawn, central, vibration = known[method]
    timeline = build_timeline(scene, central, step, longest_step, resample)
    assignment = scene.excitation.assign(samples, seed)
    schedule = build_schedule(scene, timeline, vibration, assignment)
    run = Ensemble(
        scene,
        drawn,
        assignment,
        timeline,
        schedule,
        method=method,
        tolerance=tolerance,
        dtype=dtype,
        device=device,
        threads=threads,
        seed=seed,
    )
    return run, vibration


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
