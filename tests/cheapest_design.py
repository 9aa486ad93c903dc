"""The cheapest fixed design of the main job's fragility curves, by exhaustive search, against `fragility_to`.

    python tests/cheapest_design.py [precision] [seeds] [device]

It is run by hand, and its figures are copied to docs/explanation/intervals.md. Fixed designs are nested stripes
(structures of each record's own, on any of the candidate levels) and `capacities` of a fixed bracket width. Stripes are
drawn from one large table, whose structures and levels are many: what the intervals of every set of levels come to
follows from it by the sandwich variance, and the most promising sets are then fitted for every seed. A design meets the
precision if half the interval of every median is as narrow in 95 of 100 seeds. The records are the same in all seeds.
"""

from __future__ import annotations

import math
import sys
import warnings
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.special import ndtr
from scipy.stats import t as student

import warpdyn as wd

sys.path.insert(0, str(Path(__file__).parents[1] / "studies"))
from p695_fragility import DRIFT_LIMITS, build_scene

LEVELS = 0.04 * 1.06 ** np.arange(98)
CANDIDATES = np.arange(20, 92, 3)  # of the levels, from 0.13 to 7.2 g
STRUCTURES = 128  # of each record's own, in the table
MOST_PER_RECORD = 12  # histories of each record that designs are searched to
MET, TRIED, TRIED_SEEDS = 0.95, 40, 20
WIDTHS = (0.1, 0.3, 0.5, 0.7)
# A level that fewer of the samples pass, or all but fewer, has no share between 0 and 1 in one of ten seeds with 44
# records: a state needs two that have.
LEAST_SHARE = 0.05


@dataclass
class Table:
    """Many structures of each record on many levels.

    Args:
        run: The run.
        passes: Whether each limit is passed, shape [damage_state, motion, structure, level].
    """

    run: xr.Dataset
    passes: np.ndarray

    def drawn(self, levels: np.ndarray, structures: int, seed: int) -> xr.Dataset:
        """Return the samples of some levels and of some structures of each motion, drawn at random."""
        motions = self.passes.shape[1]
        generator = np.random.default_rng(seed)
        own = np.stack([generator.permutation(STRUCTURES)[:structures] for _ in range(motions)])
        structure = own + STRUCTURES * np.arange(motions)[:, None]
        return self.run.isel(sample=(structure[..., None] * LEVELS.size + levels).ravel())


def table(device: str) -> Table:
    """Run the table."""
    scene = build_scene()
    design = scene.excitation
    stripes = wd.Stripes(design.motions, LEVELS.tolist(), design.measure, structures_per_motion=STRUCTURES)
    run = wd.simulate(replace(scene, excitation=stripes, recorders=("drift",)), seed=12345, device=device)
    run = run[["peak_storey_drift_ratio", "status"]].load()
    drift = np.where(run["status"] == 1, np.inf, run["peak_storey_drift_ratio"].max("storey"))
    drift = drift.reshape(len(design.motions), STRUCTURES, LEVELS.size)
    return Table(run, np.stack([drift > limit for limit in DRIFT_LIMITS.values()]))


def probit(share: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the weight of each level's exceedances in the estimate of ln(median), and their probability.

    Args:
        share: Share that passes at each level, shape [set of levels, level].
        x: Logarithms of the levels, likewise.
    """
    low, high = (np.where(keep, x, fill) for keep, fill in ((share <= 0.5, -np.inf), (share > 0.5, np.inf)))
    centre = np.nan_to_num((low.max(1) + high.min(1)) / 2, posinf=x.max(), neginf=x.min())
    log_deviation = np.full(len(x), np.log(0.35))
    for _ in range(40):  # Fisher scoring
        deviation = np.exp(log_deviation)[:, None]
        z = (x - centre[:, None]) / deviation
        probability = np.clip(ndtr(z), 1e-9, 1 - 1e-9)
        density = np.exp(-(z**2) / 2) / math.sqrt(2 * math.pi)
        slopes = np.stack([-density / deviation, -density * z], axis=1)
        weighted = slopes / (probability * (1 - probability))[:, None]
        information = np.einsum("kal,kbl->kab", weighted, slopes) + 1e-10 * np.eye(2)
        step = np.linalg.solve(information, (weighted * (share - probability)[:, None]).sum(2)[..., None])[..., 0]
        step = np.clip(step, -0.3, 0.3)
        centre, log_deviation = centre + step[:, 0], np.clip(log_deviation + step[:, 1], -3, 1)
    return np.einsum("ka,kal->kl", np.linalg.inv(information)[:, 0], weighted), probability


def half_widths(many: Table, sets: np.ndarray, structures: int, most: float) -> np.ndarray:
    """Return half the widest interval of a median that each set of levels comes to, relative; infinite above `most`."""
    motions = many.passes.shape[1]
    quantile = student.ppf(0.975, motions - 1)
    widest = np.zeros(len(sets))
    for passes in many.passes[::-1]:  # of the widest interval first
        share = passes.mean((0, 1))[sets]
        tells = (share > LEAST_SHARE) & (share < 1 - LEAST_SHARE)
        widest[tells.sum(axis=1) < 2] = np.inf
        sound = np.flatnonzero(np.isfinite(widest))
        if not sound.size:
            break
        weight, probability = probit(share[sound], np.log(LEVELS)[sets[sound]])
        by_structure = passes.astype(np.float32)
        for number, weights, expected in zip(sound, weight, probability, strict=True):
            influence = (by_structure[..., sets[number]] - expected.astype(np.float32)) @ weights.astype(np.float32)
            within = influence.var(axis=1, ddof=1).mean()
            among = max(influence.mean(axis=1).var(ddof=1) - within / STRUCTURES, 0.0)
            half = quantile * math.sqrt((among + within / structures) / motions)
            widest[number] = max(widest[number], math.expm1(half)) if half <= math.log1p(most) else np.inf
    return widest


def reached(curves: xr.Dataset) -> np.ndarray:
    """Return half the interval of each median, relative; infinite where there is no fit."""
    half = (curves["fragility_median_upper"] / curves["fragility_median_lower"]).values ** 0.5 - 1
    return np.where(np.isnan(half), np.inf, half)


def covers(curves: xr.Dataset, truth: np.ndarray) -> np.ndarray:
    """Return whether the interval of each median holds the truth."""
    low, high = curves["fragility_median_lower"].values, curves["fragility_median_upper"].values
    return (low <= truth) & (truth <= high)


def row(name: str, histories: float, met: float, covered: np.ndarray) -> None:
    """Print a row of the table."""
    told = ", ".join(f"{share:.2f}" for share in np.mean(covered, axis=0))
    print(f"| {name} | {histories:,.0f} | {met:.2f} | {told} |", flush=True)


def cheapest_stripes(many: Table, precision: float, seeds: int) -> None:
    """Print the cheapest nested stripes that meet the precision."""
    truth = wd.fragility(many.run, DRIFT_LIMITS, intervals_over="records")["fragility_median"].values
    sizes = {}
    for per_record in range(3, MOST_PER_RECORD + 1):
        for structures in (n for n in range(1, per_record) if per_record % n == 0 and per_record // n > 2):
            count = per_record // structures
            if count not in sizes:
                sizes[count] = np.array(list(combinations(CANDIDATES, count)))
            sets = sizes[count]
            predicted = half_widths(many, sets, structures, 1.05 * precision)
            for number in np.argsort(predicted)[:TRIED]:
                if np.isinf(predicted[number]):
                    break
                outcomes: list[tuple[bool, np.ndarray]] = []
                for seed in range(seeds):
                    curves = wd.fragility(many.drawn(sets[number], structures, seed), DRIFT_LIMITS)
                    outcomes.append((bool((reached(curves) <= precision).all()), covers(curves, truth)))
                    if seed + 1 == TRIED_SEEDS and np.mean([met for met, _ in outcomes]) < MET - 0.1:
                        break
                met = float(np.mean([met for met, _ in outcomes]))
                if met >= MET:
                    levels = ", ".join(f"{level:.2f}" for level in LEVELS[sets[number]])
                    name = f"stripes at {levels} g, {structures} of each record's own"
                    row(name, many.passes.shape[1] * per_record, met, np.array([each for _, each in outcomes]))
                    return
            print(f"{len(sets)} sets of {count} levels, {structures}: at best {predicted.min():.4f}", file=sys.stderr)


def fixed_capacities(precision: float, seeds: int, device: str, truth: np.ndarray) -> None:
    """Print what `capacities` of fixed bracket widths come to."""
    scene = build_scene()
    design = scene.excitation
    for width in WIDTHS:
        stripes = wd.Stripes(design.motions, [1.0], design.measure, structures_per_motion=1)
        found = [
            wd.capacities(
                replace(scene, excitation=stripes),
                DRIFT_LIMITS,
                tolerance=width,
                ladder=1 + width,
                highest=math.inf,
                seed=seed,
                device=device,
            )
            for seed in range(seeds)
        ]
        curves = [wd.fragility_from_capacities(each) for each in found]
        met = float(np.mean([(reached(each) <= precision).all() for each in curves]))
        histories = float(np.mean([each.attrs["histories"] for each in found]))
        row(f"capacities to {100 * width:.0f} %, one of each", histories, met, [covers(each, truth) for each in curves])


def main() -> None:
    """Print the table of designs."""
    warnings.simplefilter("ignore")
    precision = float(sys.argv[1]) if len(sys.argv) > 1 else 0.15
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    device = sys.argv[3] if len(sys.argv) > 3 else "cpu"
    many = table(device)
    first = np.where(many.passes.any(axis=-1), many.passes.argmax(axis=-1), LEVELS.size - 1)
    truth = np.exp(np.log(LEVELS[first]).mean(axis=(1, 2))) / 1.06**0.5
    print("| design | histories | met | medians covered |\n|-|-|-|-|")
    curves = [
        wd.fragility_to(build_scene(), DRIFT_LIMITS, precision, seed=seed, device=device) for seed in range(seeds)
    ]
    met = float(np.mean([(each["half_width"] <= precision).all() for each in curves]))
    spent = float(np.mean([each.attrs["histories"] + each.attrs["pilot_histories"] for each in curves]))
    row("`fragility_to`, all it spends", spent, met, [covers(each, truth) for each in curves])
    cheapest_stripes(many, precision, seeds)
    fixed_capacities(precision, seeds, device, truth)


if __name__ == "__main__":
    main()
