"""`wd.laws.certify` finds faults of the physics: each of these laws fails the checks that are named."""

from typing import Any

import numpy as np
import pytest
import warp as wp

import warpdyn as wd

# Classes whose names begin with an underscore are not registered.


class _Elastic(wd.laws.Law):
    """A correct law, whose functions the others replace."""

    strength: float = wd.laws.parameter("N", "strength", low=0.0, default=1e5)

    @staticmethod
    def derived(p):
        return {"yield_drift": p["strength"] / p["stiffness"]}

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.stiffness * drift

    @wp.func
    def elastic_energy(drift: Any, memory: Any, c: Any):
        return 0.5 * c.stiffness * drift**2


class _Jump(_Elastic):
    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        # Sixteen jumps, which 12 paths meet often enough to count.
        return c.stiffness * drift + c.strength * wp.floor(16.0 * wp.abs(drift) / c.yield_drift) * wp.sign(drift)


class _WrongStiffness(_Elastic):
    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return 2.0 * c.stiffness * drift


class _WrongTangent(_Elastic):
    @wp.func
    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        return 0.5 * c.stiffness


class _WrongEnergy(_Elastic):
    @wp.func
    def elastic_energy(drift: Any, memory: Any, c: Any):
        return -0.5 * c.stiffness * drift**2


class _Source(_Elastic):
    """It unloads above its loading line."""

    memory = ("peak",)

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        peak = max(memory.peak, wp.abs(drift))
        return c.stiffness * drift * (1.0 + 0.1 * (peak - wp.abs(drift)) / c.yield_drift), peak


class _Counting(_Elastic):
    """It softens with every step."""

    memory = ("steps",)

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.stiffness * drift / (1.0 + 1e-4 * memory.steps), memory.steps + 1.0


class _Maxwell(wd.laws.Law):
    memory = ("z",)
    relaxes = True

    @wp.func
    def force(drift: Any, memory: Any, c: Any):
        return 0.5 * c.stiffness * (drift + memory.z)

    @wp.func
    def rate(velocity: Any, memory: Any, c: Any):
        return velocity - 3.0 * memory.z


class _NotANumber(_Elastic):
    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.stiffness * drift * wp.sqrt(1.0 - wp.abs(drift) / (8.0 * c.yield_drift))


FAULTS = {
    _Jump: {"continuity of the force", "stiffness bound"},
    _WrongStiffness: {"initial stiffness", "stiffness bound"},
    _WrongTangent: {"tangent"},
    _WrongEnergy: {"negative elastic energy"},
    _Source: {"passivity"},
    _Counting: {"step independence", "force of a trial step"},
    _Maxwell: {"rate independence"},
    _NotANumber: {"values that are not finite"},
}


@pytest.mark.parametrize("kind", FAULTS, ids=lambda kind: kind.__name__)
def test_faults_are_found(kind):
    report = wd.laws.certify(kind())
    failed = {check.name for check in report.checks if not check.passed}
    assert FAULTS[kind] <= failed, str(report)
    assert not report.passed
    assert f"{len(failed)} of {len(report.checks)} checks failed" in str(report)


def test_a_correct_law_passes_and_is_drawn():
    report = wd.laws.certify(_Elastic())
    assert report.passed, str(report)
    figure = report.figure()
    assert [axes.get_title() for axes in figure.axes] == ["cycles of growing drift", "energies", "convergence of rk4"]
    np.testing.assert_allclose(report.force, 1e7 * report.drift, rtol=1e-12)
    assert "<table>" in report._repr_html_()


def test_a_wider_bound_needs_a_reason():
    class _Excused(_WrongTangent):
        exceptions = {"tangent": (1.0, "the secant is given on purpose")}  # noqa: RUF012

    report = wd.laws.certify(_Excused())
    assert report.passed, str(report)
    assert "yes (the secant is given on purpose)" in str(report)


def test_what_is_not_a_law_is_refused():
    with pytest.raises(TypeError, match="takes a law with its parameters, such as"):
        wd.laws.certify("bilinear")
    with pytest.raises(ValueError, match=r"post_yield_stiffness .*: give certify\(..., stiffness=...\)"):
        wd.laws.certify(wd.laws.LeadRubberBearing(yield_force=1e5, post_yield_stiffness=2e7))
