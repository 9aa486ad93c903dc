"""Evaluation of a limit-state function of standard normal variables, with checks of its values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import check_memory, shortened, whole_number
from warpdyn.foundations.core.messages import amount_of

LimitState = Callable[[np.ndarray], np.ndarray]
BYTES_OF_A_VARIABLE = 32  # of a sample: its normal value, a candidate and copies
MOST_SHOWN = 4  # normal values of a sample in a message


class Evaluation:
    """A limit-state function with its number of variables, whose values are checked and whose evaluations are counted.

    Args:
        function: Name of the public function, for messages.
        limit_state: The limit-state function.
        variables: Number of standard normal variables; None: the attribute `variables` of `limit_state`.

    Attributes:
        evaluations: Number of samples that were evaluated.

    Raises:
        TypeError: If `limit_state` cannot be called.
        ValueError: If the number of variables is missing, or differs from the attribute of `limit_state`.
    """

    def __init__(self, function: str, limit_state: LimitState, variables: int | None) -> None:
        if not callable(limit_state) or isinstance(limit_state, type):
            raise TypeError(
                f"{function}: limit_state must be a function of standard normal values, shape [sample, variable], that "
                "returns one value per sample, or a SceneLimitState(scene, limit), got "
                f"{f'the class {limit_state.__name__}' if isinstance(limit_state, type) else shortened(limit_state)}"
            )
        own = getattr(limit_state, "variables", None)
        if variables is None and own is None:
            raise ValueError(f"{function}: give variables=, the number of standard normal variables of limit_state")
        self.function, self.limit_state, self.evaluations = function, limit_state, 0
        self.variables = whole_number("variables", own if variables is None else variables, 1)
        if own is not None and self.variables != own:
            raise ValueError(
                f"{function}: variables={self.variables}, but limit_state has {own} variables: remove variables="
            )

    def check_memory(self, samples: int) -> None:
        """Raise a ValueError if the normal values of the samples need more memory than is free."""
        what = f"{self.function} with samples={samples} of {amount_of(self.variables, 'variable')}"
        check_memory(what, float(BYTES_OF_A_VARIABLE) * samples * self.variables, "reduce samples")

    def __call__(self, normals: np.ndarray) -> np.ndarray:
        """Return the values of the limit-state function, shape [sample], for normal values [sample, variable].

        Raises:
            TypeError: If the values are not numbers.
            ValueError: If there is not one value per sample, or a value is NaN.
        """
        given: Any = self.limit_state(normals.copy())  # a copy: the function may change its argument
        values = np.asarray(given)
        self.evaluations += len(normals)
        if values.dtype.kind not in "fiu":
            raise TypeError(
                f"{self.function}: limit_state returned values of type {values.dtype}; it must return real numbers "
                "that decrease towards failure and are negative if a sample fails, such as capacity - demand"
            )
        if values.shape != (len(normals),):
            raise ValueError(
                f"{self.function}: limit_state returned values of shape {values.shape} for {len(normals)} samples; it "
                f"must return shape ({len(normals)},): evaluate all rows of the argument, which has the shape [sample, "
                "variable]"
            )
        missing = np.isnan(values)
        if missing.any():
            first = int(missing.argmax())
            shown = ", ".join(f"{value:.4g}" for value in normals[first, :MOST_SHOWN])
            more = ", ..." if self.variables > MOST_SHOWN else ""
            raise ValueError(
                f"{self.function}: limit_state is NaN for {int(missing.sum())} of {len(normals)} samples; the first "
                f"has the standard normal values [{shown}{more}]: return a finite value for every sample, so that it "
                "is known whether the sample fails"
            )
        return values.astype(np.float64)
