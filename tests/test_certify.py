"""`wd.laws.certify` finds faults of the physics: each of these laws fails the checks that are named."""

from typing import Any

import numpy as np
import pytest
import warp as wp

import warpdyn as wd
from warpdyn.campaigns.integration import stability_guard
from warpdyn.campaigns.running.certification.exceptions import CHECKS

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


class _Yielding(wd.laws.Law):
    """A correct bilinear law, linear until it yields."""

    yield_force: float = wd.laws.shared(wd.laws.YIELD_FORCE, default=1e5)
    yield_force_negative: float = wd.laws.parameter("N", "yield force, negative side", low=0.0, default=5e4)

    memory = ("plastic",)
    is_linear_until_yield = True

    @staticmethod
    def derived(p):
        return {"above": p["yield_force"] / p["stiffness"], "below": p["yield_force_negative"] / p["stiffness"]}

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        plastic = wp.clamp(memory.plastic, drift - c.above, drift + c.below)
        return c.stiffness * (0.1 * drift + 0.9 * (drift - plastic)), plastic

    @wp.func
    def elastic_energy(drift: Any, memory: Any, c: Any):
        return 0.5 * c.stiffness * (0.1 * drift**2 + 0.9 * (drift - memory.plastic) ** 2)


class _Curved(_Yielding):
    """It softens by 1e-4 before it yields."""

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        plastic = wp.clamp(memory.plastic, drift - c.above, drift + c.below)
        softer = 1.0 - 1e-4 * wp.abs(drift - plastic) / c.above
        return c.stiffness * (0.1 * drift + 0.9 * softer * (drift - plastic)), plastic


class _SofterThanDeclared(_Yielding):
    """It yields on the negative side at 0.9 times the declared force."""

    @staticmethod
    def derived(p):
        return {"above": p["yield_force"] / p["stiffness"], "below": 0.9 * p["yield_force_negative"] / p["stiffness"]}


class _AlwaysLinear(_Yielding):
    is_linear = True


class _NotANumberWithException(_Elastic):
    """Its elastic energy is NaN, and an exception gives a reason for another bound."""

    exceptions = {"negative elastic energy": (1.0, "a reason"), "dissipation": (1.0, "a reason")}  # noqa: RUF012

    @wp.func
    def elastic_energy(drift: Any, memory: Any, c: Any):
        return c.stiffness * drift * wp.sqrt(-1.0 - drift**2)


FAULTS = {
    _Curved: {"linearity"},
    _SofterThanDeclared: {"linearity"},
    _AlwaysLinear: {"linearity"},
    _NotANumberWithException: {"values that are not finite", "negative elastic energy", "dissipation"},
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
def test_faults_are_found(kind, monkeypatch):
    monkeypatch.setattr(stability_guard, "MOST_RERUNS", 1)  # shorter steps do not make a number of NaN
    report = wd.laws.certify(kind())
    failed = {check.name for check in report.checks if not check.passed}
    assert FAULTS[kind] <= failed, str(report)
    assert not report.passed
    assert f"{len(failed)} of {len(report.checks)} checks failed" in str(report)


def test_a_law_that_is_linear_until_it_yields_passes():
    for law in (_Yielding(), _Yielding(yield_force=[1e5, 2e5], yield_force_negative=[3e5, 1e5])):
        report = wd.laws.certify(law)
        assert report.passed, str(report)
        [linearity] = [check for check in report.checks if check.name == "linearity"]
        assert linearity.measured < 1e-12  # some roundings of float64, 2.2e-16 each


@pytest.mark.parametrize(
    ("exceptions", "message"),
    [
        ({"tangnt": (1.0, "a reason")}, "'tangnt' is not a check of certify .did you mean 'tangent'"),
        ({"tangent": (np.nan, "a reason")}, "'tangent' is .nan, 'a reason'.; give a finite bound and a reason"),
        ({"tangent": (np.inf, "a reason")}, "'tangent' is .inf, 'a reason'.; give a finite bound and a reason"),
        (
            {"tangent": (1.0, " ")},
            "'tangent' is .1.0, ' '.; give a finite bound and a reason, such as exceptions = .'tangent': ",
        ),
        ({"tangent": 1.0}, "'tangent' is 1.0; give a finite bound and a reason"),
    ],
)
def test_exceptions_need_a_check_a_bound_and_a_reason(exceptions, message):
    law = type("_Excused", (_WrongTangent,), {"exceptions": exceptions})
    with pytest.raises(ValueError, match=f"exceptions of _Excused: {message}"):
        wd.laws.certify(law())


def test_every_check_has_a_name_in_the_list_of_checks():
    laws = (_Yielding(), _Maxwell(), wd.laws.Takeda(yield_force=1e5, hardening_ratio=0.05))
    found = {check.name for law in laws for check in wd.laws.certify(law).checks}
    assert found == set(CHECKS)


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
    with pytest.raises(TypeError, match=r"takes a storey law with its parameters, got .*give an object such as"):
        wd.laws.certify("bilinear")
    with pytest.raises(ValueError, match=r"post_yield_stiffness .*: give certify\(..., stiffness=...\)"):
        wd.laws.certify(wd.laws.LeadRubberBearing(yield_force=1e5, post_yield_stiffness=2e7))
