"""Methods as checked data: tableaus that are wrong are refused, and the rows of the table are what they are called."""

import numpy as np
import pytest

from warpdyn.methods import METHODS, ExplicitMethod

RK4 = {
    "name": "mine",
    "order": 4,
    "a": ((0, 0, 0, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 1, 0)),
    "b": (1 / 6, 1 / 3, 1 / 3, 1 / 6),
    "c": (0, 0.5, 0.5, 1),
}
KUTTA_THIRD = {"order": 3, "a": ((0, 0, 0), (0.5, 0, 0), (-1, 2, 0)), "b": (1 / 6, 2 / 3, 1 / 6), "c": (0, 0.5, 1)}
HEUN_THIRD = {"order": 3, "a": ((0, 0, 0), (1 / 3, 0, 0), (0, 2 / 3, 0)), "b": (0.25, 0, 0.75), "c": (0, 1 / 3, 2 / 3)}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"b": (1 / 6, 1 / 3, 1 / 3)}, "stages"),
        ({"c": (0, 0.5, 0.5)}, "stages"),
        ({"a": ((0, 0, 0), (0.5, 0, 0), (0, 0.5, 0))}, "stages"),
        ({"a": ((0, 0, 0, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 0.5, 0.5))}, "explicit"),
        ({"a": ((0, 0.1, -0.1, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 1, 0))}, "explicit"),
        ({"c": (0, 0.5, 0.6, 1)}, "rows of a must sum to c"),
        ({"b": (1 / 6, 1 / 3, 1 / 3, 1 / 5)}, "b to 1"),
        ({"b": (0.25, 0.25, 0.25, 0.25)}, "not of order 4"),
        ({"order": 5}, "not of order 5"),
        (KUTTA_THIRD, "just below its diagonal"),  # a sound method, but the kernels keep no earlier slopes
    ],
)
def test_a_wrong_tableau_is_refused(change, told):
    with pytest.raises(ValueError, match=f"method 'mine': .*{told}"):
        ExplicitMethod(**(RK4 | change))


@pytest.mark.parametrize(
    "tableau",
    [
        RK4,
        HEUN_THIRD,
        {"order": 1, "a": ((0,),), "b": (1,), "c": (0,)},
        {"order": 2, "a": ((0, 0), (0.5, 0)), "b": (0, 1), "c": (0, 0.5)},
    ],
)
def test_a_sound_tableau_is_accepted(tableau):
    method = ExplicitMethod(**(RK4 | tableau))
    assert method.stages == len(method.b)


def test_stability_polynomial_of_rk4():
    # R(z) of a four-stage method of order four is exp(z) cut after z^4, whatever its tableau (Hairer and Wanner, IV.2).
    np.testing.assert_allclose(METHODS["rk4"].stability_polynomial, [1, 1, 1 / 2, 1 / 6, 1 / 24], rtol=1e-15)


@pytest.mark.parametrize("name", METHODS)
def test_stability_polynomial_is_the_growth_of_a_step(name):
    # One step of y' = lambda y, stage by stage, is not how the polynomial was found.
    method = METHODS[name]
    assert method.name == name
    for z in (0.3, -1.7, 0.2 + 2.4j):
        slopes = []
        for row in method.a:
            slopes.append(z * (1 + sum(a * k for a, k in zip(row, slopes, strict=False))))
        growth = 1 + sum(b * k for b, k in zip(method.b, slopes, strict=True))
        assert growth == pytest.approx(np.polyval(method.stability_polynomial[::-1], z), rel=1e-14)


@pytest.mark.parametrize("name", METHODS)
def test_order(name):
    # The error of a run of y' = cos(t) y, whose solution is exp(sin t), falls with the power `order` of the step.
    # Unlike the polynomial, it sees the nodes c and a load that varies in time.
    method = METHODS[name]

    def error(steps):
        y, h = 1.0, 2.0 / steps
        for step in range(steps):
            slopes = []
            for row, c in zip(method.a, method.c, strict=True):
                stage = y + h * sum(a * k for a, k in zip(row, slopes, strict=False))
                slopes.append(np.cos((step + c) * h) * stage)
            y += h * np.dot(method.b, slopes)
        return abs(y - np.exp(np.sin(2.0)))

    # The next term of the error is a step's power smaller: 10 % of an order at these steps.
    assert np.log2(error(40) / error(80)) == pytest.approx(method.order, abs=0.1)
