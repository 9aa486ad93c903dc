"""How often the 90 % intervals of filters cover Bouc-Wen parameters; run by hand, copied to docs/theory/inference.md.

    python tests/coverage_of_filters.py [--replications 100] [--first 0] [--members 200] [--duration 3]
        [--methods particle particle_with_noise ensemble_kalman square_root_kalman unscented_kalman]

Each replication draws the parameters of a Bouc-Wen oscillator from the prior, computes the total acceleration under a
known base motion by SciPy, not by warpdyn, and adds measurement noise. "particle" has no process noise; the other
methods have records with process noise. The filter estimates the parameters with the same prior. If a filter is exact,
its 90 % interval covers the true value in 90 % of all replications.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.integrate import solve_ivp

import warpdyn as wd

MASS, STEP, NOISE = 1000.0, 0.02, 0.0617  # kg, s, m/s2
VELOCITY_NOISE = 0.005  # m/s, process noise of each step, except for "particle"
EXACT, WITH_NOISE = "particle", "particle_with_noise"
# Name of the parameter -> median and standard deviation of the logarithm; of gamma, mean and standard deviation
PRIOR = {
    "damping_coefficient": (250.0, 0.5),  # N s/m
    "stiffness": (8000.0, 0.3),  # N/m
    "beta": (1.5, 0.5),
    "gamma": (0.5, 1.0),
    "exponent": (1.8, 0.3),
}


def base_acceleration(times: np.ndarray) -> np.ndarray:
    """Return the acceleration of the base [m/s2]."""
    slow = 3.0 * np.sin(2 * np.pi * 0.7 * times) * np.exp(-0.12 * times)
    return slow + 1.5 * np.sin(2 * np.pi * 2.3 * times) * np.exp(-0.2 * times)


def drawn(random: np.random.Generator) -> dict[str, float]:
    """Return parameters from the prior that a Bouc-Wen storey can have: -beta < gamma <= beta."""
    while True:
        normals = dict(zip(PRIOR, random.standard_normal(len(PRIOR)), strict=True))
        found = {name: middle * np.exp(spread * normals[name]) for name, (middle, spread) in PRIOR.items()}
        found["gamma"] = PRIOR["gamma"][0] + PRIOR["gamma"][1] * normals["gamma"]
        if -found["beta"] < found["gamma"] <= found["beta"]:
            return found


def record(p: dict[str, float], count: int, random: np.random.Generator, velocity_noise: float) -> np.ndarray:
    """Return the measured total acceleration [m/s2] at `count` times, for a motion that is linear between samples."""
    times = STEP * np.arange(count)
    ground = base_acceleration(times)

    def slopes(t: float, state: np.ndarray) -> list[float]:
        _, v, r = state
        power = abs(r) ** p["exponent"]
        rate = v - p["beta"] * abs(v) * power * np.sign(r) - p["gamma"] * v * power
        force = p["damping_coefficient"] * v + p["stiffness"] * r
        return [v, -force / MASS - float(np.interp(t, times, ground)), rate]

    state, states = np.zeros(3), [np.zeros(3)]
    for place in range(1, count):
        state = solve_ivp(slopes, times[place - 1 : place + 1], state, rtol=1e-7, atol=1e-10).y[:, -1]
        state[1] += velocity_noise * random.standard_normal()
        states.append(state)
    of_state = np.array(states)
    exact = -(p["damping_coefficient"] * of_state[:, 1] + p["stiffness"] * of_state[:, 2]) / MASS
    return exact + NOISE * random.standard_normal(count)


def scene(count: int) -> wd.Scene:
    """Return the oscillator with the prior; stiffness and yield force have one common factor: r is a length [m]."""
    medians = {name: middle for name, (middle, _) in PRIOR.items()}
    of_law = {name: medians[name] for name in ("beta", "gamma", "exponent")}
    law = wd.laws.BoucWen(yield_force=medians["stiffness"], hardening_ratio=0.0, **of_law)
    given = {"damping": "storey", "damping_coefficient": medians["damping_coefficient"]}
    storey = wd.ShearBuilding(MASS, medians["stiffness"], 3.0, law=law, **given)
    factors = {name: wd.Lognormal(1.0, spread) for name, (_, spread) in PRIOR.items() if name != "gamma"}
    scatter = {name: wd.RandomFactor(each) for name, each in factors.items()}
    scatter |= {"yield_force": scatter["stiffness"], "gamma": wd.RandomValue(wd.Normal(*PRIOR["gamma"]))}
    motion = wd.GroundMotion(base_acceleration(STEP * np.arange(count)), STEP, "two sines")
    return wd.Scene(storey, motion, scatter, correlation={("stiffness", "yield_force"): 1.0})


def covered(method: str, seed: int, members: int, duration: float) -> dict[str, bool]:
    """Return whether the last 90 % interval of each parameter covers the true value in one replication."""
    random = np.random.default_rng([77, seed])
    count = round(duration / STEP) + 1
    truth = drawn(random)
    process = 0.0 if method == EXACT else VELOCITY_NOISE
    measured = wd.MeasuredResponse(record(truth, count, random, process), STEP, first=1)
    found = wd.assimilate(
        scene(count),
        measured,
        noise=NOISE,
        method=EXACT if method == WITH_NOISE else method,
        velocity_noise=process,
        members=members,
        seed=seed,
        execution=wd.Execution(device="cpu", threads=1),
    )
    last = found["parameter_quantile"].isel(time=-1)
    bounds = {name: last.sel(parameter=name, quantile=[0.05, 0.95]).values for name in PRIOR}
    return {name: bool(low <= truth[name] <= high) for name, (low, high) in bounds.items()}


def main() -> None:
    """Print the counts of each method."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--replications", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--members", type=int, default=200)
    parser.add_argument("--duration", type=float, default=3.0)
    parser.add_argument("--methods", nargs="*", default=[EXACT])
    given = parser.parse_args()
    for method in given.methods:
        began, rows = time.perf_counter(), []
        for seed in range(given.first, given.first + given.replications):
            rows.append(covered(method, seed, given.members, given.duration))
            if len(rows) % 10 == 0 or len(rows) == given.replications:
                counts = {name: sum(row[name] for row in rows) for name in PRIOR}
                print(method, len(rows), counts, f"{time.perf_counter() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
