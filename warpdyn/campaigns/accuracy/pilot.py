"""Choice of the cheapest method whose error is below a target by a pilot run; memory and time that a scene needs."""

from __future__ import annotations

import collections.abc
import time
from dataclasses import replace

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.error_estimate import compare
from warpdyn.campaigns.accuracy.method_choice import MethodChoice
from warpdyn.campaigns.integration.dynamics import Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.campaigns.integration.run import Drawn, prepare
from warpdyn.campaigns.integration.settings import check_target_error
from warpdyn.campaigns.integration.stability_guard import guard, integrate_guarded
from warpdyn.engine.kernels.plan import values_held
from warpdyn.engine.kernels.queues import checked_devices
from warpdyn.engine.methods.table import METHODS, StoreyForces, check_fits, fitting_methods
from warpdyn.foundations.core.checks import one_of, whole_number
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.model.scene.arguments import takes_scene
from warpdyn.model.scene.number_of_structures import with_default_design
from warpdyn.model.scene.plausibility import warn_of_implausible
from warpdyn.model.scene.scene import Scene, with_recorders

# Methods that were the cheapest for some scene and target error (within the scatter of the timings), and the cheapest
# method without a stability limit. Any other method is used only if the user names it by `method=`.
CANDIDATES = (
    "exact",
    "rk4",
    "stoermer",
    "velocity_verlet",
    "central_difference",
    "newmark_linear",
    "newmark_average",
)
# The error in the pilot run must be below this share of the target, because the reference run has a small error too.
SHARE_OF_TARGET = 0.9
# Candidates for the number of steps in the first period; each is sqrt(2) times the previous one.
STEPS_PER_PERIOD = tuple(6.0 * 2.0 ** (k / 2) for k in range(18))
# Steps per first period of the reference run for a target error of REFERENCE_ERROR; smaller targets need more steps.
REFERENCE_STEPS_PER_PERIOD, REFERENCE_ERROR = 1600.0, 1e-4
# Reject a method that needs more than MOST_HELD times as many steps for stability as for accuracy.
MOST_HELD = 20.0
# Number of samples, and most structures: enough for a few CPU threads with all their vector lanes, or for a GPU.
PILOT_SAMPLES, MOST_STRUCTURES = {"cpu": 512, "cuda": 2**14}, 512
TIMINGS = 5  # number of timings of each candidate; the shortest time counts
QUANTILE = 0.95  # share of the samples whose error must be below the target


@takes_scene
def plan(
    scene: Scene,
    target_error: float = 0.01,
    *,
    structures: int | None = None,
    seed: int = 0,
    method: str | None = None,
    dtype: str | None = None,
    device: str | collections.abc.Sequence[str] | None = None,
    threads: int | None = None,
) -> MethodChoice:
    """Return the cheapest method, step and number type for a target error of the peak drift, chosen by a pilot run.

    For each method, the pilot run finds the longest step whose error is below the target, in float32 or, if no step is
    accurate enough, in float64. Then it measures the times of these candidates. The error of a sample is the error of
    its peak storey drift (LinearSystem: peak displacement) against a run in float64 with a much shorter step, divided
    by the largest peak of the sample. This error must be below the target in 95 % of the pilot's samples. The table of
    the result also contains the largest error, which may be large if a sample is at a bifurcation.

    Args:
        scene: The scene.
        target_error: Bound [1] on the relative error of the peak drift, for 95 % of the samples.
        structures: Number of structures in the planned run, to estimate its time; None: the default of `simulate`.
        seed: Seed of the pilot's samples.
        method: Name of the method, if it is already chosen; None: try all methods that can be the cheapest.
        dtype: Number type, "float32" or "float64", if it is already chosen; None: "float32" if it is accurate enough.
        device: Device, as in `simulate`; if several are given, the pilot uses the first.
        threads: Number of CPU threads; None: every core that this process may use.

    Returns:
        The choice, with a table of all candidates and the expected time of the run.

    Raises:
        ValueError: If an argument is out of its range, or no candidate reaches the target.
        TypeError: If `scene` is not a Scene.

    Example:
        >>> scene = wd.Scene(building, wd.Cloud(motions), scatter)
        >>> choice = wd.plan(scene, target_error=0.02, method="rk4", dtype="float32")
        >>> choice.method, choice.dtype
        ('rk4', 'float32')
    """
    if not scene.structure.is_many:  # choose_method raises an error for a portfolio
        warn_of_implausible(scene)
    return choose_method(
        with_default_design(scene, structures),
        target_error,
        structures=1 if structures is None else structures,
        seed=seed,
        method=method,
        dtype=dtype,
        device=device,
        threads=threads,
    )


def choose_method(
    scene: Scene,
    target_error: float,
    *,
    structures: int,
    seed: int,
    method: str | None,
    dtype: str | None,
    device: str | collections.abc.Sequence[str] | None,
    threads: int | None,
) -> MethodChoice:
    """Return the result of `plan` for a scene whose plausibility was already checked; arguments: see `plan`."""
    check_target_error(target_error)
    if scene.structure.is_many:
        raise ValueError(
            "plan() needs a scene of one structure, got a Portfolio: plan the scene of one archetype, or use "
            "simulate(..., target_error=...), which makes a plan for each group of the portfolio's buildings"
        )
    if len(scene.excitation.event_names) > 1:
        raise ValueError(
            "the pilot of target_error can run only one event, but the scene has an EventSequence: call plan() for a "
            "scene of the first event, or use simulate(..., step=..., checked_share=...), which estimates the errors "
            "of all events"
        )
    structures, seed = whole_number("structures", structures, 1), whole_number("seed", seed, 0)
    forces, damping = dynamics_of(scene).forces, scene.structure.damping
    if method is not None:
        check_fits(method, forces, damping)
    if dtype is not None:
        one_of("dtype", dtype, ("float32", "float64"))
    pilot = _Pilot(scene, target_error, seed, checked_devices(device)[0], threads)
    fitting = _compared_methods(forces, damping)
    methods = (method,) if method else tuple(name for name in CANDIDATES if name in fitting)
    rows = []
    for name in methods:
        for precision in (dtype,) if dtype else ("float32", "float64"):
            found = pilot.longest_step(name, precision, is_settled=method is not None)
            if found is not None:
                rows.append((name, precision, *found))
                break
    if not rows:
        raise ValueError(
            f"no method keeps the 95 % error of the peak drift below {target_error:g} with up to "
            f"{STEPS_PER_PERIOD[-1]:.4g} steps in the first period (tried: {', '.join(methods)}): "
            "choose a larger target_error="
        )
    # Time all candidates one after another, and repeat this, so that a slow phase of the machine affects all of them.
    seconds = np.min([[pilot.seconds(row[5]) for row in rows] for _ in range(TIMINGS)], axis=0)
    best = int(seconds.argmin())
    columns = {
        "method": ([row[0] for row in rows], "integration method", ""),
        "dtype": ([row[1] for row in rows], "number type", ""),
        "longest_step": ([row[2] for row in rows], "longest integration step", "s"),
        "error": ([row[3] for row in rows], "95 % error of the peak drift in the pilot", "1"),
        "worst_error": ([row[4] for row in rows], "largest error of the peak drift in the pilot", "1"),
        "seconds_per_sample": (seconds, "time per sample of the pilot", "s"),
    }
    table = xr.Dataset(
        {
            key: ("candidate", np.array(v), {"long_name": text} | ({"units": units} if units else {}))
            for key, (v, text, units) in columns.items()
        },
        attrs={"target_error": target_error, "pilot_samples": pilot.chosen.size},
    )
    carried = carried_by(scene, rows[best][5], structures, float(seconds[best]))
    return MethodChoice(rows[best][0], rows[best][1], rows[best][2], table, carried)


def _compared_methods(forces: StoreyForces, damping: str = "none") -> tuple[str, ...]:
    """Return the methods that fit the forces; without implicit ones for lumped structures, whose cost is not known."""
    fitting = fitting_methods(forces, damping)
    return tuple(name for name in fitting if not (forces.is_lumped and METHODS[name].kind == "implicit"))


class _Pilot:
    """Pilot run: a few samples of a scene, with the peak drifts of a reference run at a very short step."""

    def __init__(self, scene: Scene, target_error: float, seed: int, device: str, threads: int | None) -> None:
        self.scene, self.target_error = with_recorders(scene, (scene.structure.demand,)), target_error
        self.known: dict[str, Drawn] = {}
        self.seed, self.device, self.threads = seed, device, threads
        wanted = PILOT_SAMPLES["cpu" if device == "cpu" else "cuda"]
        self.structures = scene.structures_given
        if self.structures == 0:
            samples_per_structure = scene.excitation.samples_per_structure
            most = min(wanted, MOST_STRUCTURES) if scene.scatter else 1  # enough structures to sample the scatter
            self.structures = max(-(-wanted // samples_per_structure), most)
        total = self.structures * scene.excitation.samples_per_structure
        generator = np.random.default_rng([seed, Purpose.PILOT_SAMPLES])
        self.chosen = np.sort(generator.choice(total, min(total, wanted), replace=False))
        first, vibration = self._prepared("rk4", "float64", None)
        periods = vibration.period
        self.period = float(np.median(periods))
        finer = REFERENCE_STEPS_PER_PERIOD * max(1.0, np.sqrt(REFERENCE_ERROR / target_error))
        fitting = _compared_methods(first.model.dynamics.forces)
        method, step = "exact" if "exact" in fitting else "rk4", float(periods.min()) / finer
        reference, held = self._run(method, "float64", step)
        if (
            held > MOST_HELD and "newmark_average" in fitting
        ):  # a stiff mode without effect on drifts: use a method without stability limit
            reference, _ = self._run("newmark_average", "float64", step / 2)
        self.reference = integrate_guarded(reference, self.chosen)

    def _prepared(self, method: str, dtype: str, longest_step: float | None) -> tuple[Ensemble, Vibration]:
        return prepare(
            self.scene,
            structures=self.structures,
            method=method,
            dtype=dtype,
            longest_step=longest_step,
            known=self.known,
            seed=self.seed,
            device=self.device,
            threads=self.threads,
        )

    def _run(self, method: str, dtype: str, longest_step: float) -> tuple[Ensemble, float]:
        """Return a run whose steps are stable, and the factor by which stability increased its number of steps.

        Args:
            method: Name of the method.
            dtype: Number type.
            longest_step: Upper bound of the steps [s], before they are divided for stability.
        """
        run, vibration = self._prepared(method, dtype, longest_step)
        asked = run.schedule.substeps[self.chosen].mean()
        guard(run, vibration, "substep")
        return run, float(run.schedule.substeps[self.chosen].mean() / asked)

    def _error(self, run: Ensemble) -> tuple[float, float]:
        """Return the 95 % quantile of the samples' relative errors [1], and the largest; failed samples: infinite."""
        outputs = integrate_guarded(run, self.chosen)
        found = compare(run, outputs, self.reference, self.chosen)
        errors = found.get(run.model.dynamics.peak[0], next(iter(found.values())))
        ordered = np.sort(np.where(np.isfinite(errors), errors, np.inf))
        return float(ordered[int(np.ceil(QUANTILE * ordered.size)) - 1]), float(ordered[-1])

    def longest_step(self, method: str, dtype: str, *, is_settled: bool) -> tuple[float, float, float, Ensemble] | None:
        """Return the longest step whose error in the pilot is below the target, found by bisection, and its errors.

        Args:
            method: Name of the method.
            dtype: Number type.
            is_settled: Whether the user chose the method, so that it is not rejected for its stability limit.

        Returns:
            The step [s], its 95 % error, its largest error, and the run with this step; None if no step is accurate.
        """
        low, high, found = 0, len(STEPS_PER_PERIOD) - 1, None
        while low <= high:
            middle = (low + high) // 2
            try:
                run, held = self._run(method, dtype, self.period / STEPS_PER_PERIOD[middle])
            except ValueError:  # the method amplifies an undamped mode at any step
                if is_settled:
                    raise
                return None
            if held > MOST_HELD and not is_settled:
                low = middle + 1
                continue
            error, worst = self._error(run)
            if error <= SHARE_OF_TARGET * self.target_error:
                taken = float(run.timeline.steps.max())
                found, high = (taken, error, worst, run), middle - 1
            else:
                low = middle + 1
        return found

    def seconds(self, run: Ensemble) -> float:
        """Integrate the pilot's samples and return the elapsed time per sample [s]."""
        started = time.perf_counter()
        run.integrate(self.chosen)
        return (time.perf_counter() - started) / self.chosen.size


def carried_by(scene: Scene, run: Ensemble, structures: int, seconds_per_sample: float) -> dict[str, float]:
    """Return the registers, memory traffic, steps and time that a scene needs: {quantity with its unit: number}.

    Args:
        scene: The scene, with its recorders.
        run: A run of the pilot with the chosen method, which has fewer recorders than the scene.
        structures: Number of structures in the planned run.
        seconds_per_sample: Time per sample in the pilot [s].
    """
    width = np.dtype(run.plan.dtype).itemsize
    held = values_held(replace(run.plan, recorders=scene.recorders))
    steps = run.schedule.run_intervals * run.schedule.substeps.astype(np.float64)
    total = (scene.structures_given or structures) * scene.excitation.samples_per_structure
    read = sum(motion.values.size for motion in run.timeline.motions) / max(len(run.timeline.motions), 1)
    return {
        **{f"{name} per sample [values]": count for name, count in held.items()},
        "registers per sample, if all values are held [32 bits]": sum(held.values()) * width / 4,
        "bytes read and written per sample": width * (read + held["structure"] + held["recorders"]) + 4 * 6,
        "steps per sample, mean": float(steps.mean()),
        "samples": total,
        "expected integration time [s]": seconds_per_sample * total,
    }
