"""Kinds of time integration methods: their coefficients, and checks of these; the table METHODS contains the methods.

An explicit method for u'' = f(t, u, u') is given by its tableau: a Runge-Kutta method, or a Nystroem method, which has
separate weights for displacements. A multistep method also uses the motion of earlier steps. An implicit method is
given by its parameters in the family of Newmark (1959), Hilber, Hughes and Taylor (1977), Chung and Hulbert (1993) and
Wilson (1973). The exact method has no parameters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

Matrix = tuple[tuple[float, ...], ...]
# Steps w h (circular frequency times step) at which the order of a method is checked, and tolerance of the order.
CHECKED_STEPS, ORDER_HIDDEN = (0.2, 0.1), 0.3


def product(weights: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Return weights @ table, rounded in the same way on every CPU; the operator `@` adds in different orders."""
    return np.apply_along_axis(math.fsum, -2, weights[..., None] * table)


def _check_order(method: ExplicitMethod | MultistepMethod | ImplicitMethod) -> None:
    """Raise a ValueError if a method does not have its stated order of convergence.

    The order follows from the growth of an oscillator's motion in a step, compared with exp(lambda h), for two steps.
    """
    for ratio in (0.0, 0.1):
        errors = []
        for x in CHECKED_STEPS:
            growth = np.linalg.eigvals(method.amplification(np.array(x), np.array(ratio)))
            errors.append(np.abs(growth - np.exp(x * complex(-ratio, np.sqrt(1 - ratio**2)))).min())
        if np.log2(errors[0] / errors[1]) < method.order + 1 - ORDER_HIDDEN:
            raise ValueError(
                f"method {method.name!r}: it is not of order {method.order}: correct its coefficients, or give another "
                "order="
            )


@dataclass(frozen=True)
class ExplicitMethod:
    """An explicit Runge-Kutta or Runge-Kutta-Nystroem method.

    Args:
        name: Name in `simulate` and in datasets.
        order: Order of convergence.
        a: Coefficients of earlier slopes, one row per stage, shape [stage][stage].
        b: Weights of the slopes, shape [stage].
        c: Times of the stages within the step, shape [stage].
        a_displacement: Coefficients of earlier accelerations in the displacement of a stage, divided by h^2, shape
            [stage][stage]; omitted for a Runge-Kutta method, where they are the matrix product a a.
        b_displacement: Weights of the accelerations in the displacement at the end of the step, divided by h^2, shape
            [stage]; omitted for a Runge-Kutta method, where they are the product b a.
        error: Weights of the slopes in the embedded error estimate, shape [stage]; omitted for methods without
            step-size control.
        starts_halfway: Whether velocities are half a step behind displacements, so that the first step is half a step.

    Raises:
        ValueError: If rows of `a` do not sum to `c`, `b` does not sum to 1, a table is not strictly lower triangular,
            or the method is not of the stated order.
    """

    name: str
    order: int
    a: Matrix
    b: tuple[float, ...]
    c: tuple[float, ...]
    a_displacement: Matrix | None = None
    b_displacement: tuple[float, ...] | None = None
    error: tuple[float, ...] | None = None
    starts_halfway: bool = False

    kind: ClassVar[Literal["explicit"]] = "explicit"

    def __post_init__(self) -> None:
        a, b, c = np.array(self.a), np.array(self.b), np.array(self.c)
        problem = f"method {self.name!r}: "
        if a.shape != (b.size, b.size) or c.shape != b.shape:
            raise ValueError(
                f"{problem}a, b and c must have one row per stage, got shapes {a.shape}, {b.shape} and {c.shape}"
            )
        if (self.a_displacement is None) != (self.b_displacement is None):
            raise ValueError(f"{problem}give a_displacement and b_displacement, or neither of them")
        if self.is_nystroem and (self.displacement_a.shape != a.shape or self.displacement_b.shape != b.shape):
            raise ValueError(
                f"{problem}a_displacement and b_displacement must have the {self.stages} stages of a and b"
            )
        if self.error is not None and np.shape(self.error) != b.shape:
            raise ValueError(f"{problem}error must have one value per stage, {self.stages}, got {np.size(self.error)}")
        if np.any(np.triu(a)) or np.any(np.triu(self.displacement_a)):
            raise ValueError(f"{problem}a must be zero on and above its diagonal, because the method is explicit")
        if not np.allclose(a.sum(axis=1), c, rtol=0, atol=1e-14) or abs(b.sum() - 1) > 1e-14:
            raise ValueError(f"{problem}rows of a must sum to c, and b to 1")
        if self.error is not None and abs(sum(self.error)) > 1e-14:
            raise ValueError(f"{problem}error must sum to 0: it is the difference of two sets of weights")
        if not 1 <= self.order <= self.stages:
            raise ValueError(f"{problem}order must be from 1 to the number of stages, {self.stages}, got {self.order}")
        self._check_order_conditions()
        _check_order(self)

    def _check_order_conditions(self) -> None:
        """Raise a ValueError if order conditions up to 4 are violated (Hairer, Norsett and Wanner, II.1 and II.14).

        Order conditions for slopes that are nonlinear in the state are checked for Runge-Kutta methods only.
        """
        a, b, c = np.array(self.a), np.array(self.b), np.array(self.c)
        bars = self.displacement_b
        conditions = [(2, b @ c, 1 / 2), (2, bars.sum(), 1 / 2), (3, b @ c**2, 1 / 3), (3, bars @ c, 1 / 6)]
        conditions += [(4, b @ c**3, 1 / 4), (4, bars @ c**2, 1 / 12)]
        if not self.is_nystroem:
            conditions += [(3, b @ a @ c, 1 / 6), (4, (b * c) @ a @ c, 1 / 8), (4, b @ a @ c**2, 1 / 12)]
            conditions += [(4, b @ a @ a @ c, 1 / 24)]
        for order, value, due in conditions:
            if order <= self.order and abs(value - due) > 1e-13:
                raise ValueError(
                    f"method {self.name!r}: the tableau is not of order {self.order}: correct "
                    "it, or give another order="
                )

    @property
    def stages(self) -> int:
        """Number of evaluations of the equation of motion in a step."""
        return len(self.b)

    @property
    def is_nystroem(self) -> bool:
        """Whether displacements have separate weights, as in Runge-Kutta-Nystroem methods."""
        return self.a_displacement is not None

    @property
    def is_adaptive(self) -> bool:
        """Whether the method estimates the error of each sample and adapts the step to it."""
        return self.error is not None

    @property
    def displacement_a(self) -> np.ndarray:
        """Coefficients of accelerations in the displacement of a stage, divided by h^2, shape [stage, stage]."""
        return np.array(self.a_displacement) if self.is_nystroem else product(np.array(self.a), np.array(self.a))

    @property
    def displacement_b(self) -> np.ndarray:
        """Weights of the accelerations in the displacement at the end of the step, divided by h^2, shape [stage]."""
        return np.array(self.b_displacement) if self.is_nystroem else product(np.array(self.b), np.array(self.a))

    @property
    def stability_polynomial(self) -> tuple[float, ...]:
        """Coefficients r_k of R(z) = sum r_k z^k, the factor by which a step multiplies y if y' = (z/h) y.

        For a Nystroem method, R applies to variables that are integrated like velocities, such as the memory of a
        storey law, but not to the oscillator.
        """
        a, slope, coefficients = np.array(self.a), np.ones(self.stages), [1.0]
        for _ in range(self.stages):
            coefficients.append(math.fsum(self.b * slope))
            slope = product(slope, a.T)
        return tuple(coefficients)

    def amplification(self, frequency_step: np.ndarray, damping_ratio: np.ndarray) -> np.ndarray:
        """Return the matrices by which a step multiplies the state (u, h u') of an oscillator.

        The equation of motion is u'' + 2 zeta w u' + w^2 u = 0.

        Args:
            frequency_step: w h, circular frequency times step, shape [...].
            damping_ratio: zeta, shape [...].

        Returns:
            Matrices of shape [..., 2, 2].
        """
        x, ratio = np.broadcast_arrays(np.asarray(frequency_step, float), np.asarray(damping_ratio, float))
        stiff, viscous = (x**2)[..., None], (2 * ratio * x)[..., None]
        one_u, one_w = np.array([1.0, 0.0]), np.array([0.0, 1.0])
        slopes: list[np.ndarray] = []  # h^2 u'' of each stage as a row that multiplies the state
        for stage in range(self.stages):
            u, w = one_u + self.c[stage] * one_w, one_w
            for slope, of_u, of_w in zip(slopes, self.displacement_a[stage], self.a[stage], strict=False):
                u, w = u + of_u * slope, w + of_w * slope
            slopes.append(-stiff * u - viscous * w)
        u, w = one_u + one_w, one_w
        for slope, of_u, of_w in zip(slopes, self.displacement_b, self.b, strict=True):
            u, w = u + of_u * slope, w + of_w * slope
        return np.stack([u, w], axis=-2)


@dataclass(frozen=True)
class ImplicitMethod:
    """A one-step method that solves the equation of motion for the acceleration at the end of the step.

    With displacement u, velocity v and acceleration a at the start of the step h, and u1, v1, a1 at its end: u1 = u + h
    v + h^2 ((1/2 - beta) a + beta a1) and v1 = v + h ((1 - gamma) a + gamma a1). The equation of motion is satisfied
    with the acceleration (1 - mass_lag) a1 + mass_lag a, and with (1 - force_lag) times the other forces at the end
    plus force_lag times these forces at the start of the step. With an extension theta above 1, the equation is
    satisfied at t + theta h, and the acceleration at t + h is interpolated.

    Args:
        name: Name in `simulate` and in datasets.
        order: Order of convergence.
        beta: Newmark's beta; with 0, only the damping is implicit.
        gamma: Newmark's gamma.
        mass_lag: alpha_m of Chung and Hulbert.
        force_lag: alpha_f of Chung and Hulbert; minus the alpha of Hilber, Hughes and Taylor.
        extension: Wilson's theta.

    Raises:
        ValueError: If the method is not of the stated order.
    """

    name: str
    order: int
    beta: float
    gamma: float = 0.5
    mass_lag: float = 0.0
    force_lag: float = 0.0
    extension: float = 1.0

    kind: ClassVar[Literal["implicit"]] = "implicit"
    is_adaptive = False

    def __post_init__(self) -> None:
        _check_order(self)

    def amplification(self, frequency_step: np.ndarray, damping_ratio: np.ndarray) -> np.ndarray:
        """Return the matrices by which a step multiplies the state (u, h u', h^2 u'') of an oscillator.

        The equation of motion is u'' + 2 zeta w u' + w^2 u = 0.

        Args:
            frequency_step: w h, circular frequency times step, shape [...].
            damping_ratio: zeta, shape [...].

        Returns:
            Matrices of shape [..., 3, 3].
        """
        x, ratio = np.broadcast_arrays(np.asarray(frequency_step, float), np.asarray(damping_ratio, float))
        stiff, viscous = (x**2)[..., None], (2 * ratio * x)[..., None]
        u, w, k = np.eye(3)
        reach = self.extension
        free_u, free_w = u + reach * w + reach**2 * (0.5 - self.beta) * k, w + reach * (1 - self.gamma) * k
        end = 1 - self.force_lag
        rest = self.mass_lag * k + viscous * (end * free_w + self.force_lag * w)
        rest = rest + stiff * (end * free_u + self.force_lag * u)
        effective = 1 - self.mass_lag + end * (viscous * reach * self.gamma + stiff * reach**2 * self.beta)
        k1 = k + (-rest / effective - k) / reach
        return np.stack(
            [u + w + (0.5 - self.beta) * k + self.beta * k1, w + (1 - self.gamma) * k + self.gamma * k1, k1], axis=-2
        )


@dataclass(frozen=True)
class MultistepMethod:
    """An explicit method with one evaluation of the forces per step, which also uses the motion of earlier steps.

    Let w and w1 be the changes of a displacement u in the step before and in the step after an instant, and A = h^2
    times the acceleration at this instant. A step is w1 = w + A and u1 = u + w1 + correction (A - A of the last step).
    The forces are evaluated with the velocity (velocity[0] w1 + velocity[1] w + velocity[2] w of the step before) / h,
    which is extrapolated to the end of the step. With the correction 1/12 this is Stoermer's formula of order 3 in
    summed form, which rounds less, and its weights of w are those of Adams and Bashforth (Hairer, Norsett and Wanner,
    Solving ODEs I, III.1 and III.10).

    Args:
        name: Name in `simulate` and in datasets.
        order: Order of convergence.
        correction: Fraction of the last change of A that is added to the displacement.
        velocity: Weights of w in the last three steps, the latest first.

    Raises:
        ValueError: If the method is not of the stated order.
    """

    name: str
    order: int
    correction: float
    velocity: tuple[float, float, float]

    kind: ClassVar[Literal["explicit"]] = "explicit"
    is_adaptive = False
    starts_halfway = False
    stages = 1
    # The memory of rate laws follows the change of the drift by the midpoint rule.
    stability_polynomial = (1.0, 1.0, 0.5)

    def __post_init__(self) -> None:
        _check_order(self)

    def amplification(self, frequency_step: np.ndarray, damping_ratio: np.ndarray) -> np.ndarray:
        """Return the matrices by which a step multiplies the state (u, d, d1, d2) of an oscillator.

        The equation of motion is u'' + 2 zeta w u' + w^2 u = 0; d, d1 and d2 are the changes of the displacement in the
        last three steps, the latest first.

        Args:
            frequency_step: w h, circular frequency times step, shape [...].
            damping_ratio: zeta, shape [...].

        Returns:
            Matrices of shape [..., 4, 4].
        """
        x, ratio = np.broadcast_arrays(np.asarray(frequency_step, float), np.asarray(damping_ratio, float))
        matrix = np.zeros((4, 4, *x.shape))  # matrices in the last dimensions: faster
        matrix[2, 1] = matrix[3, 2] = 1
        # The change of this step, in the second row: w - (w h)^2 u - 2 zeta w h times the weighted velocity.
        matrix[1, 0] = -(x**2)
        for place, weight in enumerate(self.velocity, start=1):
            matrix[1, place] = -2 * ratio * x * weight
        matrix[0] = (1 + self.correction) * matrix[1]
        matrix[1, 1] += 1
        for place, part in enumerate((1, 1 - self.correction, self.correction)):
            matrix[0, place] += part
        return np.moveaxis(matrix, (0, 1), (-2, -1))


@dataclass(frozen=True)
class ExactMethod:
    """The method that solves a linear system exactly from one point of its load history to the next.

    Args:
        name: Name in `simulate` and in datasets.
    """

    name: str

    kind: ClassVar[Literal["exact"]] = "exact"
    is_adaptive = False


Method = ExplicitMethod | MultistepMethod | ImplicitMethod | ExactMethod
