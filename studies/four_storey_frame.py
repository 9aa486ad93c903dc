"""Fragility of a four-storey steel moment frame by models of different cost: frame, fish-bone and sticks.

    python studies/four_storey_frame.py --out results

The frame of Skiadopoulos and Lignos (2022) has 56 hinges after Ibarra, Medina and Krawinkler. Random frames are
analysed under the 44 far-field records of FEMA P-695 at 17 levels of Sa(T1, 5 %), as the whole frame, as a fish-bone
with 12 hinges, as a flexural-shear stick and as a shear stick. The study also compares the models with histories of
the whole frame by OpenSeesPy, and measures their computing time. It writes four_storey_frame.nc and one figure.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from parts.command_line import file_in, read_arguments, save_figures
from parts.four_storey_frame.figure import draw
from parts.four_storey_frame.frame import HEIGHTS, REFERENCE, reference_motions
from parts.four_storey_frame.models import COLLAPSE_DRIFT_RATIO, MODELS, Model

import warpdyn as wd
from warpdyn.foundations.files import netcdf
from warpdyn.model.ground_motions.records import far_field

PERIOD = 1.365  # s, of the frame with P-Delta
LEVELS_IN_G = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.2, 1.5, 1.8, 2.2, 2.7)
STATES = {"1 % drift": 0.01, "2 % drift": 0.02, "4 % drift": 0.04, "collapse": np.inf}
SHOWN_LEVEL = 0.6  # g, of the rotations of hinges in the figure
QUANTILES = (0.16, 0.5, 0.84)


def scene_of(model: Model, excitation: wd.Stripes | wd.Cloud, *, is_random: bool = True) -> wd.Scene:
    """Return the scene of a model; recorders are the drifts, and the rotations of hinges."""
    structure = model.structure
    has_storeys = isinstance(structure, wd.ShearBuilding) or structure.storeys > 0
    recorders = ("drift",) if has_storeys else ("output",)
    recorders += ("spring",) if isinstance(structure, wd.HingedFrame | wd.HingedFishbone) else ()
    limit = COLLAPSE_DRIFT_RATIO if isinstance(structure, wd.ShearBuilding) else None
    scatter = model.scatter if is_random else {}
    return wd.Scene(structure, excitation, scatter, recorders=recorders, collapse_drift_ratio=limit)


def drift_ratios(run: xr.Dataset) -> np.ndarray:
    """Return the peak storey drift ratios [1], shape [storey, sample]."""
    if "peak_storey_drift_ratio" in run:
        return run["peak_storey_drift_ratio"].transpose("storey", "sample").values
    drifts = run["peak_output"].sel(output=[f"drift {storey}" for storey in range(1, 5)])  # m
    return drifts.transpose("output", "sample").values / np.array(HEIGHTS)[:, None]


def model_error(model: Model, device: str | None) -> np.ndarray:
    """Return the drift ratios of a model over those of the frame in the reference histories, shape [history, storey].

    Samples that collapse or fail are NaN.
    """
    with wd.meant_as_given("strongest_motion", "weakest_motions", "peak_ground_acceleration"):
        run = wd.simulate(scene_of(model, wd.Cloud(reference_motions()), is_random=False), device=device)
    found = np.where(run["status"].values == 0, drift_ratios(run), np.nan)
    return found.T / np.array(list(REFERENCE.values()))


def run_model(name: str, frames: int, seed: int, device: str | None) -> xr.Dataset:
    """Return status, largest drift ratio and rotations of hinges of the samples of a model, and its errors and time."""
    model = MODELS[name]()
    stripes = wd.Stripes(far_field(), LEVELS_IN_G, wd.SpectralAcceleration(PERIOD))
    started = time.process_time(), time.perf_counter()
    run = wd.simulate(scene_of(model, stripes), structures=frames, seed=seed, device=device)
    processor, wall = time.process_time() - started[0], time.perf_counter() - started[1]
    label = {"long_name": "largest peak storey drift ratio", "units": "1"}
    found = run[["status"]].assign(drift_ratio=("sample", drift_ratios(run).max(axis=0), label))
    ratio = model_error(model, device)
    label = {"long_name": "peak storey drift ratio over that of the whole frame", "units": "1"}
    history = [f"{motion} {level:g}" for motion, level in REFERENCE]
    found = found.assign(
        drift_over_frame=(("history", "storey"), ratio, label),
        wall_time=((), wall, {"long_name": "wall time of simulate()", "units": "s"}),
        processor_time=((), processor, {"long_name": "processor time of simulate()", "units": "s"}),
    ).assign_coords(
        history=("history", history, {"long_name": "reference history: motion and level"}),
        storey=("storey", np.arange(1, 5), {"long_name": "storey, from the ground up", "units": "1"}),
    )
    if "peak_spring_deformation" in run:
        hinges = list(model.structure.hinge_names)
        chosen = run.isel(sample=np.isclose(run["im_level"], SHOWN_LEVEL) & (run["status"].values <= 1))
        turned = chosen["peak_spring_deformation"].sel(spring=hinges).quantile(QUANTILES, "sample")
        found = found.assign(hinge_rotation=(("quantile", "hinge"), turned.transpose("quantile", "spring").values))
        found["hinge_rotation"].attrs = {"long_name": f"peak rotation of the hinge at {SHOWN_LEVEL} g", "units": "rad"}
        found = found.assign_coords(
            hinge=("hinge", hinges, {"long_name": "hinge"}),
            quantile=("quantile", list(QUANTILES), {"long_name": "quantile", "units": "1"}),
        )
    curves = wd.fragility(found, STATES, demand="drift_ratio", seed=seed)
    kept = found.drop_vars(
        [each for each in found.coords if each not in ("sample", "history", "storey", "hinge", "quantile")]
    )
    return kept.merge(curves, combine_attrs="drop_conflicts").expand_dims(model=[name])


def print_tables(result: xr.Dataset) -> None:
    """Print the medians [g] of the curves with their intervals, the errors of the models and their times."""
    for state in result["damage_state"].values:
        print(f"\n{state}")
        for name in result["model"].values:
            row = result.sel(model=name, damage_state=state)
            ends = "fragility_median_lower", "fragility_median_upper"
            low, high = (float(row[end]) for end in ends)
            median, dispersion = float(row["fragility_median"]), float(row["fragility_dispersion"])
            print(f"  {name:<22}{median:7.3f} g [{low:.3f}, {high:.3f}], dispersion {dispersion:.2f}")
    print("\nmodel: median error of peak drifts in elastic / yielding / near-collapse histories, processor time")
    error = np.abs(np.log(result["drift_over_frame"]))
    for name in result["model"].values:
        of_model = [float(error.sel(model=name)[place::3].median()) for place in range(3)]
        words = " / ".join(f"{100 * np.expm1(each):.0f} %" for each in of_model)
        print(f"  {name:<22}{words}, {float(result['processor_time'].sel(model=name)):.0f} s")


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 64, meaning="random frames under each record at each level", counted="frames")
    target = file_in(arguments.out, "four_storey_frame.nc")
    started = time.perf_counter()
    parts = []
    for name in MODELS:
        parts.append(run_model(name, arguments.frames, arguments.seed, arguments.device))
        print(f"{name}: {time.perf_counter() - started:.1f} s")
    result = xr.concat(parts, "model", coords="minimal", combine_attrs="drop_conflicts", join="outer")
    result["model"].attrs = {"long_name": "model"}
    title = "Fragility of a four-storey steel moment frame by models of different cost"
    result.attrs |= netcdf.trace(title, "simulate, warpdyn.fragility")
    netcdf.write(result, target)
    save_figures({"four_storey_frame": draw(result)}, arguments.out)
    print_tables(result)
    print(f"\n{time.perf_counter() - started:.1f} s; wrote {target} and four_storey_frame.png")


if __name__ == "__main__":
    main()
