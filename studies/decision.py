"""Error of fragility medians against computing time, caused by integration and sampling together.

    python studies/decision.py --out results
    python studies/decision.py --out results --device cpu --largest 64 --truth gpu/decision.nc --beside gpu/decision.nc

The study runs the building and records of studies/p695_fragility.py with several methods, steps, number types, designs
and numbers of structures. The reference has 10,000 structures and a converged step in float64. The study writes
decision.nc and decision.png, which shows the most accurate choices for each computing time. `--truth` reads the
reference from a file that the study wrote on another machine; `--beside` adds the curve in such a file to the figure.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import xarray as xr
from p695_fragility import build_scene
from parts.command_line import file_in, save_figures
from parts.decision.errors import Choices, errors_of, precision_point, record_error
from parts.decision.figure import decision_chart

from warpdyn.engine.kernels.queues import checked_devices, device_names
from warpdyn.foundations.files import netcdf

PRECISION = 0.15  # target precision of the medians for `fragility_to` [1]


def read_arguments() -> argparse.Namespace:
    """Return the arguments that were given on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    parser.add_argument("--device", help="cpu or cuda:0 [the first GPU, or the CPU]")
    parser.add_argument("--seed", type=int, default=0, help="seed of every random draw [%(default)s]")
    parser.add_argument("--largest", type=int, default=256, help="most structures of a crossed design [%(default)s]")
    parser.add_argument("--shortest", type=float, default=0.0, help="shortest step that is charted [s]")
    parser.add_argument("--truth", type=Path, help="file that this study wrote on another device")
    parser.add_argument("--beside", type=Path, nargs="*", default=[], help="further files to draw, from other devices")
    return parser.parse_args()


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments()
    target = file_in(arguments.out, "decision.nc")
    whole = Choices()
    choices = Choices(
        steps=[step for step in whole.steps if step >= arguments.shortest],
        structures=[count for count in whole.structures if count <= arguments.largest],
        structures_per_motion=[count for count in whole.structures_per_motion if count <= arguments.largest],
    )
    truth = None
    if arguments.truth:
        with xr.open_dataset(arguments.truth) as found:
            truth = found["true_log_median"].values
    result = errors_of(choices, arguments.device, arguments.seed, truth)
    true = result["true_log_median"].values
    seeds = range(arguments.seed, arguments.seed + whole.replications)
    for name, value in precision_point(build_scene(), PRECISION, true, arguments.device, seeds).items():
        result[name] = value
    result["record_error"] = record_error(build_scene(), 64, arguments.device, arguments.seed)
    result.attrs |= {
        "Conventions": "CF-1.11",
        "title": "Error of fragility medians against computing time",
        "device": device_names(checked_devices(arguments.device)),
        "cores": len(os.sched_getaffinity(0)),
        "seed": arguments.seed,
    }
    netcdf.write(result, target)
    beside = [xr.load_dataset(path) for path in arguments.beside]
    save_figures({"decision": decision_chart([result, *beside])}, arguments.out)
    print(f"wrote {target} and decision.png")


if __name__ == "__main__":
    main()
