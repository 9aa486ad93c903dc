"""Kernels that integrate whole response histories: the parts of their source, compilation, arguments and launches."""

import importlib

from warpdyn.engine.kernels.composing.user_recorders import Recorder as Recorder
from warpdyn.foundations.core.output_variables import Variable as Variable


def source(scene, *, method: str | None = None, dtype: str | None = None, device: str | None = None) -> str:
    """Return the source of the kernel that `simulate` runs for a scene.

    Args:
        scene: The scene.
        method: Integration method; None: the default of `simulate`.
        dtype: "float32" or "float64"; None: the default of `simulate`.
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU.

    Returns:
        The source of the kernel. Device functions that it calls, such as the storey law, appear only by name.

    Raises:
        ValueError: If the method, the dtype or the device is unknown, or does not fit the scene.
        TypeError: If the scene is not a Scene.

    Example:
        >>> text = wd.kernels.source(scene, method="rk4")
        >>> text.splitlines()[0]
        'def integrate_chain('
    """
    # `campaigns` decides which kernel a scene needs. That package comes after this one, so it is imported here.
    reader = importlib.import_module("warpdyn.campaigns.integration.model")
    return reader.kernel_text(scene, method, dtype, device)
