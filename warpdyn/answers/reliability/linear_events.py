"""Linear events of a scene: its drifts without yielding are linear functions of the normal variables of the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from warpdyn.answers.reliability.densities import LinearEvents
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.running.histories import Histories
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.run import Run
from warpdyn.foundations.core.checks import check_memory
from warpdyn.foundations.core.messages import no_warnings
from warpdyn.model.ground_motions.filtered_noise import Recursion
from warpdyn.model.scene.normal_variables.noise import NoiseOfNormals
from warpdyn.model.scene.scene import Scene

PULSE = 1e-6  # m/s2; no storey yields
MOST_EVENTS = 1000  # times of events per storey
LEAST_SHARE = 1e-9  # events that are less probable, relative to the most probable one, are left out
# Events have a lower threshold than the limit, because drifts between the times of events are larger.
LARGEST_FACTOR = 0.98
# Share of the limit at which samples are compared with a linear response, and their number.
NEAR_LIMIT, CHECKED_SAMPLES = 0.9, 32


def pulse_responses(scene: Scene, integration: Integration, execution: Execution) -> np.ndarray:
    """Return the drifts at the nodes of the noise for unit pulses at the first and second node, [2, time, storey].

    Args:
        scene: The scene without scatter, under FilteredNoise.
        integration: How the structures are integrated; in float64.
        execution: Where they are integrated.
    """
    noise: Any = scene.excitation
    values = np.zeros((2, noise.intervals + 1))
    values[0, 0] = values[1, 1] = PULSE
    pulses = replace(scene, excitation=NoiseOfNormals(values, noise.interval))
    exact = replace(integration, dtype="float64")
    with no_warnings():
        run = Run(pulses, 2, exact, execution, Outputs(histories=Histories([0, 1]), keep_inputs=False), 0).result()
    displacement = run["displacement"].transpose("history", "time", "dof").values
    drift = np.diff(displacement, axis=2, prepend=0.0)
    time = run["time"].values
    nodes = noise.interval * np.arange(1 + int(time[-1] / noise.interval * (1 + 1e-9)))
    place = np.rint(nodes / (time[1] - time[0])).astype(np.int64)
    found: np.ndarray = drift[:, place[place < time.size]] / PULSE
    return found


def directions_of(process: Recursion, envelope: np.ndarray, drift: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the linear functions of the normal values of the noise that give a storey's drift, [time, variable].

    Args:
        process: The process of the noise at the nodes.
        envelope: Envelope of the noise at the nodes [1], shape [node].
        drift: Drift of the storey at the nodes for unit pulses at the first and second node [s2], shape [2, time].
        times: Times of the drifts, as indices of nodes, shape [time].
    """
    states, nodes = process.output.size, envelope.size
    found = np.zeros((nodes, times.size, states))
    adjoint = np.zeros((times.size, states))
    for node in range(nodes - 1, -1, -1):
        lag = times - node + 1
        pulse = np.where(lag > 0, drift[1, np.maximum(lag, 0)], 0.0) if node else drift[0, times]
        adjoint = adjoint @ process.growth + np.outer(pulse * envelope[node], process.output)
        found[node] = adjoint @ (process.kick if node else process.start)
    return found.transpose(1, 0, 2).reshape(times.size, -1)


def linear_events_of(
    scene: Scene, limits: np.ndarray, period: float, integration: Integration, execution: Execution
) -> LinearEvents:
    """Return the events that the drift of a storey without yielding exceeds its limit at a node of the noise.

    The thresholds are lower than the limits by `threshold_factor`, because drifts between nodes are larger. Events are
    computed storey by storey, and improbable ones are left out at once, which saves memory.

    Args:
        scene: The scene without scatter, under FilteredNoise.
        limits: Limit of the drift of each storey [m], shape [storey].
        period: First period of the structure [s].
        integration: How the structures are integrated.
        execution: Where they are integrated.
    """
    noise: Any = scene.excitation
    drifts = pulse_responses(scene, integration, execution)
    last = drifts.shape[1] - 1
    stride = -(-last // MOST_EVENTS)
    times = np.arange(stride, last + 1, stride)
    factor = threshold_factor(stride * noise.interval / period)
    process, envelope = noise.spectrum.recursion(noise.interval), noise.envelope_at_nodes()
    variables = process.output.size * envelope.size
    rows: list[np.ndarray] = []
    distances: list[np.ndarray] = []
    least = np.inf
    for storey, limit in enumerate(limits):
        check_memory(
            f"importance_sampling with {times.size} events of storey {storey + 1} and {variables} variables",
            3 * 8.0 * times.size * variables,
            "give FilteredNoise a shorter duration or a longer interval, or use subset_simulation",
        )
        directions = directions_of(process, envelope, drifts[:, :, storey], times)
        deviation = np.linalg.norm(directions, axis=1)
        with np.errstate(divide="ignore"):
            distance = factor * limit / deviation
        least = min(least, float(distance.min()))
        is_kept = _is_probable(distance, least)
        rows.append(directions[is_kept] / deviation[is_kept, None])
        distances.append(distance[is_kept])
    kept = [_is_probable(each, least) for each in distances]
    return LinearEvents(
        np.concatenate([row[chosen] for row, chosen in zip(rows, kept, strict=True)]),
        np.concatenate([row[chosen] for row, chosen in zip(distances, kept, strict=True)]),
    )


def _is_probable(distance: np.ndarray, least: float) -> np.ndarray:
    """Return whether events are probable enough; the probability of an event is about exp(-distance^2 / 2)."""
    found: np.ndarray = distance**2 < least**2 - 2 * np.log(LEAST_SHARE)
    return found


def threshold_factor(share_of_period: float) -> float:
    """Return the threshold of events divided by the limit, for a time between events as a share of the period [1]."""
    return min(LARGEST_FACTOR, float(np.cos(np.pi * min(0.25, share_of_period))))


def nonlinearity(events: LinearEvents, limit_state: Callable[[np.ndarray], np.ndarray], limit: float) -> float:
    """Return the largest deviation of the demand from a linear function of the normal values [1].

    Samples of the events are scaled until the drift of the events is NEAR_LIMIT of its threshold. If the structure is
    linear, the demand of all samples is then the same share of the limit, apart from peaks between nodes.

    Args:
        events: The linear events.
        limit_state: Limit minus demand for normal values.
        limit: Limit of the demand.
    """
    normals = events.draw(np.random.default_rng(0), CHECKED_SAMPLES)
    reached = (np.abs(normals @ events.directions.T) / events.distances).max(axis=1)
    share = 1.0 - limit_state(normals * (NEAR_LIMIT / reached)[:, None]) / limit
    return float(np.abs(share / NEAR_LIMIT - 1.0).max())
