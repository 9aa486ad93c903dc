"""Thousands of random buildings at a step that is unstable for a third of them: outcomes of the stability guard.

python tests/building_sweep.py            10,000 buildings of 1 to 30 storeys (some minutes, most of them compiling)
"""

from __future__ import annotations

import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.integration.stability_guard import guard, integrate_guarded
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.engine.methods.table import METHODS
from warpdyn.foundations.core.output_variables import DIVERGED, UNSTABLE_STEP
from warpdyn.foundations.core.thread_pool import cores

LAWS, DAMPING = ("elastic", "bilinear", "bouc_wen"), ("rayleigh", "modal")
BROKEN = 1 / 3  # the share of the buildings whose limit the step is beyond
CLOSE = 0.05  # a peak drift this near to the converged one is right
GARBAGE = 2.0  # a peak drift of so many times the converged one is a blow-up that yielding has bounded
FINER = 4  # the converged run's steps in one of the sweep's


def scenes(storeys, count, seed, motion):
    """Return a scene of `count` random buildings for each number of storeys, law and damping."""
    found = []
    for index, (n, law, damping) in enumerate(product(storeys, LAWS, DAMPING)):
        random = np.random.default_rng([seed, index])
        mass = 1e5 * np.exp(0.3 * random.normal(size=(count, n)))
        stiffness = np.exp(0.4 * random.normal(size=(count, n))) * np.linspace(1.5, 0.5, n)
        period = np.exp(random.uniform(np.log(0.05), np.log(5.0), count))
        stiffness *= ((2 * np.pi / period / circular_frequencies(mass, stiffness)[:, 0]) ** 2)[:, None]
        listed = {"mass": mass, "stiffness": stiffness, "damping_ratio": random.uniform(0, 0.3, count)}
        if law != "elastic":
            weight_above = 9.81 * np.cumsum(mass[:, ::-1], axis=1)[:, ::-1]
            listed["yield_force"] = weight_above * np.exp(random.uniform(np.log(0.05), np.log(0.8), (count, n)))
            listed["hardening_ratio"] = random.uniform(0, 0.2, (count, 1)) * np.ones((1, n))
        if law == "bouc_wen":
            listed["exponent"] = np.repeat(random.choice([1.0, 1.5, 2.0, 3.0, 5.0], (count, 1)), n, axis=1)
            listed["beta"] = np.repeat(random.uniform(0.3, 0.8, (count, 1)), n, axis=1)
            # Below beta where beta is above a half: unloading is stiffer.
            listed["gamma"] = np.minimum(1.0 - listed["beta"], listed["beta"])
        nominal = {name: values[0] for name, values in listed.items() if name != "damping_ratio"}
        building = wd.ShearBuilding(**nominal, height=3.0, law=law, damping=damping, damping_ratio=0.05)
        scatter = {name: wd.GivenValues(values) for name, values in listed.items()}
        found.append(wd.Scene(building, motion, scatter=scatter, recorders=("drift",), tail=2.0))
    return found


def breaking_step(storeys, count, seed, motion):
    """Return the step [s] that is beyond RK4's limit for a third of the buildings."""
    limits = []
    for scene in scenes(storeys, count, seed, motion):
        drawn = {name: listed.values for name, listed in scene.scatter.items()}
        limits.append(dynamics_of(scene).vibration_of(drawn, METHODS["rk4"]).stable_step)
    return float(np.quantile(np.concatenate(limits), BROKEN))


def sweep(storeys, count, seed=0):
    """Return counts of the outcomes of "substep" and "flag" at a step that is unstable for a third of the buildings."""
    time = np.arange(0, 12, 0.01)
    noise = np.random.default_rng(seed).normal(size=time.size) * np.exp(-(((time - 4) / 3) ** 2))
    step = breaking_step(storeys, count, seed, wd.GroundMotion(noise, 0.01))
    grid = np.arange(0, 12, step)
    motion = wd.GroundMotion(4 * np.interp(grid, time, noise), step)  # m/s2
    counts = dict.fromkeys(
        (
            "buildings",
            "unstable",
            "diverged_substep",
            "diverged_unflagged",
            "right",
            "right_flagged",
            "not_finite_ok",
            "garbage_substep",
        ),
        0,
    )

    def prepared(scene, **settings):
        return prepare(scene, structures=count, method="rk4", device="cpu", **settings)

    built = [prepared(scene, dtype="float64")[0].plan for scene in scenes(storeys, count, seed, motion)]
    with ThreadPoolExecutor(cores()) as pool:  # compiled side by side; each thread compiles warp's headers first
        list(pool.map(lambda plan: build.load_kernel(plan, "cpu"), built))
    for scene in scenes(storeys, count, seed, motion):
        everything = np.arange(count)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            substepped = wd.simulate(scene, structures=count, step=step, dtype="float64", device="cpu")
            run, vibration = prepared(scene, dtype="float64", step=step)
            unstable = guard(run, vibration, "flag")
            raw = run.integrate(everything)
            finer, vibration = prepared(scene, dtype="float64", step=step / FINER)
            guard(finer, vibration, "substep")
            converged = integrate_guarded(finer, everything)
        flagged = unstable | (raw["status"] == UNSTABLE_STEP)
        peak, reference = raw["peak_storey_drift"], converged["peak_storey_drift"]
        with np.errstate(invalid="ignore", over="ignore"):
            right = np.all(np.abs(peak - reference) <= CLOSE * reference, axis=0)
        counts["buildings"] += count
        counts["unstable"] += int(unstable.sum())
        counts["diverged_substep"] += int((substepped["status"].values >= DIVERGED).sum())
        held = substepped["status"].values < DIVERGED
        wrong = substepped["peak_storey_drift"].values.max(axis=1) > GARBAGE * reference.max(axis=0)
        counts["garbage_substep"] += int((wrong & held).sum())
        counts["not_finite_ok"] += int((~np.isfinite(substepped["peak_storey_drift"].values[held])).sum())
        counts["diverged_unflagged"] += int(((raw["status"] == DIVERGED) & ~unstable).sum())
        counts["right"] += int(right.sum())
        counts["right_flagged"] += int((right & flagged).sum())
    return counts


if __name__ == "__main__":
    storeys = range(1, 31) if len(sys.argv) < 2 else [int(n) for n in sys.argv[1].split(",")]
    count = -(-10_000 // (len(storeys) * len(LAWS) * len(DAMPING))) if len(sys.argv) < 3 else int(sys.argv[2])
    print(sweep(storeys, count))
