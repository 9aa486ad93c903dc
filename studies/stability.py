"""Stability limits of each method: growth per step, measured with the kernels and compared with theory.

    python studies/stability.py --out results

The study measures, for every method: maps of the growth per step over w h and damping ratio, the stability limits in
these maps, and period and damping errors. It shows RK4 at steps slightly below and above its limit. Then it examines
cases that this theory does not cover: stiffness-proportional damping in a tall chain, the limit of the Bouc-Wen law,
implicit methods on yielding storeys, and time that is accumulated in float32.

The study writes stability.nc, 8 figures and stability_limits.csv (copied to docs/reference/methods). dormand_prince54
is excluded, because a method with adaptive steps has no growth per step.
"""

from __future__ import annotations

import datetime
import platform
import time
from importlib.metadata import version

import numpy as np
import xarray as xr
from parts.command_line import file_in, read_arguments, save_figures
from parts.stability import failure_figures, failures, figures, limit_table, oscillator
from seed_frame import Variable, labelled

from warpdyn.engine.kernels.queues import checked_devices, device_names
from warpdyn.engine.methods.stability_limits import stability_limit
from warpdyn.engine.methods.table import METHODS
from warpdyn.foundations.core.output_variables import STATUS_MEANINGS
from warpdyn.foundations.files import netcdf

STEPPED = [name for name, method in METHODS.items() if not method.is_adaptive]
LIMITED = [name for name in STEPPED if np.isfinite(stability_limit(METHODS[name], 0.05))]
# Damping ratios at which limits are measured: those of the tables, and more for smooth curves.
TABULATED = (0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.99, 1, 1.1, 1.25, 1.5, 2)
LIMIT_DAMPING = np.unique(np.round([*TABULATED, *np.linspace(0, 2, 81)], 12))
TABLED_DAMPING = (0, 0.02, 0.05, 0.1, 0.5, 1)  # damping ratios in stability_limits.csv
ACCURACY_STEPS = np.geomspace(0.05, 1.6, 60)
# Values of w h around the limit of RK4, 2.8284, for the growth or decay of an oscillator without damping.
RK4_STEPS, GROWN_STEPS, GROWTH = np.array([2.7, 2.82, 2.83, 2.9, 3.0]), np.array([2.83, 2.9, 3.0]), 1000.0
RK4_COUNT, LARGEST_SIZE = 2000, 1e12
SIDE, SIDE_COUNT, SIDE_DAMPING = 0.005, 2000, 0.05
CHAIN_SHARES, CHAIN_EVERY = np.array([0.999, 1.001, 2.0]), 10
EXPONENTS, PUSH_RATIOS = np.array([1.0, 2.0, 5.0, 10.0]), np.round(np.arange(0.5, 2.001, 0.02), 12)
SHOWN_RATIOS, SHOWN_EXPONENT, PUSH_COUNT = np.array([0.9, 1.1, 1.5]), 2.0, 2000
YIELDING_METHODS = ("newmark_average", "newmark_linear")
YIELDING_STEPS, YIELDING_COUNT = np.geomspace(0.1, 10, 121), 800
SHOWN_YIELDING, LARGEST_DRIFT = np.array([0.2, 5.0]), 1e30
CLOCK_STEPS, CLOCK_TIMES = np.array([1e-2, 1e-3, 1e-4, 1e-5]), np.linspace(0, 10, 501)
STATUS_TEXT = "status of the run in the kernel: " + ", ".join(f"{i} {text}" for i, text in enumerate(STATUS_MEANINGS))
FIGURES = figures.FIGURES | failure_figures.FIGURES
# Values, description and units of each dimension.
DIMENSIONS = {
    "method": (STEPPED, "integration method", "1"),
    "limited_method": (LIMITED, "integration method with a stability limit", "1"),
    "limit_damping_ratio": (LIMIT_DAMPING, "damping ratio of the limits", "1"),
    "side": (["inside", "outside"], "side of the limit, by half a per cent of the step", "1"),
    "accuracy_frequency_step": (ACCURACY_STEPS, "circular frequency times step, without damping", "1"),
    "rk4_frequency_step": (RK4_STEPS, "circular frequency times step about the limit of RK4", "1"),
    "grown_frequency_step": (GROWN_STEPS, "circular frequency times step beyond the limit of RK4", "1"),
    "rk4_step": (np.arange(RK4_COUNT + 1), "number of steps of RK4", "1"),
    "chain_damping": (list(failures.CHAIN_DAMPINGS), "damping of the 20-storey chain", "1"),
    "chain_share": (CHAIN_SHARES, "step over the longest that holds for stiffness-proportional damping", "1"),
    "chain_step": (np.arange(0, failures.CHAIN_STEPS + 1, CHAIN_EVERY), "number of steps of the chain", "1"),
    "exponent": (EXPONENTS, "Bouc-Wen exponent n", "1"),
    "push_ratio": (PUSH_RATIOS, "step over its limit for a Bouc-Wen storey, 2.785 uy / (n |v|)", "1"),
    "shown_push_ratio": (SHOWN_RATIOS, "step over its limit for a Bouc-Wen storey, of whole histories", "1"),
    "push_step": (np.arange(PUSH_COUNT + 1), "number of steps of the pushed storey", "1"),
    "yielding_method": (list(YIELDING_METHODS), "integration method on storeys that yield", "1"),
    "yielding_law": (list(failures.YIELDING_LAWS), "storey law", "1"),
    "yielding_frequency_step": (YIELDING_STEPS, "initial circular frequency times step", "1"),
    "shown_yielding_step": (SHOWN_YIELDING, "initial circular frequency times step, of whole histories", "1"),
    "yielding_step": (np.arange(YIELDING_COUNT + 1), "number of steps of the storey that yields", "1"),
    "clock_step": (CLOCK_STEPS, "integration step of the seed frame", "s"),
    "clock_time": (CLOCK_TIMES, "time", "s"),
}


def growth_maps(samples: int, device: str | None) -> tuple[dict[str, Variable], dict[str, Variable]]:
    """Return growth per step of each method on a grid of about `samples` oscillators, and coordinates of the grid."""
    rows = max(3, round(np.sqrt(0.4 * samples)))
    ratio = np.linspace(0, 2, rows)
    columns = max(3, samples // rows)
    product = np.linspace(0, oscillator.LARGEST_FREQUENCY_STEP, columns + 1)[1:]
    x, z = np.meshgrid(product, ratio)
    growth = [oscillator.growth_per_step(name, x.ravel(), z.ravel(), device).reshape(x.shape) for name in STEPPED]
    text = "largest factor by which a step multiplies a motion"
    coordinates = {
        "damping_ratio": labelled("damping_ratio", ratio, "1", "damping ratio"),
        "frequency_step": labelled("frequency_step", product, "1", "circular frequency times step"),
    }
    return {"growth_per_step": labelled(("method", "damping_ratio", "frequency_step"), growth, "1", text)}, coordinates


def limits(device: str | None) -> dict[str, Variable]:
    """Return measured and theoretical limits, and the growth of a motion at steps slightly below and above them."""
    measured = [oscillator.measured_limits(name, LIMIT_DAMPING, device) for name in LIMITED]
    theory = [[stability_limit(METHODS[name], ratio) for ratio in LIMIT_DAMPING] for name in LIMITED]
    at = np.array([stability_limit(METHODS[name], SIDE_DAMPING) for name in LIMITED])
    sides = at[:, None] * (1 + SIDE * np.array([-1, 1]))
    ratio = np.full(2, SIDE_DAMPING)
    size = [
        oscillator.sizes(name, x, ratio, SIDE_COUNT, device, SIDE_COUNT)[:, -1]
        for name, x in zip(LIMITED, sides, strict=True)
    ]
    dims = ("limited_method", "limit_damping_ratio")
    after = f"size of a motion after {SIDE_COUNT} steps over its first, half a per cent off the limit at 5 % damping"
    return {
        "measured_limit": labelled(dims, measured, "1", "largest w h without growth, measured; 0 is seen below 0.02"),
        "theoretical_limit": labelled(dims, theory, "1", "largest w h without growth, of the stability function"),
        "size_beside_limit": labelled(("limited_method", "side"), size, "1", after),
    }


def accuracies(device: str | None) -> dict[str, Variable]:
    """Return the period elongation and the numerical damping of each method."""
    found = [oscillator.accuracy(name, ACCURACY_STEPS, device) for name in STEPPED]
    texts = {
        "period_elongation": "numerical period over the exact one, less 1",
        "damping_ratio": "damping ratio that the method itself adds",
        "amplitude_kept": "amplitude kept in a period",
    }
    dims = ("method", "accuracy_frequency_step")
    return {
        f"numerical_{name}": labelled(dims, [each[name] for each in found], "1", text) for name, text in texts.items()
    }


def rk4_beside_its_limit(device: str | None) -> dict[str, Variable]:
    """Return the growth of undamped motions with RK4, and the number of steps in which they grow a thousand times."""
    none = np.zeros_like(RK4_STEPS)
    size = oscillator.sizes("rk4", RK4_STEPS, none, RK4_COUNT, device)
    drift = oscillator.oscillator_states("rk4", RK4_STEPS, none, RK4_COUNT, device)[..., 0]
    count = oscillator.steps_to_grow(GROWN_STEPS, GROWTH, RK4_COUNT, device)
    dims = ("rk4_frequency_step", "rk4_step")
    small = np.clip(size, 0, LARGEST_SIZE)
    text = "size of the motion over its first; beyond 1e12 cut off"
    drift = np.clip(np.nan_to_num(drift), -LARGEST_SIZE, LARGEST_SIZE)
    return {
        "rk4_size": labelled(dims, small, "1", text),
        "rk4_displacement": labelled(dims, drift, "m", "displacement under RK4; beyond 1e12 cut off"),
        "rk4_steps_to_thousandfold": labelled("grown_frequency_step", count, "1", "steps to a thousandfold motion"),
    }


def chains(device: str | None) -> dict[str, Variable]:
    """Return the longest steps [s] of a chain with four dampings, and motions with stiffness-proportional damping."""
    found = np.array([failures.chain_limits(damping, device) for damping in failures.CHAIN_DAMPINGS])
    trap = failures.CHAIN_DAMPINGS.index("stiffness")
    size = failures.chain_sizes("stiffness", CHAIN_SHARES * found[trap, 1], CHAIN_EVERY, device)
    names = {
        "measured": "longest step that holds, measured",
        "theoretical": "longest step that holds, of each mode's limit",
        "guarded": "longest step that the guard of a run allows",
    }
    variables = {
        f"{name}_chain_step": labelled("chain_damping", found[:, i], "s", text)
        for i, (name, text) in enumerate(names.items())
    }
    text = "size of displacements [m] and velocities [m/s] over their first, stiffness-proportional damping"
    return variables | {"chain_size": labelled(("chain_share", "chain_step"), size, "1", text)}


def bouc_wen(device: str | None) -> dict[str, Variable]:
    """Return the distance of z of a pushed Bouc-Wen storey from its bound, and the step above which it stays away."""
    x, n = np.meshgrid(PUSH_RATIOS, EXPONENTS)
    z, status = failures.pushed_bouc_wen(x.ravel(), n.ravel(), PUSH_COUNT, device)
    shown, _ = failures.pushed_bouc_wen(SHOWN_RATIOS, np.full(SHOWN_RATIOS.size, SHOWN_EXPONENT), PUSH_COUNT, device)
    dims = ("exponent", "push_ratio")
    return {
        "unsettled": labelled(dims, failures.unsettled(z).reshape(x.shape), "1", "largest |z - 1| at the end"),
        "push_status": labelled(dims, status.reshape(x.shape), "1", STATUS_TEXT),
        "pushed_memory": labelled(("shown_push_ratio", "push_step"), shown, "1", "z of a storey of exponent 2"),
        "measured_push_limit": labelled(
            "exponent", failures.bouc_wen_limits(EXPONENTS, device), "1", "step times n |v| / uy from which z fails"
        ),
    }


def yielding(device: str | None) -> dict[str, Variable]:
    """Return peak drifts of yielding storeys with implicit methods over exact peaks, and some complete histories."""
    peak, status, history = [], [], []
    count, steps = YIELDING_STEPS.size, np.concatenate([YIELDING_STEPS, SHOWN_YIELDING])
    for method in YIELDING_METHODS:
        for law in failures.YIELDING_LAWS:
            drift, outcome = failures.yielding_drift(method, law, steps, YIELDING_COUNT, device)
            drift = np.clip(np.nan_to_num(drift, nan=LARGEST_DRIFT), -LARGEST_DRIFT, LARGEST_DRIFT)
            peak.append(np.abs(drift[:count]).max(axis=1) / failures.exact_peak(law))
            status.append(outcome[:count])
            history.append(drift[count:])
    outer, shape = ("yielding_method", "yielding_law"), (len(YIELDING_METHODS), len(failures.YIELDING_LAWS))
    dims, shown = (*outer, "yielding_frequency_step"), (*outer, "shown_yielding_step", "yielding_step")
    cut = "cut off at 1e30"
    peak, status, history = (np.reshape(values, (*shape, *values[0].shape)) for values in (peak, status, history))
    return {
        "yielding_peak": labelled(dims, peak, "1", f"peak drift over the exact one, {cut}"),
        "yielding_status": labelled(dims, status, "1", STATUS_TEXT),
        "yielding_drift": labelled(shown, history, "1", f"drift over yield drift, {cut}"),
    }


def clocks(device: str | None) -> dict[str, Variable]:
    """Return errors of the frame of studies/seed_frame.py in float32 and float64, and errors of accumulated time."""
    found = [failures.frame_errors(step, device) for step in CLOCK_STEPS]
    texts = {
        "float64": "by the kernel in float64",
        "float32": "by the kernel in float32, which counts steps",
        "float32_in_numpy": "by numpy in float32 that counts steps",
        "float32_accumulated_time": "by numpy in float32 that adds its time up",
    }
    variables = {
        f"{name}_error": labelled(
            "clock_step", [each[name] for each in found], "1", f"largest error of the seed frame over its peak, {text}"
        )
        for name, text in texts.items()
    }
    place = [np.round(CLOCK_TIMES / step).astype(int) for step in CLOCK_STEPS]
    off = [failures.clock(step, 10.0)[i] - i * step for step, i in zip(CLOCK_STEPS, place, strict=True)]
    text = "time added up in float32, less the number of steps times the step"
    return variables | {"clock_error": labelled(("clock_step", "clock_time"), off, "s", text)}


def build_dataset(samples: int, device: str | None) -> xr.Dataset:
    """Run all parts of the study, and return their results as one dataset."""
    variables, coordinates = growth_maps(samples, device)
    for part in (limits, accuracies, rk4_beside_its_limit, chains, bouc_wen, yielding, clocks):
        variables |= part(device)
    for name, (values, text, units) in DIMENSIONS.items():
        coordinates[name] = (name, np.array(values), {"long_name": text, "units": units})
    dataset = xr.Dataset(variables, coords=coordinates)
    dataset.attrs = {
        "Conventions": "CF-1.11",
        "title": "Where integration methods fail, measured from the kernels",
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%dT%H:%M:%SZ} studies/stability.py",
        "source": f"warpdyn {version('warpdyn')}, warp-lang {version('warp-lang')}, numpy {np.__version__}, "
        f"Python {platform.python_version()}",
        "device": device_names(checked_devices(device)),
        "oscillators_in_each_map": int(np.prod([dataset.sizes[name] for name in ("damping_ratio", "frequency_step")])),
    }
    return dataset


def print_report(result: xr.Dataset) -> None:
    """Print measured and theoretical limits, and the results for the cases that the theory does not cover."""
    print(
        f"{'method':<26} {'limit of w h':>12} {'in theory':>10} {'largest difference':>19} {'0.5 % inside':>13} outside"
    )
    for name in result["limited_method"].values:
        row = result.sel(limited_method=name)
        theory, measured = row["theoretical_limit"], row["measured_limit"]
        off = np.abs(measured / theory.where(theory > 0) - 1).max()
        at = {"limit_damping_ratio": SIDE_DAMPING}
        inside, outside = row["size_beside_limit"].values
        print(
            f"{name:<26} {float(measured.sel(at)):>12.4f} {float(theory.sel(at)):>10.4f} {100 * float(off):>17.4f} % "
            f"{inside:>13.1e} {outside:.1e}"
        )
    print(f"at {100 * SIDE_DAMPING:g} % damping; sizes of the motion are those after {SIDE_COUNT} steps over the first")
    grown = zip(GROWN_STEPS, result["rk4_steps_to_thousandfold"].values, strict=True)
    print("RK4 grows a thousand times in " + ", ".join(f"{count:.0f} steps at w h = {x:g}" for x, count in grown))
    for kind, row in zip(failures.CHAIN_DAMPINGS, result["measured_chain_step"].values, strict=True):
        print(f"20 storeys, damping {kind}: RK4 holds to {row:.6f} s")
    push = zip(EXPONENTS, result["measured_push_limit"].values, strict=True)
    print("Bouc-Wen fails from h n |v| / uy = " + ", ".join(f"{value:.3f} at n = {n:g}" for n, value in push))
    for method in YIELDING_METHODS:
        peak = result["yielding_peak"].sel(yielding_method=method)
        worst = {law: float(peak.sel(yielding_law=law).max()) for law in failures.YIELDING_LAWS}
        told = ", ".join(f"{law} {f'{value:.3g}' if value < 1e6 else 'without end'}" for law, value in worst.items())
        print(f"{method}: largest peak drift over the exact one up to w h = {YIELDING_STEPS[-1]:g}: {told}")
    for step in CLOCK_STEPS:
        row = result.sel(clock_step=step)
        counted, added = float(row["float32_error"]), float(row["float32_accumulated_time_error"])
        print(f"float32 at {step:g} s: error {counted:.2g} where steps are counted, {added:.2g} where time is added up")


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 10_000, meaning="oscillators in each method's map of growth")
    target = file_in(arguments.out, "stability.nc")
    started = time.perf_counter()
    result = build_dataset(arguments.samples, arguments.device)
    netcdf.write(result, target)
    limit_table.write(result, TABLED_DAMPING, arguments.out / "stability_limits.csv")
    drawn = {f"stability_{name}": draw(result) for name, draw in FIGURES.items()}
    save_figures(drawn, arguments.out)
    print_report(result)
    print(f"{time.perf_counter() - started:.0f} s; wrote {target} and " + ", ".join(f"{name}.png" for name in drawn))


if __name__ == "__main__":
    main()
