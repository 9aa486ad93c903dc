"""The text of the kernel that a scene leads to."""

from warpdyn.integration.packing import plan_of
from warpdyn.kernels.build import composed
from warpdyn.kernels.queues import checked_devices
from warpdyn.scene.scene import Scene


def listing(scene: Scene, method: str | None, dtype: str | None, device: str | None) -> str:
    """Return the text of a scene's kernel; the keywords are those of `simulate`."""
    [name, *_] = checked_devices(device)
    return composed(plan_of(scene, method or "rk4", dtype or "float32", name != "cpu")).text
