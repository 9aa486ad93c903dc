"""Error of a frame with hinges against step and computing time: methods of warpdyn, and Newmark's method of OpenSees.

    python studies/frame_methods.py --out results

The frame is the four-storey steel frame of studies/four_storey_frame.py with 56 deteriorating hinges, under a record at
three levels: elastic, yielding and near collapse. The error of a method is the largest difference of its storey drifts
from the reference during the history, divided by the largest drift. The reference is rk4 with a very short step;
OpenSees is an independent program, which converges to it while the hinges are elastic. The study writes
frame_methods.nc and one figure. A point is missing if a history failed; without OpenSeesPy, its curve is missing.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from parts.command_line import file_in, parser_of, save_figures
from parts.four_storey_frame.frame import COEFFICIENTS, MASSES, frame_and_hinges
from parts.frame_methods.figure import draw
from parts.frame_methods.opensees_frame import newmark_history

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.integration.stability_guard import guard
from warpdyn.foundations.files import netcdf

RECORD, LEVELS = "LOS270", {"elastic": 0.3, "yielding": 1.0, "near collapse": 2.2}  # factors on the record
METHODS = (("rk4", "float64"), ("rk4", "float32"), ("heun", "float64"), ("velocity_verlet", "float64"))
METHODS += (("leapfrog", "float64"),)
NEWMARK = "Newmark (OpenSees)"
STEPS = (0.01, 0.005, 0.0025, 0.00125)  # s
REFERENCE_STEP = 0.00015625  # s
INTERVAL, END = 0.01, 12.0  # s, of the compared states; the record has steps of 0.01 s
LANES = 16  # histories that a CPU thread integrates at once; their levels differ by up to LEVEL_SPREAD
LEVEL_SPREAD = 0.05


def structure() -> wd.HingedFrame:
    """Return the frame with its 56 hinges, and Rayleigh damping of the initial stiffness without P-Delta."""
    frame, hinges = frame_and_hinges()
    elastic = frame.lumped()
    stiffness = elastic.stiffness_matrices({name: each[None] for name, each in elastic.parameters.items()})[0]
    damping = COEFFICIENTS[0] * np.diag(MASSES) + COEFFICIENTS[1] * stiffness
    return wd.HingedFrame(frame, hinges, damping_matrix=damping)


def motion(level: float, end: float) -> wd.GroundMotion:
    """Return the first part of the record times a factor, up to a time [s]."""
    [record] = [each for each in wd.records.far_field() if RECORD in each.name]
    return wd.GroundMotion(level * record.values[: round(end / record.step) + 1], record.step, f"{RECORD} {level:g}")


def drifts(frame: wd.HingedFrame, method: str, dtype: str, step: float, end: float) -> np.ndarray:
    """Return the storey drifts [m] of the levels at multiples of INTERVAL, shape [level, time, storey]."""
    cloud = wd.Cloud([motion(level, end) for level in LEVELS.values()])
    histories = wd.Histories(range(len(LEVELS)), every=round(INTERVAL / step))
    with wd.meant_as_given("strongest_motion", "weakest_motions", "peak_ground_acceleration", "no_damping"):
        scene = wd.Scene(frame, cloud, recorders=("spring",))
        run = wd.simulate(
            scene, method=method, dtype=dtype, step=step, device="cpu", histories=histories, on_unstable="flag"
        )
    times = INTERVAL * np.arange(1, round(end / INTERVAL) + 1)
    found = run["spring_deformation"].sel(time=times, method="nearest").isel(spring=slice(len(MASSES)))
    return found.transpose("history", "time", "spring").values


def seconds_per_history(frame: wd.HingedFrame, level: float, method: str, dtype: str, step: float, end: float) -> float:
    """Return the processor time of the kernel for one of LANES histories of a level [s], in one thread."""
    factors = np.linspace(1 - LEVEL_SPREAD, 1 + LEVEL_SPREAD, LANES)
    with wd.meant_as_given("strongest_motion", "weakest_motions", "peak_ground_acceleration", "no_damping"):
        scene = wd.Scene(frame, wd.Cloud([motion(level * each, end) for each in factors]), recorders=("spring",))
    settings = {"structures": 1, "method": method, "dtype": dtype, "step": step, "device": "cpu", "threads": 1}
    run, vibration = prepare(scene, **settings)
    guard(run, vibration, "flag")
    every = np.arange(LANES)
    run.integrate(every[:1])  # compiles the kernel
    started = time.process_time()
    run.integrate(every)
    return (time.process_time() - started) / LANES


def compare(found: np.ndarray, reference: np.ndarray) -> float:
    """Return the largest difference of drifts over the largest drift [1]."""
    return float(np.abs(found - reference).max() / np.abs(reference).max())


def measure(end: float, steps: tuple[float, ...]) -> xr.Dataset:
    """Return errors and processor times, with the dimensions level, method and step."""
    frame = structure()
    reference = drifts(frame, "rk4", "float64", REFERENCE_STEP, end)
    names = [f"{method}, {dtype}" if dtype == "float32" else method for method, dtype in METHODS] + [NEWMARK]
    error = np.full((len(LEVELS), len(names), len(steps)), np.nan)
    seconds = error.copy()
    for row, (method, dtype) in enumerate(METHODS):
        for column, step in enumerate(steps):
            found = drifts(frame, method, dtype, step, end)
            for place, level in enumerate(LEVELS.values()):
                error[place, row, column] = compare(found[place], reference[place])
                seconds[place, row, column] = seconds_per_history(frame, level, method, dtype, step, end)
        print(f"{names[row]}: {', '.join(f'{each:.2g}' for each in error[:, row].ravel())}")
    for place, level in enumerate(LEVELS.values()):
        for column, step in enumerate(steps):
            try:
                found, taken = newmark_history(motion(level, end), step, INTERVAL, end)
            except (ImportError, RuntimeError) as problem:
                print(f"{NEWMARK}: {problem}")
                continue
            error[place, -1, column], seconds[place, -1, column] = compare(found, reference[place]), taken
    return labelled(error, seconds, names, steps)


def labelled(error: np.ndarray, seconds: np.ndarray, names: list[str], steps: tuple[float, ...]) -> xr.Dataset:
    """Return errors and times as a dataset."""
    dims = ("level", "method", "step")
    words = "largest difference of storey drifts from the reference over the largest drift"
    variables = {
        "error": (dims, error, {"long_name": words, "units": "1"}),
        "seconds_per_history": (dims, seconds, {"long_name": "processor time per history", "units": "s"}),
    }
    coordinates = {
        "level": ("level", list(LEVELS), {"long_name": f"level of the record {RECORD}"}),
        "method": ("method", names, {"long_name": "integration method"}),
        "step": ("step", list(steps), {"long_name": "integration step", "units": "s"}),
        "factor": ("level", list(LEVELS.values()), {"long_name": "factor on the record", "units": "1"}),
    }
    return xr.Dataset(variables, coords=coordinates)


def main() -> None:
    """Run the study from the command line."""
    parser = parser_of(__doc__)
    parser.add_argument("--end", type=float, default=END, help="end of the histories [s] [%(default)s]")
    parser.add_argument("--steps", type=int, default=len(STEPS), help="number of steps, from 0.01 s on [%(default)s]")
    arguments = parser.parse_args()
    target = file_in(arguments.out, "frame_methods.nc")
    started = time.perf_counter()
    result = measure(arguments.end, STEPS[: arguments.steps])
    result.attrs |= netcdf.trace("Error and computing time of methods for a frame with hinges", "simulate")
    netcdf.write(result, target)
    save_figures({"frame_methods": draw(result)}, arguments.out)
    for name in ("error", "seconds_per_history"):
        for level in LEVELS:
            print(f"\n{name}, {level}\n{result[name].sel(level=level).to_pandas().map('{:.2g}'.format)}")
    print(f"\n{time.perf_counter() - started:.1f} s; wrote {target} and frame_methods.png")


if __name__ == "__main__":
    main()
