"""Kernels that integrate whole histories, and how they are composed, fed and launched."""

import importlib


def source(scene, *, method: str | None = None, dtype: str | None = None, device: str | None = None) -> str:
    """Return the source of the kernel that integrates a scene, as `simulate` with these keywords would run it.

    Example:
        >>> text = wd.kernels.source(scene, method="rk4")
        >>> "velocity" in text
        True
    """
    # What a scene needs of a kernel is read in a later room, which this one must not import before somebody asks.
    reader = importlib.import_module("warpdyn.integration.model")
    return reader.kernel_text(scene, method, dtype, device)
