"""Constants of contact laws: restitution of integrated impacts, closed forms, and refused arguments."""

from __future__ import annotations

import numpy as np
import pytest
from printed_digits import half_unit
from scipy.integrate import quad, solve_ivp

from warpdyn.model.structures.lumped import contact

pytestmark = pytest.mark.fast
FIRST, SECOND = 200e3, 350e3
MASS = FIRST * SECOND / (FIRST + SECOND)
HERTZ, LINEAR = 2.75e9, 93.5e6
# Wanted restitution, law: restitution obtained, peak force, duration at an approach velocity of 1 m/s.
TABLE = {
    (0.4, "muthukumar_desroches_2006"): (0.701635, 7.12602e06, 0.0622496),
    (0.4, "ye_li_zhu_2009"): (0.362872, 7.83107e06, 0.0721599),
    (0.4, "jankowski"): (0.392977, 7.84287e06, 0.0583865),
    (0.4, "tension"): (0.4, 2.7967e06, 0.120737),
    (0.4, "no tension"): (0.472014, 2.7967e06, 0.0989237),
    (0.65, "muthukumar_desroches_2006"): (0.774819, 7.19136e06, 0.061295),
    (0.65, "ye_li_zhu_2009"): (0.63033, 7.13358e06, 0.0634249),
    (0.65, "jankowski"): (0.647029, 5.65269e06, 0.0587748),
    (0.65, "tension"): (0.65, 2.94155e06, 0.116992),
    (0.65, "no tension"): (0.674751, 2.94155e06, 0.106843),
    (0.9, "muthukumar_desroches_2006"): (0.913177, 7.52736e06, 0.0599831),
    (0.9, "ye_li_zhu_2009"): (0.893921, 7.46349e06, 0.0601349),
    (0.9, "jankowski"): (0.899723, 7.00209e06, 0.0592262),
    (0.9, "tension"): (0.9, 3.28367e06, 0.115973),
    (0.9, "no tension"): (0.902026, 3.28367e06, 0.113498),
}


def force_of(law: str, e: float, velocity: float):
    """Return the contact force as a function of penetration and rate, from the constants of the module."""
    if law == "jankowski":
        xi = contact.jankowski_damping_ratio(e)

        def force(d: float, v: float) -> float:
            damping = 2 * xi * np.sqrt(HERTZ * np.sqrt(d) * MASS) * v if v > 0 else 0.0
            return HERTZ * d**1.5 + damping
    elif "tension" in law:
        c = contact.kelvin_voigt_dashpot(e, LINEAR, contact.reduced_mass(FIRST, SECOND))

        def force(d: float, v: float) -> float:
            return LINEAR * d + c * v
    else:
        factor = contact.hertz_damp_factor(e, law)

        def force(d: float, v: float) -> float:
            return HERTZ * d**1.5 * (1 + factor * v / velocity)

    return force


def impact(law: str, e: float, velocity: float = 1.0) -> tuple[float, float, float]:
    """Return restitution, peak force and duration of a free impact."""
    force = force_of(law, e, velocity)

    def rate(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -force(max(y[0], 0.0), y[1]) / MASS]

    def at_end(t: float, y: np.ndarray) -> float:
        return force(max(y[0], 0.0), y[1]) if law == "no tension" and y[1] < 0 else y[0] if t > 1e-4 else 1.0

    at_end.terminal = True  # type: ignore[attr-defined]
    at_end.direction = -1  # type: ignore[attr-defined]

    def at_turn(t: float, y: np.ndarray) -> float:
        return y[1]

    at_turn.terminal = law == "jankowski"  # type: ignore[attr-defined] # its damping jumps there
    options = dict(method="DOP853", rtol=1e-11, atol=1e-13, max_step=2e-3, dense_output=True)
    found = solve_ivp(rate, (0, 1), [0.0, velocity], events=(at_end, at_turn), **options)
    states, end = [found.sol(np.linspace(0, found.t[-1], 40001))], found.t[-1]
    if law == "jankowski":
        start = [found.y[0, -1], -1e-12]
        found = solve_ivp(rate, (end, 1), start, events=(at_end,), **options)
        end = found.t[-1]
    peak = max(force(max(d, 0.0), v) for d, v in states[0].T)
    return -found.y[1, -1] / velocity, peak, end


@pytest.mark.parametrize(("e", "law"), TABLE)
def test_an_impact_has_the_restitution_force_and_duration_of_the_table(e: float, law: str) -> None:
    restitution, force, duration = TABLE[e, law]
    found = impact(law, e)
    assert found[0] == pytest.approx(restitution, rel=0, abs=half_unit(restitution, 6))
    assert found[1] == pytest.approx(force, rel=0, abs=half_unit(force, 6))
    assert found[2] == pytest.approx(duration, rel=0, abs=half_unit(duration, 6))


@pytest.mark.parametrize("e", [0.2, 0.65, 0.95])
def test_the_exact_form_of_hertz_damp_has_the_wanted_restitution(e: float) -> None:
    factor = contact.hertz_damp_factor(e, "exact")
    assert contact.hertz_damp_restitution(factor) == pytest.approx(e, rel=1e-12)
    for velocity in (0.1, 2.0):
        assert impact("exact", e, velocity)[0] == pytest.approx(e, abs=2e-7)


def test_the_restitution_of_hertz_damp_is_that_of_the_table_and_continuous() -> None:
    for (e, law), (restitution, _, _) in TABLE.items():
        if law in contact.HERTZ_DAMP_FORMS:
            found = contact.hertz_damp_restitution(contact.hertz_damp_factor(e, law))
            assert found == pytest.approx(restitution, abs=6e-7)
    assert contact.hertz_damp_restitution(0.0) == 1
    below, above = contact.hertz_damp_restitution(0.99999e-4), contact.hertz_damp_restitution(1.00001e-4)
    assert below - above == pytest.approx(2 / 3 * 2e-9, rel=0.01)
    assert 0 < contact.hertz_damp_restitution(1000.0) < 0.0011
    assert contact.hertz_damp_factor(0.01, "exact") > 50


def test_kelvin_voigt_has_the_reference_constants() -> None:
    ratios = [contact.kelvin_voigt_damping_ratio(e) for e in (0.4, 0.65, 0.9)]
    assert ratios == pytest.approx([0.279998, 0.1358512, 0.03351845], rel=2e-6)
    assert contact.kelvin_voigt_damping_ratio(0.65) == pytest.approx(0.135851233, rel=4e-9)
    dashpot = contact.kelvin_voigt_dashpot(0.65, LINEAR, contact.reduced_mass(FIRST, SECOND))
    assert dashpot == pytest.approx(937275.057, rel=1e-9)


def test_no_law_dissipates_if_the_restitution_is_1() -> None:
    assert contact.kelvin_voigt_damping_ratio(1.0) == 0
    assert contact.jankowski_damping_ratio(1.0) == 0
    assert [contact.hertz_damp_factor(1.0, form) for form in contact.HERTZ_DAMP_FORMS] == [0, 0, 0]
    slopes = contact.bilinear_impact(1.0, HERTZ, 0.02, 0.1)
    assert slopes.first_stiffness == slopes.second_stiffness == pytest.approx(HERTZ * np.sqrt(0.02), rel=1e-14)


def test_hertz_impact_has_the_reference_values() -> None:
    found = contact.hertz_impact(HERTZ, contact.reduced_mass(FIRST, SECOND), 1.0)
    assert found.penetration == pytest.approx(0.02018018, rel=3e-7)
    assert found.duration == pytest.approx(0.05939583, rel=2e-7)
    assert found.force == pytest.approx(7883522, rel=1e-7)
    # x = 1 - y^2 removes the singularity.
    integral = quad(lambda y: 2 * y / np.sqrt(-np.expm1(2.5 * np.log1p(-(y**2)))) if y else 2 / np.sqrt(2.5), 0, 1)[0]
    assert found.duration == pytest.approx(2 * found.penetration * integral, rel=1e-9)
    fast = contact.hertz_impact(HERTZ, MASS, 3.0)
    assert fast.penetration / found.penetration == pytest.approx(3**0.8, rel=1e-12)
    assert fast.duration / found.duration == pytest.approx(3**-0.2, rel=1e-12)


@pytest.mark.parametrize("e", [0.5, 0.65, 0.9])
def test_bilinear_impact_has_the_force_and_the_energy_of_hertz_contact(e: float) -> None:
    deepest, share = 0.02, 0.1
    first, second, bend = contact.bilinear_impact(e, HERTZ, deepest, share)
    force = first * bend + second * (deepest - bend)
    assert force == pytest.approx(HERTZ * deepest**1.5, rel=1e-12)
    # Corners of the loop: origin, bend, deepest point, and where unloading with K1 meets the line K2 d.
    meeting = (force - first * deepest) / (second - first)
    assert meeting == pytest.approx(deepest - bend, rel=1e-12)
    corners = np.array([(0, 0), (bend, first * bend), (deepest, force), (meeting, second * meeting)])
    x, y = corners.T
    area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    assert area == pytest.approx(HERTZ * deepest**2.5 * (1 - e**2) / 2.5, rel=1e-12)
    k_eff, loss = HERTZ * np.sqrt(deepest), HERTZ * deepest**2.5 * (1 - e**2) / 2.5
    assert first == pytest.approx(k_eff + loss / (share * deepest**2), rel=1e-12)


def test_a_heavy_second_mass_is_an_obstacle() -> None:
    assert contact.reduced_mass(1e5, 1e20) == pytest.approx(1e5, rel=1e-14)
    assert contact.reduced_mass(1e5, 3e5) == contact.reduced_mass(3e5, 1e5)


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        (contact.reduced_mass, dict(first_mass=1e5, second_mass=2e5)),
        (contact.kelvin_voigt_dashpot, dict(restitution=0.6, stiffness=1e8, reduced_mass=1e5)),
        (contact.hertz_impact, dict(stiffness=1e9, reduced_mass=1e5, velocity=1.0)),
        (contact.bilinear_impact, dict(restitution=0.6, stiffness=1e9, largest_penetration=0.02, yield_share=0.1)),
    ],
)
def test_quantities_that_must_be_positive_may_not_be_0(function, arguments: dict[str, float]) -> None:
    function(**arguments)
    for name in arguments:
        with pytest.raises(ValueError, match=rf"{name}.* must be a finite number above 0, got 0.0"):
            function(**arguments | {name: 0.0})


WRONG = [
    (lambda: contact.kelvin_voigt_damping_ratio(0.0), "restitution must be a finite number above 0"),
    (lambda: contact.jankowski_damping_ratio(1.1), "restitution is 1.1; it must be above 0 and at most 1"),
    (lambda: contact.hertz_damp_factor(0.5, "hertz"), "unknown form 'hertz'; allowed: 'exact'"),
    (lambda: contact.hertz_damp_factor(0.001, "exact"), "at least 0.01 for form='exact'"),
    (lambda: contact.hertz_damp_restitution(-0.1), "factor"),
    (lambda: contact.hertz_damp_restitution(1e4), "factor is 10000; it must be at most 1000"),
    (lambda: contact.kelvin_voigt_dashpot(0.65, 0.0, 1e5), "stiffness"),
    (lambda: contact.reduced_mass(1e5, -1.0), "second_mass"),
    (lambda: contact.hertz_impact(1e9, 1e5, 0.0), "velocity"),
    (lambda: contact.bilinear_impact(0.65, 1e9, 0.02, 1.0), "yield_share is 1; it must be below 1"),
    (lambda: contact.bilinear_impact(0.1, 1e9, 0.02, 0.7), "second slope would be .* give yield_share= below 0.604"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_invalid_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
