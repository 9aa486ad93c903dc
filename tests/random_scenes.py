"""Random scenes of every law, device and damping, run by default: how many samples are wrong, and what flags them.

python tests/random_scenes.py                          all 10,000 scenes with their default methods
python tests/random_scenes.py --processes 16           the same on 16 processors
python tests/random_scenes.py --cases 0:8              the scenes of the first eight cases
python tests/random_scenes.py --methods all            with three methods in turn instead of the default method
python tests/random_scenes.py --methods stoermer       with one method instead of the default method
python tests/random_scenes.py --divided                runs each scene again in small blocks; the bits must not change

A case is one law, device, damping and number of storeys: 60 random buildings, each under 4 random motions, so 240
scenes. First periods are from 0.03 to 5 s and all buildings of a case share a run, so that its step follows the middle
of them. Every fourth building whose damping allows it stands on isolators. Laws with damage, pinching or a falling
branch get random values of these. The correct peak drifts are those of RK4 in float64 at two fine steps; a sample for
which these differ by more than 1 % has no answer and is not counted. A sample is wrong if its peak drifts are off by
more than 5 % of the largest of its storeys, although its status is ok. The script lists the wrong samples that neither
a flag (`unreliable`) nor the energy balance (off by more than 2 %) names, and variables that differ between divisions.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from unittest.mock import patch

import numpy as np
from combination_cases import springs_of_laws

import warpdyn as wd
from warpdyn.engine.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.engine.methods.table import METHODS, fitting_methods
from warpdyn.foundations.core.output_variables import DIVERGED
from warpdyn.model.structures.protection import DAMPINGS as ISOLATED_DAMPINGS
from warpdyn.model.structures.shear_building import DAMPING

SCENES, BUILDINGS, MOTIONS = 10_000, 60, 4
CASES = -(-SCENES // (BUILDINGS * MOTIONS))
FINE = (4e-4, 2e-4)  # steps of the correct solution [s]
WRONG, SETTLED, LARGEST_IMBALANCE = 0.05, 0.01, 0.02
DEVICES = ("", "friction_damper", "viscous_damper", "gap", "one_sided_gap", "")
WITHOUT_TANGENT = ("friction_damper", "gap", "one_sided_gap")  # devices whose stiffness tangent damping would damp
ISOLATORS = ("lead_rubber_bearing", "friction_pendulum", "bilinear")
WITH_GRAVITY = 3  # every third building has P-Delta
ON_ISOLATORS = 4
NOMINAL = {"m": 1.25e-3, "N": 500.0, "N m-1": 4e5}  # of the buildings that the values of `springs_of_laws` are of
METHODS_A_BUILDING = 3  # with `--methods all`
LONGEST_RECORD = 20.0  # s
SMALL_BLOCK = 52  # samples: 13 buildings, so that other samples share the vectors of a processor


def random_values(random, law):
    """Return random damage, pinching and falling branches of a law, one value per building; {} if it has none."""

    def between(low, high):
        return random.uniform(low, high, (BUILDINGS, 1))

    def in_some(values):
        return values * (random.random((BUILDINGS, 1)) < 0.7)

    if law == "hysteretic":
        second, strength = between(1.5, 5), between(1.0, 1.5)
        return {
            "ductility_2": second,
            "force_ratio_2": strength,
            "ductility_3": second + between(1, 15),
            "force_ratio_3": strength * between(0.3, 1.2),
            "pinching_drift": between(0.3, 1),
            "pinching_force": between(0.2, 1),
            "damage_by_ductility": in_some(10 ** between(-3, -1.3)),
            "damage_by_energy": in_some(10 ** between(-2.3, -0.7)),
        }
    return {}


def with_isolators(random, building, listed):
    """Return a building on random isolators, and its listed values with a column for them."""
    law = ISOLATORS[random.integers(len(ISOLATORS))]
    mass = 1.2e5
    weight = 9.81 * (mass + listed["mass"].sum(axis=1))
    after = weight / 9.81 * (2 * np.pi / random.uniform(2, 4, BUILDINGS)) ** 2  # stiffness after yield
    own = {"mass": np.full(BUILDINGS, mass), "stiffness": after * random.uniform(8, 20, BUILDINGS)}
    if law == "friction_pendulum":
        own |= {"radius": weight / after, "friction_coefficient": random.uniform(0.03, 0.1, BUILDINGS)}
        own["weight"] = weight
    else:
        own["yield_force"] = weight * random.uniform(0.03, 0.1, BUILDINGS)
        ratio = {"hardening_ratio": after / own["stiffness"]}
        own |= ratio if law == "bilinear" else {"post_yield_stiffness": after}
    first = {name: float(values[0]) for name, values in own.items() if name != "mass"}
    isolated = building.on_isolators(law, mass, 1.0, **first)
    columns = {}
    for name, values in listed.items():
        if np.ndim(values) == 1:  # a value of the whole building
            columns[name] = values
            continue
        rows = np.broadcast_to(values, (BUILDINGS, building.storeys))
        base = own.get(name, np.full(BUILDINGS, isolated.parameters[name][0]))
        columns[name] = np.column_stack([base, rows])
    for name, values in own.items():
        if name not in columns:
            above = isolated.parameters[name][1:]
            columns[name] = np.column_stack([values, np.broadcast_to(above, (BUILDINGS, above.size))])
    return isolated, columns


def random_building(random, law, values, device, damping, *, has_gravity, is_isolated):
    """Return a building and the scatter that lists as many random ones."""
    storeys = int(random.integers(1, 4))
    shape = (BUILDINGS, storeys)

    def drawn(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), (BUILDINGS, 1)))

    mass = 1e5 * np.exp(0.2 * random.normal(size=shape))
    stiffness = np.exp(0.2 * random.normal(size=shape)) * np.linspace(1.5, 1.0, storeys)
    period = drawn(0.03, 1.0 if is_isolated else 5.0)
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
    for name, drawn_values in random_values(random, law).items():
        nominal.pop(name)
        listed[name] = np.broadcast_to(drawn_values, shape)
    if device == "friction_damper":
        listed |= {"slip_force": yield_force * drawn(0.1, 0.5), "brace_stiffness": stiffness * drawn(0.5, 3)}
    elif device == "viscous_damper":
        listed["damper_coefficient"] = stiffness * period / (2 * np.pi) * drawn(0.02, 0.3)
        nominal["velocity_exponent"] = 1.0
    elif device:
        listed |= {"clearance": own["m"] * drawn(0.5, 5), "contact_stiffness": stiffness * drawn(1, 10)}
    if device == "one_sided_gap":
        nominal["restitution"] = float(random.uniform(0.4, 1.0))
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
    if is_isolated:
        building, listed = with_isolators(random, building, listed)
    return building, {name: wd.GivenValues(rows) for name, rows in listed.items()}


def random_motions(random):
    """Return two motions of filtered noise under an envelope, and two records."""
    times = np.arange(0, 12, 0.01)
    found = []
    for number in range(MOTIONS):
        peak = np.exp(random.uniform(np.log(0.5), np.log(8)))  # m/s2
        if number % 2:
            records = wd.records.far_field()
            record = records[random.integers(len(records))]
            values = record.acceleration[: int(LONGEST_RECORD / record.step)]
            found.append(wd.GroundMotion(peak * values / np.abs(values).max(), record.step, name=f"record {number}"))
            continue
        noise = np.convolve(random.normal(size=times.size), np.hanning(random.integers(3, 20)), "same")
        noise *= np.exp(-(((times - 4) / random.uniform(1, 3)) ** 2))
        found.append(wd.GroundMotion(peak * noise / np.abs(noise).max(), 0.01, name=f"motion {number}"))
    return found


def run(scene, **settings):
    """Return a run's dataset and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = wd.simulate(scene, structures=BUILDINGS, device="cpu", **settings)
    return found, [str(each.message) for each in caught]


def errors(found, truth):
    """Return each sample's error of the peak drift, relative to the largest of its storeys."""
    one, other = (each.peak_storey_drift.values.astype(float) for each in (found, truth))
    return np.abs(one - other).max(axis=1) / np.abs(other).max(axis=1)


def scene_of_case(number):
    """Return the text and the scene of a case.

    Raises:
        ValueError: If the engine refuses the building.
    """
    random = np.random.default_rng([13, number])
    springs = list(springs_of_laws().items())
    spring, (law, values) = springs[number % len(springs)]
    device, damping = DEVICES[number % len(DEVICES)], list(DAMPING)[number % len(DAMPING)]
    if damping == "rayleigh_tangent" and device in WITHOUT_TANGENT:
        damping = "rayleigh"
    is_isolated = number % ON_ISOLATORS == 2 and damping in ISOLATED_DAMPINGS
    has_gravity = number % WITH_GRAVITY == 1 and not is_isolated
    extra = f"{'+' * bool(device)}{device}, {damping}{', P-Delta' * has_gravity}{', on isolators' * is_isolated}"
    text = f"{number}: {spring}{extra}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        building, scatter = random_building(
            random, law, values, device, damping, has_gravity=has_gravity, is_isolated=is_isolated
        )
        motions = wd.Cloud(random_motions(random))
        return text, wd.Scene(building, motions, scatter=scatter, recorders=("drift", "energy"))


def differing(scene, whole, **settings):
    """Return the names of variables whose bits change if a run is divided among small blocks and two threads."""
    with patch("warpdyn.campaigns.running.blocks.CPU_BLOCK", SMALL_BLOCK):
        divided, _ = run(scene, threads=2, **settings)
    assert set(divided.variables) == set(whole.variables)
    return [name for name in whole.variables if whole[name].values.tobytes() != divided[name].values.tobytes()]


def count_case(number, methods="default", *, is_divided=False):
    """Run the scenes of one case; return the text, the counts, and a line for each wrong sample that nothing names.

    Args:
        number: Number of the case.
        methods: "default", "all" (three methods that fit, in turn) or a method.
        is_divided: Whether each scene runs a second time in small blocks; a line names variables whose bits differ.
    """
    counts, listed = Counter(), []
    started = time.perf_counter()
    try:
        text, scene = scene_of_case(number)
        coarse, truth = (run(scene, dtype="float64", method="rk4", longest_step=step)[0] for step in FINE)
    except ValueError as error:
        return f"{number}: refused: {error}", Counter({"cases refused": 1}), []
    settled = errors(coarse, truth) <= SETTLED
    chosen = [None]
    if methods == "all":
        fitting = fitting_methods(scene.structure.storey_law.forces(), scene.structure.damping)
        fitting = [name for name in fitting if METHODS[name].kind != "exact"]
        chosen = [fitting[(METHODS_A_BUILDING * number + k) % len(fitting)] for k in range(METHODS_A_BUILDING)]
    elif methods != "default":
        chosen = [methods]
    for method in chosen:
        try:
            found, _ = run(scene, method=method)
        except ValueError as error:
            counts["cases refused"] += 1
            text += f", {method} refused: {str(error)[:150]}"
            continue
        error, is_ok = errors(found, truth), found.status.values < DIVERGED
        wrong = is_ok & ~(error <= WRONG)
        by_energy = np.abs(found.energy_balance_error.values) > LARGEST_IMBALANCE
        flagged = found["unreliable"].values == 1 if "unreliable" in found else np.zeros(error.size, dtype=bool)
        counted = wrong & settled
        silent = counted & ~by_energy & ~flagged
        counts.update(
            {
                "scenes": is_ok.size,
                f"  of these by {found.attrs['method']}": is_ok.size,
                "failed with a status": int((~is_ok).sum()),
                "without an answer (two fine steps in float64 differ by more than 1 %)": int((is_ok & ~settled).sum()),
                "flagged": int((is_ok & flagged).sum()),
                "flagged, with an answer, and less than 1 % wrong": int((flagged & settled & (error < 0.01)).sum()),
                "1 to 5 % wrong": int((is_ok & settled & (error > 0.01) & (error <= WRONG)).sum()),
                "more than 5 % wrong": int(counted.sum()),
                "  of these: flagged": int((counted & flagged).sum()),
                "  of these: named by the energy balance alone": int((counted & by_energy & ~flagged).sum()),
                "  of these: nothing names them": int(silent.sum()),
            }
        )
        listed += [
            f"{text}, {found.attrs['method']}, sample {sample}: error {error[sample]:.3f}"
            for sample in np.flatnonzero(silent)
        ]
        if is_divided:
            names = differing(scene, found, method=method)
            counts["scenes run in small blocks, too"] += is_ok.size
            listed += [f"{text}, {found.attrs['method']}: divided runs differ in {', '.join(names)}"] if names else []
    return f"{text}: {time.perf_counter() - started:.0f} s", counts, listed


def main():
    """Run the cases that the command line names, and print what was counted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=1, help="processes, each with one case at a time")
    parser.add_argument("--cases", default=f"0:{CASES}", help="first case and the one after the last, such as 0:42")
    parser.add_argument("--methods", choices=("default", "all", *METHODS), default="default")
    parser.add_argument("--divided", action="store_true", help="run each scene again in small blocks")
    parser.add_argument("--seconds", type=float, default=np.inf, help="start no further case after so many seconds")
    given = parser.parse_args()
    numbers = range(*map(int, given.cases.split(":")))
    counts, listed, started = Counter(), [], time.perf_counter()
    with ProcessPoolExecutor(given.processes, mp_context=get_context("spawn")) as pool:
        waiting = iter(numbers)
        count = partial(count_case, methods=given.methods, is_divided=given.divided)
        under_way = [pool.submit(count, n) for n in itertools.islice(waiting, 2 * given.processes)]
        while under_way:
            text, counted, lines = under_way.pop(0).result()
            print(text, {k.strip(): v for k, v in counted.items() if v}, *lines, sep="\n    ", flush=True)
            counts.update(counted)
            listed += lines
            number = next(waiting, None) if time.perf_counter() - started < given.seconds else None
            if number is not None:
                under_way.append(pool.submit(count, number))
    for what, number in counts.items():
        print(f"{number:8d}  {what}")
    print(*listed, sep="\n")
    sys.exit(1 if listed else 0)


if __name__ == "__main__":
    main()
