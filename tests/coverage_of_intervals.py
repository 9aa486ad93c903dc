"""How often the intervals of fragility curves cover the truth; run by hand, copied to docs/explanation/intervals.md.

    python tests/coverage_of_intervals.py [--replications 500] [--device cpu] [--building one_storey|main_job]
        [--records 22 44 100] [--design crossed nested] [--sampling monte_carlo sobol]

Each replication has motions of its own, drawn from one population of filtered noise, and structures of its own, by
Monte Carlo or by a Sobol sequence of its own, crossed (the same structures under every motion) or nested (structures of
its own for every motion). All run as one ensemble. The truth is the fit to the samples of all replications together.
The main job's building (studies/p695_fragility.py) is meant for a GPU.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
import xarray as xr
from scipy.stats import norm, qmc

import warpdyn as wd

PERIOD, HEIGHT = 0.5, 3.0  # of the building of one storey
STIFFNESS = 2e5 * (2 * np.pi / PERIOD) ** 2
STRUCTURES = {"crossed": 16, "nested": 3}
MOTIONS_OF_ALL = 4000  # of the population


@dataclass(frozen=True)
class Case:
    """A building, how it scatters, and what is asked of it.

    Args:
        building: The building whose values are the medians.
        dispersions: Standard deviation of each parameter's logarithm.
        levels: Levels of the spectral acceleration at the first period [g].
        limits: Limit of the storey drift ratio of each damage state [1].
        storeys_alike: Correlation of the storeys' strengths.
        strength_and_stiffness: Correlation of a storey's strength with the stiffness.
        collapse_drift_ratio: Storey drift ratio at which a sample counts as collapsed [1]; None for no such limit.
    """

    building: wd.ShearBuilding
    dispersions: dict[str, float]
    levels: np.ndarray
    limits: dict[str, float]
    storeys_alike: float = 1.0
    strength_and_stiffness: float = 0.0
    collapse_drift_ratio: float | None = None

    @property
    def numbers(self) -> int:
        """Number of random numbers of one structure: of the storeys' strengths one in common and one each."""
        return len(self.dispersions) + self.building.storeys

    def values(self, uniform: np.ndarray) -> dict[str, np.ndarray]:
        """Return the parameters, shape [structure, storey or 1], from uniform numbers, shape [structure, numbers]."""
        parameters = len(self.dispersions)
        normal = norm.ppf(uniform)
        own = dict(zip(self.dispersions, normal[:, :parameters].T, strict=True))
        common = self.strength_and_stiffness * own["stiffness"]
        common = common + np.sqrt(1 - self.strength_and_stiffness**2) * own["yield_force"]
        strengths = np.sqrt(self.storeys_alike) * common[:, None]
        strengths = strengths + np.sqrt(1 - self.storeys_alike) * normal[:, parameters:]
        of_all = {name: values[:, None] for name, values in own.items()} | {"yield_force": strengths}
        return {name: np.exp(of_all[name] * dispersion) for name, dispersion in self.dispersions.items()}


def one_storey() -> Case:
    """Return one storey that yields, whose first period is half a second."""
    law = {"law": "bilinear", "yield_force": STIFFNESS * 0.004 * HEIGHT, "hardening_ratio": 0.02}
    building = wd.ShearBuilding([2e5], [STIFFNESS], HEIGHT, **law, damping="modal", damping_ratio=0.05)
    dispersions = {"mass": 0.1, "stiffness": 0.2, "yield_force": 0.25, "damping_ratio": 0.3}
    levels = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.3, 1.7, 2.5])
    return Case(building, dispersions, levels, {"slight": 0.005, "complete": 0.03})


def main_job() -> Case:
    """Return the five storeys of studies/p695_fragility.py."""
    building = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5, damping_modes=(1, 3))
    dispersions = {"mass": 0.1, "stiffness": 0.2, "yield_force": 0.25, "damping_ratio": 0.3}
    levels = np.array([0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.5])
    return Case(building, dispersions, levels, wd.hazus_drift_limits("C1M", "high"), 0.8, 0.6, 0.1)


CASES = {"one_storey": one_storey, "main_job": main_job}


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


def uniforms(replications: int, count: int, numbers: int, sampling: str, seed: int) -> np.ndarray:
    """Return uniform numbers, shape [replication x structure, numbers]."""
    if sampling == "monte_carlo":
        return np.random.default_rng(seed).random((replications * count, numbers))
    return np.concatenate([qmc.Sobol(numbers, rng=seed + each).random(count) for each in range(replications)])


def run(case: Case, records: int, design: str, sampling: str, replications: int, device: str, seed: int) -> xr.Dataset:
    """Return all replications as one run, with `replication` along the samples."""
    generator, motions = np.random.default_rng(seed), population(seed)
    structures = STRUCTURES[design] * (records if design == "nested" else 1)
    drawn = case.values(uniforms(replications, structures, case.numbers, sampling, seed))
    chosen = np.stack([generator.permutation(MOTIONS_OF_ALL)[:records] for _ in range(replications)])
    # Indices of each sample: replication, structure, motion, level.
    if design == "crossed":
        shape = replications, structures, records, case.levels.size
        replication, structure, motion, level = (part.ravel() for part in np.indices(shape, np.int32))
    else:
        shape = replications, records, STRUCTURES[design], case.levels.size
        replication, motion, own, level = (part.ravel() for part in np.indices(shape, np.int32))
        structure = motion * STRUCTURES[design] + own
    index = chosen[replication, motion]
    measure = wd.SpectralAcceleration(case.building.fundamental_period)
    intensity = measure.values(motions) / 9.80665
    scale = case.levels[level] / intensity[index]
    excitation = wd.OneMotionPerStructure(motions, index.astype(np.int32), scale, measure)
    of_sample = replication * structures + structure
    scatter = {}
    for name, factors in drawn.items():
        values = np.atleast_1d(case.building.parameters[name]) * factors[of_sample]
        scatter[name] = wd.GivenValues(values[:, 0] if name == "damping_ratio" else values)
    limit = {} if case.collapse_drift_ratio is None else {"collapse_drift_ratio": case.collapse_drift_ratio}
    scene = wd.Scene(case.building, excitation, scatter, recorders=("drift",), tail=0.0, **limit)
    result = wd.simulate(scene, structures=index.size, seed=seed, device=device, keep_inputs=False, sample_error=None)
    label = {"units": "g", "design": "stripes"}
    return result.assign_coords(
        structure=("sample", structure, {"sampling": sampling}),
        motion_index=("sample", motion),
        im_level=("sample", case.levels[level], label),
        replication=("sample", replication),
    )


def covers(part: xr.Dataset, limits: dict[str, float], truth: xr.Dataset) -> np.ndarray:
    """Return whether the intervals of median and dispersion cover, shape [estimate, damage_state]."""
    curves = wd.fragility(part, limits)
    names = ("fragility_median", "fragility_dispersion")
    return np.array([(curves[f"{n}_lower"] <= truth[n]) & (truth[n] <= curves[f"{n}_upper"]) for n in names])


def coverage(case: Case, records: int, design: str, sampling: str, replications: int, device: str) -> np.ndarray:
    """Return the shares of intervals that cover, shape [estimate, damage_state]."""
    whole = run(case, records, design, sampling, replications, device, seed=1000 * records)
    samples = whole.sizes["sample"] // replications
    together = whole.assign_coords(motion_index=whole["motion_index"] + records * whole["replication"])
    truth = wd.fragility(together, case.limits, intervals_over="records")
    parts = [whole.isel(sample=slice(number * samples, (number + 1) * samples)) for number in range(replications)]
    with multiprocessing.get_context("spawn").Pool(len(os.sched_getaffinity(0))) as processes:
        return np.mean(processes.map(partial(covers, limits=case.limits, truth=truth), parts), axis=0)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--replications", type=int, default=500)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--building", choices=CASES, default="one_storey")
    parser.add_argument("--records", type=int, nargs="+", default=[22, 44, 100])
    parser.add_argument("--design", nargs="+", choices=STRUCTURES, default=list(STRUCTURES))
    parser.add_argument("--sampling", nargs="+", choices=("monte_carlo", "sobol"), default=["monte_carlo", "sobol"])
    asked = parser.parse_args()
    case = CASES[asked.building]()
    print(f"| records | design | sampling | median: {', '.join(case.limits)} | dispersion |\n|-|-|-|-|-|")
    for records, design, sampling in product(asked.records, asked.design, asked.sampling):
        shares = coverage(case, records, design, sampling, asked.replications, asked.device)
        told = " | ".join(", ".join(f"{share:.3f}" for share in row) for row in shares)
        print(f"| {records} | {design} | {sampling} | {told} |", flush=True)


if __name__ == "__main__":
    main()
