"""What keeps a run stable: before it, each structure's limit; after it, what failed all the same."""

from __future__ import annotations

import warnings

import numpy as np

from warpdyn.ensemble import Ensemble
from warpdyn.recorders import DIVERGED, NOT_CONVERGED, UNSTABLE_STEP
from warpdyn.timeline import MOST_STEPS, Vibration

ON_UNSTABLE = ("substep", "raise", "flag")
# Samples that fail in a run for the sake of their law are run again with twice the steps, so many times, as long as
# that costs no more than this many runs (or as many samples): where most of a run fails, it needs something else.
MOST_RERUNS, MOST_COST, ALWAYS_AFFORDED = 10, 4, 10_000
LARGEST_ENERGY_ERROR = 0.02  # of the energy supplied; a well-resolved run is a hundred times below it


def guard(run: Ensemble, vibration: Vibration, on_unstable: str) -> np.ndarray:
    """Hold each sample's step within the limit of its own structure, or say which are beyond it.

    Args:
        run: The run; with "substep" its schedule is changed.
        vibration: Vibration of each drawn structure, with the method's longest stable step.
        on_unstable: "substep" (the fewest steps that hold in each interval of the record), "raise" or "flag".

    Returns:
        Which samples are beyond the limit all the same, shape [sample].

    Raises:
        ValueError: If no step holds; with "raise", if a sample's step does not hold.
    """
    structure = run.assignment.structure if vibration.stable_step.size > 1 else np.zeros_like(run.assignment.structure)
    longest = vibration.stable_step[structure]
    unstable = run.schedule.step > longest
    if not unstable.any():
        return unstable
    first = int(unstable.argmax())
    if on_unstable != "flag" and (longest == 0).any():
        raise ValueError(
            f"method {run.plan.method!r} amplifies sample {int(longest.argmin())} at any step, since a mode of it is "
            "(nearly) undamped: choose a method with a stability limit, such as 'rk4', or a damping"
        )
    if on_unstable == "raise":
        raise ValueError(
            f"the step is beyond the stability limit of {unstable.sum()} of {unstable.size} samples, the first of them "
            f"sample {first}: first period {vibration.period[structure][first]:.4g} s, step "
            f"{run.schedule.step[first]:.4g} s, of which at most {longest[first]:.4g} s holds. A step of at most "
            f"{longest.min():.4g} s holds for all; on_unstable='substep' divides the steps of these samples alone"
        )
    if on_unstable == "flag":
        holds = (
            f"A step of at most {longest.min():.3g} s holds for all" if longest.min() > 0 else "No step holds for all"
        )
        warnings.warn(
            f"the step is beyond the stability limit of {unstable.sum()} of {unstable.size} samples; their status is "
            f"unstable_step and their demands are NaN. {holds}",
            stacklevel=3,
        )
        return unstable
    interval = run.schedule.step[unstable] * run.schedule.substeps[unstable]
    substeps = np.ceil(interval / longest[unstable] * (1 - 1e-12)).astype(np.int64)
    most = (substeps / run.schedule.substeps[unstable]).max()
    run.schedule = run.schedule.with_substeps(np.flatnonzero(unstable), substeps)
    warnings.warn(
        f"the step is beyond the stability limit of {unstable.sum()} of {unstable.size} samples: each of them "
        f"takes the fewest steps that hold instead, up to {most:.3g} times as many",
        stacklevel=3,
    )
    return np.zeros_like(unstable)


def integrate_guarded(
    run: Ensemble, samples: np.ndarray, on_unstable: str, samples_per_chunk: int | None = None
) -> dict[str, np.ndarray]:
    """Integrate some samples; with "substep" run those that fail again, at shorter and shorter steps.

    What fails at a step that holds for the linear structure fails for its law: the memory of a Bouc-Wen storey that
    settles too fast, an iteration that does not converge, a yielding motion that grows.
    """
    outputs = run.integrate(samples, samples_per_chunk)
    for rerun in range(1, MOST_RERUNS + 1 if on_unstable == "substep" else 0):
        failed = np.flatnonzero(outputs["status"] >= DIVERGED)
        if not failed.size or failed.size * 2**rerun > max(MOST_COST * samples.size, ALWAYS_AFFORDED):
            break
        again = samples[failed]
        if (run.schedule.run_intervals[again] * run.schedule.substeps[again].astype(np.float64) * 2 > MOST_STEPS).any():
            break
        run.schedule = run.schedule.with_substeps(again, run.schedule.substeps[again] * 2)
        for name, values in run.integrate(again, samples_per_chunk).items():
            outputs[name][..., failed] = values
    return outputs


def warn_of_failures(outputs: dict[str, np.ndarray], stable: np.ndarray) -> None:
    """Say how many samples of a stable step failed all the same, and how many lost track of their energy."""
    status = outputs["status"]
    reasons = {
        DIVERGED: "diverged: their state is not finite at the end",
        UNSTABLE_STEP: "are flagged unstable_step: the step is too long for the memory of their storey law",
        NOT_CONVERGED: "are flagged not_converged: the method's equations of a step could not be solved",
    }
    for code, reason in reasons.items():
        count = np.count_nonzero((status == code) & stable)
        if count:
            text = f"{count} of {status.size} samples {reason}; their demands are NaN. A shorter step may hold"
            warnings.warn(text, stacklevel=3)
    if "energy_balance_error" in outputs:
        unsure = stable & (status < DIVERGED) & (np.abs(outputs["energy_balance_error"]) > LARGEST_ENERGY_ERROR)
        if unsure.any():
            warnings.warn(
                f"the energy balance of {np.count_nonzero(unsure)} of {status.size} samples is off by more than "
                f"{100 * LARGEST_ENERGY_ERROR:g} %: the step is too long for them to be accurate",
                stacklevel=3,
            )


def blank_failed(outputs: dict[str, np.ndarray], failed: np.ndarray) -> None:
    """Blank the demands of failed samples, so that no statistic takes a blow-up for a response."""
    for name, values in outputs.items():
        if name != "status" and failed.any():
            values[..., failed] = np.nan if np.issubdtype(values.dtype, np.floating) else -1
