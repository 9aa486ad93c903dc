"""`Live`: an ensemble of structures that responds to a ground motion while it arrives."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import guard
from warpdyn.campaigns.live.accepted_scenes import check_method, check_scene
from warpdyn.campaigns.live.answers import QUANTILES, Answers, checked_settings
from warpdyn.campaigns.live.finishing import finished, scene_of_record
from warpdyn.campaigns.live.packets.arriving import Arriving
from warpdyn.campaigns.live.packets.packet import Packet
from warpdyn.campaigns.live.packets.receiver import Receiver
from warpdyn.campaigns.live.packets.refused import RefusedPacket
from warpdyn.campaigns.live.packets.track import Track
from warpdyn.campaigns.live.paused_ensemble import PausedEnsemble
from warpdyn.campaigns.reductions.limits import DamageLimits, Limit
from warpdyn.engine.kernels.build import load_kernel
from warpdyn.engine.kernels.queues import open_queues
from warpdyn.foundations.core.checks import check_kind, one_of, real_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.plausibility import PlausibilityFindings, meant_as_given
from warpdyn.model.ground_motions.records.units import unit_factor
from warpdyn.model.scene.number_of_structures import number_of_structures
from warpdyn.model.scene.plausibility import warn_of_implausible
from warpdyn.model.scene.scene import Scene

LONGEST_SAMPLING_STEP = 1.0  # s


@with_suggestions
class Live:
    """An ensemble of structures that responds to a ground motion while it arrives, packet by packet.

    All structures are integrated up to the last sample that has arrived. The result after the last packet is that of
    `simulate` for the whole record, for every division into packets: bit for bit on a CPU; on a GPU, too, unless
    `simulate` prepares a large run on the GPU (then within rounding). A packet that cannot be used raises an error and
    changes nothing. Samples that arrive late, repeatedly or after a gap are put in order.

    Args:
        scene: The scene. Its excitation is one GroundMotion, one PairOfMotions, or a Cloud or OneMotionPerStructure
            with one motion. The packets replace the samples of this motion; its step and its components remain. Its
            duration should be about that of the expected motion, because the steps of lightly damped structures
            depend on the duration.
        structures: Number of structures to draw, as in `simulate`.
        seed: Seed of every random draw.
        limits: Limits of the damage states, from the lightest to the heaviest, as in `fragility`, such as
            {"slight": 0.005, "complete": 0.04} (storey drift ratios [1]); None: no damage states.
        quantiles: Quantiles of all demands among the samples [1].
        keep_samples: Whether answers contain the demands of each sample. False: only their quantiles, the damage-state
            probabilities, `failed_count` and `collapsed_count`; on a GPU nothing else is copied to the host, so that
            answers take less time. The run of `finish` always contains all samples.
        unit: Unit of the accelerations, one of `records.UNITS`.
        sampling_step: Sampling step of the packets [s] if it is not that of the scene's motion; the packets are then
            resampled by linear interpolation.
        patience: Time of signal after a gap [s] that is kept while the missing samples may still arrive.
        longest_gap: Longest gap [s] that is filled by linear interpolation after `patience`. A longer gap refuses
            further packets until the missing samples arrive, or `bridge` is called.
        integration: How the structures are integrated; None: as by `simulate`.
        execution: Device and threads; None: the first GPU, or all CPU threads.

    Attributes:
        observers: Functions that are called with each answer before `push` or `bridge` returns it, such as that of a
            LiveDisplay. They must not change the answer.

    Raises:
        ValueError: If an argument is out of its range, or the scene cannot be integrated while its motion arrives.
        TypeError: If an argument is of another type.

    Example:
        >>> limits = {"slight": 0.005, "complete": 0.015}
        >>> live = wd.Live(wd.Scene(building, motions[0], scatter), structures=3, limits=limits)
        >>> for first in range(0, 500, 50):  # packets of 1 s
        ...     answer = live.push(motions[0].acceleration[first : first + 50], start=first * 0.02)
        >>> round(float(answer["time"]), 2), answer["damage_probability"].sizes["damage_state"]
        (9.98, 3)
        >>> run = live.finish()
        >>> run.sizes["sample"]
        3
    """

    def __init__(
        self,
        scene: Scene,
        structures: int | None = None,
        *,
        seed: int = 0,
        limits: Mapping[str, Limit] | None = None,
        quantiles: Sequence[float] | np.ndarray = QUANTILES,
        keep_samples: bool = True,
        unit: str = "m/s2",
        sampling_step: float | None = None,
        patience: float = 2.0,
        longest_gap: float = 0.0,
        integration: Integration | None = None,
        execution: Execution | None = None,
    ) -> None:
        check_scene(scene)
        integration = Integration() if integration is None else integration
        execution = Execution() if execution is None else execution
        check_kind("Live", "wd.Integration", integration, Integration, argument="integration")
        check_kind("Live", "wd.Execution", execution, Execution, argument="execution")
        _check_settings(integration, execution)
        self.scene, self.seed, self.integration = scene, seed, integration
        self.execution = execution.on_first()
        self.structures = number_of_structures("Live", scene, structures)
        of_placeholder = ("strongest_motion", "peak_ground_acceleration", "record_baseline")
        with meant_as_given(*of_placeholder):
            warn_of_implausible(scene, step=integration.step, longest_step=integration.longest_step, is_live=True)
        self.unit, factor = unit, unit_factor(unit, "unit")
        [motion] = scene.excitation.motions
        self.step = float(motion.step)
        if sampling_step is not None:
            given = real_number("sampling_step [s]", sampling_step, above=0)
            if given > LONGEST_SAMPLING_STEP:
                raise ValueError(
                    f"sampling_step={given:g} s is longer than {LONGEST_SAMPLING_STEP:g} s, so that packets would "
                    f"contain no vibration: {given:g} samples per second are sampling_step={1 / given:g}"
                )
        packet_step = self.step if sampling_step is None else float(sampling_step)
        patience = real_number("patience [s]", patience, least=0)
        longest_gap = real_number("longest_gap [s]", longest_gap, least=0)
        tracks = (Track(packet_step, patience, longest_gap),) * max(1, scene.excitation.base_components)
        self.arriving = Arriving(Receiver(tracks, packet_step, self.step, factor))
        settings = checked_settings(scene, self.structures, limits, quantiles, keep_samples)
        run = build_run(scene, self.structures, integration, self.execution, seed)
        check_method(run.integration.method, scene)
        queue = open_queues(run.execution.devices, run.model.threads)[0]
        [(ensemble, vibration)] = run.events(np.arange(self.structures), queue)
        findings = run.findings[0]
        shorten_steps(ensemble, vibration, findings, divides=run.integration.divides_steps)
        guard(ensemble, vibration, integration.on_unstable, findings)
        self._answers = Answers(run.model, settings)
        self.paused = PausedEnsemble(ensemble)
        self._answers.begin_statistics(self.paused)
        for group in self.paused.groups:  # compiled now, so that the first packet does not wait
            load_kernel(group.plan, self.paused.device)
        self.is_finished = False
        self.observers: list[Callable[[xr.Dataset], object]] = []
        self._seconds_integrating = 0.0  # of all packets

    @property
    def time(self) -> float:
        """Time since the first sample of the motion up to which the structures are integrated [s]."""
        return self.paused.intervals * self.step

    @property
    def limits(self) -> DamageLimits | None:
        """Limits of the damage states; None: no damage states."""
        return self._answers.limits

    @property
    def quantiles(self) -> np.ndarray:
        """Quantiles of the demands that answers contain [1]."""
        return self._answers.quantiles

    @property
    def keep_samples(self) -> bool:
        """Whether answers contain the demands of each sample."""
        return self._answers.keep_samples

    @property
    def record(self) -> np.ndarray:
        """Accelerations that have been integrated [m/s2], shape [time, component]."""
        return self.arriving.record

    @property
    def lag(self) -> float:
        """Time between the last integrated sample and now [s]; NaN if it is not known.

        If time stamps are not POSIX times, the lag is relative to the packet that arrived earliest after its samples.
        """
        return self.arriving.lag(self.time)

    def push(
        self,
        acceleration: ArrayLike | Packet,
        start: float | None = None,
        *,
        step: float | None = None,
        component: int | None = None,
    ) -> xr.Dataset:
        """Integrate all structures under the samples of a packet, and return the answer.

        Args:
            acceleration: Accelerations [m/s2], or in the `unit` of the Live, shape [time] or [time, component]; or a
                Packet.
            start: Time of the first sample [s], such as POSIX time; None: the packet follows the latest sample.
            step: Sampling step of the packet [s]; None: not checked.
            component: Index of the only component in the packet; None: all components.

        Returns:
            The answer: see `answer`.

        Raises:
            RefusedPacket: If the packet cannot be used. The ensemble is then unchanged.
            ValueError: If the motion is finished, or a Packet is given together with a start, step or component.
        """
        self._check_open()
        packet = acceleration
        if not isinstance(packet, Packet):
            packet = Packet(packet, start, step, component)
        elif (start, step, component) != (None, None, None):
            raise ValueError(
                "push: a Packet has its own start, step and component: give them to wd.packets.Packet(...), or push "
                "the accelerations themselves"
            )
        return self._integrate(self.arriving.accepted(packet))

    def bridge(self) -> xr.Dataset:
        """Fill the gap in the motion by linear interpolation, and return the answer up to the last sample."""
        self._check_open()
        return self._integrate(self.arriving.receiver.bridge())

    def follow(self, packets: Iterable[Packet | ArrayLike], on_refused: str = "raise") -> Iterator[xr.Dataset]:
        """Push the packets of an iterable, and yield the answer after each of them.

        Args:
            packets: The packets, such as those of `packets.from_socket`.
            on_refused: "raise" raises the error of a refused packet; "warn" warns of it and continues.

        Raises:
            TypeError: If `packets` cannot be iterated.
        """
        one_of("on_refused", on_refused, ("raise", "warn"))
        if not isinstance(packets, Iterable):
            raise TypeError(
                f"follow() takes an iterable of packets, got {type(packets).__name__}: give, for example, "
                "wd.packets.from_socket(host, port), or call push() with the values of one packet"
            )
        for packet in packets:
            try:
                yield self.push(packet)
            except RefusedPacket as error:
                if on_refused == "raise":
                    raise
                warn_caller(str(error))

    def answer(self) -> xr.Dataset:
        """Return demands so far, their quantiles and the damage-state probabilities.

        Returns:
            Dataset with the recorded demands of every sample up to `time`, as `simulate` returns them for a record
            that ends here without free vibration; `..._quantile` of each demand, over `quantile`; and, with limits,
            `damage_probability(damage_state)` [1], the share of the samples in each state. A collapsed sample is in
            the heaviest state; failed samples do not count. Residual drifts are missing until `finish`. The attributes
            count the packets, and contain the lag behind real time and the drift of the clock [s]. With
            `keep_samples=False`, the demands of every sample are left out; `failed_count(failure)` and
            `collapsed_count` are the numbers of failed and of collapsed samples.
        """
        if not len(self.record):
            raise ValueError("no sample of all components has arrived yet: call push() first")
        self.paused.write_outputs(self.record[-1:], self.paused.intervals)
        return self._answers.of(self.paused, self.time, self.arriving.report(self.time))

    def finish(self) -> xr.Dataset:
        """End the motion, integrate the free vibration after it, and return the run as a dataset.

        Returns:
            The dataset that `simulate` returns for the whole record, with the same bits (see `Live`); its
            `seconds_integrating` are those of all packets pushed to this Live and of the end. Samples that failed are
            run again with shorter steps, from the start of the record.

        Raises:
            ValueError: If fewer than two samples have arrived, or the motion is finished.
        """
        self._check_open()
        values, gap = self.arriving.whole, self.arriving.receiver.gap
        if len(values) < 2:
            raise ValueError(f"finish() needs at least 2 samples of the motion, got {len(values)}: push more packets")
        if gap:
            warn_caller(
                f"the motion ends before a gap of {gap:.4g} s; the samples after the gap are not used. Call "
                "live.bridge() before finish() to interpolate the gap"
            )
        findings = PlausibilityFindings()
        findings.add("strongest_motion", float(np.abs(values).max()) or np.nan, " that has arrived")
        findings.warn()
        scene = scene_of_record(self.scene, values)
        given = scene, self.structures, self.integration, self.execution, self.seed
        run = finished(*given, self.paused, values[self.paused.intervals :])
        run.attrs["seconds_integrating"] = float(run.attrs["seconds_integrating"]) + self._seconds_integrating
        self.is_finished = True
        return run

    def _integrate(self, receiver: Receiver) -> xr.Dataset:
        """Integrate the samples that a receiver adds, keep the receiver, and return the answer."""
        values, receiver = self.arriving.new_samples(receiver)
        if len(values):
            began = time.perf_counter()
            self.paused.advance(np.concatenate([self.record[-1:], values]))
            self._seconds_integrating += time.perf_counter() - began
        self.arriving.keep(values, receiver)
        answer = self.answer() if len(self.record) else xr.Dataset(attrs=self.arriving.report(self.time))
        for observe in tuple(self.observers):  # an observer may remove itself
            observe(answer)
        return answer

    def _check_open(self) -> None:
        if self.is_finished:
            raise ValueError("the motion of this Live is finished: make a new Live for another motion")


def _check_settings(integration: Integration, execution: Execution) -> None:
    """Raise a ValueError if settings need the whole record before the first step."""
    if integration.target_error is not None:
        raise ValueError(
            "Live does not support target_error, because the pilot run needs the whole record: call wd.plan with an "
            "earlier record, and give its method and longest_step"
        )
    if integration.resample:
        raise ValueError("Live resamples packets by sampling_step=: remove resample, and give the step of the packets")
    if execution.cluster is not None:
        raise ValueError("Live does not support a cluster, whose workers would answer too late: remove cluster")
