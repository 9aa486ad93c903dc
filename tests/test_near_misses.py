"""Near misses of names are answered with what was meant."""

import re

import pytest
from test_bad_input import building, scene

import warpdyn as wd

pytestmark = pytest.mark.fast


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (lambda: wd.LogNormal, "no 'LogNormal' (did you mean 'Lognormal'?)"),
        (lambda: wd.plan(scene(), method="RK4"), "unknown method 'RK4' (did you mean 'rk4'?)"),
        (lambda: building(damping="raleigh"), "unknown damping 'raleigh' (did you mean 'rayleigh'?)"),
        (lambda: scene(recorders=("drifts",)), "'drifts' (did you mean 'drift'?)"),
        (lambda: scene(scatter={"stifness": 1.0}), "'stifness' (did you mean 'stiffness'?)"),
        (lambda: building(damping="none"), "damping 'none' does not take damping_ratio: give damping='rayleigh' or"),
    ],
)
def test_near_misses_are_answered_with_what_was_meant(call, meant):
    with pytest.raises((ValueError, AttributeError), match=re.escape(meant)):
        call()
