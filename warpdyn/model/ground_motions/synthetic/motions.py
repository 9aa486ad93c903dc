"""Synthetic motions from their parameters: filtered and modulated white noise."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.linalg import expm
from scipy.special import gammaincinv, gammaln

from warpdyn.foundations.core.checks import check_memory, finite_numbers, real_number, whole_number
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.random_numbers import key_of
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.synthetic.modulation import gamma_modulation

# Columns of the table of parameters, with their units.
COLUMNS = {
    "arias_intensity": "m/s",
    "duration": "s",
    "middle": "s",
    "frequency": "Hz",
    "frequency_slope": "Hz/s",
    "damping_ratio": "1",
}
LEAST_FREQUENCY = 0.3  # Hz; the filter frequency is not lower
STEADY = 0.01, 0.99  # the filter frequency is constant before and after these shares of the energy
LAST = 0.9995  # share of the energy at which the modulated noise ends
TAIL = 1.6  # duration of the decay of the high-pass filter after it, times its corner frequency
LEAST_STEP = 1e-4  # s; the filter of the strongest motions passes hardly anything above 50 Hz
SHARE_OF_PERIOD = 0.25  # largest step, as a share of the shortest period of the filter
BATCH = 2**22  # samples that are computed at once


@suggests_names
def synthetic_motions(
    parameters: pd.DataFrame,
    seed: int = 0,
    step: float = 0.01,
    high_pass: float = 0.1,
    *,
    device: str | None = None,
) -> list[GroundMotion]:
    """Return synthetic motions with given parameters: white noise, filtered and modulated in time.

    The motion is q(t) x(t), filtered. x(t) is white noise that has passed a linear oscillator, divided by its standard
    deviation at each time; the frequency of the oscillator is `frequency` at the time `middle` and changes by
    `frequency_slope`, but not before 1 % and after 99 % of the energy, and not below 0.3 Hz. q(t)^2 is the energy times
    a gamma density. The high-pass filter is the acceleration of a critically damped oscillator.

    Source: Rezaeian and Der Kiureghian (2008, 2010), Earthquake Engineering & Structural Dynamics 37(10) and 39(10).

    Args:
        parameters: One row per motion with the columns `arias_intensity` [m/s] before the high-pass filter, `duration`
            from 5 to 95 % of it [s], `middle`: time of 45 % of it [s], `frequency` [Hz], `frequency_slope` [Hz/s] and
            `damping_ratio` of the filter [1]. The index contains the indices of the motions; the noise of a motion
            depends only on the seed and its index.
        seed: Seed of the white noise.
        step: Sampling step [s].
        high_pass: Corner frequency of the high-pass filter [Hz].
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU. Motions of a CPU and of a GPU
            agree within rounding.

    Returns:
        The motions, with different durations.

    Raises:
        ValueError: If a column is missing, a value is out of range, a duration is so long compared with `middle` that
            the modulating function does not start at zero, the step is below 1e-4 s or too long for the frequencies, or
            there is no such device.
        TypeError: If `parameters` is not a DataFrame.

    Example:
        >>> table = pd.DataFrame({"arias_intensity": [0.5, 1.0], "duration": 12.0, "middle": 7.0, "frequency": 5.0})
        >>> motions = wd.synthetic_motions(table.assign(frequency_slope=-0.1, damping_ratio=0.3), seed=1)
        >>> len(motions), motions[0].step
        (2, 0.01)
    """
    values, index = _checked_parameters(parameters)
    seed = whole_number("synthetic_motions: seed", seed, 0)
    step = checked_step("synthetic_motions", step)
    corner = real_number("synthetic_motions: high_pass [Hz]", high_pass, above=0)
    shape, scale = gamma_modulation(values["duration"], values["middle"])
    if np.any(shape <= 1):
        row = int(np.argmax(shape <= 1))
        raise ValueError(
            f"synthetic_motions: duration={values['duration'][row]:.4g} s is too long for middle="
            f"{values['middle'][row]:.4g} s in row {row}: the motion would start at full strength; give a duration "
            f"below {_LONGEST * values['middle'][row]:.4g} s"
        )
    fastest = float(fastest_frequencies(values, shape, scale).max())
    if step > SHARE_OF_PERIOD / fastest or corner > 0.1 / step:
        raise ValueError(
            f"synthetic_motions: step={step:g} s is too long for a filter frequency of {fastest:.4g} Hz and high_pass="
            f"{corner:g} Hz: give a step of at most {min(SHARE_OF_PERIOD / fastest, 0.1 / corner):.3g} s"
        )
    samples = np.ceil((scale * gammaincinv(shape, LAST) + TAIL / corner) / step).astype(np.int64) + 1
    findings = PlausibilityFindings()
    findings.add("record_step", step, " of the synthetic motions")
    findings.add_each(
        "synthetic_arias_intensity", values["arias_intensity"].tolist(), lambda row: f" in row {row} of parameters"
    )
    findings.warn()
    check_memory(
        f"{len(index)} synthetic motions", 8.0 * samples.sum(), "generate fewer at once, by first= and number="
    )
    energy = values["arias_intensity"] * 2 * STANDARD_GRAVITY / np.pi  # integral of the squared acceleration [m2/s3]
    start, end = (scale * gammaincinv(shape, share) for share in STEADY)
    motions = {
        "index": index,
        "samples": samples,
        "log_energy": np.log(energy) - shape * np.log(scale) - gammaln(shape),
        "shape": shape,
        "scale": scale,
        "middle": values["middle"],
        "start": start,
        "end": end,
        "frequency": values["frequency"],
        "slope": values["frequency_slope"],
        "damping_ratio": values["damping_ratio"],
    }
    # Imported here, because scenes contain motions, and building a scene must not import warp.
    from warpdyn.engine.kernels.auxiliary.synthetic_motions.launches import generated
    from warpdyn.engine.kernels.queues import checked_devices

    on, *others = checked_devices(device)
    if others:
        raise ValueError(f"synthetic_motions runs on one device, got {device!r}: give device='cuda:0' or 'cpu'")
    found: list[GroundMotion] = []
    edges = np.searchsorted(np.cumsum(samples), np.arange(0, samples.sum() + BATCH, BATCH), side="left")
    edges = np.unique(np.concatenate([[0], edges, [len(index)]])).clip(0, len(index))
    for low, high in pairwise(edges if on == "cpu" else (0, len(index))):  # a GPU divides the motions itself
        batch = {name: column[low:high] for name, column in motions.items()}
        rows = generated(batch, _filter(corner, step), step, LEAST_FREQUENCY, key_of(seed), on)
        found += [GroundMotion(row, step, f"synthetic {i}") for i, row in zip(batch["index"], rows, strict=True)]
    return found


def checked_step(name: str, step: float) -> float:
    """Return the sampling step of synthetic motions [s]; raise a ValueError if it is below LEAST_STEP."""
    value = real_number(f"{name}: step [s]", step, above=0)
    if value < LEAST_STEP:
        raise ValueError(
            f"{name}: step={value:g} s is too short: a motion of 50 s would have {50 / value:,.0f} samples, but its "
            f"filter passes hardly anything above 50 Hz: give a step of at least {LEAST_STEP:g} s, "
            "such as step=0.005"
        )
    return value


def fastest_frequencies(values: Mapping[str, np.ndarray], shape: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return the largest filter frequency of each motion over time [Hz], shape [motion].

    Args:
        values: Columns of the parameters, each of shape [motion].
        shape: Shape of the gamma density of the energy [1], shape [motion].
        scale: Scale of the gamma density [s], shape [motion].
    """
    since = np.array([scale * gammaincinv(shape, share) - values["middle"] for share in STEADY])
    found: np.ndarray = (values["frequency"] + values["frequency_slope"] * since).max(axis=0)
    return np.maximum(found, LEAST_FREQUENCY)


def _filter(corner: float, step: float) -> np.ndarray:
    """Return the coefficients of the high-pass filter over a step, shape [4, 2] in a row, its stiffness and damping.

    Rows: the new displacement and velocity of the oscillator, from displacement, velocity, and acceleration at the
    start and at the end of the step (linear in between).
    """
    w = 2 * np.pi * corner
    system = np.zeros((4, 4))  # displacement, velocity, acceleration and its slope
    system[0, 1] = system[2, 3] = system[1, 2] = 1.0
    system[1, :2] = -(w**2), -2 * w
    over = expm(system * step)[:2]
    at_end = over[:, 3] / step
    rows = np.stack([over[:, 0], over[:, 1], over[:, 2] - at_end, at_end])
    return np.concatenate([rows.ravel(), [w**2, 2 * w]])


def _checked_parameters(parameters: pd.DataFrame) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return the columns of a table of parameters, and the indices of the motions."""
    if not isinstance(parameters, pd.DataFrame):
        raise TypeError(
            f"synthetic_motions: parameters must be a pandas DataFrame with the columns {', '.join(COLUMNS)}, got "
            f"{type(parameters).__name__}"
        )
    names = [str(name) for name in parameters]
    for name in COLUMNS:
        if name not in names:
            raise ValueError(f"synthetic_motions: parameters has no column {name!r}{did_you_mean(name, names)}")
    if not len(parameters):
        raise ValueError("synthetic_motions: parameters has no rows: give one row per motion")
    values = {}
    for name, unit in COLUMNS.items():
        column = finite_numbers(f"synthetic_motions: parameters[{name!r}]", parameters[name].to_numpy())
        bad = np.zeros(column.size, bool) if name == "frequency_slope" else column <= 0
        if name == "damping_ratio":
            bad |= column >= 1
        if bad.any():
            row = int(np.argmax(bad))
            bound = "above 0 and below 1" if name == "damping_ratio" else f"above 0 {unit}"
            raise ValueError(
                f"synthetic_motions: parameters[{name!r}] is {column[row]:g} in row {row}; it must be {bound}"
            )
        values[name] = column
    index = parameters.index.to_numpy()
    if index.dtype.kind not in "iu" or np.any(index < 0) or np.unique(index).size < index.size:
        raise ValueError(
            "synthetic_motions: the index of parameters must contain different whole numbers of at least 0, the "
            "indices of the motions: use parameters.reset_index(drop=True)"
        )
    return values, index.astype(np.int64)


_LONGEST = float((gammaincinv(1.0, 0.95) - gammaincinv(1.0, 0.05)) / gammaincinv(1.0, 0.45))
