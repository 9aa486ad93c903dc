"""What NumPy functions of users' laws compute is recorded as NumPy computes it, or refused for the host to do."""

import warnings

import numpy as np
import pytest

from warpdyn.engine.tracing.arrays import NotTraceableError, Traced, nodes_of, traced

pytestmark = pytest.mark.fast
VALUES = np.array([[0.5, -1.0, 3.0], [2.0, 2.5, -0.3]])
OTHERS = np.array([[1.0, -2.0, 2.0], [0.1, 4.0, -0.4]])
RECORDED = {
    "clip by place": lambda x: np.clip(x, -0.5, 1.0),
    "clip by old names": lambda x: np.clip(x, a_min=-0.5, a_max=1.0),
    "clip by new names": lambda x: np.clip(x, min=-0.5, max=1.0),
    "where": lambda x: np.where(x > 0, x, OTHERS),
    "round": np.round,
    "sum": lambda x: np.sum(x, axis=1),
    "sum of all": np.sum,
    "sum with kept axes": lambda x: np.sum(x, axis=0, keepdims=True),
    "largest": lambda x: np.max(x, axis=0),
    "least": lambda x: x.min(axis=1),
    "running sum": lambda x: np.cumsum(x, axis=1),
    "differences": lambda x: np.diff(x, axis=1, prepend=0.0),
    "sorted": lambda x: np.sort(x, axis=0),
    "sorted row": lambda x: np.sort(x[0]),
    "any along an axis": lambda x: np.where(np.any(x > 2.2, axis=1), 1.0, 0.0),
    "all along an axis": lambda x: np.where((x > -0.5).all(axis=0), 1.0, 0.0),
    "in a list": lambda x: np.where(np.isin(x, [3.0, 2.0]), 1.0, 0.0),
    "stack": lambda x: np.stack([x, x * x], axis=1),
    "exp - 1": lambda x: np.expm1(300.0 * x),
    "truth as numbers": lambda x: (x > 0).astype(np.float64) + 1.0,
    "filled": lambda x: np.full_like(x, 2.0) + x,
}
REFUSED = {
    "decimals": lambda x: np.round(x, 3),
    "second differences": lambda x: np.diff(x, n=2),
    "start of a sum": lambda x: np.sum(x, axis=1, initial=5.0),
    "sum where": lambda x: np.sum(x, where=x > 0),
    "start of a reduction": lambda x: np.maximum.reduce(x, initial=9.0),
    "inverted membership": lambda x: np.isin(x, [3.0], invert=True),
    "fmax": lambda x: np.fmax(x, OTHERS),
    "nanmin": np.nanmin,
    "one argument of where": lambda x: np.where(x > 0),
    "method clip": lambda x: x.clip(0.0, 1.0),
    "method mean": lambda x: x.mean(),
    "float32": lambda x: x.astype(np.float32),
    "truth of numbers": lambda x: x.astype(bool),
    "flattened running sum": np.cumsum,
    "function": np.median,
    "type of zeros": lambda x: np.zeros_like(x, dtype=np.float32),
}


def of_constants(function) -> np.ndarray:
    """Return what a recorded function gives for constants."""
    return np.vectorize(lambda node: node.value)(nodes_of(function(traced(VALUES)))).astype(np.float64)


@pytest.mark.parametrize("case", RECORDED)
def test_recorded_functions_are_those_of_numpy(case):
    function = RECORDED[case]
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        expected = np.asarray(function(VALUES), dtype=np.float64)
        np.testing.assert_allclose(of_constants(function), expected, rtol=1e-12)
    function(Traced.inputs(lambda row, column: f"x[{row}, {column}]", 2, 3))  # and values that vary


@pytest.mark.parametrize("case", REFUSED)
def test_other_functions_and_arguments_are_refused(case):
    with pytest.raises(NotTraceableError):
        REFUSED[case](Traced.inputs(lambda row, column: f"x[{row}, {column}]", 2, 3))
