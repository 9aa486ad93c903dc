"""Response spectra: peak displacements of linear oscillators under ground motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.engine.methods.oscillator_increments import LARGEST_NORM, halvings_of, oscillator_increments
from warpdyn.foundations.core.checks import real_numbers, whole_number
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.thread_pool import MOST_THREADS, cores
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions, motion_names, motion_numbers
from warpdyn.model.ground_motions.plausibility import warn_of_implausible_motions

# Bounds of period / step of the record. For shorter periods, the result has no correct digits because of rounding, and
# the search for peaks is slow. For longer periods, a bound on the free vibration overflows.
SHORTEST_PERIOD, LONGEST_PERIOD = 1e-5, 1e9


@suggests_names
def response_spectra(
    motions: GroundMotion | Sequence[GroundMotion],
    periods: ArrayLike,
    damping_ratios: ArrayLike = 0.05,
    *,
    device: str | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Return the response spectra of ground motions.

    The base acceleration is linear between samples and zero after the last sample. The response is exact; its peak is
    the maximum over continuous time, including free vibration after the record. The relative rounding error is about
    1e-16 times the phase angle of an undamped oscillator at the end of the record, and smaller with damping.

    Source: Nigam and Jennings (1969), "Calculation of response spectra from strong-motion earthquake records".

    Args:
        motions: One ground motion or several.
        periods: Undamped natural periods [s], one value or a 1-D array.
        damping_ratios: Viscous damping as a fraction of critical [1], from 0 up to but not including 1, one or a 1-D
            array.
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU.
        threads: Number of CPU threads; None: all cores that this process may use.

    Returns:
        Dataset with the dimensions (motion, damping_ratio, period): `spectral_displacement` (relative to the ground);
        `pseudo_spectral_velocity`, its product with the circular frequency; and `pseudo_spectral_acceleration`, its
        product with the squared circular frequency.

    Raises:
        ValueError: If `motions` is empty, a period is not finite and positive or is outside 1e-5 to 1e9 steps of a
            motion, a damping ratio is outside [0, 1), or there is no such device.
        TypeError: If a motion is not a GroundMotion.

    Example:
        >>> spectra = wd.response_spectra(motions, periods=[0.1, 0.3, 1.0], damping_ratios=[0.02, 0.05])
        >>> spectra["pseudo_spectral_acceleration"].sel(period=0.3, damping_ratio=0.05).values.round(1)
        array([ 6.2,  8.4,  7.3, 10.7,  6.1,  5.8,  8.3,  5.3])
    """
    motions = checked_motions(motions)
    periods = _one_or_row("periods", checked_periods(periods, "periods"))
    damping_ratios = _one_or_row("damping_ratios", real_numbers("damping_ratios", damping_ratios))
    bad = damping_ratios[~((damping_ratios >= 0) & (damping_ratios < 1))]
    if bad.size:
        raise ValueError(f"damping_ratios must be from 0 up to but not including 1, got {bad[0]}")
    warn_of_implausible_motions(motions, periods)
    displacement = spectral_displacements(motions, periods, damping_ratios, device=device, threads=threads)
    frequency = 2 * np.pi / periods
    dimensions = ("motion", "damping_ratio", "period")
    spectra = {
        "spectral_displacement": (displacement, "spectral displacement", "m"),
        "pseudo_spectral_velocity": (frequency * displacement, "pseudo-spectral velocity", "m s-1"),
        "pseudo_spectral_acceleration": (frequency**2 * displacement, "pseudo-spectral acceleration", "m s-2"),
    }
    of_damping = {"long_name": "viscous damping as a fraction of critical", "units": "1"}
    return xr.Dataset(
        {name: (dimensions, values, {"long_name": long, "units": u}) for name, (values, long, u) in spectra.items()},
        coords={
            "motion": motion_numbers(len(motions)),
            "motion_name": motion_names(motions),
            "damping_ratio": ("damping_ratio", damping_ratios, of_damping),
            "period": ("period", periods, {"long_name": "undamped natural period", "units": "s"}),
        },
        attrs=trace("Response spectra", "response_spectra"),
    )


def spectral_displacements(
    motions: Sequence[GroundMotion],
    periods: np.ndarray,
    damping_ratios: np.ndarray,
    *,
    device: str | None = "cpu",
    threads: int | None = None,
) -> np.ndarray:
    """Return the spectral displacements [m], shape [motion, damping_ratio, period].

    The arguments are those of `response_spectra`; they are not checked, except for the range of periods.
    """
    # Imported here, because scenes contain intensity measures, and building a scene must not import warp.
    from warpdyn.engine.kernels.auxiliary.oscillator_peaks import largest_displacements
    from warpdyn.engine.kernels.queues import checked_devices

    threads = cores() if threads is None else whole_number("threads", threads, 1, MOST_THREADS)
    first, *others = checked_devices(device)
    if others:
        raise ValueError(f"response spectra run on one device, got {device!r}: give device='cuda:0' or 'cpu'")
    shape = (len(motions), damping_ratios.size, periods.size)
    if 0 in shape:
        return np.empty(shape)
    steps, step_index = np.unique([motion.step for motion in motions], return_inverse=True)
    for motion in motions:
        bad = periods[(periods < SHORTEST_PERIOD * motion.step) | (periods > LONGEST_PERIOD * motion.step)]
        if bad.size:
            raise ValueError(
                f"period {bad[0]:g} s is outside the range for motion {motion.name!r}, which has steps of "
                f"{motion.step:g} s: give periods from {SHORTEST_PERIOD * motion.step:g} to "
                f"{LONGEST_PERIOD * motion.step:g} s (for period 0, use PeakGroundAcceleration)"
            )
    size = np.array([motion.acceleration.size for motion in motions])
    order = np.argsort(-size, kind="stable")  # the longest record first
    records = {
        "acceleration": np.concatenate([motions[i].acceleration for i in order]),
        "first": np.cumsum(size[order]) - size[order],
        "intervals": size[order] - 1,
        "step_index": step_index[order],
        "step": steps,
    }
    damping_ratio, period = (values.ravel() for values in np.meshgrid(damping_ratios, periods, indexing="ij"))
    result = np.empty(shape)
    result[order] = largest_displacements(records, _packed(period, damping_ratio, steps), first, threads).reshape(shape)
    return result


def _packed(period: np.ndarray, damping_ratio: np.ndarray, steps: np.ndarray) -> dict[str, np.ndarray]:
    """Return the arrays about oscillators that the kernel reads, each of shape [step, oscillator] or [oscillator].

    The arrays are propagators, which advance the response by one step, and bounds of the response within a step.

    The bounds decide which steps may contain a peak. Suppose that, within a step h, the displacement exceeds the
    largest value so far, P, and reaches its largest value m at an instant of rest. After this instant, the speed grows
    by at most A + w^2 m per unit of time, where A is the larger of the ground accelerations at the ends of the step.
    Before it, the speed grows by at most exp(2 zeta w t) times this rate, because damping acts backwards in time. One
    end of the step is within h / 2 of the instant. Therefore, m is at most the displacement at this end +
    k (A + w^2 m) h^2 / 8 with k = exp(zeta w h), and the sum of the speeds at both ends is at most k^2 (A + w^2 m) h.
    The displacement also cannot exceed P if the amplitude of the free vibration about the static response, plus the
    static response at one of the ends, is less than P.
    """
    frequency = 2 * np.pi / period
    stiffness, damping, h = frequency**2, 2 * damping_ratio * frequency, steps[:, None]
    norm = (frequency + damping) * h
    halvings = halvings_of(norm)
    increments, response = np.empty((2, *norm.shape, 2, 2))
    for count in np.unique(halvings):
        step, chosen = np.nonzero(halvings == count)
        parts = oscillator_increments(
            stiffness[chosen, None], damping[chosen, None], h[step], frequency=None, halvings=int(count)
        )
        increments[step, chosen], response[step, chosen] = (part[:, :, 0] for part in parts)

    growth = np.exp(np.minimum(damping / 2 * h, 100.0))  # with larger values, the bounds exclude no step anyway
    bend = growth * h**2 / 8
    share = 1 - bend * stiffness
    is_sharp = share > 0.1
    # If share is positive: P < m <= (P + bend A) / share.
    divisor = np.where(is_sharp, share, 1.0)
    turn = np.where(is_sharp, growth**2 * h * (1 + stiffness * bend / divisor), 1e300)
    swing = np.where(is_sharp, growth**2 * h * stiffness / divisor, 1e300)
    damped = frequency * np.sqrt((1 - damping_ratio) * (1 + damping_ratio))
    by_step = {
        "flexibility": 1 / stiffness,
        "lag": damping / stiffness**2 / h,
        "creep": 1 / stiffness / h,
        "sine_by_v": 1 / damped,
        "sine_by_u": damping / 2 / damped,
    }
    return {
        "frequency": frequency,
        "damping_ratio": damping_ratio,
        "pieces": np.maximum(np.ceil(norm / LARGEST_NORM), 1),
        "u_by_u": increments[..., 0, 0],
        "u_by_v": increments[..., 0, 1],
        "v_by_u": increments[..., 1, 0],
        "v_by_v": increments[..., 1, 1],
        # The load on the oscillator is minus the ground acceleration.
        "u_by_start": -response[..., 0, 0],
        "u_by_end": -response[..., 0, 1],
        "v_by_start": -response[..., 1, 0],
        "v_by_end": -response[..., 1, 1],
        "bend": bend,
        "share": share,
        "turn": turn,
        "swing": swing,
    } | {name: np.broadcast_to(values, norm.shape) for name, values in by_step.items()}


def checked_periods(periods: ArrayLike, name: str = "period") -> np.ndarray:
    """Return periods [s] as a float64 array; raise a ValueError unless all are finite and positive."""
    values = real_numbers(name, periods)
    bad = values[~(np.isfinite(values) & (values > 0))]
    if bad.size:
        raise ValueError(
            f"{name} must be finite and above 0 s, got {bad[0]} (for period 0, use PeakGroundAcceleration)"
        )
    return values


def _one_or_row(name: str, values: np.ndarray) -> np.ndarray:
    if values.ndim > 1 or values.size == 0:
        raise ValueError(f"{name} must be one value or a 1-D array of values, got shape {values.shape}")
    return np.atleast_1d(values)
