"""Scenes whose samples are shared by threads of a GPU: {name: (scene, settings, constants of the kernel)}."""

import numpy as np
from test_frame_storeys import IMK, MASS, fish_bone, grid_frame

import warpdyn as wd

LOADS = {"brackets": (0.5, 0.4), "slab_load": 3e4}
RECORDERS = ("output", "spring", "drift", "acceleration")
SETTINGS = {"method": "leapfrog", "step": 0.0025, "dtype": "float64"}


def shaken(structure, *, recorders=RECORDERS):
    """Return a scene with pulses: the first leaves the structure elastic, the last makes it collapse."""
    time = 0.01 * np.arange(120)
    pulses = [wd.GroundMotion(scale * np.sin(4 * time), 0.01, f"sine x {scale}") for scale in (0.3, 1.5, 3.0, 12.0)]
    return wd.Scene(structure, wd.Cloud(pulses), recorders=recorders, tail=0.1)


def damped(storeys):
    """Return settings of a frame whose damping couples all floors."""
    return {
        "damping_matrix": 0.3 * MASS * np.eye(storeys) + 2e4 * (storeys * np.eye(storeys) - 1),
        "drift_capacity": 0.05,
    }


def grid(law, storeys=3, bays=2, *, hinge_stiffness=None, **loads):
    """Return a scene of a frame whose joints are a grid."""
    base = grid_frame(storeys, bays, law=law, **loads)
    frame = base.frame
    if hinge_stiffness is not None:
        whole = frame.description()
        for member in whole["members"].values():
            member |= {end: hinge_stiffness for end in ("spring_start", "spring_end") if end in member}
        frame = wd.Frame(**whole)
    return shaken(wd.HingedFrame(frame, base.hinges, **damped(storeys)))


BILINEAR = {"law": "bilinear", "hardening_ratio": 0.02}
PLASTIC = {"law": "elastic_perfectly_plastic"}
FLAGGED = SETTINGS | {"on_unstable": "flag"}
PEAKS = ("peak_output", "peak_spring_deformation", "peak_spring_force", "peak_acceleration")
ALSO_ALONE = {"bilinear"}  # In these cases each sample also runs alone.
# Cases with the same structure and constants share their kernels.
CASES = {
    "bilinear": (grid(BILINEAR, **LOADS), SETTINGS, {}),
    "perfectly plastic": (grid(PLASTIC, **LOADS), SETTINGS, {}),
    "rigid hinges": (grid(BILINEAR, hinge_stiffness=1e12, **LOADS), SETTINGS, {}),
    "two storeys, float32": (grid(BILINEAR, 2, **LOADS), SETTINGS | {"dtype": "float32"}, {}),
    "one branch after the other": (grid(PLASTIC, **LOADS), SETTINGS, {"MOST_TOGETHER": 0}),
    "one solution": (grid(BILINEAR, **LOADS), FLAGGED, {"MOST_SOLUTIONS": 1}),
    "capped": (grid(IMK, **LOADS), SETTINGS, {}),
    "fish-bone": (shaken(fish_bone(3, IMK, **damped(3))), SETTINGS, {}),
}
