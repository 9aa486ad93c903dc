"""Errors of peak drifts of RK4 and of Stoermer's method, measured by OpenSees: buildings under 22 records.

python tests/opensees_ensembles.py                     264 histories, about a quarter of an hour
python tests/opensees_ensembles.py bilinear bouc_wen   the histories of these laws

OpenSees integrates at 1/16 of the step of RK4 or less (average acceleration with Newton's iteration). Its Bouc-Wen
storeys have an error of first order in the step, so they are integrated at this step and half of it, and extrapolated.
The table contains the median and the 95 % quantile of the errors: the largest difference of a storey's peak drift,
divided by the largest peak drift of all storeys.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from conftest import ROOT
from opensees import chain_drifts
from scipy.constants import g as STANDARD_GRAVITY

import warpdyn as wd

sys.path.insert(0, str(ROOT / "studies"))
from parts.accuracy_speed.scenes import strong_part
from peers.storey_laws import LAWS as MATERIALS

LAWS = ("elastic", "elastic_perfectly_plastic", "bilinear", "bouc_wen")
STOREYS = (1, 3, 5)
RECORDS = range(0, 44, 2)  # of the far-field set: one component of each record
LEVELS = (1.0, 2.0, 4.0)  # spectral accelerations at the first period, divided by that at yield, in turn
YIELD_DRIFT, MASS, HEIGHT, DAMPING_RATIO, TAIL = 0.015, 2.0e5, 3.0, 0.05, 1.0  # m, kg, m, 1, s
FINER = 16  # steps of OpenSees in each step of RK4
METHODS = {"rk4": 1, "stoermer": 2}  # steps in each default step of RK4


@dataclass(frozen=True)
class History:
    """Peak drifts of one history.

    Args:
        theirs: Peak drift of each storey by OpenSees [m].
        ours: The same by each method of warpdyn [m].
        change: Change of OpenSees' peak drifts from the last halving of its step, over the largest peak drift [1].
    """

    theirs: np.ndarray
    ours: dict[str, np.ndarray]
    change: float

    def error(self, method: str) -> float:
        """Return the largest error of a storey's peak drift, over the largest peak drift of all storeys."""
        return float(np.abs(self.ours[method] - self.theirs).max() / self.theirs.max())


def build(law: str, storeys: int) -> wd.ShearBuilding:
    """Return a building with a first period of 0.1 s per storey (a single storey: 0.3 s) and Rayleigh damping."""
    stiffness = np.linspace(1.0, 2 / 3, storeys) * 1e8
    period = max(0.1 * storeys, 0.3)
    unit = wd.ShearBuilding(np.full(storeys, MASS), stiffness, HEIGHT).fundamental_period
    stiffness = stiffness * (unit / period) ** 2
    own = {} if law == "elastic" else {"yield_force": YIELD_DRIFT * stiffness} | MATERIALS[law].parameters(YIELD_DRIFT)
    damping = {"damping": "rayleigh", "damping_ratio": DAMPING_RATIO}
    return wd.ShearBuilding(np.full(storeys, MASS), stiffness, HEIGHT, law=law, **damping, **own)


def opensees_peaks(building: wd.ShearBuilding, law: str, motion: wd.GroundMotion, substeps: int) -> np.ndarray:
    """Return OpenSees' peak storey drifts [m], shape [storey], with this number of steps in each step of the motion."""
    p, modes = building.parameters, building.modal()["circular_frequency"].values
    first, second = modes[0], modes[min(1, len(modes) - 1)]
    of_mass, of_stiffness = np.array([first * second, 1]) * 2 * DAMPING_RATIO / (first + second)
    row = MATERIALS[law]
    own = row.parameters(YIELD_DRIFT)
    materials = [(row.material, row.numbers(k, YIELD_DRIFT * k, own)) for k in p["stiffness"].tolist()]
    damping = of_mass, of_stiffness * p["stiffness"]
    intervals = len(motion.acceleration) - 1 + int(np.ceil(TAIL / motion.step * (1 - 1e-9)))
    gravity = np.zeros(building.storeys)
    drifts = chain_drifts(p["mass"], materials, damping, gravity, motion.acceleration, motion.step, intervals, substeps)
    return np.abs(drifts).max(axis=0)


def compare(law: str, storeys: int, record: int, level: float, finer: int = FINER) -> History:
    """Run a building under the strong part of a far-field record with all methods and with OpenSees."""
    building, motion = build(law, storeys), strong_part(wd.records.far_field()[record])
    measure = wd.SpectralAcceleration(building.fundamental_period)
    # Acceleration of the first mode at which the first storey yields, roughly.
    frequency = 2 * np.pi / building.fundamental_period
    yields_at = YIELD_DRIFT * frequency**2 * (storeys + 1) / 2 / STANDARD_GRAVITY
    scene = wd.Scene(building, wd.Stripes([motion], [level * yields_at], measure), recorders=("drift",), tail=TAIL)
    with wd.meant_as_given("lowest_intensity_level"):  # one level
        run = wd.simulate(scene, method="rk4", device="cpu")
        step, scale = float(run["integration_step"][0]), float(run["scale_factor_of_motion"][0])
        ours = {
            name: wd.simulate(scene, method=name, step=step / steps, device="cpu")["peak_storey_drift"].values[0]
            for name, steps in METHODS.items()
        }
    scaled = wd.GroundMotion(scale * motion.acceleration, motion.step, motion.name)
    substeps = finer * round(motion.step / step)
    coarse, fine = (opensees_peaks(building, law, scaled, count) for count in (substeps // 2, substeps))
    change = float(np.abs(fine - coarse).max() / fine.max())
    if law == "bouc_wen":
        coarse, fine = fine, opensees_peaks(building, law, scaled, 2 * substeps)
        fine = 2 * fine - coarse
    return History(fine, ours, change)


def histories(
    laws: Iterable[str], heights: Iterable[int], records: Iterable[int]
) -> Iterator[tuple[str, int, History]]:
    """Yield law, number of storeys and history of each building under each record."""
    for law in laws:
        for storeys in heights:
            for place, record in enumerate(records):
                yield law, storeys, compare(law, storeys, record, LEVELS[place % len(LEVELS)])


def print_row(words: str, found: list[History]) -> None:
    """Print the number of histories, and the quantiles of the errors and of OpenSees' last change in percent."""
    columns = [[each.error(method) for each in found] for method in METHODS] + [[each.change for each in found]]
    quantiles = [100 * np.quantile(column, [0.5, 0.95]) for column in columns]
    print(f"{words:<32}{len(found):>5}" + "".join(f"{a:10.4f}{b:9.4f}" for a, b in quantiles), flush=True)


def main() -> None:
    """Print a row for each law and number of storeys, and one for all histories."""
    groups: dict[tuple[str, int], list[History]] = {}
    print(" " * 37 + "".join(f"{name:>19}" for name in (*METHODS, "OpenSees' change")))
    print(f"{'law, storeys':<32}{'runs':>5}" + "    median     95 %" * 3 + "  [%]")
    for law, storeys, history in histories(sys.argv[1:] or LAWS, STOREYS, RECORDS):
        groups.setdefault((law, storeys), []).append(history)
        if len(groups[law, storeys]) == len(RECORDS):
            print_row(f"{law}, {storeys}", groups[law, storeys])
    print_row("all", [history for found in groups.values() for history in found])


if __name__ == "__main__":
    main()
