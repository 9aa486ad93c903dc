"""How often the intervals of fragility curves cover the truth; run by hand, and copied to docs/statistics.md.

    python tests/coverage_of_intervals.py [replications] [device] [records design sampling]

Each replication has motions of its own, drawn from one population of filtered noise, and structures of its own, by
Monte Carlo or by a Sobol sequence of its own, crossed (the same structures under every motion) or nested (structures of
its own for every motion). All run as one ensemble. The truth is the fit to the samples of all replications together.
"""

from __future__ import annotations

import sys
from itertools import product

import numpy as np
import xarray as xr
from scipy.stats import norm, qmc

import warpdyn as wd

LEVELS = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.3, 1.7, 2.5])
LIMITS = {"slight": 0.005, "complete": 0.03}
DISPERSIONS = {"mass": 0.1, "stiffness": 0.2, "yield_force": 0.25, "damping_ratio": 0.3}
PERIOD, HEIGHT = 0.5, 3.0
STIFFNESS = 2e5 * (2 * np.pi / PERIOD) ** 2
NOMINAL = {"mass": 2e5, "stiffness": STIFFNESS, "yield_force": STIFFNESS * 0.004 * HEIGHT, "damping_ratio": 0.05}
STRUCTURES = {"crossed": 16, "nested": 3}
MOTIONS_OF_ALL = 4000  # of the population


def building() -> wd.ShearBuilding:
    """Return one storey that yields, whose first period is half a second."""
    stiffness, strength, ratio = (NOMINAL[name] for name in ("stiffness", "yield_force", "damping_ratio"))
    law = {"law": "bilinear", "yield_force": strength, "hardening_ratio": 0.02}
    return wd.ShearBuilding([NOMINAL["mass"]], [stiffness], HEIGHT, **law, damping="modal", damping_ratio=ratio)


def population(seed: int) -> list[wd.GroundMotion]:
    """Return motions of filtered noise: a hard and a soft soil, short and long, of 10 s."""
    generator, time = np.random.default_rng(seed), 0.02 * np.arange(400)
    motions = []
    for number in range(MOTIONS_OF_ALL):
        frequency = 2 * np.pi * np.exp(generator.normal(np.log(2.5), 0.4))
        noise = np.fft.rfft(generator.standard_normal(time.size))
        at = 2 * np.pi * np.fft.rfftfreq(time.size, 0.02)
        ratio = at / frequency
        gain = np.sqrt((1 + (1.2 * ratio) ** 2) / ((1 - ratio**2) ** 2 + (1.2 * ratio) ** 2))
        peak = np.exp(generator.normal(np.log(1.5), 0.3))
        envelope = (time / peak) * np.exp(1 - time / peak)
        values = np.fft.irfft(noise * gain, time.size) * envelope
        values -= values.mean()
        motions.append(wd.GroundMotion(values / np.abs(values).max(), 0.02, f"noise {number}"))
    return motions


def factors(replications: int, count: int, sampling: str, seed: int) -> np.ndarray:
    """Return factors on the parameters, shape [replication, structure, parameter]."""
    if sampling == "monte_carlo":
        uniform = np.random.default_rng(seed).random((replications, count, len(DISPERSIONS)))
    else:
        uniform = np.stack([qmc.Sobol(len(DISPERSIONS), rng=seed + each).random(count) for each in range(replications)])
    return np.exp(norm.ppf(uniform) * np.array(list(DISPERSIONS.values())))


def run(records: int, design: str, sampling: str, replications: int, device: str, seed: int) -> xr.Dataset:
    """Return all replications as one run, with `replication` along the samples."""
    generator, motions = np.random.default_rng(seed), population(seed)
    structures = STRUCTURES[design] * (records if design == "nested" else 1)
    drawn = factors(replications, structures, sampling, seed)
    chosen = np.stack([generator.permutation(MOTIONS_OF_ALL)[:records] for _ in range(replications)])
    # Indices of each sample: replication, structure, motion, level.
    if design == "crossed":
        shape = replications, structures, records, LEVELS.size
        replication, structure, motion, level = (part.ravel() for part in np.indices(shape))
    else:
        shape = replications, records, STRUCTURES[design], LEVELS.size
        replication, motion, own, level = (part.ravel() for part in np.indices(shape))
        structure = motion * STRUCTURES[design] + own
    index = chosen[replication, motion]
    measure = wd.SpectralAcceleration(PERIOD)
    intensity = measure.values(motions) / 9.80665
    excitation = wd.OneMotionPerStructure(motions, index.astype(np.int32), LEVELS[level] / intensity[index], measure)
    of_sample = drawn[replication, structure]
    scatter = {}
    for place, name in enumerate(DISPERSIONS):
        values = NOMINAL[name] * of_sample[:, place]
        scatter[name] = wd.GivenValues(values if name == "damping_ratio" else values[:, None])
    scene = wd.Scene(building(), excitation, scatter, recorders=("drift",), tail=0.0)
    result = wd.simulate(scene, structures=index.size, seed=seed, device=device, keep_inputs=False, sample_error=None)
    label = {"units": "g", "design": "stripes"}
    return result.assign_coords(
        structure=("sample", structure, {"sampling": sampling}),
        motion_index=("sample", motion),
        im_level=("sample", LEVELS[level], label),
        replication=("sample", replication),
    )


def coverage(records: int, design: str, sampling: str, replications: int, device: str) -> dict[str, list[float]]:
    """Return the shares of intervals that cover, by damage state and estimate."""
    whole = run(records, design, sampling, replications, device, seed=1000 * records)
    samples = whole.sizes["sample"] // replications
    together = whole.assign_coords(motion_index=whole["motion_index"] + records * whole["replication"])
    truth = wd.fragility(together, LIMITS, intervals_over="records")
    found: dict[str, list[float]] = {}
    covers = {name: [] for name in ("median", "dispersion")}
    for number in range(replications):
        part = whole.isel(sample=slice(number * samples, (number + 1) * samples))
        curves = wd.fragility(part, LIMITS)
        for name, rows in covers.items():
            true = truth[f"fragility_{name}"].values
            rows.append((curves[f"fragility_{name}_lower"] <= true) & (true <= curves[f"fragility_{name}_upper"]))
    for name, rows in covers.items():
        found[name] = np.mean([row.values for row in rows], axis=0).tolist()
    return found


def main() -> None:
    """Print the table."""
    replications = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    device = sys.argv[2] if len(sys.argv) > 2 else "cpu"
    print(f"| records | design | sampling | median: {', '.join(LIMITS)} | dispersion |\n|-|-|-|-|-|")
    chosen = [(int(sys.argv[3]), *sys.argv[4:6])] if len(sys.argv) > 5 else None
    for records, design, sampling in chosen or product((22, 44, 100), STRUCTURES, ("monte_carlo", "sobol")):
        shares = coverage(records, design, sampling, replications, device)
        told = " | ".join(", ".join(f"{share:.3f}" for share in row) for row in shares.values())
        print(f"| {records} | {design} | {sampling} | {told} |", flush=True)


if __name__ == "__main__":
    main()
