"""Description of the machine on which the study benchmark runs, as text."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

import warp as wp

PACKAGES = ("warpdyn", "warp-lang", "numpy", "jax", "diffrax", "numba", "numba-cuda", "cubie", "openseespy")
COMPILERS = {"g++": r"(\d+\.\d+\.\d+)", "nvcc": r"release (\S+),"}


def available_devices() -> list[str]:
    """Return the names of the CPU and of all GPUs of this machine."""
    return ["cpu", *(f"cuda:{number}" for number in range(wp.get_cuda_device_count()))]


def processor() -> str:
    """Return the name of the processor, and the number of cores that this process may use, as text."""
    name = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        found = re.search(r"model name\s*: (.+)", information.read_text())
        name = found[1] if found else name
    return f"{name}, {len(os.sched_getaffinity(0))} cores"


def gpus(devices: Sequence[str]) -> str:
    """Return the models of the GPUs among the devices as text; "none" without a GPU."""
    names = [wp.get_device(device).name for device in devices if device != "cpu"]
    return ", ".join(names) or "none"


def versions() -> str:
    """Return the versions of Python, of the installed packages, and of the compilers, as text."""
    found = [f"Python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            continue
    for compiler, pattern in COMPILERS.items():
        if shutil.which(compiler):
            said = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
            version = re.search(pattern, said)
            found.append(f"{compiler} {version[1] if version else ''}".strip())
    return ", ".join(found)
