"""The five ensembles of the study accuracy_speed, with the range of steps of their charts."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from p695_fragility import BUILDING, SCATTER as BUILDING_SCATTER

import warpdyn as wd
from warpdyn.model.ground_motions.records import far_field

# Numbers of horizontal pairs in the far-field set: five with a step of 0.01 s and three with 0.02 s.
PAIRS = ("1", "2", "3", "7", "11", "15", "17", "18")
# A record is cut to the part between these shares of its Arias intensity, to reduce the computing time.
STRONG_PART = (0.01, 0.98)
FRAME = json.loads((Path(__file__).parents[3] / "data" / "seed_frame.json").read_text())


@dataclass(frozen=True)
class Charted:
    """One ensemble of the study, with the range of steps of its chart.

    Args:
        label: Name of the ensemble in figures.
        scene: The scene that is integrated.
        motions: Number of samples of each structure.
        first_step: Longest charted step [s].
        reference_step: Step of the reference solution [s].
        dearest: A curve ends where its time is this many times the time of the cheapest point [1].
        known: Drawn structures and their modal properties, which `prepare` keeps, by the number of samples.
    """

    label: str
    scene: wd.Scene
    motions: int
    first_step: float
    reference_step: float
    dearest: float = 20.0
    known: dict[int, dict] = field(default_factory=dict, repr=False)

    def structures(self, samples: int) -> int:
        """Return the number of structures that gives at least this number of samples."""
        return -(-samples // self.motions)


def strong_part(motion: wd.GroundMotion) -> wd.GroundMotion:
    """Return the part of a motion that contains 97 % of its Arias intensity."""
    share = np.cumsum(motion.acceleration**2)
    first, last = np.searchsorted(share / share[-1], STRONG_PART)
    return wd.GroundMotion(motion.acceleration[first : last + 1], motion.step, motion.name, motion.source)


def _stripe(building: wd.ShearBuilding, motions: list[wd.GroundMotion], level_in_g: float) -> wd.Stripes:
    return wd.Stripes(motions, (level_in_g,), wd.SpectralAcceleration(building.fundamental_period))


def _scatter(*names: str) -> dict[str, wd.RandomFactor]:
    return {name: BUILDING_SCATTER[name] for name in names}


def _seed_frame() -> wd.Scene:
    """Return the scene of a published frame under its harmonic force; its matrices are those of a shear chain."""
    stiffness, damping = (-np.diag(FRAME[name], 1)[0] for name in ("stiffness", "damping"))
    height = 3.0  # m; it has no effect on the results
    frame = wd.ShearBuilding(
        np.diag(FRAME["mass"]), stiffness, height, damping="storey", damping_coefficient=float(damping)
    )
    load = wd.HarmonicForce(FRAME["force_amplitude"], FRAME["circular_frequency"], FRAME["duration"])
    scatter = {
        "stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.10)),
        "damping_coefficient": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.30)),
    }
    return wd.Scene(frame, load, scatter=scatter, recorders=("drift",), title="Seed frame with scatter")


def _five_storeys(law: str, motions: list[wd.GroundMotion]) -> wd.Scene:
    """Return the five-storey building with a storey law; every record is scaled to 0.8 g at its first period."""
    linear = {name: BUILDING.parameters[name] for name in ("mass", "stiffness", "height", "damping_ratio")}
    yielding = {name: BUILDING.parameters[name] for name in ("yield_force", "hardening_ratio")}
    own = {"elastic": {}, "bilinear": yielding, "bouc_wen": yielding | {"exponent": 2.0}}[law]
    building = wd.ShearBuilding(**linear, law=law, damping="rayleigh", damping_modes=BUILDING.damping_modes, **own)
    scatter = _scatter("mass", "stiffness", "damping_ratio", *(["yield_force"] if own else []))
    # Residual drifts are not recorded for the elastic building, because they are zero.
    record = ("drift", "residual") if own else ("drift",)
    title = f"Five-storey building, {law.replace('_', '-')}"
    return wd.Scene(building, _stripe(building, motions, 0.8), scatter=scatter, recorders=record, title=title)


def _stiff_tower(motions: list[wd.GroundMotion]) -> wd.Scene:
    """Return a bilinear building of 20 storeys with dampers in every storey and 10 % damping in the first mode.

    The damping is proportional to the stiffness, so it is 260 % of critical in the last mode. Therefore the stable step
    of explicit methods with damping forces in every stage is only a quarter of the step without damping.
    """
    storeys, period, ratio, base_shear_coefficient = 20, 2.0, 0.10, 0.12
    mass, frequency, gravity = 1.0e6, 2 * np.pi / period, 9.80665
    stiffness = mass * (frequency / (2 * np.sin(np.pi / (4 * storeys + 2)))) ** 2  # uniform chain with this period
    below = np.arange(storeys)
    strength = base_shear_coefficient * storeys * mass * gravity * (1 - below * (below + 1) / (storeys * (storeys + 1)))
    tower = wd.ShearBuilding(
        mass,
        stiffness,
        3.05,
        law="bilinear",
        yield_force=strength,
        hardening_ratio=0.05,
        damping="storey",
        damping_coefficient=2 * ratio / frequency * stiffness,
    )
    scatter = _scatter("mass", "stiffness", "yield_force") | {"damping_coefficient": BUILDING_SCATTER["damping_ratio"]}
    title = "Stiff 20-storey building, bilinear"
    record = ("drift", "residual")
    return wd.Scene(tower, _stripe(tower, motions, 0.4), scatter=scatter, recorders=record, title=title)


def build_scenes() -> dict[str, Charted]:
    """Return the five ensembles of the study as a mapping from name to ensemble."""
    motions = [strong_part(motion) for motion in far_field() if motion.name.split()[0][:-1] in PAIRS]
    count = len(motions)
    five = {law: _five_storeys(law, motions) for law in ("elastic", "bilinear", "bouc_wen")}
    return {
        "seed_frame": Charted("seed frame, 3 storeys, harmonic force", _seed_frame(), 1, 0.08, 0.02 / 256),
        "linear": Charted("linear, 5 storeys, records", five["elastic"], count, 0.02, 0.02 / 256),
        "bilinear": Charted("bilinear, 5 storeys, records", five["bilinear"], count, 0.02, 0.02 / 256),
        "bouc_wen": Charted("Bouc-Wen, 5 storeys, records", five["bouc_wen"], count, 0.02, 0.02 / 256),
        "stiff": Charted("stiff bilinear, 20 storeys, records", _stiff_tower(motions), count, 0.02, 0.02 / 128, 10.0),
    }
