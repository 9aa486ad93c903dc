"""Kernels that integrate whole histories, and how they are composed, fed and launched."""

import importlib


def source(scene, *, method: str | None = None, dtype: str | None = None, device: str | None = None) -> str:
    """Return the source of the kernel that integrates a scene, as `simulate` with these keywords would run it.

    Args:
        scene: The scene.
        method: Integration method, as of `simulate`.
        dtype: "float32" or "float64", as of `simulate`.
        device: "cpu" or "cuda:0"; None for the first GPU, or the CPU where there is none.

    Returns:
        The text of the function that Warp compiles, with the device functions that it calls named in it.

    Raises:
        ValueError: If the method, the dtype or the device is unknown, or does not fit the scene.
        TypeError: If the scene is none.

    Example:
        >>> text = wd.kernels.source(scene, method="rk4")
        >>> text.splitlines()[0]
        'def integrate_chain('
    """
    # What a scene needs of a kernel is read in a later room, which this one must not import before somebody asks.
    reader = importlib.import_module("warpdyn.campaigns.integration.model")
    return reader.kernel_text(scene, method, dtype, device)
