"""Whole histories beside OpenSees': buildings of several laws under recorded motions, from elastic to collapse.

python tests/opensees_histories.py              # every building, a table row a history: some minutes
python tests/opensees_histories.py steel        # those whose name begins so
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from opensees import chain_drifts

import warpdyn as wd
from warpdyn.motions import STANDARD_GRAVITY
from warpdyn.records import far_field

LIMIT = 0.1  # collapse drift ratio
RECORDS = (0, 9, 18, 27, 36)  # of the far-field set: five earthquakes
LEVELS = (0.3, 1.0, 2.5)  # Sa(T1) over what brings the building to yield
OURS, THEIRS = 2.5e-3, 2.5e-4  # longest steps [s]; OpenSees' is of second order, and of first with a law's own rate
DAMPING_RATIO = 0.05
TAIL = 12.0  # periods of free vibration


@dataclass(frozen=True)
class Compared:
    """A building and what OpenSees calls its storeys.

    Args:
        building: The building.
        materials: Uniaxial material and parameters of each storey.
        yields_at: Sa(T1) at which it yields, roughly [g].
    """

    building: wd.ShearBuilding
    materials: list[tuple[str, list[float]]]
    yields_at: float

    @property
    def weight_over_height(self) -> np.ndarray:
        """Gravity load that each storey carries over its height [N/m]; 0 without P-Delta."""
        return np.zeros(self.building.storeys)


def frame(storeys: int, law: str, **parameters: object) -> wd.ShearBuilding:
    """Return a building of a tenth of a second a storey whose strength follows the shears of a triangular load."""
    mass = np.full(storeys, 1.0e5)
    period = 0.4 if storeys == 1 else 0.12 * storeys + 0.1
    shear = np.cumsum(np.arange(storeys, 0, -1.0))
    stiffness = shear / shear[-1]
    unit = wd.ShearBuilding(mass, stiffness * 1e8, 3.2).fundamental_period
    stiffness = stiffness * 1e8 * (unit / period) ** 2
    yield_force = 0.2 * mass.sum() * STANDARD_GRAVITY * shear / shear[-1]
    damping = {"damping": "rayleigh", "damping_ratio": DAMPING_RATIO}
    return wd.ShearBuilding(mass, stiffness, 3.2, law=law, yield_force=yield_force, **damping, **parameters)


def bilinear(storeys: int) -> Compared:
    """Return a building of bilinear storeys: Steel01."""
    building = frame(storeys, "bilinear", hardening_ratio=0.03)
    p = building.parameters
    steel = [("Steel01", [f, k, 0.03]) for f, k in zip(p["yield_force"], p["stiffness"], strict=True)]
    return Compared(building, steel, 0.2)


def bouc_wen(storeys: int) -> Compared:
    """Return a building of Bouc-Wen storeys; OpenSees' memory is a deformation."""
    building = frame(storeys, "bouc_wen", hardening_ratio=0.03)
    p = building.parameters
    rows = [
        ("BoucWen", [0.03, k, 1.0, 0.5 * k / f, 0.5 * k / f, 1.0, 0.0, 0.0, 0.0])
        for f, k in zip(p["yield_force"], p["stiffness"], strict=True)
    ]
    return Compared(building, rows, 0.2)


BUILDINGS: dict[str, Callable[[], Compared]] = {
    "bilinear, 3 storeys": lambda: bilinear(3),
    "Bouc-Wen, 5 storeys": lambda: bouc_wen(5),
}


@dataclass(frozen=True)
class Outcome:
    """What one history came to by both.

    Args:
        ours: Peak storey drift ratio of each storey, inf where it collapsed.
        theirs: The same by OpenSees.
        residual: Residual storey drift ratios, ours and theirs, shape [2, storey].
    """

    ours: np.ndarray
    theirs: np.ndarray
    residual: np.ndarray

    @property
    def collapses(self) -> tuple[bool, bool]:
        """Whether a storey passed the limit."""
        return bool(self.ours.max() > LIMIT), bool(self.theirs.max() > LIMIT)

    @property
    def peak_error(self) -> float:
        """Largest difference of a storey's peaks over the largest peak of all storeys."""
        return float(np.abs(self.ours - self.theirs).max() / self.theirs.max())

    @property
    def residual_error(self) -> float:
        """Largest difference of a storey's residual drifts over the largest peak of all storeys."""
        return float(np.abs(np.subtract(*self.residual)).max() / self.theirs.max())


def compare(compared: Compared, record: int, level: float, longest_step: float = THEIRS) -> Outcome:
    """Run a building under a far-field record at a level over that of its yielding, OpenSees at a step of its own."""
    building, period = compared.building, compared.building.fundamental_period
    scene = wd.Scene(
        building,
        wd.Stripes([far_field()[record]], [level * compared.yields_at], wd.SpectralAcceleration(period)),
        record=("drift", "residual"),
        collapse_drift_ratio=LIMIT,
        tail=TAIL * period,
    )
    run = wd.simulate(scene, longest_step=OURS, dtype="float64")
    motion = scene.excitation.motions[0]
    intervals = len(motion.values) - 1 + int(np.ceil(TAIL * period / motion.step * (1 - 1e-9)))
    p, modes = building.parameters, building.modal()["circular_frequency"].values
    first, second = modes[0], modes[min(1, len(modes) - 1)]
    of_mass, of_stiffness = np.array([first * second, 1]) * 2 * DAMPING_RATIO / (first + second)
    drift = chain_drifts(
        p["mass"],
        compared.materials,
        (of_mass, of_stiffness * p["stiffness"]),
        compared.weight_over_height,
        float(run["scale_factor_of_motion"][0]) * motion.values,
        motion.step,
        intervals,
        int(np.ceil(motion.step / longest_step - 1e-9)),
    )
    ratio = drift / p["height"]
    lost = ~np.isfinite(ratio).all()  # no equilibrium was found: OpenSees' way to collapse
    # The mean under a Hann window over the last three periods.
    position = 1 - np.arange(len(ratio))[::-1] / len(ratio) * intervals * motion.step / (3 * period)
    weight = np.where(position > 0, 1 - np.cos(2 * np.pi * position), 0)
    peaks = np.full(building.storeys, np.inf) if lost else np.abs(ratio).max(axis=0)
    residuals = run["residual_drift_ratio"].values[0], weight @ ratio / weight.sum()
    return Outcome(run["peak_storey_drift_ratio"].values[0], peaks, np.stack(residuals))


def main() -> None:
    """Print a row a history."""
    print(f"{'building':<32}{'record':>7}{'level':>6}  {'peak':>8} {'OpenSees':>8} {'apart':>8} {'residual apart':>15}")
    for name, make in BUILDINGS.items():
        if name.lower().startswith(tuple(sys.argv[1:] or [""])):
            for record in RECORDS:
                for level in LEVELS:
                    outcome = compare(make(), record, level)
                    rest = (
                        f"collapses {outcome.collapses}"
                        if any(outcome.collapses)
                        else f"{outcome.peak_error:8.2%} {outcome.residual_error:15.2%}"
                    )
                    peaks = f"{outcome.ours.max():8.4f} {outcome.theirs.max():8.4f}"
                    print(f"{name:<32}{record:>7}{level:>6}  {peaks} {rest}", flush=True)


if __name__ == "__main__":
    main()
