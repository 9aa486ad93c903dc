"""Buildings of a region, analysed one by one in OpenSees as in SimCenter, and by warpdyn on the same core.

    python studies/simcenter.py --out results

SimCenter's R2D creates a multi-storey shear model of each building by its application MDOF-LU, and OpenSees analyses it
under one pair of ground motions after the other. In this study, twenty Hazus buildings of 1 to 20 storeys are analysed
under 25 pairs of the FEMA P-695 near-field set without scaling:

- by OpenSeesPy with the settings of R2D (see parts/simcenter/opensees.py), then without the files of recorders, then
  with the solver and step that are fastest for OpenSees;
- by warpdyn.

The study prints the processor time per history, the ratios of these times, the extrapolated time for 1.84 million
buildings under 25 pairs, and the differences of peak storey drifts, with default settings and with converged steps. It
takes 15 minutes and writes simcenter.nc. It needs openseespy and the records: pip install "warpdyn[test]".
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from parts.benchmark.machine import processor, versions
from parts.command_line import file_in
from parts.simcenter.buildings import BUILDINGS, Building, multi_storey_model, shear_building
from parts.simcenter.opensees import Way, analyse
from peers.opensees_newmark import load_opensees
from tqdm import tqdm

import warpdyn as wd
from warpdyn.foundations.files import netcdf

REGION = 1_840_000 * 25 * 2  # histories in SimCenter's Bay Area testbed: buildings, pairs of motions, components
FINE = 5e-4  # longest step of the converged runs [s]
# Other settings were at most 10 % faster than "OpenSees at its best": band solvers, one model per component, other
# algorithms and convergence tests, linear acceleration.
WAYS = {
    "OpenSees as in R2D": Way(),
    "without recorder files": Way(writes_files=False),
    "OpenSees at its best": Way(freedoms=2, system="ProfileSPD", constraints="Plain", divides_by_frequency=True),
}
R2D, BEST, CONVERGED = "OpenSees as in R2D", "OpenSees at its best", "OpenSees converged"
OURS, OURS_CONVERGED = "warpdyn", "warpdyn converged"
COMPARED = ((OURS, R2D), (OURS_CONVERGED, CONVERGED), (OURS, CONVERGED), (R2D, CONVERGED), (BEST, CONVERGED))
HOUSES = "W1"  # wood houses, the type of most buildings of a region
# Scatter of the buildings, as in SimCenter's Bay Area testbed.
SCATTER = {name: wd.RandomFactor(wd.Lognormal(1.0, 0.1)) for name in ("stiffness", "damping_ratio")}
Pairs = Sequence[tuple[wd.GroundMotion, wd.GroundMotion]]


def run_opensees(buildings: Sequence[Building], pairs: Pairs) -> xr.Dataset:
    """Return processor times [s], steps, completion and peak drift ratios of each analysis, for each `Way`."""
    ops = load_opensees()
    ways = WAYS | {CONVERGED: Way(freedoms=2, system="ProfileSPD", constraints="Plain", longest_step=FINE)}
    shape = len(ways), len(buildings), len(pairs)
    seconds, steps, ended = np.zeros(shape), np.zeros(shape, np.int64), np.zeros(shape, np.int8)
    peaks = np.full((*shape, 2, max(building.storeys for building in buildings)), np.nan)
    with tqdm(total=shape[1] * shape[2], desc="OpenSees", unit="pair", disable=None) as progress:
        for i, building in enumerate(buildings):
            model = multi_storey_model(building)
            for j, pair in enumerate(pairs):
                for k, way in enumerate(ways.values()):  # alternately, so that other load of the machine affects all
                    found = analyse(ops, model, pair, way)
                    seconds[k, i, j], steps[k, i, j], ended[k, i, j] = found.seconds, found.steps, found.is_finished
                    if found.peak_drift_ratio is not None:
                        peaks[k, i, j, :, : building.storeys] = found.peak_drift_ratio
                progress.update()
    along = ("opensees", "building", "pair")
    said = {"long_name": "processor time of both components of a pair", "units": "s"}
    return xr.Dataset(
        {
            "seconds_of_analysis": (along, seconds, said),
            "steps_of_analysis": (along, steps, {"long_name": "steps of an analysis", "units": "1"}),
            "is_finished": (along, ended, {"long_name": "whether the analysis came to its end", "units": "1"}),
            "peak_storey_drift_ratio": ((*along, "component", "storey"), peaks, {"units": "1"}),
        },
        {"opensees": list(ways), "building": [building.name for building in buildings]},
    )


def run_warpdyn(
    buildings: Sequence[Building], pairs: Pairs, copies: int = 1, longest_step: float | None = None
) -> tuple[float, np.ndarray]:
    """Return time and peak drift ratios of buildings under pairs of motions, by warpdyn on one CPU thread.


    Args:
        buildings: The buildings of the inventory.
        pairs: The pairs of ground motions.
        copies: Number of buildings of each type; more than one have random stiffness and damping.
        longest_step: Upper bound of the step [s], in float64; None: the default step of warpdyn, in float32.

    Returns:
            Processor time per history [s], and peak drift ratios [1], shape [building, pair, component, storey].
    """
    scatter = SCATTER if copies > 1 else {}
    portfolio = wd.Portfolio({each.name: wd.Archetype(shear_building(each), copies, scatter) for each in buildings})
    design = wd.Cloud([motion for pair in pairs for motion in pair])
    scene = wd.Scene(portfolio, design, recorders=("drift", "acceleration"))  # R2D records both
    started = time.process_time()
    dtype = "float32" if longest_step is None else "float64"
    run = wd.simulate(scene, longest_step=longest_step, dtype=dtype, device="cpu", threads=1)
    seconds = (time.process_time() - started) / run.sizes["sample"]
    if int((run["status"] != 0).sum()):
        raise RuntimeError(
            f"{int((run['status'] != 0).sum())} of {run.sizes['sample']} histories failed or collapsed, so their peaks "
            "cannot be compared: choose a shorter longest_step="
        )
    peaks = run["peak_storey_drift_ratio"].values
    return seconds, peaks.reshape(len(buildings) * copies, len(pairs), 2, -1)


def measure(buildings: Sequence[Building], pairs: Pairs, copies: int) -> xr.Dataset:
    """Return a dataset with times and peak drift ratios of all analyses, by OpenSees and by warpdyn."""
    groups = {"all": list(buildings), "houses": [each for each in buildings if each.building_type == HOUSES]}
    groups = {name: group for name, group in groups.items() if group}

    def take_times() -> tuple[list[float], np.ndarray]:
        alone, peaks = run_warpdyn(buildings, pairs)
        return [alone, *(run_warpdyn(group, pairs, copies)[0] for group in groups.values())], peaks

    load = [os.getloadavg()[0]]
    take_times()  # compiles the kernels
    before, ours = take_times()
    load.append(os.getloadavg()[0])
    found = run_opensees(buildings, pairs)
    load.append(os.getloadavg()[0])
    after, _ = take_times()
    converged = run_warpdyn(buildings, pairs, longest_step=FINE)[1]
    theirs = found["peak_storey_drift_ratio"]
    found = found.drop_vars("peak_storey_drift_ratio")
    found["peak_storey_drift_ratio"] = xr.DataArray(
        np.concatenate([np.stack([ours, converged]), theirs.values]),
        {"way": [OURS, OURS_CONVERGED, *theirs["opensees"].values]},
        ("way", *theirs.dims[1:]),
        attrs={"long_name": "peak storey drift ratio", "units": "1"},
    )
    found["seconds_of_history"] = xr.DataArray(
        [before, after],
        {"run": ["these histories", *(f"{copies} of each: {name}" for name in groups)]},
        ("turn", "run"),
        attrs={"long_name": "processor time of a history in warpdyn", "units": "s"},
    )
    said = {"title": "SimCenter's way and warpdyn on one core", "processor": processor(), "versions": versions()}
    return found.assign_attrs(said, load=load, motions="FEMA P-695 near-field pairs as recorded")


def differences(found: xr.Dataset, one: str, other: str) -> xr.DataArray:
    """Return the largest difference of the peak drifts of each history, divided by its largest peak drift.

    Values are NaN if OpenSees failed before the end of the motion.
    """
    peaks = found["peak_storey_drift_ratio"]
    first, second = peaks.sel(way=one), peaks.sel(way=other)
    return abs(first - second).max("storey") / second.max("storey")


def report(found: xr.Dataset) -> None:
    """Print the processor times, their ratios, and the differences of the peak drifts."""
    theirs = found["seconds_of_analysis"].sel(opensees=list(WAYS)) / 2  # a pair is two histories
    alone, *many = found["seconds_of_history"].mean("turn").values.tolist()
    houses = [name for name in found["building"].values if name.startswith(f"{HOUSES} ")]
    for name, group, ours in zip(("all buildings", "wood houses"), (found["building"], houses), many, strict=False):
        print(f"\n{name + ', one core':<28}{'ms a history':>14}{'over warpdyn':>14}{'core days of a region':>24}")
        rows = dict(zip(WAYS, theirs.sel(building=group).mean(("building", "pair")).values.tolist(), strict=True))
        for way, seconds in (rows | {"warpdyn, many buildings": ours}).items():
            days = seconds * REGION / 86400
            print(f"{way:<28}{1e3 * seconds:>14.4g}{seconds / ours:>14.4g}{days:>24.4g}")
    histories, of_r2d = found.sizes["building"] * found.sizes["pair"] * 2, float(theirs.sel(opensees=R2D).mean())
    print(
        f"\nthese {histories:,} histories alone: {1e3 * alone:.3g} ms each in warpdyn, a ratio of {of_r2d / alone:.3g}"
    )

    print(f"\n{'peak storey drifts apart':<48}{'median':>9}{'95 %':>9}{'largest':>9}{'within 1 %':>12}")
    for one, other in COMPARED:
        apart = differences(found, one, other).values
        apart = apart[~np.isnan(apart)]
        shares = f"{np.median(apart):>9.4%}{np.quantile(apart, 0.95):>9.3%}{apart.max():>9.3%}"
        print(f"{one + ' from ' + other:<48}{shares}{(apart < 0.01).mean():>12.1%}")

    heads = f"{'step in R2D [s]':>17}{'ms a history':>14}{'largest drift':>15}{'own settings':>14}{'converged':>11}"
    print(f"\n{'building':<18}{heads}  (largest differences)")
    for building in found["building"].values:
        of = found.sel(building=[building])
        steps = of["steps_of_analysis"].sel(opensees=CONVERGED) / of["steps_of_analysis"].sel(opensees=R2D)
        seconds = float(theirs.sel(opensees=R2D, building=building).mean())
        largest = float(of["peak_storey_drift_ratio"].sel(way=CONVERGED).max())
        own, converged = (float(differences(of, *each).max()) for each in ((OURS, R2D), (OURS_CONVERGED, CONVERGED)))
        numbers = (
            f"{FINE * float(steps.max()):>17.5f}{1e3 * seconds:>14.4g}{largest:>15.3f}{own:>14.3%}{converged:>11.3%}"
        )
        print(f"{building:<18}{numbers}")
    unfinished = (1 - found["is_finished"]).sum(("building", "pair"))
    told = ", ".join(f"{int(unfinished.sel(opensees=way))} {way}" for way in found["opensees"].values)
    print(f"\nanalyses that OpenSees did not bring to an end, of {histories // 2}: {told}")
    load = ", ".join(f"{value:.2f}" for value in found.attrs["load"])
    print(f"{found.attrs['processor']}; load at the start, before OpenSees and after it: {load}")


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    parser.add_argument("--buildings", type=int, default=20, help="how many of the twenty buildings [%(default)s]")
    parser.add_argument("--pairs", type=int, default=25, help="pairs of motions [%(default)s]")
    parser.add_argument(
        "--copies", type=int, default=50, help="of each building in warpdyn's run of many buildings [%(default)s]"
    )
    arguments = parser.parse_args()
    target = file_in(arguments.out, "simcenter.nc")
    try:
        load_opensees()
    except ImportError as error:
        raise SystemExit(
            f"this study compares with OpenSeesPy, which cannot be imported ({error}): pip install openseespy"
        ) from error
    chosen = np.unique(np.linspace(0, len(BUILDINGS) - 1, arguments.buildings).round().astype(int))
    pairs = wd.records.pairs(wd.records.near_field())[: arguments.pairs]
    found = measure([BUILDINGS[i] for i in chosen], pairs, arguments.copies)
    netcdf.write(found, target)
    report(found)
    print(f"wrote {target}")


if __name__ == "__main__":
    main()
