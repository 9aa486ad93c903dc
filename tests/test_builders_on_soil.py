"""Structures on soil: the reference case, closed forms, an independent integration, and invalid input."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import complex_modes
from lumped_cases import pulse
from scipy.integrate import solve_ivp

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
SETTINGS = {"dtype": "float64", "device": "cpu"}
SOIL = wd.Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
FOOTING = wd.RectangularFooting(10.0, 6.0)
BASE = {"foundation_mass": 150e3, "rocking_inertia": 2.0e6}


def run_of(building, motion, step=0.0005, **changed):
    return wd.simulate(wd.Scene(building, motion), step=step, **SETTINGS, **changed)


def oscillator(damping: str = "stiffness_proportional") -> wd.ShearBuilding:
    """L07 on a fixed base: T = 0.4 s, 5 %, 12 m high."""
    stiffness = 500e3 * (2 * np.pi / 0.4) ** 2
    return wd.ShearBuilding([500e3], [stiffness], 12.0, damping=damping, damping_ratio=0.05)


@pytest.mark.parametrize("damping", ["stiffness_proportional", "mass_proportional", "modal"])
def test_an_oscillator_on_soil_has_the_reference_response(damping):
    building = oscillator(damping)
    springs = wd.foundation_springs(building, FOOTING, SOIL, direction="width")
    assert springs.sway_stiffness == pytest.approx(1.80526547e9, rel=1e-8)
    assert springs.rocking_stiffness == pytest.approx(7.61376826e10, rel=1e-8)
    # The reference divides the dashpots by the frequency of the period with dynamic stiffnesses, 0.456363 s instead of
    # 0.4536515 s.
    assert springs.sway_dashpot == pytest.approx(64783675.5 * 0.4536515 / 0.456363, rel=2e-6)
    assert springs.rocking_dashpot == pytest.approx(207438885 * 0.4536515 / 0.456363, rel=2e-6)
    # Closed form of Pais and Kausel for sliding: density x shear-wave velocity x area at any frequency.
    assert springs.sway_dashpot == pytest.approx(1800 * SOIL.shear_wave_velocity * 240, rel=1e-12)
    peaks = {"u1": 0.06049148, "sway": 0.003024341, "rocking": 0.0009143329}
    run = run_of(wd.structure_on_soil(building, springs, **BASE), pulse(3.0, 0.5, 0.5))
    for dof, value in peaks.items():
        assert run["peak_displacement"].sel(dof=dof).item() == pytest.approx(value, rel=2e-3)  # of the dashpots
    given = wd.FoundationSprings(1.80526547e9, 7.61376826e10, 64783675.5, 207438885.0)
    on_soil = wd.structure_on_soil(building, given, **BASE)
    matrices = on_soil.central_matrices(on_soil.parameters)
    size, ratio = complex_modes(matrices["mass"], matrices["damping"], matrices["stiffness"])
    assert 2 * np.pi / size[0] == pytest.approx(0.4549389, rel=2e-7)
    assert ratio[0] == pytest.approx(0.04860312, rel=2e-7)
    assert (size[1], ratio[1]) == pytest.approx((216.3332, 0.3713189), rel=3e-7)
    run = run_of(on_soil, pulse(3.0, 0.5, 0.5))
    assert run["peak_spring_deformation"].sel(spring="storey 1").item() == pytest.approx(0.04667903, rel=1e-5)
    assert run["peak_spring_deformation"].sel(spring="sway").item() == pytest.approx(0.003024341, rel=1e-5)
    for dof, value in peaks.items():
        assert run["peak_displacement"].sel(dof=dof).item() == pytest.approx(value, rel=1e-5)
    assert run["peak_acceleration"].sel(dof="u1").item() == pytest.approx(11.55761, rel=2e-5)


@pytest.mark.meant_as_given("foundation_mass_over_building", "rocking_inertia_over_masses")
def test_the_period_is_that_of_a_massless_foundation():
    # T~ / T = sqrt(1 + k / K_x + k h^2 / K_r), exact without mass of the foundation.
    springs = wd.FoundationSprings(1.5e9, 5e10)
    k = 500e3 * (2 * np.pi / 0.4) ** 2
    due = 0.4 * np.sqrt(1 + k / 1.5e9 + k * 144 / 5e10)
    found = wd.structure_on_soil(oscillator(), springs, foundation_mass=0.05, rocking_inertia=0.5)
    assert found.fundamental_period == pytest.approx(due, rel=1e-6)


def three_storeys(**changed) -> wd.ShearBuilding:
    given = {"law": "bilinear", "yield_force": [9e5, 7e5, 5e5], "hardening_ratio": 0.05}
    given |= {"damping": "rayleigh", "damping_ratio": 0.03} | changed
    return wd.ShearBuilding([2e5, 2e5, 1.5e5], [1.2e8, 1e8, 7e7], [4.0, 3.5, 3.5], **given)


def test_stiff_soil_is_a_fixed_base():
    building, motion = three_storeys(gravity_load=[2e6, 2e6, 1.5e6]), pulse(6.0, 0.5, 0.4, 4.0)
    springs = wd.FoundationSprings(1e14, 1e17)
    on_soil = wd.structure_on_soil(building, springs, foundation_mass=1e6, rocking_inertia=1e9)
    fixed = run_of(building, motion, 0.001)
    np.testing.assert_allclose(on_soil.modal()["period"][:3], building.modal()["period"], rtol=1e-5)
    run = run_of(on_soil, motion, 2e-5)
    springs = [f"storey {storey}" for storey in (1, 2, 3)]
    found = run["peak_spring_deformation"].sel(spring=springs)[0]
    np.testing.assert_allclose(found, fixed["peak_storey_drift"][0], rtol=1e-3)
    assert (fixed["peak_storey_drift"][0] > 2 * np.array([9e5 / 1.2e8, 7e5 / 1e8, 5e5 / 7e7])).any()


def test_a_chain_is_the_same_as_a_lumped_structure():
    motion = pulse(6.0, 0.5, 0.4, 4.0)
    cases = [
        three_storeys(gravity_load=[2e6, 2e6, 1.5e6]),
        wd.ShearBuilding([2e5, 1e5], [1e8, 7e7], 3.0, damping="storey", damping_coefficient=[1e6, 2e6]),
        wd.ShearBuilding(
            [2e5, 1e5], [1e8, 7e7], 3.0, law=["elastic", wd.laws.Bilinear(yield_force=5e5, hardening_ratio=0.02)]
        ),
    ]
    for building in cases:
        chain, lumped = run_of(building, motion, 0.001), run_of(wd.lumped_chain(building), motion, 0.001)
        np.testing.assert_allclose(lumped["peak_spring_deformation"][0], chain["peak_storey_drift"][0], rtol=1e-9)
        np.testing.assert_allclose(lumped["peak_acceleration"][0], chain["peak_floor_acceleration"][0], rtol=1e-9)
    capacities = wd.ShearBuilding([1e5] * 2, 1e8, 3.0, drift_capacity=0.05, drift_ratio_capacity=[0.01, 0.02])
    found = wd.lumped_chain(capacities).parameters["deformation_capacity"]
    np.testing.assert_allclose(found, [0.03, 0.05])


def test_a_yielding_building_on_soil_has_the_response_of_an_independent_integration():
    # SciPy integrates the sway, the rocking and the deformations relative to the base, with own matrices.
    building, motion = three_storeys(), pulse(7.0, 0.6, 0.4, 3.0)
    springs = wd.FoundationSprings(9e8, 3e10, sway_dashpot=2e7, rocking_dashpot=3e8)
    on_soil = wd.structure_on_soil(building, springs, **BASE)
    mass, heights = np.array([2e5, 2e5, 1.5e5]), np.array([4.0, 7.5, 11.0])
    k, yields, hardening = np.array([1.2e8, 1e8, 7e7]), np.array([9e5, 7e5, 5e5]), 0.05
    rows = np.eye(3) - np.eye(3, k=-1)
    elastic = rows.T @ np.diag(k) @ rows
    omega = np.sqrt(np.linalg.eigvals(np.diag(1 / mass) @ elastic))
    first, second = np.sort(omega.real)[:2]
    a1 = 2 * 0.03 / (first + second)
    damping = a1 * first * second * np.diag(mass) + a1 * elastic
    whole = np.zeros((5, 5))
    whole[:3, :3] = np.diag(mass)
    whole[:3, 3] = whole[3, :3] = mass
    whole[:3, 4] = whole[4, :3] = mass * heights
    whole[3, 3], whole[3, 4] = mass.sum() + 150e3, mass @ heights
    whole[4, 3], whole[4, 4] = mass @ heights, mass @ heights**2 + 2e6
    load, inverse = whole[:, 3], np.linalg.inv(whole)
    time = 0.01 * np.arange(motion.acceleration.size)

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        q, v, plastic = state[:5], state[5:10], state[10:]
        drift, speed = rows @ q[:3], rows @ v[:3]
        limit = yields / k
        stretch = np.clip(drift - plastic, -limit, limit)
        flows = (np.abs(drift - plastic) >= limit) & (stretch * speed > 0)
        force = hardening * k * drift + (1 - hardening) * k * stretch
        resisting = np.concatenate(
            [rows.T @ force + damping @ v[:3], [9e8 * q[3] + 2e7 * v[3], 3e10 * q[4] + 3e8 * v[4]]]
        )
        ground = np.interp(t, time, motion.acceleration)
        return np.concatenate([v, inverse @ (-resisting - load * ground), np.where(flows, speed, 0.0)])

    found = solve_ivp(rate, (0, 3), np.zeros(13), "RK45", rtol=1e-7, atol=1e-11, max_step=5e-4, dense_output=True)
    states = found.sol(np.linspace(0, 3, 12001))
    run = run_of(on_soil, motion, 0.00025)
    drifts = np.abs(rows @ states[:3]).max(axis=1)
    assert (drifts > 2 * yields / k).any()
    np.testing.assert_allclose(run["peak_spring_deformation"][0, :3], drifts, rtol=5e-4)
    base = np.abs(states[3:5]).max(axis=1)
    np.testing.assert_allclose(run["peak_displacement"][0, 3:], base, rtol=5e-4)


@pytest.mark.meant_as_given("period_on_soil", "rocking_inertia_over_masses")
def test_rocking_increases_the_effect_of_gravity():
    # A rigid building that rocks: the weight times its height is lost of the rocking stiffness.
    building = wd.ShearBuilding([1e5, 1e5], 1e13, [5.0, 5.0], gravity_load=[1e6, 1e6])
    springs = wd.FoundationSprings(1e15, 1e8)
    on_soil = wd.structure_on_soil(building, springs, foundation_mass=1e5, rocking_inertia=1e6)
    rigid = np.sqrt((1e8 - 1e6 * 5 - 1e6 * 10) / (1e6 + 1e5 * 25 + 1e5 * 100))
    assert 2 * np.pi / on_soil.fundamental_period == pytest.approx(rigid, rel=1e-5)


def test_a_tower_on_soil_has_its_drifts_relative_to_the_base():
    tower = wd.FlexuralShearBuilding([3e5] * 6, 3.5, period=0.8, alpha0=3.0, damping="modal", damping_ratio=0.05)
    springs = wd.foundation_springs(tower, FOOTING, SOIL, direction="length", soil_damping_ratio=0.02)
    bare = wd.foundation_springs(tower, FOOTING, SOIL, direction="length")
    assert springs.rocking_stiffness == bare.rocking_stiffness
    assert springs.rocking_dashpot > bare.rocking_dashpot
    on_soil = wd.structure_on_soil(tower, springs, **BASE)
    run = run_of(on_soil, pulse(2.0, 0.8, 0.5, 4.0), 0.001)
    for storey in (1, 6):
        drift = run["peak_output"].sel(output=f"drift {storey}").item()
        assert drift == pytest.approx(run["peak_spring_deformation"].sel(spring=f"frame {storey}").item(), rel=1e-4)


def test_embedded_footings_need_a_rocking_dashpot():
    embedded = wd.RectangularFooting(10.0, 6.0, embedment=2.0)
    with pytest.raises(ValueError, match=r"rocking_dashpot is missing.*give rocking_dashpot= in N m s, such as 0\.0"):
        wd.foundation_springs(oscillator(), embedded, SOIL)
    found = wd.foundation_springs(oscillator(), embedded, SOIL, rocking_dashpot=2e8)
    assert found.rocking_dashpot == 2e8
    assert found.sway_stiffness > 1.3 * 1.80526547e9


ALONE = wd.LumpedStructure({"a": 1e5}, [wd.Spring("k", {"a": 1.0}, stiffness=1e7)])
SPRINGS = wd.FoundationSprings(1e9, 1e11)
TWO = wd.LumpedStructure(
    {"x": 1e5, "y": 1e5},
    [wd.Spring(name, {name: 1.0}, stiffness=1e7) for name in "xy"],
    influence=[{"x": 1.0}, {"y": 1.0}],
)
WRONG = [
    (lambda: wd.structure_on_soil(ALONE, SPRINGS, **BASE), r"floor_heights is missing.*floor_heights=\{'a': 3.5\}"),
    (lambda: wd.structure_on_soil(ALONE, SPRINGS, **BASE, floor_heights={"b": 3.0}), "height in m of each of 'a'"),
    (lambda: wd.structure_on_soil(ALONE, SPRINGS, **BASE, floor_heights={"a": -3.0}), r"floor_heights\['a'\]"),
    (lambda: wd.structure_on_soil(TWO, SPRINGS, **BASE), "2 components of base motion; give one"),
    (
        lambda: wd.structure_on_soil(oscillator(), SPRINGS, foundation_mass=0.0, rocking_inertia=1.0),
        r"foundation_mass \[kg\] must be a finite number above 0",
    ),
    (
        lambda: wd.foundation_springs(oscillator(), FOOTING, SOIL, soil_damping_ratio=5.0),
        "soil_damping_ratio is 5, but must be below 1: .*soil_damping_ratio=0.05",
    ),
    (lambda: wd.FoundationSprings(0.0, 1e9), r"sway_stiffness \[N/m\] must be a finite number above 0"),
    (lambda: wd.FoundationSprings(1e9, 1e9, -1.0), r"sway_dashpot \[N s/m\]"),
    (lambda: wd.foundation_springs(oscillator(), FOOTING, SOIL, direction="x"), "unknown direction 'x'; allowed"),
    (lambda: wd.Soil(0.3, 1800.0), "neither shear_modulus nor shear_wave_velocity is given"),
    (
        lambda: wd.lumped_chain(three_storeys(damping="rayleigh_tangent")),
        "a lumped structure cannot have damping='rayleigh_tangent': give the building damping='rayleigh'",
    ),
    (
        lambda: wd.lumped_chain(three_storeys(devices=("friction_damper",), slip_force=1e5, brace_stiffness=1e8)),
        r"the building has devices \(friction_damper\)",
    ),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_wrong_arguments_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_other_classes_are_refused():
    with pytest.raises(TypeError, match=r"takes a RectangularFooting, got Soil"):
        wd.foundation_springs(oscillator(), SOIL, SOIL)
    with pytest.raises(TypeError, match=r"takes FoundationSprings, got dict; call wd.foundation_springs"):
        wd.structure_on_soil(oscillator(), {}, **BASE)
    with pytest.raises(TypeError, match="takes a ShearBuilding, got LumpedStructure"):
        wd.lumped_chain(ALONE)
