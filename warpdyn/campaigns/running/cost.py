"""Estimate of the time of a run, before the first kernel is launched."""

from __future__ import annotations

from collections.abc import Sequence

from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import Run
from warpdyn.foundations.core.messages import amount_of, tell, warn_caller

# By RK4 in float32, one CPU core takes 0.8 ns (elastic) to 2.3 ns (Bouc-Wen) for one step of one storey; about ten
# times as long for laws with deterioration, in float64 and by implicit methods. 5 ns is right within a factor of about
# 10. A GPU is assumed to be as fast as 200 CPU cores.
SECONDS_OF_A_STEP, CORES_OF_A_GPU = 5e-9, 200
TOLD = 300.0  # expected time of a run [s] above which it is reported before the run starts
MOST_STEPS_OF_A_SAMPLE = 10**7  # a record of one day at 10 ms; a launch cannot be interrupted within a sample
MOST_CHOSEN_STEPS = 10**8  # of a sample whose step the user did not limit; about ten seconds on a CPU, minutes on a GPU


def tell_cost(run: Run, events: Sequence[Ensemble]) -> None:
    """Report the expected time of a run if it is longer than TOLD [s]; warn or refuse if a sample has very many steps.

    Args:
        run: The prepared run.
        events: The first block of structures of the run: one ensemble (set of samples) for each event.

    Raises:
        ValueError: If a sample would take more than MOST_CHOSEN_STEPS steps, and the user gave no step.
    """
    is_chosen = run.integration.step is None and run.integration.longest_step is None
    total = 0.0
    for whole, samples in zip(events, run.samples_by_event, strict=True):
        part = whole.example
        steps = part.steps_of(slice(None))
        total += samples * float(steps.mean())
        worst = int(steps.argmax())
        if steps[worst] > MOST_STEPS_OF_A_SAMPLE:
            step = part.schedule.step[worst]
            finding = (
                f"sample {part.sample[worst]} takes {steps[worst]:.3g} steps of {step:.3g} s, over "
                f"{steps[worst] * step:.3g} s: check that the step of the motion is in seconds, the masses, and the "
                "stiffnesses of storeys, springs and contacts"
            )
            if is_chosen and steps[worst] > MOST_CHOSEN_STEPS:
                raise ValueError(f"{finding}. If they are right, give longest_step={step:.3g}")
            warn_caller(finding)
    workers = CORES_OF_A_GPU * len(run.execution.devices) if run.execution.is_gpu else run.execution.cores
    seconds = total * run.model.plan.dofs * SECONDS_OF_A_STEP / workers
    if seconds > TOLD:
        freedom = amount_of(run.model.plan.dofs, "degree of freedom", "degrees of freedom")
        tell(
            f"{run.samples:,} samples take {total:.3g} steps of {freedom}: in the order of {_spoken(seconds)} on "
            f"{', '.join(run.execution.devices)} (rough estimate)"
        )


def _spoken(seconds: float) -> str:
    """Return a time given in s as text in minutes, hours or days, such as "90 minutes"."""
    if seconds < 2 * 3600:
        return f"{seconds / 60:.0f} minutes"
    return f"{seconds / 3600:.0f} hours" if seconds < 72 * 3600 else f"{seconds / 86400:,.0f} days"
