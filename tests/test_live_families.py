"""Live ensembles of frames with hinges, controlled buildings and floor spectra have the bits of `simulate`."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from frame_cases import portal

import warpdyn as wd

pytestmark = pytest.mark.filterwarnings("ignore:implausible input")
TIME = 0.02 * np.arange(80)
MOTION = wd.GroundMotion(6.0 * np.sin(7.0 * TIME), 0.02, "sine")
HOW = {"integration": wd.Integration(method="rk4"), "execution": wd.Execution(device="cpu", threads=1)}
HINGE = {"law": "bilinear", "yield_force": 1.5e5, "hardening_ratio": 0.02}
HINGES = {(member, end): HINGE for member in ("C1_1", "C1_2", "B1_1") for end in ("start", "end")}
DAMPED = {"damping": "modal", "damping_ratio": 0.03, "drift_capacity": 0.1}
OF_HINGES = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring")}


def hinged_frame() -> wd.Scene:
    return wd.Scene(wd.HingedFrame(portal(), HINGES, **DAMPED), MOTION, OF_HINGES, recorders=("spring",))


def hinged_fishbone() -> wd.Scene:
    structure = wd.HingedFishbone.from_frame(portal(), HINGES, **DAMPED)
    return wd.Scene(structure, MOTION, OF_HINGES, recorders=("spring",))


def controlled() -> wd.Scene:
    """Return a building with an observer of noisy sensors, delayed commands and floor spectra."""
    building = wd.ShearBuilding(
        1e5, 4e7, 3.0, law="bilinear", yield_force=2e5, hardening_ratio=0.05, damping="rayleigh", damping_ratio=0.05
    )
    actuators = [wd.control.Actuator(1)]
    loop = wd.control.Control(
        actuators,
        regulator=wd.control.lqr(building, actuators, force_weight=1e-8),
        sampling_interval=0.02,
        noise={"velocity": 0.01},
        delay=0.04,
    )
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    spectra = {"recorders": ("drift", "floor_spectra"), "floor_spectra": wd.FloorSpectra([0.3, 1.0])}
    return wd.Scene(building, MOTION, scatter, control=loop, **spectra)


def live_run(scene: wd.Scene, samples: int) -> xr.Dataset:
    live = wd.Live(scene, 3, **HOW)
    for packet in wd.packets.from_motion(MOTION, samples):
        live.push(packet)
    return live.finish()


def of_hinges(scene_of):
    """Mark the case of a frame with hinges, whose kernels compile for a long time."""
    return pytest.param(scene_of, marks=pytest.mark.thorough)


@pytest.mark.parametrize("scene_of", [of_hinges(hinged_frame), of_hinges(hinged_fishbone), controlled])
def test_every_division_into_packets_has_the_same_bits(scene_of):
    scene = scene_of()
    run = live_run(scene, 80)  # integrated without a pause before its last sample
    for samples in (1, 7):  # pauses while hinges yield, and between two samples of the controller
        found = live_run(scene, samples)
        for name in run.variables:
            assert found[name].equals(run[name]), name
    if scene.control is None:
        rotations = run["peak_spring_deformation"].sel(spring=list(scene.structure.hinge_names))
        assert float(rotations.max()) > 0.01  # rad, far beyond yielding
    else:
        assert float(run["peak_control_force"].min()) > 1e4  # N


@pytest.mark.thorough
@pytest.mark.parametrize("scene_of", [hinged_frame, hinged_fishbone, controlled])
def test_packets_give_the_bits_of_simulate(scene_of):
    run, found = wd.simulate(scene_of(), structures=3, **HOW), live_run(scene_of(), 7)
    for name in run.variables:
        assert found[name].equals(run[name]), name
