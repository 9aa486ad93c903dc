"""Exact variances of random motions and of oscillators under them, and variances from the kernels.

`python tests/noise_statistics.py 1000000 [device]` prints every variance beside its truth, in standard errors.
"""

import functools
import sys

import numpy as np
import warp as wp
from scipy.linalg import expm

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.engine.kernels.arguments import brought
from warpdyn.engine.kernels.functions.noise import noise_of
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.plan import Plan, row_types, structs
from warpdyn.engine.laws import Elastic
from warpdyn.foundations.core.random_numbers import key_of

LANES = 2
INTENSITY, GROUND, OMEGA, RATIO = 0.01, (15.0, 0.6), 2 * np.pi, 0.05
OSCILLATOR = wd.ShearBuilding(1.0, OMEGA**2, 1.0, damping="storey", damping_coefficient=2 * RATIO * OMEGA)
WHITE = wd.WhiteNoise(INTENSITY)
KANAI_TAJIMI = wd.KanaiTajimi(INTENSITY, *GROUND)
# Of the white noise itself, from rest (closed form); what is linear over 0.02 s has this part of the stationary one.
VARIANCES = {1.0: 5.91375671361e-4, 2.0: 9.06619334743e-4, 5.0: 1.21199841594e-3, 10.0: 1.26416811277e-3}
STATIONARY, PART_OF_WHITE_NOISE = 0.00126651479552922, 0.997382189432
# Stationary, under Kanai and Tajimi's motion itself; and of that motion.
KANAI_TAJIMI_VARIANCE, KANAI_TAJIMI_ACCELERATION = 0.001682483798251, 0.95818575934489


def van_loan(matrix: np.ndarray, covariance: np.ndarray, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Return e^{A h} and the covariance that noise adds over h (Van Loan 1978, IEEE TAC 23(3))."""
    n = len(matrix)
    joined = expm(np.block([[-matrix, covariance], [np.zeros((n, n)), matrix.T]]) * interval)
    return joined[n:, n:].T, joined[n:, n:].T @ joined[:n, n:]


def oscillator_variances(spectrum: wd.WhiteNoise | wd.KanaiTajimi, interval: float, count: int) -> np.ndarray:
    """Return the exact variance of the oscillator's displacement from rest at each node of a stationary motion.

    The motion is straight between nodes. Oscillator and motion are one linear recursion, of which the covariance is
    taken from node to node; its matrices are not the engine's.
    """
    if isinstance(spectrum, wd.WhiteNoise):
        growth, added, output = np.zeros((1, 1)), np.array([[2 * np.pi * INTENSITY / interval]]), np.ones(1)
        start = added
    else:
        frequency, ratio = GROUND
        matrix = np.array([[0, 1], [-(frequency**2), -2 * ratio * frequency]])
        growth, added = van_loan(matrix, np.diag([0, 2 * np.pi * INTENSITY]), interval)
        output = matrix[1]
        start = np.pi * INTENSITY / (2 * ratio * frequency) * np.diag([1 / frequency**2, 1])
    moving = np.zeros((4, 4))  # displacement, velocity, the motion and its rate
    moving[0, 1] = moving[2, 3] = 1
    moving[1] = [-(OMEGA**2), -2 * RATIO * OMEGA, -1, 0]
    over = expm(moving * interval)[:2]
    by_start, by_end = over[:, 2] - over[:, 3] / interval, over[:, 3] / interval
    size = len(growth)
    step = np.zeros((2 + size, 2 + size))
    step[:2, :2], step[2:, 2:] = over[:, :2], growth
    step[:2, 2:] = np.outer(by_start, output) + np.outer(by_end, output) @ growth
    entry = np.vstack([np.outer(by_end, output), np.eye(size)])
    state = np.zeros_like(step)
    state[2:, 2:] = start
    variances = [0.0]
    for _ in range(count):
        state = step @ state @ step.T + entry @ added @ entry.T
        variances.append(state[0, 0])
    return np.array(variances)


@functools.cache
def path_kernel(load: str, dtype: str) -> wp.Kernel:
    """Return the kernel that writes every interval's motion, as the kernels of structures read it."""
    plan = Plan("chain", 1, Elastic.variants["elastic"], "none", load, ("drift",), "rk4", dtype, LANES, 1)
    noise, types, number = noise_of(plan), structs(dtype), getattr(wp, dtype)
    Processes, Numbers, over_interval = noise.Processes, noise.Numbers, noise.over_interval
    row, _, indices = row_types(plan)

    @wp.kernel(module="unique", enable_backward=False)
    def follow(
        loads: types.Load,
        key: wp.uint64,
        first: wp.uint64,
        intervals: int,
        begin: wp.array2d(dtype=number),
        change: wp.array2d(dtype=number),
    ):
        column = LANES * wp.tid()
        processes = Processes()
        numbers = Numbers()
        run = indices()
        scale = row()
        for j in range(LANES):
            numbers[j] = first + wp.uint64(column + j)
            run[j] = intervals
            scale[j] = number(1.0)
        for interval in range(begin.shape[0]):
            here, more, processes = over_interval(loads, key, numbers, interval, run, scale, processes)
            for j in range(LANES):
                begin[interval, column + j] = here[j]
                change[interval, column + j] = more[j]

    return follow


def paths(
    noise: wd.FilteredNoise, samples: int, *, seed: int, first: int = 0, run: int = 0, dtype="float64", device="cpu"
) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion at each interval's start and its change over it, shape [interval, sample], one past the end.

    Args:
        noise: The motion.
        samples: Number of samples, which is even.
        seed: Seed of the motions.
        first: Index of the first sample.
        run: Intervals of the run; 0 for those of the motion and one more.
        dtype: Type of the motion's values.
        device: Warp device.
    """
    scene = wd.Scene(OSCILLATOR, noise)
    timeline = prepare(scene, structures=1, method="rk4", dtype=dtype, device=device)[0].timeline
    loads = brought("Load", scene.excitation.pack(timeline, scene.structure.dofs), dtype, device)
    shape = (noise.intervals + 1, samples)
    begin, change = (wp.full(shape, np.nan, dtype=getattr(wp, dtype), device=device) for _ in range(2))
    arguments = [loads, key_of(seed), first, run or noise.intervals + 1, begin, change]
    kernel = loaded(path_kernel(scene.excitation.kernel_load, dtype), device)
    wp.launch(kernel, dim=samples // LANES, inputs=arguments, device=device)
    return begin.numpy(), change.numpy()


def displacements(
    noise: wd.FilteredNoise,
    times: list[float],
    samples: int,
    *,
    seed: int,
    device="cpu",
    method="exact",
    at_a_time=100_000,
) -> np.ndarray:
    """Return the oscillator's displacement under each sample's motion at some times [s], shape [time, sample]."""
    scene = wd.Scene(OSCILLATOR, noise, recorders=("drift",), tail=0.0)
    step = noise.interval
    run, _ = prepare(scene, structures=samples, method=method, dtype="float32", step=step, seed=seed, device=device)
    every = int(np.gcd.reduce(np.round(np.array(times) / step).astype(int)))
    rows = np.round(np.array(times) / step).astype(int) // every
    parts = []
    for start in range(0, samples, at_a_time):
        _, values = run.integrate_histories(range(start, min(start + at_a_time, samples)), every, step)
        parts.append(values["displacement"][:, rows, 0].T)
    return np.concatenate(parts, axis=1)


def in_standard_errors(values: np.ndarray, variance: float | np.ndarray) -> np.ndarray:
    """Return how far the mean square of normal values, sample last, is from their variance, in standard errors."""
    squares = np.mean(np.square(values, dtype=np.float64), axis=-1)
    return (squares / variance - 1) / np.sqrt(2 / values.shape[-1])


def errors(samples: int, *, seed: int = 0, device: str = "cpu") -> dict[str, float]:
    """Return how far every variance is from its truth, in standard errors of so many samples."""
    found = {}
    white = wd.FilteredNoise(WHITE, 10.0, 0.02)
    times = list(VARIANCES)
    moved = displacements(white, times, samples, seed=seed, device=device)
    truth = np.array(list(VARIANCES.values())) * PART_OF_WHITE_NOISE
    for time, error in zip(times, in_standard_errors(moved, truth), strict=True):
        found[f"displacement under white noise at {time:g} s"] = float(error)
    filtered = wd.FilteredNoise(KANAI_TAJIMI, 20.0, 0.01)
    moved = displacements(filtered, [20.0], samples, seed=seed, device=device)
    part = oscillator_variances(KANAI_TAJIMI, 0.01, 2000)[-1] / KANAI_TAJIMI_VARIANCE
    [error] = in_standard_errors(moved, KANAI_TAJIMI_VARIANCE * part)
    found[f"displacement under Kanai-Tajimi noise, of which nodes keep {part:.5f}"] = float(error)
    begin, _ = paths(wd.FilteredNoise(KANAI_TAJIMI, 1.0, 0.1), samples, seed=seed + 1, device=device)
    for node in (0, 1, 5):
        error = in_standard_errors(begin[node], KANAI_TAJIMI_ACCELERATION)
        found[f"acceleration of Kanai-Tajimi noise at node {node}"] = float(error)
    return found


if __name__ == "__main__":
    for name, value in errors(int(sys.argv[1]), device=sys.argv[2] if len(sys.argv) > 2 else "cpu").items():
        print(f"{name:<75} {value:+.2f} standard errors")
