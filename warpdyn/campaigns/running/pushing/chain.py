"""A chain of storeys that is pushed by lateral loads: the search for its next equilibrium."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.running.pushing.search import (
    ITERATIONS,
    LEAST_STIFFNESS,
    SHORTENINGS,
    SHORTEST_STEP,
    TOLERANCE,
    Pushed,
)
from warpdyn.engine.laws.springs import StoreyRules
from warpdyn.model.structures.physics import effective_stiffness, storey_weight_over_height
from warpdyn.model.structures.shear_building import ShearBuilding


class PushedChain(Pushed):
    """Storeys of a building in equilibrium under lateral loads; `push` moves them to the next roof displacement."""

    def __init__(
        self, building: ShearBuilding, shears: np.ndarray, rules: StoreyRules, coefficients: np.ndarray
    ) -> None:
        super().__init__(rules, coefficients)
        self.shears, self.stiffness = shears, effective_stiffness(building.parameters)
        # P-Delta force per storey drift [N/m].
        self.leaning = storey_weight_over_height(building.parameters) if "gravity_load" in building.parameters else 0.0
        # Elastic drifts under the loads, scaled to sum 1, and the base shear over the roof displacement [N/m].
        self.elastic_drift = shears / self.stiffness
        self.roof_stiffness = 1 / self.elastic_drift.sum()
        self.elastic_drift *= self.roof_stiffness
        self.softens, self.last_moves = False, np.zeros(building.storeys)

    @property
    def reached(self) -> float:
        """Roof displacement [m]."""
        return float(self.drift.sum())

    @property
    def moved(self) -> np.ndarray:
        """Floor displacements [m], shape [floor]."""
        return np.cumsum(self.drift)

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
