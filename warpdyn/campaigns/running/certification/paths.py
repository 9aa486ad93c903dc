"""Storeys of a law that follow prescribed drift paths; all device functions of the law are evaluated at every step."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import warp as wp

from warpdyn.engine.kernels.auxiliary.storey_answers import ANSWERS, storey_answers_kernel
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.laws.law import StoreyElement
from warpdyn.engine.laws.springs import StoreyRules

TURNS, STEPS = 24, 120  # number of reversals in a path, number of steps between two reversals
CHORD = 1e-5  # length over which slopes and jumps of the force are measured, as a share of the drift scale


@dataclass(frozen=True, eq=False)
class Storeys:
    """Storeys that have the same law, damper or stop; each follows a different drift path.

    Args:
        element: Class of the law, damper or stop.
        p: Parameters of the law, damper or stop, and "stiffness" [N/m], each of shape [1, storey].
        scale: Drift [m] at which the storey has yielded or the device is active, such as the yield drift.
    """

    element: type[StoreyElement]
    p: dict[str, np.ndarray]
    scale: float

    @property
    def count(self) -> int:
        """Number of storeys, each with a separate drift path."""
        return self.p["stiffness"].shape[1]

    @property
    def rules(self) -> StoreyRules:
        """The device functions (functions in kernels) of the law, damper or stop."""
        return self.element.variant(self.p)

    @property
    def coefficients(self) -> np.ndarray:
        """The coefficients that the device functions read, shape [coefficient, storey]."""
        row = self.element.spring(self.p)
        return np.concatenate(np.broadcast_arrays(*self.element.coefficients(self.p, row), self.p["stiffness"])[:-1])

    @property
    def stiffest(self) -> np.ndarray:
        """The largest tangent stiffness that the law declares [N/m], shape [storey]."""
        return np.broadcast_to(self.element.stiffest(self.p), (1, self.count))[0]

    def path(self, steps: int = STEPS) -> np.ndarray:
        """Return random drifts [m] with reversals of all amplitudes, shape [step, storey]; the last drift is 0.

        Args:
            steps: Number of steps between two reversals. The number does not change the drifts at the reversals.
        """
        rng = np.random.default_rng(11)
        shape = (TURNS, self.count)
        turns = 10 ** rng.uniform(-0.5, 1.2, shape) * self.scale * rng.uniform(-1, 1, shape)
        turns[-1] = 0
        return legs(np.concatenate([np.zeros((1, self.count)), turns]), steps)

    def cycles(self, steps: int = STEPS) -> np.ndarray:
        """Return drifts [m] of two cycles each with amplitudes of 1, 3 and 8 times the scale, shape [step, storey]."""
        turns = [0.0, *(side * size for size in (1, 1, 3, 3, 8, 8) for side in (1, -1)), 0.0]
        return legs(np.repeat(self.scale * np.array(turns)[:, None], self.count, axis=1), steps)

    def answers(self, drift: np.ndarray, dtype: str = "float64", device: str = "cpu") -> dict[str, np.ndarray]:
        """Return the results of the device functions at each step of a drift path, by name, and the path as "drift".

        Args:
            drift: Drifts [m], shape [step, storey].
            dtype: Number type, "float32" or "float64".
            device: Device on which the functions are evaluated, such as "cpu" or "cuda:0".

        Returns:
            Arrays of shape [step, storey].
        """
        number = DTYPES[dtype]
        given: list[wp.array] = [wp.array(values, dtype=number, device=device) for values in (self.coefficients, drift)]
        result = wp.full((len(ANSWERS), *drift.shape), np.nan, dtype=number, device=device)
        kernel = loaded(storey_answers_kernel(self.rules, dtype), device)
        wp.launch(kernel, dim=self.count, inputs=[*given, CHORD * self.scale, result], device=device)
        return dict(zip(ANSWERS, result.numpy().astype(np.float64), strict=True)) | {"drift": drift}


def legs(corners: np.ndarray, steps: int) -> np.ndarray:
    """Return straight paths between successive corners, `steps` steps each, shape [step, storey], without the start."""
    along = np.arange(1, steps + 1)[:, None] / steps
    return np.concatenate([a + (b - a) * along for a, b in itertools.pairwise(corners)])
