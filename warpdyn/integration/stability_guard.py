"""What keeps a run stable: before it, each structure's limit; after it, what failed all the same."""

from __future__ import annotations

import numpy as np

from warpdyn.core.messages import tell
from warpdyn.core.output_variables import DIVERGED, NOT_CONVERGED, UNSTABLE_STEP
from warpdyn.ground_motions.excitation import MOST_STEPS
from warpdyn.integration.dynamics import Vibration
from warpdyn.integration.ensemble import Ensemble

# Samples that fail in a run for the sake of their law are run again with twice the steps, so many times, as long as
# that costs no more than this many runs (or as many samples): where most of a run fails, it needs something else.
MOST_RERUNS, MOST_COST, ALWAYS_AFFORDED = 10, 4, 10_000
LARGEST_ENERGY_ERROR = 0.02  # of the energy supplied; a well-resolved run is a hundred times below it


class Findings:
    """What was found of a run's stability, block after block, to be told once.

    Args:
        samples: Samples of the run.
        method: Integration method.
        event: Name of the event of a sequence whose samples they are; it stands before all that is told.
    """

    def __init__(self, samples: int, method: str, event: str = "") -> None:
        self.samples, self.method, self.event = samples, method, f"{event}: " if event else ""
        self.beyond = self.unsure = 0
        self.failed = dict.fromkeys((DIVERGED, UNSTABLE_STEP, NOT_CONVERGED), 0)
        self.least, self.most = np.inf, 1.0  # step that holds for all [s]; times as many steps as asked for
        self.first = ""  # of the samples beyond the limit
        self.never: int | None = None  # a sample for which no step holds

    def add_limits(self, run: Ensemble, vibration: Vibration) -> np.ndarray:
        """Find which of a block's samples are beyond the limit of their structure, shape [sample]."""
        self.least = min(self.least, float(vibration.stable_step.min()))
        longest = vibration.stable_step[run.row]
        unstable = run.schedule.step > longest
        if not unstable.any():
            return unstable
        if not self.beyond:
            first = int(unstable.argmax())
            self.first = (
                f"sample {run.sample[first]}: first period {vibration.period[run.row[first]]:.4g} s, step "
                f"{run.schedule.step[first]:.4g} s, of which at most {longest[first]:.4g} s holds"
            )
        if self.never is None and (longest == 0).any():
            self.never = int(run.sample[longest.argmin()])
        self.beyond += int(np.count_nonzero(unstable))
        return unstable

    def refuse(self, any_step: bool) -> None:
        """Raise a ValueError if no step holds for a sample or, with `any_step`, if any step was beyond its limit."""
        if self.never is not None:
            raise ValueError(
                f"{self.event}method {self.method!r} amplifies sample {self.never} at any step, since a mode of it is "
                "(nearly) undamped: choose a method with a stability limit, such as 'rk4', or a damping"
            )
        if any_step and self.beyond:
            raise ValueError(
                f"{self.event}the step is beyond the stability limit of {self.beyond} of {self.samples} samples, the "
                f"first of them {self.first}. A step of at most {self.least:.4g} s holds for all; "
                "on_unstable='substep' divides the steps of these samples alone"
            )

    def warn(self, on_unstable: str) -> None:
        """Say what was done about steps beyond the limit, what failed all the same, and what lost its energy."""
        messages = []
        beyond = f"the step is beyond the stability limit of {self.beyond} of {self.samples} samples"
        if self.beyond and on_unstable == "flag":
            holds = f"A step of at most {self.least:.3g} s holds for all" if self.least > 0 else "No step holds for all"
            messages.append(f"{beyond}; their status is unstable_step and their demands are NaN. {holds}")
        elif self.beyond:
            messages.append(
                f"{beyond}: each of them takes the fewest steps that hold instead, up to {self.most:.3g} times as many"
            )
        reasons = {
            DIVERGED: "diverged: their state is not finite at the end",
            UNSTABLE_STEP: "are flagged unstable_step: the step is too long for the memory of their storey law",
            NOT_CONVERGED: "are flagged not_converged: the method's equations of a step could not be solved",
        }
        messages += [
            f"{self.failed[code]} of {self.samples} samples {reason}; their demands are NaN. A shorter step may hold"
            for code, reason in reasons.items()
            if self.failed[code]
        ]
        if self.unsure:
            messages.append(
                f"the energy balance of {self.unsure} of {self.samples} samples is off by more than "
                f"{100 * LARGEST_ENERGY_ERROR:g} %: the step is too long for them to be accurate"
            )
        for text in messages:
            tell(self.event + text)

    def add_outcomes(self, outputs: dict[str, np.ndarray], stable: np.ndarray) -> None:
        """Take what became of a block's samples whose step was stable."""
        status = outputs["status"]
        if status.max() >= DIVERGED:
            for code in self.failed:
                self.failed[code] += int(np.count_nonzero((status == code) & stable))
        if "energy_balance_error" in outputs:
            off = np.abs(outputs["energy_balance_error"]) > LARGEST_ENERGY_ERROR
            if off.any():
                self.unsure += int(np.count_nonzero(stable & (status < DIVERGED) & off))


def guard(run: Ensemble, vibration: Vibration, on_unstable: str, findings: Findings | None = None) -> np.ndarray:
    """Hold each sample's step within the limit of its own structure, or say which are beyond it.

    Args:
        run: The samples; with "substep" their schedule is changed.
        vibration: Vibration of each of their structures, with the method's longest stable step.
        on_unstable: "substep" (the fewest steps that hold in each interval of the record), "raise" or "flag".
        findings: Where it is kept what there is to tell of it.

    Returns:
        Which samples are beyond the limit all the same, shape [sample].

    Raises:
        ValueError: If no step holds; with "raise", if a sample's step does not hold.
    """
    findings = Findings(run.sample.size, run.plan.method) if findings is None else findings
    unstable = findings.add_limits(run, vibration)
    if on_unstable != "flag":
        findings.refuse(any_step=on_unstable == "raise")
    if on_unstable != "substep" or not unstable.any():
        return unstable
    longest, before = vibration.stable_step[run.row[unstable]], run.schedule.substeps[unstable]
    substeps = np.ceil(run.schedule.step[unstable] * before / longest * (1 - 1e-12)).astype(np.int64)
    findings.most = max(findings.most, float((substeps / before).max()))
    run.schedule = run.restepped(np.flatnonzero(unstable), substeps)
    return np.zeros_like(unstable)


class Reruns:
    """How often the samples that fail are run again, blocks of a run in turn.

    What is afforded for a sample is counted on the samples before it, however they are divided into blocks: where a
    good part of a run fails, one of its samples may stay failed that would have been run again by itself.
    """

    def __init__(self) -> None:
        self._seen, self._failed = 0, [0] * (MOST_RERUNS + 1)

    def settle(self, run: Ensemble, samples: np.ndarray, outputs: dict[str, np.ndarray]) -> None:
        """Run those of some samples that failed again, at shorter and shorter steps.

        What fails at a step that holds for the linear structure fails for its law: the memory of a Bouc-Wen storey that
        settles too fast, an iteration that does not converge, a yielding motion that grows.

        Args:
            run: The samples' structures.
            samples: The samples.
            outputs: Their outputs, sample last, which are changed.
        """
        failed, seen = np.flatnonzero(outputs["status"] >= DIVERGED), self._seen
        self._seen += samples.size
        for rerun in range(1, MOST_RERUNS + 1):
            cost = 2**rerun * (self._failed[rerun] + np.arange(1, failed.size + 1))
            self._failed[rerun] += failed.size
            again = samples[failed]
            steps = 2.0 * run.schedule.run_intervals[again] * run.schedule.substeps[again]
            chosen = (cost <= np.maximum(MOST_COST * (seen + failed + 1), ALWAYS_AFFORDED)) & (steps <= MOST_STEPS)
            failed, again = failed[chosen], again[chosen]
            if not failed.size:
                return
            run.schedule = run.restepped(again, run.schedule.substeps[again] * 2)
            found = run.integrate(again)
            for name, values in found.items():
                outputs[name][..., failed] = values
            failed = failed[found["status"] >= DIVERGED]


def integrate_guarded(run: Ensemble, samples: np.ndarray, reruns: Reruns | None = None) -> dict[str, np.ndarray]:
    """Integrate some samples and run those that fail again, at shorter and shorter steps.

    Args:
        run: The samples' structures.
        samples: The samples.
        reruns: What samples before them had run again; None where there are none.
    """
    outputs = run.integrate(samples)
    (Reruns() if reruns is None else reruns).settle(run, samples, outputs)
    return outputs


def blank_failed(outputs: dict[str, np.ndarray], failed: np.ndarray) -> None:
    """Blank the demands of failed samples, so that no statistic takes a blow-up for a response."""
    if not failed.any():
        return
    for name, values in outputs.items():
        if name != "status":
            values[..., failed] = np.nan if np.issubdtype(values.dtype, np.floating) else -1
