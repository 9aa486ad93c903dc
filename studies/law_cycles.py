"""Force-drift curves of every storey law, isolator, damper and stop for the reference pages.

    python studies/law_cycles.py --out docs/reference/laws

Every storey follows the drift cycles of studies/laws.py, and a monotonic push from rest to the largest drift. The force
of a damper or stop does not include the force of the storey to which it belongs. The study writes cycles.nc, in which
forces are rounded to 1/1000 of the yield force. The tests of laws, dampers and stops compare this file with the forces
that the present code computes.
"""

from __future__ import annotations

import argparse
import datetime
import json
from importlib.metadata import version
from pathlib import Path

import numpy as np
import xarray as xr
from laws import DUCTILITIES, STIFFNESS, YIELD_DRIFT, YIELD_FORCE, protocol
from peers.storey_laws import LAWS

import warpdyn as wd
from warpdyn.engine.laws import DEVICES

ROUNDING = 1e-3  # rounding of stored forces, divided by the yield force
EVERY = 10  # every 10th step of the cycles is stored, and all turning points are among them
WEIGHT = 2.0e6  # weight on a sliding bearing [N]
# Isolators with all their parameters, and devices, in addition to the laws of studies/peers/storey_laws.py.
ISOLATORS = {
    "lead_rubber_bearing": {"yield_force": YIELD_FORCE, "post_yield_stiffness": STIFFNESS / 10},
    "friction_pendulum": {"friction_coefficient": 0.05, "radius": 2.0, "weight": WEIGHT},
}
STOP = {"clearance": 5 * YIELD_DRIFT, "contact_stiffness": 4 * STIFFNESS}
OF_DEVICES = {
    "friction_damper": {"slip_force": 0.5 * YIELD_FORCE, "brace_stiffness": 2 * STIFFNESS},
    "gap": STOP | {"restitution": 0.6},
    "one_sided_gap": STOP | {"restitution": 0.6},
}


def parameters_of(name: str) -> dict[str, float]:
    """Return all parameters of a law, isolator, damper or stop as a mapping from names to values in SI units."""
    if name in OF_DEVICES or name in ISOLATORS:
        return OF_DEVICES.get(name) or ISOLATORS[name]
    own = {} if name == "elastic" else {"yield_force": YIELD_FORCE}
    return own | LAWS[name].parameters(YIELD_DRIFT)


def building_with(name: str) -> wd.ShearBuilding:
    """Return a one-storey building with a law, or elastic with a damper or stop; height and mass have no effect."""
    if name in DEVICES:
        return wd.ShearBuilding(1.0, STIFFNESS, 3.0, devices=(name,), **parameters_of(name))
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=name, **parameters_of(name))


def forces(name: str, drift: np.ndarray) -> np.ndarray:
    """Return the force of a law, damper or stop divided by the yield force, for given drifts [m], shape [step]."""
    found = wd.storey_hysteresis(building_with(name), drift)["storey_force"].values[:, 0]
    return (found - STIFFNESS * drift * (name in DEVICES)) / YIELD_FORCE


def curves(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return forces divided by the yield force, as stored in the file: in the cycles, and in one monotonic push."""
    return forces(name, protocol())[::EVERY], forces(name, push())[::EVERY]


def push() -> np.ndarray:
    """Return the drifts [m] of a monotonic push from rest to the largest drift, shape [step]."""
    return np.linspace(0, DUCTILITIES[-1], 1001) * YIELD_DRIFT


def take_all() -> xr.Dataset:
    """Return a dataset with the force-drift curves of all laws, isolators, dampers and stops."""
    names = [*LAWS, *ISOLATORS, *OF_DEVICES]
    cycles, pushed = (np.array(each) for each in zip(*map(curves, names), strict=True))
    words = "force over yield force"
    return xr.Dataset(
        {
            "ductility": ("step", protocol()[::EVERY] / YIELD_DRIFT, {"long_name": "drift over yield drift"}),
            "force": (("element", "step"), cycles, {"long_name": f"{words} along the cycles"}),
            "pushed_ductility": ("pushed_step", push()[::EVERY] / YIELD_DRIFT, {"long_name": "drift over yield drift"}),
            "pushed_force": (("element", "pushed_step"), pushed, {"long_name": f"{words} in one push"}),
        },
        {
            "element": ("element", names, {"long_name": "storey law, isolator or device"}),
            "parameters": ("element", [json.dumps(parameters_of(name)) for name in names]),
        },
        {
            "title": "Storey laws and devices under the same cycles",
            "history": f"{datetime.date.today():%Y-%m-%d} warpdyn {version('warpdyn')} studies/law_cycles.py",
            "stiffness": STIFFNESS,
            "yield_force": YIELD_FORCE,
        },
    )


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    packing = {"dtype": "int16", "_FillValue": -32768, "zlib": True, "complevel": 9}
    encoding = {name: packing | {"scale_factor": ROUNDING} for name in ("force", "pushed_force")}
    encoding |= {name: packing | {"scale_factor": 0.01} for name in ("ductility", "pushed_ductility")}
    take_all().to_netcdf(folder / "cycles.nc", encoding=encoding)


if __name__ == "__main__":
    main()
