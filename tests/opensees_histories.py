"""Whole histories beside OpenSees': buildings of several laws under recorded motions, from elastic to collapse.

python tests/opensees_histories.py              # every building, a table row a history: some minutes
python tests/opensees_histories.py steel        # those whose name begins so
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from opensees import chain_drifts
from scipy.constants import g as STANDARD_GRAVITY

import warpdyn as wd

LIMIT = 0.1  # collapse drift ratio
RECORDS = (0, 9, 18, 27, 36)  # of the far-field set: five earthquakes
OURS, THEIRS = (
    2.5e-3,
    5e-4,
)  # longest steps [s]; OpenSees' is of second order, of first with the rate of Bouc-Wen storeys
FINE = 5e-4
DAMPING_RATIO = 0.05
TAIL = 12.0  # periods of free vibration
MASS, HEIGHT = 1.0e5, 3.2  # of a floor [kg], of a storey [m]


@dataclass(frozen=True)
class Compared:
    """A building and the OpenSees material of its storeys.

    Args:
        building: The building.
        material: OpenSees' uniaxial material of its storeys.
        parameters: From a storey's own parameters to the material's, in its order.
        yields_at: Sa(T1) at which it yields, roughly [g].
        strengths: Of its motions, over that; the largest brings some to collapse.
        longest_step: Ours [s]; storeys that pinch and unload softly turn more often than others.
    """

    building: wd.ShearBuilding
    material: str
    parameters: Callable[[Mapping[str, float]], list[float | str]]
    yields_at: float
    strengths: tuple[float, ...]
    longest_step: float = OURS

    @property
    def levels(self) -> list[float]:
        """Sa(T1) of its motions [g]."""
        return [self.yields_at * strength for strength in self.strengths]

    @property
    def materials(self) -> list[tuple[str, list[float | str]]]:
        """The material of each storey, from the ground up."""
        p = {name: values.tolist() for name, values in self.building.parameters.items() if np.ndim(values)}
        storeys = [dict(zip(p, values, strict=True)) for values in zip(*p.values(), strict=True)]
        return [(self.material, self.parameters(storey)) for storey in storeys]

    @property
    def weight_over_height(self) -> np.ndarray:
        """Gravity load that each storey carries over its height [N/m]; 0 without P-Delta."""
        p = self.building.parameters
        loads = p.get("gravity_load", np.zeros(self.building.storeys))
        return np.cumsum(loads[::-1])[::-1] / p["height"]


def frame(storeys: int, coefficient: float, law: str, **parameters: object) -> wd.ShearBuilding:
    """Return a building of a tenth of a second a storey whose strength follows the shears of a triangular load.

    Args:
        storeys: Their number.
        coefficient: Strength of the first storey over the building's weight.
        law: Storey law.
        **parameters: Its own, and the gravity load.
    """
    mass = np.full(storeys, MASS)
    period = 0.4 if storeys == 1 else 0.1 * storeys + 0.1
    shear = np.cumsum(np.arange(storeys, 0, -1.0))[::-1]
    stiffness = shear / shear[0]
    unit = wd.ShearBuilding(mass, stiffness * 1e8, HEIGHT).fundamental_period
    stiffness = stiffness * 1e8 * (unit / period) ** 2
    yield_force = coefficient * mass.sum() * STANDARD_GRAVITY * shear / shear[0]
    damping = {"damping": "rayleigh", "damping_ratio": DAMPING_RATIO}
    return wd.ShearBuilding(mass, stiffness, HEIGHT, law=law, yield_force=yield_force, **damping, **parameters)


def corners_of(p: Mapping[str, float], count: int) -> list[float]:
    """Return force and drift of a backbone's corners, as OpenSees has them."""
    ratios = [(1.0, 1.0), *((p[f"force_ratio_{i}"], p[f"ductility_{i}"]) for i in range(2, count + 1))]
    return [value for f, d in ratios for value in (f * p["yield_force"], d * p["yield_force"] / p["stiffness"])]


def bilinear(storeys: int, coefficient: float) -> Compared:
    """Return a building of bilinear storeys: Steel01."""
    building = frame(storeys, coefficient, "bilinear", hardening_ratio=0.03)
    return Compared(building, "Steel01", lambda p: [p["yield_force"], p["stiffness"], 0.03], coefficient, (2, 6, 10))


def menegotto_pinto(storeys: int, coefficient: float) -> Compared:
    """Return a building of Menegotto and Pinto's storeys: Steel02, with isotropic hardening."""
    own = {"hardening_ratio": 0.02, "transition_curvature": 18.0}
    own |= {"isotropic_hardening": 0.02, "isotropic_hardening_ductility": 3.0}
    building = frame(storeys, coefficient, "menegotto_pinto", **own)
    curve = [0.02, 18.0, 0.925, 0.15, 0.02, 3.0, 0.02, 3.0]
    return Compared(building, "Steel02", lambda p: [p["yield_force"], p["stiffness"], *curve], coefficient, (2, 6, 14))


def ibarra_medina_krawinkler(storeys: int, coefficient: float) -> Compared:
    """Return a building of peak-oriented storeys that deteriorate, caps at 2 % and has no strength left at 12 %."""
    to_capping, post_capping, ratio, residual, lasting = 0.02 * HEIGHT, 0.10 * HEIGHT, 1.1, 0.05, 0.8 * HEIGHT
    own = {"plastic_drift_to_capping": to_capping, "post_capping_drift": post_capping}
    own |= {"capping_force_ratio": ratio, "residual_force_ratio": residual}
    modes = ("strength", "post_capping", "unloading", "reloading")
    own |= {f"{mode}_deterioration_drift": lasting for mode in modes}
    building = frame(storeys, coefficient, "ibarra_medina_krawinkler_peak_oriented", **own)

    def parameters(p: Mapping[str, float]) -> list[float | str]:
        side = [to_capping, post_capping, 1e9, p["yield_force"], ratio, residual]
        return [p["stiffness"], *side, *side, *[lasting] * 4, *[1.0] * 4, 1.0, 1.0]

    return Compared(building, "IMKPeakOriented", parameters, coefficient, (2, 4, 8))


def pinching4(storeys: int, coefficient: float) -> Compared:
    """Return a building of four-point storeys, pinched as in GEM's toolkit and damaged by drift and energy."""
    ductility, ratio = (4.0, 8.0, 16.0), (1.2, 1.3, 0.3)
    pinching = {"reloading_drift": 0.5, "reloading_force": 0.25, "unloading_force": 0.05}
    damage = {  # by drift, by energy, their exponents, limit
        "stiffness": (0.3, 0.1, 0.8, 0.6, 0.5),
        "reloading": (0.1, 0.1, 0.8, 0.6, 0.3),
        "strength": (0.1, 0.2, 1.0, 0.6, 0.4),
    }
    own = {f"ductility_{i + 2}": value for i, value in enumerate(ductility)} | pinching
    own |= {f"force_ratio_{i + 2}": value for i, value in enumerate(ratio)}
    names = ("by_drift", "by_use", "drift_exponent", "use_exponent", "limit")
    for kind, values in damage.items():
        own |= {f"{kind}_damage_{name}": value for name, value in zip(names, values, strict=True)}
    building = frame(storeys, coefficient, "pinching4", **own)

    def parameters(p: Mapping[str, float]) -> list[float | str]:
        side = corners_of(p, 4)
        numbers = [*side, *(-value for value in side), *pinching.values(), *pinching.values()]
        return [*numbers, *(value for kind in damage.values() for value in kind), 10.0, "energy"]

    return Compared(building, "Pinching4", parameters, coefficient, (1, 2, 5))


def bouc_wen(storeys: int, coefficient: float) -> Compared:
    """Return a building of Bouc-Wen storeys whose slope gravity turns negative; OpenSees' memory is a deformation."""
    building = frame(storeys, coefficient, "bouc_wen", hardening_ratio=0.02, gravity_load=MASS * STANDARD_GRAVITY)

    def parameters(p: Mapping[str, float]) -> list[float | str]:
        shape = 0.5 * p["stiffness"] / p["yield_force"]
        return [0.02, p["stiffness"], 1.0, shape, shape, 1.0, 0.0, 0.0, 0.0]

    return Compared(building, "BoucWen", parameters, coefficient, (1.5, 4, 8))


def hazus(building_type: str, level: str, storeys: int) -> Compared:
    """Return a building of a Hazus type as SimCenter's MDOF-LU has it: Hysteretic."""
    damping = {"damping": "rayleigh", "damping_ratio": DAMPING_RATIO}
    building = wd.ShearBuilding.from_hazus(building_type, level, storeys, law="hysteretic", **damping)

    def parameters(p: Mapping[str, float]) -> list[float | str]:
        side = corners_of(p, 3)
        pinching = p["pinching_drift"], p["pinching_force"]
        return [*side, *(-value for value in side), *pinching, 0.0, 0.0, p["unloading_exponent"]]

    weight = building.parameters["mass"].sum() * STANDARD_GRAVITY
    return Compared(building, "Hysteretic", parameters, building.parameters["yield_force"][0] / weight, (2, 5, 9), FINE)


def capacity(law: str, storeys: int, distribution: str, strengths: tuple[float, ...], *curve: list[float]) -> Compared:
    """Return a building from a capacity spectrum [m, g], whose points, at storeys, are the material's."""
    displacement, acceleration = curve
    in_si = np.array(acceleration) * STANDARD_GRAVITY
    how = {"curve": "spectrum", "distribution": distribution, "damping": "rayleigh", "damping_ratio": DAMPING_RATIO}
    with wd.meant_as_given("capacity_yield_drift_ratio"):  # GEM's curve is of lower storeys
        building = wd.ShearBuilding.from_capacity(displacement, in_si, storeys, MASS, HEIGHT, law=law, **how)

    def four_points(p: Mapping[str, float]) -> list[float | str]:
        side = corners_of(p, 4)
        pinching = [p[name] for name in ("reloading_drift", "reloading_force", "unloading_force")]
        return [*side, *(-value for value in side), *pinching, *pinching, *[0.0] * 15, 10.0, "energy"]

    def kinematic(p: Mapping[str, float]) -> list[float | str]:
        """Drift and force of the corners, and of a point far along what follows the last."""
        side = np.array(corners_of(p, 3)).reshape(-1, 2)[:, ::-1]
        far = side[-1] + 100 * side[-1, 0] * np.array([1, p["hardening_ratio"] * p["stiffness"]])
        return [*side.ravel().tolist(), *far.tolist()]

    material, parameters = {"pinching4": ("Pinching4", four_points), "quadrilinear": ("MultiLinear", kinematic)}[law]
    return Compared(building, material, parameters, acceleration[0], strengths, FINE)


# The four points of the examples of GEM's oq-vmtk [m, g], and four that rise.
GEM = [0.00060789, 0.00486316, 0.02420000, 0.04353684], [0.10315200, 0.20630401, 0.12378241, 0.12502023]
RISING = [0.005, 0.015, 0.04, 0.10], [0.15, 0.25, 0.32, 0.36]

BUILDINGS: dict[str, Callable[[], Compared]] = {
    "bilinear, 1 storey": lambda: bilinear(1, 0.30),
    "Menegotto-Pinto, 3 storeys": lambda: menegotto_pinto(3, 0.25),
    "peak-oriented, 5 storeys": lambda: ibarra_medina_krawinkler(5, 0.20),
    "four-point, 10 storeys": lambda: pinching4(10, 0.15),
    "Bouc-Wen with P-Delta, 20 storeys": lambda: bouc_wen(20, 0.10),
    "Hazus C1M by MDOF-LU, 5 storeys": lambda: hazus("C1M", "high", 5),
    "GEM's curve, 2 storeys": lambda: capacity("pinching4", 2, "first_mode", (1.5, 3, 5), *GEM),
    "GEM's curve, frame of 4 storeys": lambda: capacity("pinching4", 4, "frame", (1.5, 3, 5), *GEM),
    "rising curve, MultiLinear, 3 storeys": lambda: capacity("quadrilinear", 3, "triangular", (2, 4, 8), *RISING),
}


@dataclass(frozen=True)
class Outcome:
    """Results of one history by both programs.

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


def compare(compared: Compared, record: int, level: float, theirs: float = THEIRS) -> Outcome:
    """Run a building under a far-field record at a level [g] with both programs, at OpenSees' longest step [s]."""
    building, period = compared.building, compared.building.fundamental_period
    scene = wd.Scene(
        building,
        wd.Stripes([wd.records.far_field()[record]], [level], wd.SpectralAcceleration(period)),
        recorders=("drift", "residual"),
        collapse_drift_ratio=LIMIT,
        tail=TAIL * period,
    )
    run = wd.simulate(scene, longest_step=compared.longest_step, dtype="float64")
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
        int(np.ceil(motion.step / theirs - 1e-9)),
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
    """Print a row for each history."""
    print(f"{'building':<32}{'record':>7}{'level':>6}  {'peak':>8} {'OpenSees':>8} {'apart':>8} {'residual apart':>15}")
    for name, make in BUILDINGS.items():
        if name.lower().startswith(tuple(sys.argv[1:] or [""])):
            compared = make()
            for record in RECORDS:
                for level in compared.levels:
                    outcome = compare(compared, record, level)
                    rest = (
                        f"collapses {outcome.collapses}"
                        if any(outcome.collapses)
                        else f"{outcome.peak_error:8.2%} {outcome.residual_error:15.2%}"
                    )
                    peaks = f"{outcome.ours.max():8.4f} {outcome.theirs.max():8.4f}"
                    print(f"{name:<32}{record:>7}{level:>6.2f}  {peaks} {rest}", flush=True)


if __name__ == "__main__":
    main()
