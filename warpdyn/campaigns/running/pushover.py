"""Quasi-static analysis of a shear building: storey hysteresis and pushover, by the storey laws of the kernels."""

from __future__ import annotations

import numpy as np
import warp as wp
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.engine.kernels.auxiliary.storey_path import storey_path_kernel
from warpdyn.engine.kernels.auxiliary.storey_step import storey_step_kernel
from warpdyn.engine.kernels.kernel_cache import initialise, loaded
from warpdyn.engine.laws.springs import StoreyRules, spring_row
from warpdyn.foundations.core.checks import check_kind, finite_numbers
from warpdyn.foundations.core.description import to_json
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.structures.lateral_loads import floor_loads, storey_shears
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.physics import effective_stiffness, storey_weight_over_height
from warpdyn.model.structures.shear_building import ShearBuilding

TOLERANCE = 1e-9  # largest unbalanced storey force in equilibrium, as a share of the base shear
ITERATIONS = 50  # most corrections in the search for an equilibrium
SHORTENINGS = 40  # most halvings of one correction
SHORTEST_STEP = 2.0**-10  # as a share of a requested step
LEAST_STIFFNESS = 1e-6  # as a share of the initial stiffness; a tangent stiffness below it is replaced in a correction
GIVEN_LOADS = "given"  # name of the pattern if the caller gives floor loads
# Longest step of a law with a rate [yield drifts], and most such steps of a path of drifts.
LONGEST_STEP, MOST_STEPS = 0.25, 10_000_000


def _spring_and_coefficients(building: ShearBuilding) -> tuple[StoreyRules, np.ndarray]:
    """Return the device functions of the building's storey law, and its coefficients, shape [coefficient, storey]."""
    parameters = {name: np.atleast_1d(value)[None] for name, value in building.parameters.items()}
    law = building.storey_law
    coefficients = np.concatenate(np.broadcast_arrays(*law.coefficients(parameters)))
    return law.rules(parameters), np.ascontiguousarray(coefficients, np.float64)


def _warn_of_implausible_path(drift_ratio: np.ndarray) -> None:
    """Warn if drift ratios [1] are so large that the drifts were probably given in another unit than m."""
    findings = PlausibilityFindings()
    findings.add("pushed_drift_ratio", np.abs(drift_ratio).max())
    findings.warn()


@suggests_names
def storey_hysteresis(building: ShearBuilding, drift: ArrayLike) -> xr.Dataset:
    """Return the forces of a building's storeys under prescribed quasi-static drifts (hysteresis), in float64.

    Args:
        building: The building.
        drift: Storey drifts [m], starting from 0. Shape [step]: all storeys have the same drift; or [step, storey].
            Bouc-Wen and Baber-Noori storeys are integrated in parts of a step of at most 0.25 yield drifts.

    Returns:
        `storey_drift` [m], `storey_force` [N] and `dissipated_energy` [J], all of shape [step, storey]. The dissipated
        energy is the work done (trapezoidal rule) less the stored energy. The attribute `building` is the building as
        JSON.

    Raises:
        ValueError: If a drift is not finite, or the shape is wrong.
        TypeError: If `building` is not a ShearBuilding.

    Example:
        >>> cycle = wd.storey_hysteresis(building, [0.0, 0.01, -0.01, 0.0])
        >>> (cycle["storey_force"] / 1e3).round().values  # kN
        array([[   0.,    0.],
               [ 305.,  205.],
               [-305., -205.],
               [  95.,   95.]])
    """
    check_kind("storey_hysteresis", "a ShearBuilding", building, ShearBuilding, _advice(building), argument="building")
    path = finite_numbers("drift", drift)
    if path.ndim == 1:
        path = np.repeat(path[:, None], building.storeys, axis=1)
    if path.ndim != 2 or path.shape[1] != building.storeys or not path.size:
        raise ValueError(f"drift must have shape [step] or [step, {building.storeys}], got {np.shape(drift)}")
    _warn_of_implausible_path(path / building.parameters["height"])
    spring, coefficients = _spring_and_coefficients(building)
    initialise()  # before Warp starts with the first array
    divided, steps = path, np.arange(len(path))
    if building.storey_law.forces().has_rate and "yield_force" in building.parameters:
        divided, steps = _divided(path, building.parameters["yield_force"] / building.parameters["stiffness"])
    arrays: list[wp.array] = [wp.array(np.ascontiguousarray(each), device="cpu") for each in (coefficients, divided)]
    results = [wp.full(divided.shape, np.nan, dtype=wp.float64, device="cpu") for _ in range(2)]
    kernel = loaded(storey_path_kernel(spring, "float64"))
    wp.launch(kernel, dim=building.storeys, inputs=arrays, outputs=results, device="cpu")
    force, dissipated = (result.numpy()[steps] for result in results)
    return _storey_dataset(building, path, force, dissipated, "forces of storeys at given drifts", "storey_hysteresis")


def _divided(path: np.ndarray, yield_drift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a path with steps of at most LONGEST_STEP yield drifts, and the places of the given drifts in it.

    Args:
        path: Storey drifts [m], shape [step, storey]; the path starts from 0.
        yield_drift: Yield drift of each storey [m]; NaN in storeys whose law has none.

    Raises:
        ValueError: If the path has more than MOST_STEPS such steps.
    """
    moved = np.abs(np.diff(path, axis=0, prepend=0.0)) / yield_drift
    parts = np.maximum(1, np.ceil(np.nan_to_num(moved).max(axis=1) / LONGEST_STEP))
    if parts.sum() > MOST_STEPS:
        raise ValueError(
            f"drift: the path has {parts.sum() * LONGEST_STEP:.3g} yield drifts, more than "
            f"{MOST_STEPS * LONGEST_STEP:,.0f}: give drifts in m, or a shorter path"
        )
    steps = np.cumsum(parts.astype(int)) - 1
    before = np.vstack([np.zeros((1, path.shape[1])), path])
    at = np.arange(int(parts.sum())) + 1.0
    known = np.concatenate([[0.0], steps + 1.0])
    return np.stack([np.interp(at, known, drifts) for drifts in before.T], axis=1), steps


@suggests_names
def pushover(
    building: ShearBuilding, roof_displacement: ArrayLike, *, pattern: str | ArrayLike = "first_mode"
) -> xr.Dataset:
    """Run a pushover analysis: push a building quasi-statically by lateral loads of one pattern.

    The roof displacement is prescribed and the base shear follows, so that a building can be pushed beyond its peak
    strength. Within a step the drift of each storey changes in one direction only, and a step is divided at the point
    at which a storey begins to soften (lose strength). From then on one storey softens and the others unload. An
    equilibrium is a minimum of the work; it is searched from elastic drift increments, or from the increments of the
    last step. Viscous damping has no effect. With a gravity load (P-Delta) the lateral load is the resistance of the
    springs minus the P-Delta force, and may be negative.

    Args:
        building: The building.
        roof_displacement: Roof displacements [m], starting from 0, shape [step]; they may reverse. For Bouc-Wen
            storeys, use steps that are short compared with the yield displacement.
        pattern: "first_mode" (floor mass times first mode), "triangular" (floor mass times height above the ground),
            "uniform" (floor mass), or floor loads of any scale [1], shape [floor].

    Returns:
        `roof_displacement` [m] and `base_shear` [N] (sum of the lateral loads), shape [step]; `storey_drift` [m],
        `storey_force` [N] of the springs and `dissipated_energy` [J], defined as in `storey_hysteresis`, shape [step,
        storey]; `floor_load` [1], the share of each floor in the base shear, shape [floor]. The attribute `building` is
        the building as JSON, and the attribute `pattern` is the name of the pattern ("given" for floor loads). If no
        equilibrium is found in a step, the curve ends at the last equilibrium, whose roof displacement lies within that
        step. Then a warning and the attribute `stopped_because` report the roof displacement and the reason.

    Raises:
        ValueError: If a displacement is not finite, or the pattern is unknown, negative or without a load on the roof.
        RuntimeError: If no equilibrium is found at all.
        TypeError: If `building` is not a ShearBuilding.

    Example:
        >>> pushed = wd.pushover(building, np.linspace(0.0, 0.1, 101))
        >>> (pushed["base_shear"][::25] / 1e3).round().values  # kN
        array([  0., 315., 342., 368., 395.])
    """
    check_kind("pushover", "a ShearBuilding", building, ShearBuilding, _advice(building), argument="building")
    path = finite_numbers("roof_displacement", roof_displacement)
    if path.ndim != 1 or not path.size:
        raise ValueError(f"roof_displacement must have shape [step], got {np.shape(roof_displacement)}")
    parameters = building.parameters
    loads = floor_loads(pattern, parameters["mass"], parameters["height"], effective_stiffness(parameters))
    _warn_of_implausible_path(path / parameters["height"].sum())
    chain = _PushedChain(building, storey_shears(loads))
    shape = (path.size, building.storeys)
    drift, force, dissipated, base_shear = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan), []
    stopped: dict[str, str] = {}
    for step, displacement in enumerate(path):
        reached = chain.push(displacement)
        if reached < 1:
            stopped = {"stopped_because": f"step {step}, to {displacement:g} m: {chain.reason_to_stop()}"}
            if reached == 0:
                break
            path[step] = chain.drift.sum()
        base_shear.append(chain.base_shear)
        drift[step], force[step], dissipated[step] = chain.drift, chain.force, chain.work - chain.recoverable
        if stopped:
            break
    found = len(base_shear)
    if stopped:
        if not found:
            raise RuntimeError(f"pushover: {stopped['stopped_because']}")
        warn_caller(f"pushover: the curve ends before the given path does. {stopped['stopped_because']}")
    path, drift, force, dissipated = path[:found], drift[:found], force[:found], dissipated[:found]
    along = {"units": "m", "long_name": "roof displacement"}
    pushed = _storey_dataset(building, drift, force, dissipated, "building pushed slowly by lateral loads", "pushover")
    floors = np.arange(1, building.storeys + 1, dtype=np.int32)
    return (
        pushed.assign_coords(floor=("floor", floors, {"units": "1", "long_name": "floor above the storey"}))
        .assign(
            roof_displacement=("step", path, along),
            base_shear=("step", np.array(base_shear), {"units": "N", "long_name": "sum of the lateral loads"}),
            floor_load=("floor", loads, {"units": "1", "long_name": "lateral load over the base shear"}),
        )
        .assign_attrs(stopped | {"pattern": pattern if isinstance(pattern, str) else GIVEN_LOADS})
    )


class _PushedChain:
    """Storeys of a building in equilibrium under lateral loads; `push` moves them to the next roof displacement."""

    def __init__(self, building: ShearBuilding, shears: np.ndarray) -> None:
        storeys = building.storeys
        row, coefficients = _spring_and_coefficients(building)
        self.shears, self.stiffness = shears, effective_stiffness(building.parameters)
        # P-Delta force per storey drift [N/m].
        self.leaning = storey_weight_over_height(building.parameters) if "gravity_load" in building.parameters else 0.0
        # Elastic drifts under the loads, scaled to sum 1, and the base shear over the roof displacement [N/m].
        self.elastic_drift = shears / self.stiffness
        self.roof_stiffness = 1 / self.elastic_drift.sum()
        self.elastic_drift *= self.roof_stiffness
        memory = (max(1, spring_row(row).memory), storeys)
        # The kernel and numpy share this memory.
        self.drift, self.trial = np.zeros(storeys), np.zeros(storeys)
        self.memory, self.trial_memory = np.zeros(memory), np.full(memory, np.nan)
        self.trial_force, self.tangent, self.trial_recoverable = (np.full(storeys, np.nan) for _ in range(3))
        given = (coefficients, self.drift, self.memory, self.trial)
        found = (self.trial_memory, self.trial_force, self.tangent, self.trial_recoverable)
        initialise()  # before Warp starts with the first array
        self.kept: list[wp.array] = [
            wp.array(values, dtype=wp.float64, device="cpu", copy=False) for values in (*given, *found)
        ]
        kernel = loaded(storey_step_kernel(row))
        self.launch = wp.launch(kernel, dim=storeys, inputs=self.kept, device="cpu", record_cmd=True)
        self.force, self.work, self.recoverable = np.zeros(storeys), np.zeros(storeys), np.zeros(storeys)
        self.largest_shear, self.base_shear, self.softens, self.last_moves = 0.0, 0.0, False, np.zeros(storeys)

    def push(self, displacement: float) -> float:
        """Move the roof towards `displacement` [m] in one or several steps; return the share reached [1]."""
        begin, done, share = float(self.drift.sum()), 0.0, 1.0
        while done < 1:
            if self._step(begin + (done + share) * (displacement - begin), share > SHORTEST_STEP):
                done += share
                share = min(2 * share, 1 - done)
            elif share > SHORTEST_STEP:
                share *= 0.5
            else:
                break
        return done

    def reason_to_stop(self) -> str:
        """Return, as text for a message, why the last call of `push` found no further equilibrium."""
        softest = int(np.argmax(np.abs(self.last_moves))) + 1
        return (
            f"no equilibrium was found beyond a roof displacement of {self.drift.sum():.6g} m (base shear "
            f"{self.base_shear:.6g} N), in steps down to {SHORTEST_STEP:.1e} of the given one. Storey {softest}, which "
            "moved most in the last step, may soften faster than the other storeys unload (snap-back), which a "
            "prescribed roof displacement cannot follow: give a path that ends here, or a building whose storey loses "
            "strength more slowly"
        )

    def _step(self, displacement: float, stops_at_peak: bool) -> bool:
        """Move the roof to `displacement` [m] in one step; return whether an equilibrium was found there.

        The result is False if there is no equilibrium, or if `stops_at_peak` is True and the step would pass the peak
        strength of a storey. The caller then uses a shorter step that ends at the peak, because from that point on the
        other storeys unload while this storey softens.
        """
        move = displacement - self.drift.sum()
        scale = max(self.largest_shear, abs(move) * self.roof_stiffness)
        for one_softens in (False, True):
            # Once a storey softens, keep it as the softening one; switching to another would load and unload storeys.
            goes_on = self.softens and not one_softens and move * self.last_moves.sum() > 0
            shares = self.last_moves / self.last_moves.sum() if goes_on else self.elastic_drift
            self.trial[:] = self.drift + move * shares
            self.launch.launch()
            if one_softens:
                self._let_one_soften()
            base_shear = self._balance(scale)
            if base_shear is None:
                continue
            softens = int(np.count_nonzero(self._softening()))
            if stops_at_peak and softens and not self.softens:
                return False
            # If several storeys reach their peak strength together, rounding may move some of them beyond their peak
            # without a decrease of the base shear.
            falls = bool((self.base_shear - base_shear) * np.sign(move) > TOLERANCE * scale)
            if softens > 1 and falls and not one_softens:
                continue
            self.last_moves[:] = self.trial - self.drift
            self._accept()
            self.base_shear, self.softens = base_shear, softens > 0
            self.largest_shear = max(self.largest_shear, abs(base_shear))
            return True
        return False

    def _balance(self, scale: float) -> float | None:
        """Move the trial drifts to an equilibrium; return its base shear [N], or None if no equilibrium is found.

        `scale` is the force [N] to which the largest unbalanced storey force is compared.
        """
        for _ in range(ITERATIONS):
            # Each storey gives one estimate of the base shear; in equilibrium these estimates agree.
            shear = self._resistance() / self.shears
            base_shear, correction = self._correction(shear, (self.tangent - self.leaning) / self.shears)
            if np.abs(self._resistance() - base_shear * self.shears).max() <= TOLERANCE * scale:
                return base_shear
            self._descend(base_shear, correction)
        return None

    def _softening(self) -> np.ndarray:
        """Return which storeys moved in this step and have a negative tangent stiffness, shape [storey]."""
        return (self.tangent - self.leaning < -LEAST_STIFFNESS * self.stiffness) & (self.trial != self.drift)

    def _let_one_soften(self) -> None:
        """Give the increments of all softening storeys to the weakest of these storeys, and reset the other ones.

        An equilibrium in which two storeys soften is unstable: the smallest difference makes one of them unload. The
        other softening storeys return to their drifts at the start of the step.
        """
        softening = self._softening()
        if not softening.any():
            return
        weakest = int(np.where(softening, self._resistance() / self.shears, np.inf).argmin())
        moves = np.where(softening, self.trial - self.drift, 0.0)
        self.trial[softening] = self.drift[softening]
        self.trial[weakest] += moves.sum()
        self.launch.launch()

    def _resistance(self) -> np.ndarray:
        """Return the trial forces of the storeys minus their P-Delta forces [N], shape [storey]."""
        return self.trial_force - self.leaning * self.trial

    def _correction(self, shear: np.ndarray, slope: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the base shear [N] and the corrections of the storey drifts [m] (with sum 0) by Newton's method.

        An equilibrium is a minimum of the work, sum over storeys of integral F / S d(drift), for the given sum of
        drifts (F: storey force, S: storey shear over base shear). If the tangents do not give a descent of the work,
        use the tangent of the weakest softening storey and the initial stiffnesses of the other softening storeys. If
        this is not a descent either, use the initial stiffness of every storey.

        Args:
            shear: Each storey's estimate of the base shear, F / S [N], shape [storey].
            slope: Derivatives of these estimates with respect to the drifts [N/m], shape [storey].
        """
        initial = self.stiffness / self.shears
        least = LEAST_STIFFNESS * initial
        slope = np.where(np.abs(slope) < least, least, slope)
        # If several storeys soften, all except one must unload.
        alone = np.where(slope < 0, initial, slope)
        weakest = int(np.where(slope < 0, shear, np.inf).argmin())
        alone[weakest] = slope[weakest]
        for hardness in (slope, alone, initial):
            flexibility = 1 / hardness
            softening = np.count_nonzero(hardness < 0)
            # One storey may soften while the others unload, if these are stiff enough.
            if softening == 0 or (softening == 1 and flexibility.sum() < 0):
                break
        base_shear = float((shear * flexibility).sum() / flexibility.sum())
        correction = (base_shear - shear) * flexibility
        # Add the rounding error of the sum to the storey with the largest flexibility, whose force changes least.
        correction[np.abs(flexibility).argmax()] -= correction.sum()
        return base_shear, correction

    def _descend(self, base_shear: float, correction: np.ndarray) -> None:
        """Change the trial drifts by `correction` [m], halved until the work no longer rises at its end."""
        start, share = self.trial.copy(), 1.0
        downhill = self._slope(base_shear, correction)
        for _ in range(SHORTENINGS):
            self.trial[:] = start + share * correction
            self.launch.launch()
            if self._slope(base_shear, correction) <= -0.5 * downhill:
                return
            share *= 0.5

    def _slope(self, base_shear: float, correction: np.ndarray) -> float:
        """Return the derivative of the work along `correction`; inf or NaN if the correction is much too large."""
        with np.errstate(over="ignore", invalid="ignore"):  # such a trial is shortened
            return float((self._resistance() / self.shears - base_shear) @ correction)

    def _accept(self) -> None:
        self.work += 0.5 * (self.trial_force + self.force) * (self.trial - self.drift)
        self.drift[:], self.memory[:], self.force[:] = self.trial, self.trial_memory, self.trial_force
        self.recoverable[:] = self.trial_recoverable


def _storey_dataset(
    building: ShearBuilding, drift: np.ndarray, force: np.ndarray, dissipated: np.ndarray, title: str, function: str
) -> xr.Dataset:
    dims, storey = ("step", "storey"), {"units": "1", "long_name": "storey, from the ground up"}
    return xr.Dataset(
        {
            "storey_drift": (dims, drift, {"units": "m", "long_name": "storey drift"}),
            "storey_force": (dims, force, {"units": "N", "long_name": "restoring force of the storey"}),
            "dissipated_energy": (dims, dissipated, {"units": "J", "long_name": "work done less what is stored"}),
        },
        coords={
            "step": ("step", np.arange(len(drift), dtype=np.int32), {"units": "1", "long_name": "step of the path"}),
            "storey": ("storey", np.arange(1, drift.shape[1] + 1, dtype=np.int32), storey),
        },
        attrs=trace(title, function) | {"building": to_json(building)},
    )


def _advice(building: object) -> str:
    """Return what to do with a lumped structure, or ""."""
    if not isinstance(building, LumpedStructure):
        return ""
    return "simulate a lumped structure under forces that increase slowly, wd.ForceHistory(values, step)"
