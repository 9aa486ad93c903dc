"""Time integration methods as checked data: an explicit Runge-Kutta method is its tableau, one row in METHODS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ExplicitMethod:
    """An explicit Runge-Kutta method for y' = f(t, y).

    Args:
        name: What scenes and datasets call it.
        order: Order of convergence.
        a: Coefficients of earlier slopes, one row a stage, shape [stage][stage].
        b: Weights of the slopes, shape [stage].
        c: Times of the stages within the step, shape [stage].

    Raises:
        ValueError: If rows of `a` do not sum to `c`, `b` does not sum to 1, `a` is not strictly lower triangular, or
            the stability polynomial does not agree with exp(z) to the stated order.
    """

    name: str
    order: int
    a: tuple[tuple[float, ...], ...]
    b: tuple[float, ...]
    c: tuple[float, ...]

    def __post_init__(self) -> None:
        a, b, c = np.array(self.a), np.array(self.b), np.array(self.c)
        if a.shape != (b.size, b.size) or c.shape != b.shape:
            raise ValueError(f"method {self.name!r}: a, b and c disagree on the number of stages")
        if np.any(np.triu(a)):
            raise ValueError(f"method {self.name!r}: a must be zero on and above its diagonal, the method is explicit")
        if not np.allclose(a.sum(axis=1), c, atol=1e-14) or not np.isclose(b.sum(), 1, atol=1e-14):
            raise ValueError(f"method {self.name!r}: rows of a must sum to c, and b to 1")
        if np.any(np.tril(a, -2)):
            # The kernels keep no earlier slopes: each stage starts from the accepted state and the last slope alone.
            raise ValueError(f"method {self.name!r}: a may hold values only just below its diagonal")
        if not 1 <= self.order <= self.stages:
            raise ValueError(f"method {self.name!r}: {self.stages} stages are not of order {self.order}")
        taylor = 1 / np.cumprod([1.0, *range(1, self.order + 1)])
        if not np.allclose(self.stability_polynomial[: self.order + 1], taylor, atol=1e-14):
            raise ValueError(f"method {self.name!r}: the tableau is not of order {self.order}")

    @property
    def stages(self) -> int:
        """Evaluations of the equation of motion a step."""
        return len(self.b)

    @property
    def stability_polynomial(self) -> tuple[float, ...]:
        """Coefficients r_k of R(z) = sum r_k z^k, the growth a step of y' = (z/h) y."""
        a, slope, coefficients = np.array(self.a), np.ones(self.stages), [1.0]
        for _ in range(self.stages):
            coefficients.append(float(np.dot(self.b, slope)))
            slope = a @ slope
        return tuple(coefficients)


METHODS = {
    method.name: method
    for method in (
        ExplicitMethod(  # Kutta 1901: the classical fourth-order method
            "rk4",
            order=4,
            a=((0, 0, 0, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 1, 0)),
            b=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
            c=(0, 0.5, 0.5, 1),
        ),
    )
}
