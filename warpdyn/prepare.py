"""What comes before a run: its arguments are checked, its samples drawn, and their steps laid out."""

from __future__ import annotations

import os

from warpdyn import pack
from warpdyn.checks import one_of, real_number, whole_number
from warpdyn.ensemble import Ensemble
from warpdyn.kernels.build import checked_device
from warpdyn.methods import METHODS, fitting_methods
from warpdyn.sample import draw
from warpdyn.scene import Scene
from warpdyn.timeline import Vibration, build_schedule, build_timeline

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
) -> tuple[Ensemble, Vibration]:
    """Check a run's arguments (of `simulate`), draw its samples and lay out their steps."""
    if not isinstance(scene, Scene):
        raise TypeError(f"a run takes a Scene, got {type(scene).__name__}")
    one_of("method", method, METHODS)
    row = METHODS[method]
    one_of("dtype", dtype, ("float32", "float64"))
    samples, seed = whole_number("samples", samples, 1), whole_number("seed", seed, 0)
    threads = _cores() if threads is None else whole_number("threads", threads, 1)
    fitting = fitting_methods(scene.structure.law)
    if method not in fitting:
        raise ValueError(
            f"method {method!r} needs a linear structure, and storeys of law {scene.structure.law!r} are not; "
            f"these fit: {', '.join(fitting)}"
        )
    if tolerance is not None and not row.is_adaptive:
        adaptive = [name for name, other in METHODS.items() if other.is_adaptive]
        raise ValueError(f"method {method!r} takes no tolerance; these do: {', '.join(adaptive)}")
    tolerance = DEFAULT_TOLERANCE if tolerance is None else real_number("tolerance", tolerance, above=0)
    device = checked_device(device)
    drawn = draw(scene.structure, scene.scatter, scene.correlation, scene.sampling, samples, seed)
    central = pack.vibration_of(scene, {n: v[None] for n, v in scene.central_parameters.items()}, row)
    timeline = build_timeline(scene, central, step, longest_step, resample)
    assignment = scene.excitation.assign(samples, seed)
    vibration = pack.vibration_of(scene, drawn, row)
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
    )
    return run, vibration


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
