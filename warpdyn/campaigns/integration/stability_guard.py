"""Stability of a run: the step of each sample is limited before the run, and failed samples are run again after it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from warpdyn.campaigns.integration.dynamics import Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.time_grid import stable_substeps
from warpdyn.engine.kernels.output_table import OF_FAILURES
from warpdyn.engine.methods.defaults import FALLBACK
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import CONTROL_FAILED, DIVERGED, NOT_CONVERGED, UNSTABLE_STEP
from warpdyn.model.ground_motions.excitation import MOST_STEPS

# A sample that failed because of its storey law is run again with twice as many steps, up to MOST_RERUNS times. Within
# a range of structures, each rerun may take at most MOST_COST times the steps of the range's earlier samples, or
# ALWAYS_AFFORDED steps times storeys (0.1 to 1 s for most laws, a few seconds for the slowest): if most of a run fails,
# it needs another method. A CPU integrates rows of ROW samples, so that one sample takes as long as ROW samples.
MOST_RERUNS, MOST_COST, ALWAYS_AFFORDED, ROW = 10, 2, 3e7, 16
MOST_RERUNS_OF_GRIDS = 2  # of 748,000 histories of a frame, 889 had no equilibrium, 569 after 2 reruns, 448 after 3
# A range contains whole structures, which together have at most this many samples, or one structure. It depends only on
# the scene, so that results do not depend on blocks, regions, devices, or failures outside of the range.
SAMPLES_OF_A_RANGE = 2**12
LARGEST_ENERGY_ERROR = 0.02  # divided by the energy supplied; the error of an accurate run is 100 times smaller
LARGEST_CHANGE = 0.01  # relative change of a reliable sample's peak drift in a second run: accuracy/reliability.py
# How the findings of two blocks are merged: SUMS are added, LEAST are the minimum, MOST are the maximum, FIRST is the
# first value that is not empty.
SUMS: tuple[str, ...] = ("beyond", "unsure", "in_float64", "blank", "too_long", "leaping")
SUMS += ("off", "sensitive", "unreliable", "checked", "unchecked")
LEAST, MOST, FIRST = ("longest_accurate", "least"), ("most", "error", "has_hinges", "is_controlled"), ("first", "never")
OF_CONTROL = (
    "flagged control_failed: a command was not finite or beyond its limits, or a stroke exceeded its limit; demands of "
    "such samples are NaN. `control_failure` and `time_of_control_failure` give the reason and the time"
)
LOOP = "The closed loop may be unstable: see wd.control.sampled_eigenvalues and wd.control.delay_margin. "


class StabilityFindings:
    """Findings on the stability of a run (counts, extreme steps), collected block by block and reported as warnings.

    Args:
        samples: Number of samples of the run.
        method: Name of the integration method.
        event: Name of the event in a sequence that the samples belong to; every message begins with it.
    """

    def __init__(self, samples: int, method: str, event: str = "") -> None:
        self.samples, self.method, self.event = samples, method, f"{event}: " if event else ""
        self.beyond = self.unsure = self.in_float64 = self.blank = 0
        self.too_long, self.longest_accurate = 0, np.inf  # samples with an inaccurate step; longest accurate step [s]
        self.failed = dict.fromkeys((DIVERGED, UNSTABLE_STEP, NOT_CONVERGED, CONTROL_FAILED), 0)
        self.leaping = 0  # samples in which a storey passed its drift capacity by a move of over half of it in one step
        self.has_hinges = self.is_controlled = False  # whether structures have a column line, and a control
        self.least, self.most = np.inf, 1.0  # step that is stable for all [s]; largest factor on the number of steps
        self.unreliable = self.checked = self.unchecked = 0  # numbers of samples by their flag `unreliable`
        self.error, self.off, self.sensitive = 0.0, 0, 0  # required error; samples above it; sensitive samples
        self.first = ""  # description of the first sample beyond the stability limit
        self.never: int | None = None  # a sample for which no step is stable

    def add_limits(self, run: Ensemble, vibration: Vibration) -> np.ndarray:
        """Add samples to the findings; return which of them have a step beyond the stability limit, shape [sample]."""
        self.least = min(self.least, float(vibration.stable_step.min()))
        self.is_controlled = self.is_controlled or run.scene.control is not None
        self.has_hinges = self.has_hinges or (run.plan.pattern is not None and run.plan.pattern.line is not None)
        longest = vibration.stable_step[run.row]
        unstable = run.schedule.step > longest
        if not unstable.any():
            return unstable
        if not self.beyond:
            self.first = self.description(run, vibration, int(unstable.argmax()))
        if self.never is None and (longest == 0).any():
            self.never = int(run.sample[longest.argmin()])
        self.beyond += int(np.count_nonzero(unstable))
        return unstable

    @staticmethod
    def description(run: Ensemble, vibration: Vibration, sample: int) -> str:
        """Return a text with the first period, the step and the stability limit of sample number `sample` of `run`."""
        row = run.row[sample]
        return (
            f"sample {run.sample[sample]}: first period {vibration.period[row]:.4g} s, step "
            f"{run.schedule.step[sample]:.4g} s, which must be at most {vibration.stable_step[row]:.4g} s"
        )

    def of_no_samples(self) -> StabilityFindings:
        """Return empty findings for the same run and event."""
        found = StabilityFindings(self.samples, self.method)
        found.event = self.event
        return found

    def include(self, other: StabilityFindings) -> None:
        """Add the findings on later samples, such as the samples of the next block, to these findings."""
        for name in SUMS:
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in LEAST:
            setattr(self, name, min(getattr(self, name), getattr(other, name)))
        for name in MOST:
            setattr(self, name, max(getattr(self, name), getattr(other, name)))
        for name in FIRST:
            if getattr(self, name) in ("", None):
                setattr(self, name, getattr(other, name))
        for code in self.failed:
            self.failed[code] += other.failed[code]

    def add_sample_errors(self, error: float, off: int, sensitive: int) -> None:
        """Add `off` samples whose estimated error exceeds the required `error` [1], and `sensitive` samples."""
        self.error, self.off, self.sensitive = error, self.off + off, self.sensitive + sensitive

    def add_flags(self, flags: np.ndarray, status: np.ndarray) -> None:
        """Count the samples that did not fail by their flag: > 0 unreliable, 0 reliable, < 0 not checked."""
        ended = status < DIVERGED
        self.unreliable += int(np.count_nonzero(flags[ended] > 0))
        self.checked += int(np.count_nonzero(flags[ended] >= 0))
        self.unchecked += int(np.count_nonzero(flags[ended] < 0))

    def refuse(self, any_step: bool) -> None:
        """Raise a ValueError if no step is stable for a sample or, if `any_step`, if any step exceeds its limit."""
        if self.never is not None:
            raise ValueError(
                f"{self.event}method {self.method!r} amplifies sample {self.never} at any step, because one of its "
                "modes has (nearly) no damping: use method='rk4', which is stable below a limit, or add damping"
            )
        if any_step and self.beyond:
            raise ValueError(
                f"{self.event}the step is beyond the stability limit of {self.beyond} of {self.samples} samples, the "
                f"first of them {self.first}. Give a step= of at most {self.least:.4g} s, which is stable for all, or "
                "on_unstable='substep', which divides only the steps of these samples"
            )

    def _are(self, count: int, total: int | None = None) -> str:
        """Return "1 of 20 samples is" or "3 of 20 samples are"; `total` None: the number of samples of the run."""
        return f"{count} of {self.samples if total is None else total} samples {'is' if count == 1 else 'are'}"

    def warn(self, on_unstable: str) -> None:
        """Warn of steps beyond the stability limit, failed or unreliable samples, and energy that does not balance."""
        messages = []
        beyond = f"the step is beyond the stability limit of {self.beyond} of {self.samples} samples"
        if self.beyond and on_unstable == "flag":
            stable = f"A step= of at most {self.least:.3g} s" if self.least > 0 else "No step"
            advice = "on_unstable='substep' divides only the steps of these samples"
            advice = advice if self.least > 0 else "use method='rk4', which is stable below a limit, or add damping"
            messages.append(
                f"{beyond}; their status is unstable_step and their demands are NaN. {stable} is stable for all; "
                f"{advice}"
            )
        elif self.beyond:
            next_one = "They are stable, but not accurate: see the next warning"
            messages.append(
                f"{beyond}: each of them takes the fewest stable steps instead, up to {self.most:.3g} times as many. "
                f"{next_one if self.too_long else 'No action is needed'}"
            )
        reasons = {
            DIVERGED: "flagged diverged: the state is not finite, or a storey drifts by a thousand times its height",
            UNSTABLE_STEP: "flagged unstable_step: the step is too long for the memory of the storey law",
        }
        leaping = (
            "flagged unstable_step: in the step in which a storey passed its drift capacity, its drift "
            "changed by more than half of the capacity, which may be a numerical blow-up and not a collapse"
        )
        counts = [(self.failed[code], reason) for code, reason in reasons.items()] + [(self.leaping, leaping)]
        messages += [
            f"{self._are(count)} {reason}; demands of such samples are NaN. {LOOP * self.is_controlled}Try a "
            "shorter step= (or longest_step=), or another method=; if all steps fail, check the structure's parameters"
            for count, reason in counts
            if count
        ]
        if self.failed[NOT_CONVERGED]:
            flagged = f"{self._are(self.failed[NOT_CONVERGED])} flagged not_converged"
            messages.append(
                f"{flagged}: the hinges of a frame have no equilibrium in a step; demands of such samples are NaN. "
                "spring_without_equilibrium is the index of the hinge. Try a shorter step="
                if self.has_hinges
                else f"{flagged}: method {self.method!r} found no equilibrium at the end of a step; demands of such "
                "samples are NaN. If the force of a storey law jumps, as when the energy capacity of an "
                "Ibarra-Medina-Krawinkler storey is exhausted, the step has no solution, and a shorter step does not "
                f'help. Use an explicit method: method="{FALLBACK}"'
            )
        if self.failed[CONTROL_FAILED]:
            messages.append(f"{self._are(self.failed[CONTROL_FAILED])} {OF_CONTROL}")
        if self.too_long:
            messages.append(
                f"the step is too long for the first period of {self.too_long} of {self.samples} samples: the method's "
                f"period error accumulates. Use a step of at most {self.longest_accurate:.3g} s, or remove step=: then "
                "only the steps of these samples are divided"
            )
        if self.off:
            messages.append(
                f"the estimated error of {self.off} of {self.samples} samples is larger than {self.error:g}: "
                "`estimated_relative_error_of_sample` gives the error of each. Give a shorter step= or longest_step=, "
                "or do not use these samples singly"
            )
        if self.sensitive:
            messages.append(
                f"{self._are(self.sensitive)} `sensitive`: a motion scaled by 1.001 changes their peaks by more than "
                f"{self.error:g}, and another step may do so, too. Use shares and medians of many samples, not these "
                "single ones"
            )
        if self.unreliable or self.unchecked:
            not_checked = f", {self.unchecked} were not checked" if self.unchecked else ""
            advice = (
                "sample_error=0.05 checks all of them" if self.unchecked else "sample_error=0.05 estimates their errors"
            )
            earlier = " in this event or an earlier one" if self.event else ""
            messages.append(
                f"{self._are(self.unreliable, self.checked)} `unreliable`{not_checked}: at half the step, with the "
                f"motion unchanged or times 1.001, a peak drift changes by more than {100 * LARGEST_CHANGE:g} "
                f"%{earlier}. Use shares and medians of many samples, not single ones. A shorter longest_step= may "
                f"help; {advice}"
            )
        if self.blank:
            messages.append(
                f"energies of {self.blank} of {self.samples} samples are beyond the largest number of their type and "
                "are NaN: check their parameters, or use dtype='float64'"
            )
        if self.in_float64:
            messages.append(
                f"{self.in_float64} of {self.samples} samples have displacements too large for float32 to resolve "
                "whether a storey unloads (or may have had them before the scene's record_from): they were run again "
                "in float64. Use dtype='float64' to run all samples once"
            )
        if self.unsure:
            messages.append(
                f"the energy balance of {self.unsure} of {self.samples} samples is off by more than "
                f"{100 * LARGEST_ENERGY_ERROR:g} %, so their demands may be wrong. Give a shorter step= "
                "or longest_step=, or estimate the errors of the drifts with checked_share=0.1"
            )
        for text in messages:
            warn_caller(self.event + text)

    def add_outcomes(self, outputs: dict[str, np.ndarray], stable: np.ndarray) -> None:
        """Count failures and bad energy balances of a block, for samples whose step was stable.

        Args:
            outputs: Outputs of the samples by name; the last dimension is the sample.
            stable: Whether the step of each sample was stable, shape [sample].
        """
        status = outputs["status"]
        if status.max() >= DIVERGED:
            leaping = np.zeros(status.shape, dtype=bool)
            if "time_of_collapse" in outputs:
                leaping = (status == UNSTABLE_STEP) & np.isfinite(outputs["time_of_collapse"])
            self.leaping += int(np.count_nonzero(leaping & stable))
            for code in self.failed:
                self.failed[code] += int(np.count_nonzero((status == code) & stable & ~leaping))
        if "energy_balance_error" in outputs:
            error = outputs["energy_balance_error"]
            off = np.abs(error) > LARGEST_ENERGY_ERROR
            blank = ~np.isfinite(error)
            if blank.any():
                self.blank += int(np.count_nonzero(stable & (status < DIVERGED) & blank))
            if off.any():
                self.unsure += int(np.count_nonzero(stable & (status < DIVERGED) & off))


def guard(
    run: Ensemble, vibration: Vibration, on_unstable: str, findings: StabilityFindings | None = None
) -> np.ndarray:
    """Return which samples have a step above their stability limit, shape [sample], after `on_unstable` is applied.

    `on_unstable="substep"` divides steps above the limit; "raise" raises an error if a step is above the limit; "flag"
    changes nothing.

    Args:
        run: The samples. If `on_unstable` is "substep", their schedule is changed.
        vibration: Vibration of the structures of the samples, with the method's longest stable step.
        on_unstable: "substep" (the smallest stable number of steps per interval of the record), "raise" or "flag".
        findings: Findings to which the samples are added; None: they are discarded.

    Returns:
        Which samples have a step beyond the limit after this call, shape [sample].

    Raises:
        ValueError: If a sample has no stable step; if `on_unstable` is "raise", also if a sample's step is beyond the
            limit.
    """
    findings = StabilityFindings(run.sample.size, run.plan.method) if findings is None else findings
    unstable = findings.add_limits(run, vibration)
    if on_unstable != "flag":
        findings.refuse(any_step=on_unstable == "raise")
    if on_unstable != "substep" or not unstable.any():
        return unstable
    longest, before = vibration.stable_step[run.row[unstable]], run.schedule.substeps[unstable]
    substeps = stable_substeps(run.schedule.step[unstable], before, longest).astype(np.int64)
    findings.most = max(findings.most, float((substeps / before).max()))
    run.schedule = run.restepped(np.flatnonzero(unstable), substeps)
    return np.zeros_like(unstable)


def structures_of_a_range(samples_per_structure: int) -> int:
    """Return the number of structures in a rerun range (structures whose failed samples share one limit on reruns)."""
    return max(1, SAMPLES_OF_A_RANGE // samples_per_structure)


class Reruns:
    """Reruns of failed samples, within a limit on the number of steps for each range of structures.

    The failed samples of a range are run again in their order, as long as the steps of all reruns stay within the
    limit, which follows from the steps of the samples up to then. Whether a sample is run again thus depends only on
    the samples before it in its range. If many of them fail, the sample may not be run again.
    """

    def __init__(self) -> None:
        # By (range, rerun): number of samples, and steps charged to them. Rerun 0 is the first run, of all samples.
        self._charges: dict[tuple[int, int], tuple[int, float]] = {}

    def settle(self, run: Ensemble, samples: np.ndarray, outputs: dict[str, np.ndarray]) -> None:
        """Rerun the samples that failed, with the steps halved in each rerun, and overwrite their outputs.

        If a step is stable for the linear structure, a sample fails because of its storey law. Examples: the memory of
        a Bouc-Wen storey changes too fast, an iteration does not converge, or a yielding motion grows without bound. A
        sample is also run again if a storey passes its drift capacity by too long a move in one step, which may be a
        numerical blow-up instead of a collapse.

        Args:
            run: Ensemble that contains the samples.
            samples: Indices of the samples in `run`, after all earlier samples of their ranges.
            outputs: Outputs of the samples by name, which are overwritten; the last dimension is the sample.
        """
        # A shorter step does not help if a control failed.
        failed = np.flatnonzero((outputs["status"] >= DIVERGED) & (outputs["status"] != CONTROL_FAILED))
        if not failed.size and run.is_of_whole_ranges:
            return
        structures = structures_of_a_range(run.scene.excitation.samples_per_structure)
        ranges = run.assignment.structure[samples] // structures
        # Ranges that end in this block are not charged by any other block.
        own = np.flatnonzero(np.isin(ranges, ranges[failed])) if run.is_of_whole_ranges else np.arange(ranges.size)

        def steps(which: np.ndarray | slice) -> np.ndarray:
            return run.steps_of(samples[own[which]])

        charged = self._charge(0, ranges[own], steps, np.searchsorted(own, failed))
        afforded = np.maximum(MOST_COST * charged, ALWAYS_AFFORDED / run.plan.dofs)
        of_failed = run.steps_of(samples[failed])
        for rerun in range(1, 1 + (MOST_RERUNS_OF_GRIDS if run.plan.frame_storeys else MOST_RERUNS)):
            if not failed.size:
                return
            taken = 2**rerun * of_failed
            charged = self._charge(rerun, ranges[failed], taken.__getitem__, np.arange(failed.size))
            granted = (charged <= afforded) & (taken <= MOST_STEPS)
            failed, of_failed, afforded = failed[granted], of_failed[granted], afforded[granted]
            if not failed.size:
                return
            again = samples[failed]
            run.halve_steps(again)
            found = run.integrate(again)
            for name, values in found.items():
                outputs[name][..., failed] = values
            still = (found["status"] >= DIVERGED) & (found["status"] != CONTROL_FAILED)
            failed, of_failed, afforded = failed[still], of_failed[still], afforded[still]

    def _charge(
        self, rerun: int, ranges: np.ndarray, steps: Callable[[slice], np.ndarray], which: np.ndarray
    ) -> np.ndarray:
        """Charge the steps of samples to their rerun ranges; return the sums of charged steps at the samples `which`.

        A row of ROW samples is charged with ROW times the steps of its first sample.

        Args:
            rerun: Number of the rerun; 0 is the first run.
            ranges: Range of each sample, shape [sample].
            steps: Function that returns the number of steps of a slice of the samples.
            which: Increasing indices of the samples for which the charged steps are returned.

        Returns:
            Sum of the charged steps in the sample's range, for each sample in `which`.
        """
        charged = np.empty(which.size)
        for first, last in pairwise([*np.flatnonzero(np.diff(ranges, prepend=-1)).tolist(), ranges.size]):
            key = int(ranges[first]), rerun
            count, taken = self._charges.get(key, (0, 0.0))
            begin = -count % ROW  # the first of these samples that begins a new row
            sums = taken + np.cumsum(np.append(0.0, ROW * steps(slice(first + begin, last, ROW))))
            own = slice(*np.searchsorted(which, [first, last]))
            charged[own] = sums[(which[own] - first + ROW - begin) // ROW]
            self._charges[key] = count + last - first, float(sums[-1])
        return charged


def integrate_guarded(run: Ensemble, samples: np.ndarray, reruns: Reruns | None = None) -> dict[str, np.ndarray]:
    """Integrate samples, run failed samples again at shorter steps, and return all outputs (the sample is last).

    Args:
        run: Ensemble that contains the samples.
        samples: Indices of the samples in `run`.
        reruns: Reruns of earlier samples, which count for the limit; None if there are no earlier samples.
    """
    outputs = run.integrate(samples)
    (Reruns() if reruns is None else reruns).settle(run, samples, outputs)
    return outputs


def blank_failed(outputs: dict[str, np.ndarray], failed: np.ndarray) -> None:
    """Set demands of failed samples to NaN (integers: -1), so that no statistic uses them."""
    for name, values in outputs.items() if failed.any() else ():
        if name not in ("status", "spring_without_equilibrium", *OF_FAILURES):  # why a sample failed
            values[..., failed] = np.nan if np.issubdtype(values.dtype, np.floating) else -1
