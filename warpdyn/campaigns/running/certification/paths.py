"""Storeys of a law along paths of drift, with the results of all its device functions at every step."""

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

TURNS, STEPS = 24, 120  # reversals of a path, steps between two of them
CHORD = 1e-5  # over the drift scale: the length over which slopes and jumps are measured


@dataclass(frozen=True, eq=False)
class Storeys:
    """Storeys of one law or device, each with its own path.

    Args:
        element: The class of the law or device.
        p: Its parameters and "stiffness", each [1, storey].
        scale: A drift at which the storey has yielded or the device works [m], such as the yield drift.
    """

    element: type[StoreyElement]
    p: dict[str, np.ndarray]
    scale: float

    @property
    def count(self) -> int:
        """Number of storeys."""
        return self.p["stiffness"].shape[1]

    @property
    def rules(self) -> StoreyRules:
        """Their device functions."""
        return self.element.variant(self.p)

    @property
    def coefficients(self) -> np.ndarray:
        """The coefficients that the device functions read, [coefficient, storey]."""
        row = self.element.spring(self.p)
        return np.concatenate(np.broadcast_arrays(*self.element.coefficients(self.p, row), self.p["stiffness"])[:-1])

    @property
    def stiffest(self) -> np.ndarray:
        """The declared largest tangent stiffness [N/m], [storey]."""
        return np.broadcast_to(self.element.stiffest(self.p), (1, self.count))[0]

    def path(self, steps: int = STEPS) -> np.ndarray:
        """Return drifts [m] with reversals at all sizes, [step, storey]; they end at 0.

        Args:
            steps: Number of steps between two reversals; the reversals do not depend on it.
        """
        rng = np.random.default_rng(11)
        shape = (TURNS, self.count)
        turns = 10 ** rng.uniform(-0.5, 1.2, shape) * self.scale * rng.uniform(-1, 1, shape)
        turns[-1] = 0
        return legs(np.concatenate([np.zeros((1, self.count)), turns]), steps)

    def cycles(self, steps: int = STEPS) -> np.ndarray:
        """Return drifts [m] of three pairs of cycles, of 1, 3 and 8 times the scale, [step, storey]."""
        turns = [0.0, *(side * size for size in (1, 1, 3, 3, 8, 8) for side in (1, -1)), 0.0]
        return legs(np.repeat(self.scale * np.array(turns)[:, None], self.count, axis=1), steps)

    def answers(self, drift: np.ndarray, dtype: str = "float64", device: str = "cpu") -> dict[str, np.ndarray]:
        """Return the results of the device functions at each step, [step, storey] each, and "drift".

        Args:
            drift: Drifts [m], [step, storey].
            dtype: Number type.
            device: Device, such as "cpu" or "cuda:0".
        """
        number = DTYPES[dtype]
        given: list[wp.array] = [wp.array(values, dtype=number, device=device) for values in (self.coefficients, drift)]
        result = wp.full((len(ANSWERS), *drift.shape), np.nan, dtype=number, device=device)
        kernel = loaded(storey_answers_kernel(self.rules, dtype), device)
        wp.launch(kernel, dim=self.count, inputs=[*given, CHORD * self.scale, result], device=device)
        return dict(zip(ANSWERS, result.numpy().astype(np.float64), strict=True)) | {"drift": drift}


def legs(corners: np.ndarray, steps: int) -> np.ndarray:
    """Return straight paths through corners, [step, storey], each of `steps` steps, without the first corner."""
    along = np.arange(1, steps + 1)[:, None] / steps
    return np.concatenate([a + (b - a) * along for a, b in itertools.pairwise(corners)])
