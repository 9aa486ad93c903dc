"""Correlation ratios: first-order shares of variance from the structures of any run with random parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.intervals.student_t import jackknife_half_width
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.sensitivity.structure_outputs import STRUCTURE, outputs_of
from warpdyn.campaigns.reductions.limits import DRIFT, Limit
from warpdyn.foundations.core.near_misses import suggests_names

LEAST_STRUCTURES, ENOUGH_STRUCTURES = 32, 256
LEAST_EVEN = 256  # structures of a Sobol sequence that are spread evenly in the classes of each input
MOST_DEPENDENCE = 0.25  # largest share of the ranks of an input that another, independent input may explain
MOST_GROUPS = 50  # groups of structures of the jackknife


@suggests_names
def correlation_ratios(
    run: xr.Dataset,
    *,
    demand: str = DRIFT,
    limits: Mapping[str, Limit] | None = None,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Return the correlation ratio of each random parameter of a run: the share of variance that it explains alone.

    The correlation ratio is the variance of the mean output given the parameter, over the variance of the output. For
    independent parameters it is the first-order Sobol index, from structures that were run anyway. The output of a
    structure is its mean demand over its motions, at each level, or, with `limits`, its fragility median. If each
    structure has only some of the motions, the variability among motions is part of the variance.

    The structures are divided into 2 n^(1/3) classes (the odd number below) of equal number by the parameter; the
    estimate is Kelley's epsilon squared, (between - (classes - 1) * within) / total, which has no bias if the parameter
    has no effect. In a Sobol sequence of at least 256 structures, the other parameters are spread evenly in each class,
    so that the means of classes scatter much less than the estimate assumes; then the estimate is Pearson's eta
    squared, between / total, whose error is half as large (0.002 to 0.004 for 4,096 structures). If structures have
    different motions, random noise or sensor noise, the demands also scatter independently of the inputs, and the
    estimate is Kelley's. Few structures of a Sobol sequence with 5 or more inputs can repeat a pattern between two
    inputs, so that an input without effect would have the ratio of the other one: such runs are refused.

    Sources: Pearson (1905), "On the general theory of skew correlation and non-linear regression", Drapers' Company
    Research Memoirs; Kelley (1935), "An unbiased correlation ratio measure", Proceedings of the National Academy of
    Sciences 21(9). Intervals: jackknife over groups of structures with Student's t.

    Args:
        run: A run with random parameters, as `simulate` returned it, with at least 32 structures.
        demand: Name of the demand; the worst storey or floor counts.
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand], for fragility
            medians; the run needs stripes, with every structure under several motions. None: the demand.
        confidence: Probability that the intervals cover the true value [1].

    Returns:
        `correlation_ratio(input)` [1] with `_lower` and `_upper`, and with the dimension `stripe` for a demand on
        stripes or `damage_state` for medians. A parameter that was drawn by storey is one input per storey. The ratios
        of correlated inputs overlap.

    Raises:
        TypeError: If `run` is not a Dataset.
        ValueError: If the run has no random parameters or fewer than 32 structures, two independent inputs depend on
            each other in its structures, samples failed, samples collapsed and `limits` is None, or a structure has no
            fragility curve.

    Example:
        >>> many = wd.simulate(scene, structures=64, seed=1)
        >>> wd.correlation_ratios(many)["correlation_ratio"].sel(stripe=1.4).round(1).values
        array([0.9])
    """
    check_confidence(confidence)
    outputs = outputs_of("correlation_ratios", run, demand, limits)
    values = outputs.values
    count = len(values)
    if count < LEAST_STRUCTURES:
        raise ValueError(
            f"correlation_ratios needs at least {LEAST_STRUCTURES} structures, got {count}: give simulate(scene, "
            f"structures={ENOUGH_STRUCTURES})"
        )
    names, drawn = _drawn(run, count)
    _check_dependence(run, names, drawn)
    is_even = (
        count >= LEAST_EVEN
        and run[STRUCTURE].attrs.get("sampling") == "sobol"
        and outputs.have_equal_motions
        and not _has_noise(_scene_of(run))
    )
    whole, half = _with_half_width(drawn, values, confidence, is_even=is_even)
    return xr.Dataset(
        {
            f"correlation_ratio{suffix}": outputs.dataset_of(each, "input", name=f"correlation ratio{end}")
            for suffix, each, end in (
                ("", whole, ""),
                ("_lower", whole - half, ", lower bound"),
                ("_upper", whole + half, ", upper bound"),
            )
        },
        {"input": ("input", np.array(names), {"long_name": "random parameter"}), **outputs.coordinates},
        {
            "analysis": "correlation_ratios",
            "demand": demand,
            "structures": count,
            "confidence": float(confidence),
            "estimator": "eta squared" if is_even else "epsilon squared",
            "interval_method": "jackknife over groups of structures, Student's t",
        },
    )


def _scene_of(run: xr.Dataset) -> dict[str, Any]:
    """Return the description of a run's scene; {} if the run has no description."""
    try:
        found: dict[str, Any] = json.loads(str(run.attrs.get("scene", "{}")))
    except json.JSONDecodeError:
        return {}
    return found


def _has_noise(scene: Mapping[str, Any]) -> bool:
    """Return whether the samples of a scene contain random numbers other than those of the inputs."""
    sensors = (scene.get("control") or {}).get("noise") or {}
    return scene.get("excitation", {}).get("type") == "FilteredNoise" or any(sensors.values())


def _check_dependence(run: xr.Dataset, names: list[str], drawn: np.ndarray) -> None:
    """Raise a ValueError if one input explains the ranks of another one, though they were drawn independently.

    Args:
        run: The run.
        names: Name of each input, shape [input].
        drawn: Values of the inputs, shape [input, structure].
    """
    scene = _scene_of(run)
    scatter, parameters = scene["scatter"], [name.split(" (")[0] for name in names]
    correlated = [set(pair.split(" ")) for pair in scene.get("correlation", {})]
    ranks = np.argsort(np.argsort(drawn, axis=1, kind="stable"), axis=1, kind="stable").astype(np.float64)
    share, count = _ratios(drawn, ranks.T), drawn.shape[1]
    for place, of_place in enumerate(parameters):
        for other, of_other in enumerate(parameters):
            both = {of_place, of_other}
            is_random = all("distribution" in scatter[name] for name in both)
            is_independent = (
                both not in correlated if len(both) == 2 else not scatter[of_place].get("storey_correlation")
            )
            if place == other or not is_random or not is_independent:
                share[place, other] = 0.0
    if share.max() > MOST_DEPENDENCE:
        first, second = np.unravel_index(int(share.argmax()), share.shape)
        raise ValueError(
            f"correlation_ratios: in the {count} structures of the run, {names[first]!r} explains "
            f"{100 * share.max():.0f} % of the variance of {names[second]!r}, though the two were drawn independently, "
            "so that the ratio of one would contain the effect of the other: give simulate(scene, structures="
            f"{2 * max(ENOUGH_STRUCTURES, count)}), or Scene(..., sampling='monte_carlo')"
        )


def _drawn(run: xr.Dataset, count: int) -> tuple[list[str], np.ndarray]:
    """Return the names of the drawn inputs of a run, and their values, shape [input, structure]."""
    scattered = list(_scene_of(run).get("scatter", {}))
    _, first = np.unique(run[STRUCTURE].values, return_index=True)
    names, rows = [], []
    for name in scattered:
        if name not in run:
            raise ValueError(
                f"correlation_ratios: the run does not contain the drawn values of {name!r}: do not give "
                "keep_inputs=False to simulate()"
            )
        values = run[name].transpose("sample", ...).values[first].astype(np.float64).reshape(count, -1)
        kept = np.flatnonzero(np.ptp(values, axis=0) > 0)  # NaN in storeys without the parameter, and nominal values
        values = values[:, kept]
        if not kept.size:
            continue
        scale = values / values.mean(axis=0)
        if np.allclose(scale, scale[:, :1], rtol=1e-5):  # one draw for the building
            names.append(name)
            rows.append(values[:, 0])
            continue
        (dim,) = (str(each) for each in run[name].dims if each != "sample")
        labels = run[dim].values if dim in run.coords else np.arange(1, run.sizes[dim] + 1)
        prefix = f"{dim} " if np.issubdtype(np.asarray(labels).dtype, np.integer) else ""
        names += [f"{name} ({prefix}{labels[place]})" for place in kept]
        rows += list(values.T)
    if not names:
        raise ValueError("correlation_ratios: the run has no random parameters: give Scene(..., scatter=...)")
    return names, np.array(rows)


def _with_half_width(
    drawn: np.ndarray, values: np.ndarray, confidence: float, *, is_even: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return correlation ratios and half the widths of their intervals; arguments and shapes: see `_ratios`."""
    count = len(values)
    group = np.random.default_rng(0).permutation(count) % min(count, MOST_GROUPS)
    groups = int(group.max()) + 1
    left = [_ratios(drawn[:, group != each], values[group != each], is_even=is_even) for each in range(groups)]
    return _ratios(drawn, values, is_even=is_even), jackknife_half_width(left, confidence)


def _ratios(drawn: np.ndarray, values: np.ndarray, *, is_even: bool = False) -> np.ndarray:
    """Return the correlation ratio of each input and output, shape [input, output].

    Args:
        drawn: Values of the inputs, shape [input, structure].
        values: Outputs, shape [structure, output].
        is_even: Whether the other inputs are spread evenly in each class: points of a Sobol sequence.
    """
    count = len(values)
    classes = int(2 * count ** (1 / 3) + 1e-9)
    classes -= 1 - classes % 2  # classes of a power of two would align with the points of a Sobol sequence
    total = ((values - values.mean(axis=0)) ** 2).sum(axis=0)
    found = np.empty((len(drawn), values.shape[1]))
    for place, row in enumerate(drawn):
        parts = np.array_split(values[np.argsort(row, kind="stable")], classes)
        within = sum(((part - part.mean(axis=0)) ** 2).sum(axis=0) for part in parts)
        variance = within / (count - classes)
        with np.errstate(invalid="ignore", divide="ignore"):
            found[place] = (total - within - (0 if is_even else classes - 1) * variance) / total
    return found
