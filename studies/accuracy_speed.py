"""Error against computing time of every integration method on the same ensembles.

    python studies/accuracy_speed.py --out results

The study computes three things: work-precision diagrams of five ensembles, with reference solutions that are far more
accurate than any charted point; the errors that `checked_share` estimates, compared with the true errors; and the
choice of `plan`, compared with the best choice of an exhaustive search. It writes accuracy_speed.nc and four figures.
studies/decision.py shows how accuracy, number of structures and number of records affect a fragility curve.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
import xarray as xr
from parts.accuracy_speed import figures
from parts.accuracy_speed.chart_of_methods import chart_of_methods
from parts.accuracy_speed.points import (
    DEMANDS,
    STATISTICS,
    STEPS,
    TOLERANCES,
    Point,
    Settings,
    chart,
    charted_rows,
    compile_kernels,
    reference_of,
)
from parts.accuracy_speed.promises import TARGETS, Planned, agreement, plan_scene
from parts.accuracy_speed.scenes import Charted, build_scenes
from parts.command_line import file_in, read_arguments, save_figures
from tqdm import tqdm

from warpdyn.engine.kernels.queues import checked_devices, device_names
from warpdyn.engine.methods.table import METHODS
from warpdyn.foundations.files import netcdf

DTYPES = ("float32", "float64")
Points = Mapping[tuple[str, str, float], Point]


def label_points(scenes: Mapping[str, Charted], points: Mapping[str, Points]) -> xr.Dataset:
    """Return the points of all scenes, with the dimensions scene, method, dtype and step; NaN for missing points."""
    axes = (list(scenes), list(METHODS), list(DTYPES), list(STEPS))
    shape = tuple(len(axis) for axis in axes)
    errors = np.full((*shape, len(DEMANDS), len(STATISTICS)), np.nan)
    estimated, seconds, substepped = errors.copy(), np.full(shape, np.nan), np.full(shape, np.nan)
    for scene, of_scene in points.items():
        for key, point in of_scene.items():
            place = tuple(axis.index(value) for axis, value in zip(axes, (scene, *key), strict=True))
            errors[place], estimated[place] = point.errors, point.estimated
            seconds[place], substepped[place] = point.seconds, point.substepped
    dims = ("scene", "method", "dtype", "step")
    relative = "relative to the sample's largest value over its storeys; of residual drifts, to its peak drift ratio"
    variables = {
        "error": ((*dims, "demand", "statistic"), errors, "relative error over the ensemble", "1", relative),
        "estimated_error": (
            (*dims, "demand", "statistic"),
            estimated,
            "relative error as the engine's check estimates it",
            "1",
            relative,
        ),
        "seconds_per_sample": (
            dims,
            seconds,
            "integration time per sample",
            "s",
            "least of several runs, after a warm-up",
        ),
        "substepped": (dims, substepped, "share of samples given shorter steps", "1", "to hold within their limit"),
    }
    words = {
        "scene": "ensemble",
        "method": "integration method",
        "dtype": "number type",
        "demand": "demand",
        "statistic": "statistic of the error over the samples",
    }
    values = {**dict(zip(dims, axes, strict=True)), "demand": list(DEMANDS), "statistic": list(STATISTICS)}
    coordinates = {name: (name, values[name], {"long_name": text, "units": "1"}) for name, text in words.items()}
    coordinates["step"] = ("step", axes[3], {"long_name": "longest integration step", "units": "s"})
    tolerance = {"long_name": "relative tolerance of the adaptive method", "units": "1"}
    coordinates["tolerance"] = ("step", [TOLERANCES[step] for step in STEPS], tolerance)
    labels = {"long_name": "what figures call the ensemble", "units": "1"}
    coordinates["scene_label"] = ("scene", [charted.label for charted in scenes.values()], labels)
    return xr.Dataset(
        {n: (d, v, {"long_name": t, "units": u, "comment": c}) for n, (d, v, t, u, c) in variables.items()},
        coords=coordinates,
    )


def label_plans(scenes: Mapping[str, Charted], plans: Mapping[str, list[Planned]]) -> xr.Dataset:
    """Return the choice of `plan` for each scene and target error, and the fastest charted point within the target."""
    columns = {
        "plan_method": ("method that plan chose", "1"),
        "plan_dtype": ("number type that plan chose", "1"),
        "plan_step": ("longest step that plan chose", "s"),
        "plan_error": ("true 95 % error of the peak drift on plan's choice", "1"),
        "plan_seconds_per_sample": ("integration time per sample on plan's choice", "s"),
        "best_method": ("method of the cheapest charted point within the target", "1"),
        "best_dtype": ("number type of that point", "1"),
        "best_step": ("longest step of that point", "s"),
        "best_error": ("95 % error of the peak drift of that point", "1"),
        "best_seconds_per_sample": ("integration time per sample of that point", "s"),
    }
    variables = {}
    for name, (text, units) in columns.items():
        rows = [[getattr(planned, name) for planned in plans[scene]] for scene in scenes]
        variables[name] = (("scene", "target"), np.array(rows), {"long_name": text, "units": units})
    target = {"long_name": "target of the 95 % error of the peak drift", "units": "1"}
    return xr.Dataset(variables, coords={"target": ("target", list(TARGETS), target)})


def build_dataset(scenes: Mapping[str, Charted], settings: Settings) -> xr.Dataset:
    """Measure all points and plans of the scenes, and return them as one dataset."""
    started = time.perf_counter()
    compile_kernels(scenes.values(), settings)
    compiled = time.perf_counter()
    points, plans = {}, {}
    for name, charted in scenes.items():
        reference = reference_of(charted, settings)
        most = len(charted_rows(charted)) * len(STEPS[STEPS.index(charted.first_step) :])
        with tqdm(total=most, desc=name, unit="point", disable=None) as progress:
            points[name] = chart(charted, reference, settings, progress)
        plans[name] = plan_scene(charted, reference, points[name], settings)
    charts = time.perf_counter()
    parts = [label_points(scenes, points), label_plans(scenes, plans)]
    dataset = xr.merge(parts, compat="equals", combine_attrs="no_conflicts")
    dataset.attrs |= {
        "Conventions": "CF-1.11",
        "title": "Accuracy against speed of integration methods on ensembles",
        "device": device_names(checked_devices(settings.device)),
        "samples": settings.samples,
        "seed": settings.seed,
        "seconds_compiling": compiled - started,
        "seconds_charting": charts - compiled,
    }
    return dataset


def print_report(result: xr.Dataset) -> None:
    """Print the fastest charted methods, the choices of `plan`, and the ratios of estimated to true errors."""
    print(f"\n{'ensemble':<12} {'target':>7}  {'best charted':<52} {'plan':<52} error and time, over target and best")
    for scene in result["scene"].values:
        for target in result["target"].values:
            row = result.sel(scene=scene, target=target)
            texts = []
            for who in ("best", "plan"):
                method, dtype, step, seconds = (
                    row[f"{who}_{name}"].item() for name in ("method", "dtype", "step", "seconds_per_sample")
                )
                found = f"{method} {dtype} {1e3 * step:.3g} ms: {1e6 * seconds:.3g} us" if method else "none"
                texts.append(f"{found:<52}")
            error, ratio = row["plan_error"] / target, row["plan_seconds_per_sample"] / row["best_seconds_per_sample"]
            print(f"{scene:<12} {target:>7g}  {' '.join(texts)} {error.item():.2f} {ratio.item():.2f}")
    ratio, within = agreement(result)
    print(
        f"estimated over true error, {ratio.size} of them: within a factor of 2 in {100 * within:.1f} %, "
        f"from {ratio.min():.2g} to {ratio.max():.2g}"
    )
    parts = ", ".join(f"{name} {result.attrs[f'seconds_{name}']:.0f} s" for name in ("compiling", "charting"))
    print(parts)


def main() -> None:
    """Run the study from the command line: measure, write the dataset, draw the figures and print the report."""
    arguments = read_arguments(__doc__, 1024, meaning="samples of each ensemble, at least")
    target = file_in(arguments.out, "accuracy_speed.nc")
    result = build_dataset(build_scenes(), Settings(arguments.samples, arguments.device, arguments.seed))
    netcdf.write(result, target)
    drawn = {
        "accuracy_speed": chart_of_methods(result),
        "accuracy_speed_ensembles": figures.work_precision(result),
        "accuracy_speed_residual": figures.residual_drift(result),
        "accuracy_speed_promises": figures.promises(result),
    }
    save_figures(drawn, arguments.out)
    print_report(result)
    print(f"wrote {target} and " + ", ".join(f"{name}.png" for name in drawn))


if __name__ == "__main__":
    main()
