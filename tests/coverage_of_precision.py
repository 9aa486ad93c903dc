"""How often the intervals of `fragility_to` cover the truth, though they decide when it stops; run by hand.

    python tests/coverage_of_precision.py [replications] [records] [device]

Its figures are copied to docs/explanation/intervals.md. Each replication has records and structures of its own, of the
population of tests/coverage_of_intervals.py. The precisions are those that one structure of each record reaches often,
in about half of the replications, and seldom: the second is where stopping selects most. The truth is the fit to the
capacities of two structures under every motion of the population.
"""

from __future__ import annotations

import math
import sys
import warnings

import numpy as np
from coverage_of_intervals import DISPERSIONS, LIMITS, MOTIONS_OF_ALL, PERIOD, building, population

import warpdyn as wd

QUANTILES = (0.9, 0.5, 0.1)  # of the widths that one structure of each record reaches


def scene(motions: list[wd.GroundMotion]) -> wd.Scene:
    """Return one storey that yields under some motions, with one structure of each motion's own."""
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, spread)) for name, spread in DISPERSIONS.items()}
    stripes = wd.Stripes(motions, [1.0], wd.SpectralAcceleration(PERIOD), structures_per_motion=1)
    return wd.Scene(building(), stripes, scatter, recorders=("drift",), tail=0.0)


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    replications = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    records = int(sys.argv[2]) if len(sys.argv) > 2 else 44
    device = sys.argv[3] if len(sys.argv) > 3 else "cpu"
    motions, generator = population(1), np.random.default_rng(records)
    whole = [
        wd.capacities(scene(motions), LIMITS, tolerance=0.02, highest=math.inf, seed=seed, device=device)
        for seed in (1, 2)
    ]
    truth = np.exp(np.mean([np.log(found["capacity"]).mean(["structure", "motion"]) for found in whole], axis=0))
    drawn = [[motions[i] for i in generator.permutation(MOTIONS_OF_ALL)[:records]] for _ in range(replications)]
    # A precision that is reached at once leaves what one structure of each record comes to.
    once = [
        float(wd.fragility_to(scene(some), LIMITS, 0.5, seed=seed, device=device)["half_width"].max())
        for seed, some in enumerate(drawn)
    ]
    print(f"| records | precision | met | structures of each | medians covered: {', '.join(LIMITS)} |\n|-|-|-|-|-|")
    for precision in np.quantile(once, QUANTILES).round(3):
        covered, met, count = [], [], []
        for seed, some in enumerate(drawn):
            curves = wd.fragility_to(scene(some), LIMITS, float(precision), seed=seed, device=device)
            low, high = curves["fragility_median_lower"].values, curves["fragility_median_upper"].values
            covered.append((low <= truth) & (truth <= high))
            met.append(bool((curves["half_width"] <= precision).all()))
            count.append(curves.attrs["structures_per_motion"])
        told = ", ".join(f"{share:.3f}" for share in np.mean(covered, axis=0))
        print(f"| {records} | {precision:g} | {np.mean(met):.2f} | {np.mean(count):.1f} | {told} |", flush=True)


if __name__ == "__main__":
    main()
