"""Random scenes of every law, device, damping and method, as run by default: which are off, and what says so.

python tests/random_scenes.py                 10,000 scenes, ten minutes, most of them compiling
python tests/random_scenes.py 600             as many as take 600 s

A scene is one random building of up to three storeys, of a first period from 0.03 to 5 s, under one random motion;
buildings of all periods share a run, so that its step follows the middle of them. The truth is RK4 in float64 at two
fine steps; where these are 1 % apart, the scene has no answer. Scenes more than 5 % off it with status ok are listed,
unless a warning names them: `sample_error=0.05`, or an energy balance off by more than 2 %.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections import Counter
from itertools import count, cycle

import numpy as np
from combination_cases import springs_of_laws

import warpdyn as wd
from warpdyn.core.output_variables import DIVERGED
from warpdyn.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.methods.table import METHODS, fitting_methods
from warpdyn.structures.shear_building import DAMPING

SCENES, BUILDINGS, MOTIONS = 10_000, 60, 4
FINE = (4e-4, 2e-4)  # steps of the truth [s]
OFF, SETTLED, LARGEST_IMBALANCE = 0.05, 0.01, 0.02
DEVICES = ("", "friction_damper", "viscous_damper", "gap", "")
WITH_GRAVITY = 3  # every third building has P-Delta
NOMINAL = {"m": 1.25e-3, "N": 500.0, "N m-1": 4e5}  # of the buildings that the values of `springs_of_laws` are of
METHODS_A_BUILDING = 3


def random_building(random, law, values, device, damping, *, has_gravity):
    """Return a building and the scatter that lists as many random ones."""
    storeys = int(random.integers(1, 4))
    shape = (BUILDINGS, storeys)

    def drawn(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), (BUILDINGS, 1)))

    mass = 1e5 * np.exp(0.2 * random.normal(size=shape))
    stiffness = np.exp(0.2 * random.normal(size=shape)) * np.linspace(1.5, 1.0, storeys)
    period = drawn(0.03, 5.0)
    stiffness *= (2 * np.pi / period / circular_frequencies(mass, stiffness)[:, :1]) ** 2
    weight_above = 9.81 * np.cumsum(mass[:, ::-1], axis=1)[:, ::-1]
    yield_force = weight_above * drawn(0.05, 1.0)
    own = {"m": yield_force / stiffness, "N": yield_force, "N m-1": stiffness}
    listed = {"mass": mass, "stiffness": stiffness}
    nominal = {}
    for name, value in values.items():
        units = wd.laws.LAWS[law].parameters[name].units
        if name == "yield_force":
            listed[name] = yield_force
        elif units in own and value:
            listed[name] = value / NOMINAL[units] * own[units] * np.exp(random.uniform(-0.2, 0.2, (BUILDINGS, 1)))
        else:
            nominal[name] = value
    if device == "friction_damper":
        listed |= {"slip_force": yield_force * drawn(0.1, 0.5), "brace_stiffness": stiffness * drawn(0.5, 3)}
    elif device == "viscous_damper":
        listed["damper_coefficient"] = stiffness * period / (2 * np.pi) * drawn(0.02, 0.3)
        nominal["velocity_exponent"] = 1.0
    elif device == "gap":
        listed |= {"clearance": own["m"] * drawn(0.5, 5), "contact_stiffness": stiffness * drawn(1, 10)}
    if has_gravity:
        listed["gravity_load"] = 3.0 * stiffness * drawn(0.005, 0.1)
    for name in DAMPING[damping].parameters:
        if name == "damping_ratio":
            listed[name] = drawn(0.01, 0.1)[:, 0]
        else:
            listed[name] = 0.1 * stiffness * period / (2 * np.pi)
    building = wd.ShearBuilding(
        height=3.0,
        law=law,
        devices=(device,) if device else (),
        damping=damping,
        **{name: rows[0] for name, rows in listed.items()},
        **nominal,
    )
    return building, {name: wd.GivenValues(rows) for name, rows in listed.items()}


def random_motions(random):
    """Return motions of filtered noise under an envelope."""
    times = np.arange(0, 12, 0.01)
    found = []
    for number in range(MOTIONS):
        noise = np.convolve(random.normal(size=times.size), np.hanning(random.integers(3, 20)), "same")
        noise *= np.exp(-(((times - 4) / random.uniform(1, 3)) ** 2))
        peak = np.exp(random.uniform(np.log(0.5), np.log(8)))  # m/s2
        found.append(wd.GroundMotion(peak * noise / np.abs(noise).max(), 0.01, name=f"motion {number}"))
    return found


def run(scene, **settings):
    """Return a run's dataset and its warnings."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = wd.simulate(scene, structures=BUILDINGS, device="cpu", **settings)
    return found, [str(each.message) for each in told]


def errors(found, truth):
    """Return each sample's error of the peak drift, relative to the largest of its storeys."""
    one, other = (each.peak_storey_drift.values.astype(float) for each in (found, truth))
    return np.abs(one - other).max(axis=1) / np.abs(other).max(axis=1)


def sweep(seconds):
    """Count the scenes by what came out, and list those that are off and that nothing names."""
    counts, listed, off_by = Counter(), [], Counter()
    started, rows = time.perf_counter(), cycle(springs_of_laws().items())
    dampings, methods_at = cycle(DAMPING), count()
    for number, (spring, (law, values)) in enumerate(rows):
        if counts["scenes"] >= SCENES or time.perf_counter() - started > seconds:
            break
        random = np.random.default_rng([13, number])
        device, damping = DEVICES[number % len(DEVICES)], next(dampings)
        has_gravity = number % WITH_GRAVITY == 1
        case = f"{number}: {spring}{'+' * bool(device)}{device}, {damping}{', P-Delta' * has_gravity}"
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                building, scatter = random_building(random, law, values, device, damping, has_gravity=has_gravity)
                motions = wd.Cloud(random_motions(random))
                scene = wd.Scene(building, motions, scatter=scatter, recorders=("drift", "energy"))
                coarse, truth = (run(scene, dtype="float64", longest_step=step)[0] for step in FINE)
        except ValueError as error:
            print(f"{case}: refused: {error}", flush=True)
            counts["cases refused"] += 1
            continue
        settled = errors(coarse, truth) <= SETTLED
        fitting = [name for name in fitting_methods(building.law, damping) if METHODS[name].kind != "exact"]
        for _ in range(METHODS_A_BUILDING):
            method = fitting[next(methods_at) % len(fitting)]
            try:
                found, _ = run(scene, method=method)
            except ValueError as error:
                print(f"{case}, {method}: refused: {str(error)[:150]}", flush=True)
                counts["cases refused"] += 1
                continue
            error, ok = errors(found, truth), found.status.values < DIVERGED
            off = ok & ~(error <= OFF)
            told = np.abs(found.energy_balance_error.values) > LARGEST_IMBALANCE
            counts.update(
                {
                    "scenes": ok.size,
                    "failed with a status": int((~ok).sum()),
                    "within 1 %": int((ok & (error <= 0.01)).sum()),
                    "1 to 5 % off": int((ok & (error > 0.01) & (error <= OFF)).sum()),
                    "more than 5 % off": int(off.sum()),
                    "  of these: two fine steps in float64 differ": int((off & ~settled).sum()),
                    "  of these: the energy balance tells": int((off & settled & told).sum()),
                }
            )
            left = off & settled & ~told
            if left.any():
                named, _ = run(scene, method=method, sample_error=OFF)
                estimate = named.estimated_relative_error_of_sample.values
                by_error, by_flag = estimate > OFF, named.sensitive.values == 1
                counts["  of these: sample_error's estimate tells"] += int((left & by_error).sum())
                counts["  of these: only `sensitive` tells"] += int((left & ~by_error & by_flag).sum())
                off_by[f"{spring.split('_')[0]}{'+' * bool(device)}{device}"] += int(left.sum())
                for sample in np.flatnonzero(left & ~by_error & ~by_flag):
                    counts["  of these: nothing tells"] += 1
                    listed.append(
                        f"{case}, {method}, sample {sample}: {error[sample]:.3f}, est. {estimate[sample]:.3f}"
                    )
                    print("  nothing tells:", listed[-1], flush=True)
            print(f"{case}, {method}: {int(off.sum())} off, {time.perf_counter() - started:.0f} s", flush=True)
    return counts, off_by, listed


if __name__ == "__main__":
    counted, off_by, unnamed = sweep(float(sys.argv[1]) if len(sys.argv) > 1 else np.inf)
    for what, number in counted.items():
        print(f"{number:8d}  {what}")
    print("off, settled, and not told by the energy balance, by law and device:", dict(off_by.most_common()))
    print(*unnamed, sep="\n")
