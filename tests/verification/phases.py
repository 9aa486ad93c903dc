"""Exact histories of structures with bilinear springs and contacts: matrix exponentials between located events."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq
from threadpoolctl import threadpool_limits


@dataclass(frozen=True)
class Spring:
    """A spring whose force is linear in phases.

    Args:
        row: Coefficients of its deformation d, shape [dof].
        stiffness: Stiffness, in a contact that of the contact.
        yield_force: Force at yield of a bilinear spring; infinite: elastic.
        ratio: Stiffness after yield over the initial one.
        gap: Deformation at which a contact begins; None: not a contact.
    """

    row: tuple[float, ...]
    stiffness: float
    yield_force: float = np.inf
    ratio: float = 0.0
    gap: float | None = None


class Phases:
    """The motion of a structure with such springs.

    M q'' + C q' + K q + sum of row f(row q) = load, where the load is linear between its samples. In a phase each
    spring is elastic, yields up or down, or is a contact that is open or closed; the system is then linear. A change of
    phase is located by Brent's method.
    """

    def __init__(self, mass, damping, springs: list[Spring], stiffness=0.0) -> None:
        self.mass, self.damping = np.asarray(mass, float), np.asarray(damping, float)
        self.n = len(self.mass)
        self.inverse = np.linalg.inv(self.mass)
        self.rows = np.array([spring.row for spring in springs])
        self.stiffness = np.array([spring.stiffness for spring in springs])
        self.ratio = np.array([spring.ratio for spring in springs])
        self.strength = np.array([spring.yield_force for spring in springs])
        self.is_contact = np.array([spring.gap is not None for spring in springs])
        self.gap = np.array([spring.gap or 0.0 for spring in springs])
        self.limit = self.strength / self.stiffness  # elastic deformation at yield
        self.base = np.zeros((self.n, self.n)) + stiffness
        self.known: dict[tuple, np.ndarray] = {}

    def history(self, load: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return displacements and velocities [time, dof] and spring forces [time, spring] at the samples of the load.

        Args:
            load: Forces at the samples, shape [time, dof].
            step: Time between two samples.
        """
        with threadpool_limits(limits=1, user_api="blas"):  # many small matrices
            return self._history(load, step)

    def _history(self, load: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        state = np.zeros(2 * self.n)
        self.centre = np.zeros(len(self.rows))  # deformation without force of the elastic branch
        self.mode = np.zeros(len(self.rows), dtype=int)
        self.enter_phase()
        states, forces = [state], [self.forces(state)]
        for start, end in itertools.pairwise(load):
            slope, done = (end - start) / step, 0.0
            while True:
                left = step - done
                whole = self.advanced(state, start + slope * done, slope, left)
                if not (self.events(whole) > 0).any():
                    break
                at = self.first_event(state, start + slope * done, slope, left)
                state = self.advanced(state, start + slope * done, slope, at)
                self.change(state)
                self.enter_phase()
                done += at
            state = whole
            states.append(state)
            forces.append(self.forces(state))
        table = np.array(states)
        return table[:, : self.n], table[:, self.n :], np.array(forces)

    def enter_phase(self) -> None:
        """Compute the stiffness of each spring and its force at deformation zero in the present phase."""
        mode, k, r = self.mode, self.stiffness, self.ratio
        yields = np.where(np.isinf(self.strength), 0.0, self.strength)
        of_bilinear = np.where(mode != 0, mode * (1 - r) * yields, -(1 - r) * k * self.centre)
        self.tangent = np.where(self.is_contact, k * mode, np.where(mode != 0, r * k, k))
        self.constant = np.where(self.is_contact, -k * self.gap * mode, of_bilinear)
        self.pull = self.rows.T @ self.constant
        self.name = mode.tobytes()

    def advanced(self, state: np.ndarray, force: np.ndarray, slope: np.ndarray, time: float) -> np.ndarray:
        """Return the state after a time in the present phase."""
        key = self.name, time
        over = self.known.get(key)
        if over is None:
            n, system = self.n, np.zeros((4 * self.n, 4 * self.n))
            whole = self.base + self.rows.T @ (self.tangent[:, None] * self.rows)
            system[:n, n : 2 * n] = np.eye(n)
            system[n : 2 * n, :n], system[n : 2 * n, n : 2 * n] = -self.inverse @ whole, -self.inverse @ self.damping
            system[n : 2 * n, 2 * n : 3 * n], system[2 * n : 3 * n, 3 * n :] = self.inverse, np.eye(n)
            over = expm(system * time)[: 2 * n]
            self.known[key] = over
        return over @ np.concatenate([state, force - self.pull, slope])

    def forces(self, state: np.ndarray) -> np.ndarray:
        """Return the forces of the springs."""
        return self.tangent * (self.rows @ state[: self.n]) + self.constant

    def events(self, state: np.ndarray) -> np.ndarray:
        """Return a value for each spring that exceeds 0 if the state is beyond the end of the spring's phase."""
        deformation, rate, mode = self.rows @ state[: self.n], self.rows @ state[self.n :], self.mode
        of_contact = np.where(mode != 0, self.gap - deformation, deformation - self.gap)
        of_bilinear = np.where(mode != 0, -mode * rate, np.abs(deformation - self.centre) - self.limit)
        return np.where(self.is_contact, of_contact, of_bilinear)

    def first_event(self, state: np.ndarray, force: np.ndarray, slope: np.ndarray, time: float) -> float:
        """Return the time of the first change of phase."""
        first = time
        for place in np.flatnonzero(self.events(self.advanced(state, force, slope, time)) > 0):
            at = brentq(
                lambda t, place=place: self.events(self.advanced(state, force, slope, t))[place], 0.0, time, xtol=1e-15
            ) if self.events(state)[place] < 0 else 0.0  # fmt: skip
            first = min(first, at)
        return first

    def change(self, state: np.ndarray) -> None:
        """Change the phase of the spring whose event has occurred."""
        values = self.events(state)
        scale = np.abs(self.rows) @ (np.abs(state[: self.n]) + 1e-6)
        place = int((values / scale).argmax())
        deformation = float(self.rows[place] @ state[: self.n])
        if self.is_contact[place]:
            self.mode[place] = 1 - self.mode[place]
        elif self.mode[place]:
            self.centre[place] = deformation - self.mode[place] * self.limit[place]
            self.mode[place] = 0
        else:
            self.mode[place] = np.sign(deformation - self.centre[place])
