"""A program that writes and runs, to be interrupted: `python interrupted.py <what> <path> <structures>`.

It prints "begun" when what is to be interrupted begins, and "done" at its end.
"""

from __future__ import annotations

import sys

import numpy as np
import xarray as xr

import warpdyn as wd

MOTIONS = [wd.GroundMotion(np.sin(np.arange(1000.0) * pace), 0.01, name=str(pace)) for pace in (0.2, 0.05)]
MEMORY = 67_500_000  # bytes, so that there are several blocks
SCATTER = {"mass": wd.RandomFactor(wd.Lognormal(1, 0.2))}


def dataset(samples: int) -> xr.Dataset:
    """Return a dataset that is written in parts if it has more samples than a chunk."""
    random = np.random.default_rng(0)
    variables = {f"demand_{i}": (("sample", "storey"), random.random((samples, 3))) for i in range(6)}
    return xr.Dataset(variables, {"sample": np.arange(samples)}, {"title": "to be interrupted"})


def scene(is_many: bool, structures: int) -> wd.Scene:
    """Return a scene of one building under stripes, or of buildings of two heights."""

    def building(storeys: int) -> wd.ShearBuilding:
        return wd.ShearBuilding([2e5] * storeys, 1e8, 3.0, law="bouc_wen", yield_force=4e5, hardening_ratio=0.1)

    design = wd.Stripes(MOTIONS, [0.1, 0.3], wd.PeakGroundAcceleration())
    recorded = {"recorders": ("drift", "acceleration"), "tail": 0.5}
    if not is_many:
        return wd.Scene(building(3), design, SCATTER, **recorded)
    city = {str(n): wd.Archetype(building(n), count=structures, scatter=SCATTER) for n in (1, 3)}
    return wd.Scene(wd.Portfolio(city), design, **recorded)


def run(what: str, path: str, structures: int) -> None:
    """Do what is to be interrupted."""
    if what == "write":
        held = dataset(4000 * structures)
        print("begun", flush=True)
        wd.write(held, path)
        return
    is_many = what == "portfolio"
    given, count = scene(is_many, structures), {} if is_many else {"structures": structures}
    print("begun", flush=True)
    wd.simulate(given, seed=7, device="cpu", path=path, memory=MEMORY, **count).close()


if __name__ == "__main__":
    run(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    print("done", flush=True)
