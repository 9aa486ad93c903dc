"""A lumped structure that is pushed by loads of one pattern: the search for its next equilibrium."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from warpdyn.campaigns.running.pushing.search import (
    ITERATIONS,
    LEAST_STIFFNESS,
    SHORTENINGS,
    SHORTEST_STEP,
    TOLERANCE,
    Pushed,
)
from warpdyn.engine.laws.springs import StoreyRules
from warpdyn.model.structures.lumped.structure import LumpedStructure

LEAST_DESCENT = 1e-4  # decrease of the unbalanced force that a correction must reach, as a share of its linear decrease
PARTS_OF_LOADS = 32  # in which permanent loads increase if they do not lead to a stable equilibrium at once
MOST_TRIED = 8  # most springs that are tried as the only one that softens


class PushedStructure(Pushed):
    """A lumped structure in equilibrium under loads; `push` moves it to the next displacement of one degree of freedom.

    The resistance is R(q) = sum of the springs' forces on the coordinates + (K - K_geometric) q - permanent loads; in
    equilibrium it is the load factor times the load pattern. Coordinates are the degrees of freedom and, in a frame
    with hinges, displacements without mass. Displacements and storey drifts are relative to the equilibrium under the
    permanent loads, rotations of hinges are not.

    Args:
        structure: The structure.
        loads: Load pattern, shape [dof]: loads per unit of the base shear.
        control: Index of the degree of freedom whose displacement is prescribed.
        rules: Device functions of the law of the springs.
        coefficients: Coefficients of the law, shape [coefficient, spring].
    """

    def __init__(
        self,
        structure: LumpedStructure,
        loads: np.ndarray,
        control: int,
        rules: StoreyRules,
        coefficients: np.ndarray,
    ) -> None:
        super().__init__(rules, coefficients)
        self.structure, self.control = structure, control
        self.rows, self.elastic, self.permanent = structure.static_system()
        coordinates = len(self.elastic)
        self.loads: np.ndarray = np.append(loads, np.zeros(coordinates - structure.dofs))
        self.launch.launch()  # devices have their stiffness in the law
        of_law = np.where(self.tangent > 0, self.tangent, 0.0)
        stiffness = structure.parameters["stiffness"]
        self.stiffness = np.where(stiffness > 0, stiffness, of_law)
        self.initial = self._matrix(self.stiffness)
        self.factor = cho_factor(self.initial)
        flexible = cho_solve(self.factor, self.loads)
        self.load_stiffness = float(1 / (self.loads @ flexible))  # base shear / displacement [N/m]
        # Elastic displacements under the loads at a control displacement of 1, and the load factor per m.
        self.control_stiffness = float(1 / flexible[control])
        self.elastic_shape: np.ndarray = flexible * self.control_stiffness
        self.tangent_shape = self.elastic_shape
        self.displacement, self.trial_displacement = np.zeros(coordinates), np.zeros(coordinates)
        self.last_moves, self.softening = np.zeros(coordinates), 0
        self.at_rest, self.offset = np.zeros(coordinates), np.zeros(len(self.rows))
        if self.permanent.any():
            self._settle()

    def _settle(self) -> None:
        """Move to the equilibrium under the permanent loads, at once or, if it is unstable, in parts of the loads."""
        whole = self.permanent
        for parts in (1, PARTS_OF_LOADS):
            for state in (self.displacement, self.drift, self.memory, self.force):
                state[...] = 0.0
            for part in range(1, parts + 1):
                self.permanent = whole * (part / parts)
                problem = self._settling_problem()
                if problem is not None:
                    break
                self.displacement[:] = self.trial_displacement
                self._accept()
            if problem is None:
                break
        self.permanent = whole
        if problem is not None:
            raise problem
        self.at_rest[:] = self.displacement
        dofs = self.structure.dofs
        self.offset = self.rows[:, :dofs] @ self.at_rest[:dofs]
        self.drift -= self.offset

    def _settling_problem(self) -> Exception | None:
        """Search the equilibrium under the permanent loads; all coordinates are free. Return an error if it fails."""
        move = cho_solve(self.factor, self.permanent - self.elastic @ self.displacement - self.rows.T @ self.force)
        self._try(self.displacement + move)
        scale = np.sqrt(self.permanent @ cho_solve(self.factor, self.permanent) * self.load_stiffness)
        for _ in range(ITERATIONS):
            left = self._size(self._resistance())
            if left <= TOLERANCE * scale:
                break
            for stiffness in (self._matrix(self._tangents()), self.initial):
                correction = np.linalg.lstsq(stiffness, -self._resistance())[0]
                if self._descend(correction, left, has_loads=False):
                    break
        else:
            return RuntimeError(
                "pushover: no equilibrium under the gravity loads was found, because hinges yield under gravity: check "
                "the units of gravity_load [N] and yield_force [N m]"
            )
        if self._buckles():
            return ValueError(
                "pushover: no stable equilibrium under the gravity loads was found: hinges yield under gravity, and "
                "the frame then resists its P-Delta moments too little. Check the units of gravity_load [N] and "
                "yield_force [N m], reduce the loads, or give p_delta=False"
            )
        return None

    def _buckles(self) -> bool:
        """Return whether the trial state is unstable under loads that do not change.

        It is unstable if the second-order work of a motion is negative, in which springs load or unload (Hill 1958, "A
        general theory of uniqueness and stability in elastic-plastic solids"). The motions are the lowest modes.
        """
        tangents = self._tangents()
        for sign in (1.0, -1.0):
            chosen = tangents
            for _ in range(MOST_TRIED):
                motion = sign * eigh(self._matrix(chosen), self.initial, subset_by_index=[0, 0])[1][:, 0]
                unloads = (self.rows @ motion) * self.trial_force < 0
                branches = np.where(unloads, self.stiffness, tangents)
                if motion @ self._matrix(branches) @ motion < -LEAST_STIFFNESS:  # 1 for the initial stiffness
                    return True
                if (branches == chosen).all():
                    break
                chosen = branches
        return False

    @property
    def reached(self) -> float:
        """Displacement of the controlled degree of freedom [m]."""
        return float(self.displacement[self.control] - self.at_rest[self.control])

    @property
    def moved(self) -> np.ndarray:
        """Displacements along the coordinates [m], shape [coordinate]."""
        return self.displacement - self.at_rest

    def reason_to_stop(self) -> str:
        """Return, as text for a message, why the last call of `push` found no further equilibrium."""
        ratio = np.where(self.stiffness > 0, self.tangent / np.maximum(self.stiffness, 1e-300), np.inf)
        softest = self.structure.springs[int(np.argmin(ratio))].name
        return (
            f"no stable equilibrium was found beyond a displacement of {self.reached:.6g} m of degree of freedom "
            f"{self.structure.dof_names[self.control]!r} (base shear {self.base_shear:.6g} N), in steps down to "
            f"{SHORTEST_STEP:.1e} of the given one. Spring {softest!r}, which was softest there, may soften faster "
            "than the others unload (snap-back), or the structure may buckle in another direction: give a path that "
            "ends here, another control=, or a structure whose springs lose strength more slowly"
        )

    def _step(self, displacement: float, stops_at_peak: bool) -> bool:
        move = displacement - self.reached
        if move == 0:  # the first step may be at rest
            self._try(self.displacement.copy())
            self._accept()
            return True
        scale = max(self.largest_shear, abs(move) * self.control_stiffness)
        goes_on = self.softening > 0 and move * self.last_moves[self.control] > 0
        for shape in [self.tangent_shape, self.elastic_shape] if goes_on else [self.elastic_shape]:
            base_shear = self._found_from(shape, displacement, scale)
            if base_shear is None:
                continue
            if stops_at_peak and np.count_nonzero(self._softens()) > self.softening:
                return False
            if self._is_stable():
                self._take(base_shear)
                return True
        base_shear = self._with_one_softening(displacement, scale)
        if base_shear is not None:
            self._take(base_shear)
        return base_shear is not None

    def _take(self, base_shear: float) -> None:
        """Make the trial state the accepted one."""
        self.last_moves[:] = self.trial_displacement - self.displacement
        self.softening = int(np.count_nonzero(self._softens()))
        self.displacement[:] = self.trial_displacement
        self._accept()
        self.base_shear = base_shear
        self.largest_shear = max(self.largest_shear, abs(base_shear))
        self.tangent_shape = self._shape(self._tangents())

    def _shape(self, tangents: np.ndarray) -> np.ndarray:
        """Return the displacements under the loads at a control displacement of 1 for tangents of the springs [N/m].

        If these tangents do not determine them, return those of the elastic structure.
        """
        try:
            found = np.linalg.solve(self._matrix(tangents), self.loads)
        except np.linalg.LinAlgError:
            return self.elastic_shape
        return self.elastic_shape if found[self.control] == 0 else found / found[self.control]

    def _found_from(self, shape: np.ndarray, displacement: float, scale: float) -> float | None:
        """Search an equilibrium from moves of a given shape [1, 1/m]; return its base shear [N], or None."""
        start = self.displacement + (displacement - self.reached) * shape
        start[self.control] = displacement + self.at_rest[self.control]
        self._try(start)
        return self._balance(scale)

    def _try(self, displacement: np.ndarray) -> None:
        """Evaluate all springs at trial displacements, shape [coordinate]."""
        self.trial_displacement = displacement
        self.trial[:] = self.rows @ displacement - self.offset
        self.launch.launch()

    def _balance(self, scale: float) -> float | None:
        """Move the trial displacements to an equilibrium; return its base shear [N], or None if the search fails.

        Newton's method at a prescribed displacement. A correction by the tangents must reduce the unbalanced force;
        otherwise one by the initial stiffness is used.

        Args:
            scale: Force [N] to which the unbalanced force is compared.
        """
        for _ in range(ITERATIONS):
            unbalanced = self._unbalanced()
            if unbalanced <= TOLERANCE * scale:
                return self._load_factor()
            if not self._descend(self._correction(self._matrix(self._tangents())), unbalanced):
                self._descend(self._correction(self.initial), unbalanced)
        return None

    def _descend(self, correction: np.ndarray, unbalanced: float, *, has_loads: bool = True) -> bool:
        """Change the trial displacements by `correction`, halved until the unbalanced force [N] decreases.

        Return whether it decreases; otherwise the trial displacements have the whole correction. Without `has_loads`,
        only the permanent loads act.
        """
        start, share = self.trial_displacement, 1.0
        for _ in range(SHORTENINGS):
            self._try(start + share * correction)
            left = self._unbalanced() if has_loads else self._size(self._resistance())
            if left <= (1 - LEAST_DESCENT * share) * unbalanced:
                return True
            share *= 0.5
        self._try(start + correction)
        return False

    def _resistance(self) -> np.ndarray:
        """Return the resistance to the trial displacements [N, N m], shape [coordinate]."""
        found: np.ndarray = self.rows.T @ self.trial_force + self.elastic @ self.trial_displacement - self.permanent
        return found

    def _load_factor(self) -> float:
        """Return the base shear [N] whose loads come closest to the resistance."""
        softened = self.elastic_shape / self.control_stiffness
        return float(softened @ self._resistance() / (softened @ self.loads))

    def _unbalanced(self) -> float:
        """Return the unbalanced force [N]; inf if a trial is too large."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self._size(self._resistance() - self._load_factor() * self.loads)

    def _size(self, forces: np.ndarray) -> float:
        """Return the size of forces [N] in the norm of the initial flexibility; inf if one is not finite."""
        if not np.isfinite(forces).all():
            return np.inf
        with np.errstate(over="ignore", invalid="ignore"):
            return float(np.sqrt(max(forces @ cho_solve(self.factor, forces), 0.0) * self.load_stiffness))

    def _tangents(self) -> np.ndarray:
        """Return the tangent stiffness of each spring [N/m]; near 0 it is replaced by a small stiffness."""
        least = LEAST_STIFFNESS * self.stiffness
        return np.where(np.abs(self.tangent) < least, least, self.tangent)

    def _matrix(self, tangents: np.ndarray) -> np.ndarray:
        """Return the stiffness matrix for tangents of the springs [N/m], shape [coordinate, coordinate]."""
        found: np.ndarray = (self.rows.T * tangents) @ self.rows + self.elastic
        return found

    def _correction(self, stiffness: np.ndarray) -> np.ndarray:
        """Return Newton's corrections of the displacements, shape [coordinate]; the controlled one does not change.

        Args:
            stiffness: Stiffness matrix [N/m], shape [coordinate, coordinate].
        """
        count, unit = len(self.loads), self.control_stiffness  # the unknown base shear in units of this stiffness
        bordered = np.zeros((count + 1, count + 1))
        bordered[:count, :count] = stiffness
        bordered[:count, count] = -unit * self.loads
        bordered[count, self.control] = unit
        try:
            found: np.ndarray = np.linalg.solve(bordered, np.append(-self._resistance(), 0.0))
        except np.linalg.LinAlgError:  # the tangents allow a free motion at the prescribed displacement
            found = np.linalg.lstsq(bordered, np.append(-self._resistance(), 0.0))[0]
        found[self.control] = 0.0
        return found[:count]

    def _softens(self) -> np.ndarray:
        """Return which springs moved in this step and have a negative tangent stiffness, shape [spring]."""
        return (self.tangent < -LEAST_STIFFNESS * self.stiffness) & (self.trial != self.drift)

    def _is_stable(self) -> bool:
        """Return whether the equilibrium is stable at a prescribed displacement.

        The tangent stiffness has no negative eigenvalue; or one, and the base shear falls as the displacement grows.
        """
        tangent = self._matrix(self._tangents())
        values = eigh(tangent, self.initial, eigvals_only=True)
        negative = int(np.count_nonzero(values < -LEAST_STIFFNESS))
        if negative != 1:
            return negative == 0
        return float(np.linalg.solve(tangent, self.loads)[self.control]) < 0

    def _with_one_softening(self, displacement: float, scale: float) -> float | None:
        """Search a stable equilibrium in which one spring softens and the others unload; return its base shear [N].

        If several springs soften, the smallest difference makes all but one of them unload. The springs that moved most
        are tried first.
        """
        softens, tangents = self._softens(), self._tangents()
        moved = np.where(softens, np.abs(self.trial - self.drift) * np.sqrt(self.stiffness), -1.0)
        unloading = np.where(softens, self.stiffness, tangents)
        for spring in np.argsort(-moved, kind="stable")[: min(MOST_TRIED, int(softens.sum()))]:
            alone = unloading.copy()
            alone[spring] = tangents[spring]
            base_shear = self._found_from(self._shape(alone), displacement, scale)
            if base_shear is not None and self._is_stable():
                return base_shear
        return None
