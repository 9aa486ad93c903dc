"""Springs and dashpots of foundations: reference values, limits, cone models, and structures on soil."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import complex_modes, peak, pulse, response

from warpdyn.model.structures.lumped.foundations import cones, gazetas, pais_kausel as pk, period_on_soil as ps
from warpdyn.model.structures.lumped.foundations.footing import MODES, RectangularFooting, Soil

pytestmark = pytest.mark.fast
SOIL = Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
SURFACE = RectangularFooting(10.0, 6.0)
EMBEDDED = RectangularFooting(10.0, 6.0, embedment=2.0, contact_height=1.5)
# Gazetas at the surface, its embedment factor; Pais and Kausel at the surface, embedment factor, alpha and beta at 0.5.
TABLE = {
    "z": (2.190605e09, 1.139898, 2.269752e09, 1.166097, 0.9637209, 0.3806637),
    "y": (1.754887e09, 1.383418, 1.805265e09, 1.34569, 1, 0.2215741),
    "x": (1.674887e09, 1.450707, 1.72769e09, 1.34569, 1, 0.2315231),
    "rx": (7.421932e10, 1.379612, 8.152615e10, 1.421488, 0.9455682, 0.01370972),
    "ry": (1.68602e11, 1.613624, 1.725343e11, 1.355374, 0.8806838, 0.04225338),
    "t": (1.70497e11, 1.643271, 1.634391e11, 1.77831, 0.9156751, None),
}


@pytest.mark.parametrize("mode", MODES)
def test_a_footing_has_the_values_of_the_table(mode: str) -> None:
    surface, factor, pk_surface, pk_factor, alpha, beta = TABLE[mode]
    assert gazetas.gazetas_stiffness(SURFACE, SOIL)[mode] == pytest.approx(surface, rel=3e-7)
    factors = gazetas.gazetas_embedment_factors(EMBEDDED, rocking_form="contact_over_width")
    assert factors[mode] == pytest.approx(factor, rel=5e-7)
    assert pk.pais_kausel_stiffness(SURFACE, SOIL)[mode] == pytest.approx(pk_surface, rel=3e-7)
    assert pk.pais_kausel_embedment_factors(EMBEDDED)[mode] == pytest.approx(pk_factor, rel=5e-7)
    assert pk.pais_kausel_stiffness(EMBEDDED, SOIL)[mode] == pytest.approx(pk_surface * pk_factor, rel=8e-7)
    assert pk.pais_kausel_stiffness_modifiers(SURFACE, 0.5)[mode] == pytest.approx(alpha, rel=1e-7)
    if beta is not None:
        assert pk.pais_kausel_radiation_damping(SURFACE, SOIL, 0.5)[mode] == pytest.approx(beta, rel=3e-7)


def test_a_square_footing_has_the_closed_forms_of_gazetas() -> None:
    b, nu, g = 3.0, 0.35, 40e6
    stiffness = gazetas.gazetas_stiffness(RectangularFooting(b, b), SOIL)
    assert stiffness["z"] == pytest.approx(4.54 * g * b / (1 - nu), rel=1e-12)
    assert stiffness["y"] == pytest.approx(9 * g * b / (2 - nu), rel=1e-12)
    assert stiffness["x"] == stiffness["y"]
    # 3.6 and 8.3 are rounded: (4 / 3)^0.75 times 2.9 or 3, and (8 / 3)^0.75 times 4
    assert stiffness["rx"] == pytest.approx(3.6 * g * b**3 / (1 - nu), rel=1e-3)
    assert stiffness["ry"] == pytest.approx(3 * (4 / 3) ** 0.75 * g * b**3 / (1 - nu), rel=1e-12)
    assert stiffness["t"] == pytest.approx(8.3 * g * b**3, rel=7e-3)


def test_a_square_footing_of_pais_and_kausel_is_the_same_in_both_directions() -> None:
    square = RectangularFooting(3.0, 3.0, embedment=1.0)
    for values in (
        pk.pais_kausel_stiffness(square, SOIL),
        pk.pais_kausel_embedment_factors(square),
        pk.pais_kausel_radiation_damping(square, SOIL, 0.7),
    ):
        assert values["x"] == pytest.approx(values["y"], rel=1e-12)
    stiffness = pk.pais_kausel_stiffness(RectangularFooting(3.0, 3.0), SOIL)
    assert stiffness["rx"] == pytest.approx(stiffness["ry"], rel=1e-12)
    assert stiffness["z"] == pytest.approx(4.7 * 40e6 * 3 / 0.65, rel=1e-12)
    assert stiffness["y"] == pytest.approx(9.2 * 40e6 * 3 / 1.65, rel=1e-12)
    assert stiffness["rx"] == pytest.approx(4.0 * 40e6 * 27 / 0.65, rel=1e-12)
    modifiers = pk.pais_kausel_stiffness_modifiers(square, [0.2, 1.0])
    assert modifiers["rx"] == pytest.approx(modifiers["ry"], rel=1e-12)


@pytest.mark.parametrize("footing", [SURFACE, RectangularFooting(4.0, 4.0), RectangularFooting(12.0, 3.0)])
def test_both_sets_of_formulas_give_similar_stiffnesses(footing: RectangularFooting) -> None:
    first, second = gazetas.gazetas_stiffness(footing, SOIL), pk.pais_kausel_stiffness(footing, SOIL)
    for mode in MODES:
        assert first[mode] == pytest.approx(second[mode], rel=0.13), mode


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.35, 0.45, 0.5])
@pytest.mark.parametrize("footing", [SURFACE, RectangularFooting(4.0, 4.0), EMBEDDED])
def test_dashpots_approach_those_of_plane_waves_at_high_frequency(footing: RectangularFooting, nu: float) -> None:
    soil = Soil(poisson_ratio=nu, density=1800.0, shear_wave_velocity=150.0)
    psi = min(np.sqrt(2 * (1 - nu) / (1 - 2 * nu)), 2.5) if nu < 0.5 else 2.5
    _, dashpots = pk.pais_kausel_impedance(footing, soil, 1e7)
    length, b, depth, shear = footing.half_length, footing.half_width, footing.embedment, 1800.0 * 150.0
    ends, sides = 4 * b * depth, 4 * length * depth  # walls normal to x and to y
    expected = {
        "z": shear * (psi * footing.area + ends + sides),
        "y": shear * (footing.area + ends + psi * sides),
        "x": shear * (footing.area + psi * ends + sides),
        "rx": shear * psi * footing.inertia_x,
        "ry": shear * psi * footing.inertia_y,
    }
    assert set(dashpots) == ({"z", "y", "x"} if depth else set(expected))
    for mode, value in dashpots.items():
        assert value == pytest.approx(expected[mode], rel=1e-6), mode


def test_impedance_has_the_static_limit_and_the_damping_ratio() -> None:
    springs, dashpots = pk.pais_kausel_impedance(EMBEDDED, SOIL, 1e-6)
    for mode, value in pk.pais_kausel_stiffness(EMBEDDED, SOIL).items():
        assert springs[mode] == pytest.approx(value, rel=1e-12)
    omega = np.array([5.0, 20.0])
    springs, dashpots = pk.pais_kausel_impedance(SURFACE, SOIL, omega)
    ratios = pk.pais_kausel_radiation_damping(SURFACE, SOIL, omega * 6.0 / SOIL.shear_wave_velocity)
    for mode, value in dashpots.items():
        assert omega * value / (2 * springs[mode]) == pytest.approx(ratios[mode], rel=1e-12)
    # Rocking radiates little at low frequency.
    slow = pk.pais_kausel_radiation_damping(SURFACE, SOIL, 1e-3)
    assert slow["rx"] < 1e-6 * slow["y"]


def test_embedment_factors_are_1_at_the_surface_and_forms_of_rocking_differ() -> None:
    for factors in (
        pk.pais_kausel_embedment_factors(SURFACE),
        gazetas.gazetas_embedment_factors(SURFACE, rocking_form="contact_over_width"),
        gazetas.gazetas_embedment_factors(SURFACE, rocking_form="mylonakis_2006"),
    ):
        assert factors == dict.fromkeys(MODES, 1.0)
    first, second = (gazetas.gazetas_embedment_factors(EMBEDDED, rocking_form=form) for form in gazetas.ROCKING_FORMS)
    # 1 + 0.92 0.25^0.6 (1.5 + 0.75^1.9 0.6^-0.6)
    assert second["ry"] == pytest.approx(1 + 0.92 * 0.25**0.6 * (1.5 + 0.75**1.9 * 0.6**-0.6), rel=1e-12)
    assert second["ry"] / first["ry"] > 1.15
    long = RectangularFooting(12.0, 3.0, embedment=3.0)
    of_long = [gazetas.gazetas_embedment_factors(long, rocking_form=form)["ry"] for form in gazetas.ROCKING_FORMS]
    assert of_long[1] / of_long[0] == pytest.approx(1.8, abs=0.05)
    assert {mode: value for mode, value in first.items() if mode != "ry"} == {
        mode: value for mode, value in second.items() if mode != "ry"
    }
    without_contact = RectangularFooting(10.0, 6.0, embedment=2.0, contact_height=0.0)
    factors = gazetas.gazetas_embedment_factors(without_contact, rocking_form="mylonakis_2006")
    assert factors["rx"] == factors["ry"] == factors["t"] == 1
    assert factors["y"] == pytest.approx(1 + 0.15 * np.sqrt(1 / 3), rel=1e-12)


def test_charts_of_gazetas_are_reproduced_at_their_points() -> None:
    a0 = np.array([0.444, 0.889, 1.333, 2.0])
    va, vs = SOIL.lysmer_velocity, SOIL.shear_wave_velocity
    assert va == pytest.approx(3.4 * vs / (np.pi * 0.65), rel=1e-12)
    for row, aspect in enumerate((1, 2, 4)):
        footing = RectangularFooting(3.0 * aspect, 3.0)
        polar = footing.inertia_x + footing.inertia_y
        modifiers = gazetas.gazetas_stiffness_modifiers(footing, SOIL, a0)
        for mode, chart in gazetas.STIFFNESS_CHARTS.items():
            assert modifiers[mode] == pytest.approx(chart[row], rel=1e-12)
        dashpots = gazetas.gazetas_radiation_dashpots(footing, SOIL, a0)
        scale = {"z": va * footing.area, "y": vs * footing.area, "t": vs * polar}
        scale |= {"rx": va * footing.inertia_x, "ry": va * footing.inertia_y}
        for mode, chart in gazetas.DAMPING_CHARTS.items():
            assert dashpots[mode] == pytest.approx(1800 * scale[mode] * np.array(chart[row]), rel=1e-12)
        assert dashpots["x"] == pytest.approx(np.full(4, 1800 * vs * footing.area), rel=1e-12)
    # Half-way between L / B = 2 and 4.
    last = gazetas.gazetas_stiffness_modifiers(RectangularFooting(9.0, 3.0), SOIL, 2.0)
    assert last["z"] == pytest.approx((0.642 + 0.699) / 2, rel=1e-12)
    dashpots = gazetas.gazetas_radiation_dashpots(RectangularFooting(9.0, 3.0), SOIL, 2.0)
    assert dashpots["y"] == pytest.approx((0.860 + 0.922) / 2 * 1800 * vs * 108, rel=1e-12)
    assert dashpots["ry"] == pytest.approx((0.839 + 0.980) / 2 * 1800 * va * 4 * 3 * 9**3 / 3, rel=1e-12)


def test_all_values_of_the_charts_of_gazetas() -> None:
    charts = {
        "k_z": "0.989 0.922 0.815 0.600 1.007 0.965 0.866 0.642 1.032 1.023 0.935 0.699",
        "k_y": "1.035 0.987 0.935 0.889 1.087 1.090 1.083 1.092 1.165 1.248 1.280 1.263",
        "c_z": "0.933 0.948 0.963 1.001 0.985 0.999 1.011 1.037 1.095 1.080 1.061 1.061",
        "c_y": "0.795 0.770 0.759 0.812 0.996 0.963 0.895 0.860 1.164 1.038 0.961 0.922",
        "c_rx": "0.107 0.262 0.384 0.507 0.153 0.324 0.432 0.552 0.192 0.358 0.458 0.581",
        "c_ry": "0.108 0.269 0.411 0.549 0.288 0.533 0.688 0.839 0.702 0.818 0.882 0.980",
        "c_t": "0.094 0.256 0.440 0.717 0.260 0.541 0.719 0.887 0.650 0.919 0.965 0.971",
    }
    for name, text in charts.items():
        table = gazetas.STIFFNESS_CHARTS if name[0] == "k" else gazetas.DAMPING_CHARTS
        assert np.ravel(table[name[2:]]).tolist() == [float(word) for word in text.split()], name


def test_modifiers_of_gazetas_have_the_formulas_and_the_static_limit() -> None:
    for value in gazetas.gazetas_stiffness_modifiers(SURFACE, SOIL, 0.0).values():
        assert value == 1
    found = gazetas.gazetas_stiffness_modifiers(SURFACE, SOIL, 1.0)
    assert [float(found[mode]) for mode in ("rx", "ry", "t", "x")] == pytest.approx([0.8, 0.7, 0.86, 1.0], rel=1e-12)
    clay = Soil(poisson_ratio=0.48, density=1800.0, shear_wave_velocity=150.0)
    of_clay = gazetas.gazetas_stiffness_modifiers(SURFACE, clay, 1.0)
    assert of_clay["ry"] == pytest.approx(1 - 0.25 * (10 / 6) ** 0.3, rel=1e-12)
    assert "z" not in of_clay
    assert "z" not in gazetas.gazetas_radiation_dashpots(SURFACE, clay, 1.0)
    for nu, slope, has_z in ((0.4, 0.3, True), (0.4001, 0.3, False), (0.4499, 0.3, False), (0.45, 0.2914, False)):
        soil = Soil(poisson_ratio=nu, density=1800.0, shear_wave_velocity=150.0)
        of_soil = gazetas.gazetas_stiffness_modifiers(SURFACE, soil, 1.0)
        assert of_soil["ry"] == pytest.approx(1 - slope, abs=5e-5)
        assert ("z" in of_soil) == has_z


# A structure on the footing at the surface: m = 500 t at 12 m, T = 0.4 s, 5 %; shaking along the width.
MASS, HEIGHT, STIFFNESS = 500e3, 12.0, 123370055.0


def on_soil() -> dict[str, float]:
    """Return the springs at a0 = omega B / Vs, where omega = 2 pi / T~ follows from the static springs."""
    static = pk.pais_kausel_stiffness(SURFACE, SOIL)
    ratio = ps.period_ratio_on_soil(STIFFNESS, HEIGHT, static["y"], static["rx"])
    omega = 2 * np.pi / (0.4 * ratio)
    springs, _ = pk.pais_kausel_impedance(SURFACE, SOIL, omega)
    a0 = pk.dimensionless_frequency(SURFACE, SOIL, omega)
    betas = pk.pais_kausel_radiation_damping(SURFACE, SOIL, a0)
    return {
        "static_ratio": ratio,
        "a0": float(a0),
        "Kx": float(springs["y"]),
        "Kr": float(springs["rx"]),
        "beta_y": float(betas["y"]),
        "beta_rx": float(betas["rx"]),
    }


def test_a_structure_on_soil_has_the_reference_period_and_damping() -> None:
    found = on_soil()
    assert 0.4 * found["static_ratio"] == pytest.approx(0.4536515, rel=2e-7)
    assert found["a0"] == pytest.approx(0.557461675, rel=2e-9)
    assert found["Kx"] == pytest.approx(1.80526547e9, rel=4e-9)
    assert found["Kr"] == pytest.approx(7.61376826e10, rel=4e-9)
    assert found["beta_y"] == pytest.approx(0.2470381, rel=3e-7)
    assert found["beta_rx"] == pytest.approx(0.01875556, rel=3e-7)
    ratio = ps.period_ratio_on_soil(STIFFNESS, HEIGHT, found["Kx"], found["Kr"])
    period = 0.4 * ratio
    assert period == pytest.approx(0.456363, rel=2e-6)
    beta_f = ps.foundation_damping_ratio(
        period, ratio, MASS, HEIGHT, found["Kx"], found["Kr"], found["beta_y"], found["beta_rx"], 0.0
    )
    hysteretic = ps.damping_ratio_on_soil(0.05, beta_f, ratio, structure_damping="hysteretic")
    assert hysteretic == pytest.approx(0.05474397, rel=3e-7)
    viscous = ps.damping_ratio_on_soil(0.05, beta_f, ratio, structure_damping="viscous")
    assert viscous == pytest.approx(0.04999988, rel=3e-7)


def sway_rocking_model(foundation_mass: float = 150e3, inertia: float = 2e6) -> tuple[np.ndarray, ...]:
    """Return mass, damping, stiffness and load of the reference case, with dashpots tuned at 2 pi / T~."""
    found = on_soil()
    omega = 2 * np.pi / (0.4 * ps.period_ratio_on_soil(STIFFNESS, HEIGHT, found["Kx"], found["Kr"]))
    cx, cr = 2 * found["beta_y"] * found["Kx"] / omega, 2 * found["beta_rx"] * found["Kr"] / omega
    assert (cx, cr) == pytest.approx((64783675.5, 207438885), rel=4e-9)
    mass, load = ps.sway_rocking_matrices(MASS, HEIGHT, foundation_mass, inertia)
    c = 2 * 0.05 * np.sqrt(STIFFNESS * MASS)
    return mass, np.diag([c, cx, cr]), np.diag([STIFFNESS, found["Kx"], found["Kr"]]), load


def test_the_sway_rocking_model_has_the_reference_modes() -> None:
    frequency, damping = complex_modes(*sway_rocking_model()[:3])
    assert 2 * np.pi / frequency[0] == pytest.approx(0.4549389, rel=2e-7)
    assert damping[0] == pytest.approx(0.04860312, rel=2e-7)
    assert frequency[1] == pytest.approx(216.3332, rel=3e-7)
    assert damping[1] == pytest.approx(0.3713189, rel=3e-7)
    # Massless foundation.
    frequency, damping = complex_modes(*sway_rocking_model(0.0, 0.0)[:3])
    assert 2 * np.pi / frequency[0] == pytest.approx(0.4546091, rel=3e-7)
    assert damping[0] == pytest.approx(0.0484472, rel=2e-6)


def test_the_sway_rocking_model_has_the_reference_response() -> None:
    mass, damping, stiffness, load = sway_rocking_model()
    found = response(mass, damping, stiffness, load, pulse(3.0, 0.5, 0.5), parts=50)
    time, u, v, a = (found[name] for name in ("time", "u", "v", "a"))
    expected = ((0.04667903, 1.4296), (0.003024341, 1.4556), (0.0009143329, 1.4259))
    for dof, (value, when) in enumerate(expected):
        size, at = peak(time, u[:, dof], v[:, dof])
        assert size == pytest.approx(value, rel=3e-7)
        assert at == pytest.approx(when, abs=1e-4)
    to_mass = np.array([1.0, 1.0, HEIGHT])
    assert peak(time, u @ to_mass, v @ to_mass)[0] == pytest.approx(0.06049148, rel=3e-7)
    total = a @ to_mass + found["ground"][:, 0]
    assert peak(time, total, np.gradient(total, time))[0] == pytest.approx(11.55761, rel=2e-6)


def test_periods_on_stiff_soil_are_those_on_a_fixed_base() -> None:
    assert ps.period_ratio_on_soil(STIFFNESS, HEIGHT, 1e30, 1e30) == 1
    assert ps.effective_period_ratio_on_soil(1.3, 1.0) == pytest.approx(1.3, rel=1e-15)
    assert ps.effective_period_ratio_on_soil(1.3, 1e9) == pytest.approx(1.0, rel=1e-9)
    assert ps.damping_ratio_on_soil(0.05, 0.0, 1.0, structure_damping="viscous") == 0.05
    damping = ps.foundation_damping_ratio(1.0, 1.5, 1e5, 10.0, 1e30, 1e30, 0.1, 0.1, 0.06)
    assert damping == pytest.approx(0.06 * (1 - 1 / 2.25), rel=1e-12)


CONES = [(motion, nu) for motion in cones.MOTIONS for nu in (0.0, 0.25, 1 / 3, 0.45, 0.5)]


@pytest.mark.parametrize(("motion", "nu"), CONES)
def test_a_cone_has_the_exact_static_stiffness_and_its_dynamic_stiffness(motion: str, nu: float) -> None:
    r, rho, vs = 3.0, 1900.0, 180.0
    g = rho * vs**2
    soil = Soil(poisson_ratio=nu, density=rho, shear_wave_velocity=vs)
    extra = {"trapped_inertia": 0.0} if motion == "rocking" and nu > 1 / 3 else {}
    cone = cones.disk_cone(motion, r, soil, **extra)
    exact = {
        "horizontal": 8 * g * r / (2 - nu),
        "vertical": 4 * g * r / (1 - nu),
        "rocking": 8 * g * r**3 / (3 * (1 - nu)),
        "torsion": 16 * g * r**3 / 3,
    }[motion]
    assert cone.stiffness == pytest.approx(exact, rel=1e-12)
    assert cone.dynamic_stiffness(0.0) == pytest.approx(exact, rel=1e-12)
    omega = np.array([3.0, 30.0, 300.0])
    b = omega * cone.apex_height / cone.wave_speed
    if motion in ("horizontal", "vertical"):
        assert cone.inner_inertia == 0
        expected = exact * (1 + 1j * b) - omega**2 * cone.trapped_mass
        assert cone.dashpot == pytest.approx(rho * cone.wave_speed * np.pi * r**2, rel=1e-12)
    else:
        share = b**2 / (3 * (1 + b**2))
        expected = exact * (1 - share + 1j * b * share)
    assert cone.dynamic_stiffness(omega) == pytest.approx(expected, rel=1e-12)
    trapped = 2.4 * (nu - 1 / 3) * rho * np.pi * r**3 if motion == "vertical" and nu > 1 / 3 else 0.0
    assert cone.trapped_mass == pytest.approx(trapped, rel=1e-12)


def test_cones_have_their_wave_speeds_and_trapped_inertia() -> None:
    stiff, clay = (Soil(poisson_ratio=nu, density=1900.0, shear_wave_velocity=180.0) for nu in (0.25, 0.45))
    assert cones.disk_cone("horizontal", 3.0, clay).wave_speed == 180
    assert cones.disk_cone("torsion", 3.0, clay).wave_speed == 180
    assert cones.disk_cone("vertical", 3.0, stiff).wave_speed == pytest.approx(180 * np.sqrt(3), rel=1e-12)
    assert cones.disk_cone("vertical", 3.0, clay).wave_speed == 360
    assert cones.disk_cone("rocking", 3.0, clay, trapped_inertia=7.0).trapped_mass == 7
    # Both speeds are equal at Poisson's ratio 1/3.
    third = Soil(poisson_ratio=1 / 3, density=1900.0, shear_wave_velocity=180.0)
    assert cones.disk_cone("vertical", 3.0, third).wave_speed == pytest.approx(360, rel=1e-12)


CLAY = Soil(poisson_ratio=0.45, density=1800.0, shear_wave_velocity=150.0)
WRONG = [
    (lambda: RectangularFooting(3.0, 4.0), "half_length 3 m is less than half_width 4 m: exchange"),
    (lambda: RectangularFooting(3.0, 0.0), "half_width .* above 0"),
    (lambda: RectangularFooting(3.0, 2.0, contact_height=1.0), "contact_height 1 m is above embedment 0 m"),
    (lambda: Soil(0.3, 1800.0), "neither shear_modulus nor shear_wave_velocity is given: give one of them"),
    (lambda: Soil(0.3, 1800.0, shear_modulus=1e7, shear_wave_velocity=200.0), "is not density x shear_wave_velocity"),
    (lambda: Soil(0.6, 1800.0, shear_modulus=1e7), "poisson_ratio is 0.6; it must be from 0 to 0.5"),
    (lambda: pk.pais_kausel_stiffness_modifiers(SURFACE, -0.1), "frequency must be at least 0"),
    (lambda: pk.pais_kausel_impedance(SURFACE, SOIL, 0.0), "circular_frequency must be above 0"),
    (lambda: gazetas.gazetas_embedment_factors(EMBEDDED, rocking_form="gazetas"), "unknown rocking_form 'gazetas'"),
    (lambda: gazetas.gazetas_radiation_dashpots(SURFACE, SOIL, 0.2), "0.2 is outside the charts, 0.444 to 2"),
    (lambda: gazetas.gazetas_stiffness_modifiers(SURFACE, SOIL, 2.5), "2.5 is outside the charts, 0 to 2"),
    (
        lambda: gazetas.gazetas_radiation_dashpots(RectangularFooting(30.0, 6.0), SOIL, 1.0),
        "L / B is 5, but the charts end at 4",
    ),
    (lambda: ps.period_ratio_on_soil(1e8, 12.0, 0.0, 1e10), "sway_stiffness"),
    (lambda: ps.effective_period_ratio_on_soil(0.9, 2.0), "period_ratio must be a finite number of at least 1"),
    (lambda: ps.damping_ratio_on_soil(0.05, 0.0, 1.0, structure_damping="linear"), "unknown structure_damping"),
    (lambda: ps.sway_rocking_matrices(1e5, 0.0, 0.0, 0.0), "height"),
    (lambda: cones.disk_cone("vert", 3.0, SOIL), "unknown motion 'vert'"),
    (lambda: cones.disk_cone("rocking", 3.0, CLAY), "trapped_inertia is missing: for Poisson's ratio 0.45"),
    (lambda: cones.disk_cone("vertical", 3.0, CLAY, trapped_inertia=1.0), "trapped_inertia has no effect"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_invalid_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


POSITIVE = [
    (ps.period_ratio_on_soil, dict(stiffness=1e8, height=10.0, sway_stiffness=1e9, rocking_stiffness=1e10)),
    (ps.sway_rocking_matrices, dict(mass=1e5, height=10.0)),
    (ps.foundation_damping_ratio, dict(period=1.0, mass=1e5, height=9.0, sway_stiffness=1e9, rocking_stiffness=1e9)),
    (cones.disk_cone, dict(radius=3.0)),
]
OTHERS = {
    ps.sway_rocking_matrices: dict(foundation_mass=0.0, rocking_inertia=0.0),
    ps.foundation_damping_ratio: dict(
        period_ratio=1.1, sway_damping_ratio=0.1, rocking_damping_ratio=0.0, soil_damping_ratio=0.0
    ),
    cones.disk_cone: dict(motion="torsion", soil=SOIL),
}


@pytest.mark.parametrize(("function", "arguments"), POSITIVE)
def test_quantities_that_must_be_positive_may_not_be_0(function, arguments: dict[str, float]) -> None:
    function(**arguments, **OTHERS.get(function, {}))
    for name in arguments:
        with pytest.raises(ValueError, match=rf"{name} .* must be a finite number above 0, got 0.0"):
            function(**arguments | {name: 0.0}, **OTHERS.get(function, {}))


def test_arguments_of_another_class_are_refused() -> None:
    with pytest.raises(TypeError, match=r"takes a RectangularFooting, got Soil; give footing="):
        pk.pais_kausel_stiffness(SOIL, SOIL)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"takes a Soil, got float; give soil="):
        gazetas.gazetas_stiffness(SURFACE, 40e6)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"takes a Soil, got float; give soil="):
        cones.disk_cone("torsion", 3.0, 40e6)  # type: ignore[arg-type]
