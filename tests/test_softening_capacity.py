"""Chains that follow capacity curves of two to four points beyond their peaks: pushed, they have the curves again."""

from __future__ import annotations

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.engine.laws import GEM_DAMAGE
from warpdyn.model.structures.hazus import building_class

pytestmark = pytest.mark.fast

IMK = "ibarra_medina_krawinkler"
TO_ZERO = {"unloading_exponent": 0.4, "pinching_drift": 0.6, "pinching_force": 0.4}


def hazus_curve(kind: str, level: str) -> tuple[list[float], list[float]]:
    """Return spectral yield, ultimate and a last level point of a Hazus type [m, m/s2]."""
    row, storeys = building_class(kind, level), {"C1M": 5, "W1": 1}[kind]
    ay = row["yield_spectral_acceleration_g"] * 9.8
    dy = ay * (storeys * row["period_per_storey_s"] / (2 * np.pi)) ** 2
    over = row["overstrength_ratio"]
    du = dy * (1 + (over - 1) / row["hardening_ratio"])
    return [dy, du, 2 * du], [ay, over * ay, over * ay]


# The four points of the examples of GEM's oq-vmtk [m, g]; the last rises by 1 %.
GEM = [0.00060789, 0.00486316, 0.02420000, 0.04353684], [0.10315200, 0.20630401, 0.12378241, 0.12502023]
GEM_CURVE = GEM[0], [9.81 * acceleration for acceleration in GEM[1]]
RESIDUAL = [0.02, 0.10, 0.25, 0.50], [1.0e6, 1.4e6, 0.5e6, 0.5e6]
RISING_END = [0.02, 0.10, 0.25, 0.50], [1.0e6, 1.4e6, 0.5e6, 0.505e6]
CAPPED = [0.02, 0.10, 0.25], [1.0e6, 1.4e6, 0.5e6]
TO_NOTHING = [0.02, 0.10, 0.25], [1.0e6, 1.4e6, 0.0]
FALLING = [0.03, 0.30], [2.0e6, 1.0e6]
FLAT_TOP = [0.02, 0.10, 0.20, 0.50], [1.0e6, 1.4e6, 1.4e6, 0.3e6]
STEEP = [0.02, 0.10, 0.11, 0.50], [1.0e6, 1.4e6, 0.5e6, 0.2e6]
RISING = [0.02, 0.10, 0.25, 0.40], [1.0e6, 1.4e6, 1.5e6, 1.55e6]
FALL_THEN_RISE = [0.03, 0.20, 0.40], [1.0e6, 0.6e6, 0.606e6]

# Curve, its form, law, distribution, storeys, parameters.
CURVES = {
    "Hazus C1M, trilinear": (hazus_curve("C1M", "high"), "spectrum", "trilinear", "first_mode", 5, {}),
    "Hazus C1M, Hysteretic": (hazus_curve("C1M", "high"), "spectrum", "hysteretic", "first_mode", 5, TO_ZERO),
    "Hazus W1, Pinching4": (hazus_curve("W1", "low"), "spectrum", "pinching4", "triangular", 1, {}),
    "GEM, first mode": (GEM_CURVE, "spectrum", "pinching4", "first_mode", 2, {}),
    "GEM, frame": (GEM_CURVE, "spectrum", "pinching4", "frame", 4, {}),
    "GEM, soft storey": (GEM_CURVE, "spectrum", "pinching4", "soft_storey", 4, {}),
    "GEM, damaged": (GEM_CURVE, "spectrum", "pinching4", "first_mode", 3, GEM_DAMAGE),
    "GEM, Hysteretic": (GEM_CURVE, "spectrum", "hysteretic", "frame", 3, {}),
    "residual, Pinching4": (RESIDUAL, "pushover", "pinching4", "triangular", 8, GEM_DAMAGE),
    "residual, Hysteretic": (RESIDUAL, "pushover", "hysteretic", "triangular", 5, TO_ZERO),
    "residual, IMKBilin": (RESIDUAL, "pushover", f"{IMK}_bilinear", "triangular", 5, {}),
    "residual, IMKPeakOriented": (RISING_END, "pushover", f"{IMK}_peak_oriented", "frame", 12, {}),
    "rising end, Pinching4": (RISING_END, "pushover", "pinching4", "triangular", 5, {}),
    "capped, IMKBilin": (CAPPED, "pushover", f"{IMK}_bilinear", "soft_storey", 6, {}),
    "to nothing, Hysteretic": (TO_NOTHING, "pushover", "hysteretic", "first_mode", 4, {}),
    "falling at once, Pinching4": (FALLING, "pushover", "pinching4", "triangular", 6, {}),
    "flat top, Pinching4": (FLAT_TOP, "pushover", "pinching4", "triangular", 4, {}),
    "steep, Pinching4": (STEEP, "pushover", "pinching4", "frame", 10, {}),
    "rising, quadrilinear": (RISING, "pushover", "quadrilinear", "triangular", 4, {}),
    "fall then rise, Pinching4": (FALL_THEN_RISE, "pushover", "pinching4", "triangular", 3, {}),
}
PINCHED = {"pinching_force_ratio": 0.4, "pinching_drift_ratio": 0.5}


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.meant_as_given(
    "capacity_period", "capacity_base_shear_coefficient", "capacity_yield_drift_ratio", "pushed_drift_ratio"
)
def test_the_pushed_building_has_the_curve_again(name: str) -> None:
    (x, y), form, law, distribution, storeys, parameters = CURVES[name]
    x, y, mass = np.array(x), np.array(y), np.linspace(2.4e5, 1.6e5, storeys)
    building = wd.ShearBuilding.from_capacity(
        x, y, storeys, mass, 3.0, curve=form, distribution=distribution, law=law, **parameters
    )
    if form == "spectrum":
        # Displacement times the participation factor at the roof, acceleration times the effective mass.
        shape = building.modal()["shape"].values[0]
        x = x * (mass @ shape / (mass @ shape**2) * shape[-1])
        y = y * ((mass @ shape) ** 2 / (mass @ shape**2))
    roof = np.linspace(0, x[-1], 120)[1:]  # in steps that meet none of the points but the last
    pattern = "triangular" if distribution == "triangular" else "first_mode"
    pushed = wd.pushover(building, roof, pattern=pattern)["base_shear"].values
    expected = np.interp(roof, [0, *x], [0, *y])
    # Half of 1 % where a rising end is taken as level; elsewhere a step finds the peak within 2^-10 of its length.
    assert np.abs(pushed - expected).max() < 0.006 * y.max()
    near = expected > 0.1 * y.max()
    np.testing.assert_allclose(pushed[near], expected[near], rtol=0.01)


def test_twenty_curves_are_followed() -> None:
    assert len(CURVES) == 20


def test_one_storey_softens_and_the_others_unload() -> None:
    building = wd.ShearBuilding.from_capacity(*RESIDUAL, 5, 2.0e5, 3.0, law="pinching4")
    pushed = wd.pushover(building, [0.05, 0.10, 0.15, 0.25, 0.50], pattern="triangular")
    drift, force = pushed["storey_drift"].values, pushed["storey_force"].values
    grows = np.diff(drift[1:], axis=0)[1] > 0
    assert grows.sum() == 1
    elastic = (force[1] - force[3]) / building.parameters["stiffness"]
    np.testing.assert_allclose((drift[1] - drift[3])[~grows], elastic[~grows], rtol=1e-6)


def test_every_storey_has_the_curves_shape_as_gems_have() -> None:
    """By the construction of GEM's toolkit, by hand: drifts Gamma Sd dphi, forces Gamma Sa sum of m phi above."""
    mass = 1.0e5 * np.array([1, 1, 0.75])
    building = wd.ShearBuilding.from_capacity(
        *GEM_CURVE, 3, mass, 3.0, curve="spectrum", distribution="frame", law="pinching4", softening="every_storey",
        collapses_at_end=True,
    )  # fmt: skip
    shape = (np.arange(1, 4) / 3) ** 0.6
    participation = (mass @ shape) / (mass @ shape**2)
    drift = participation * np.outer(GEM_CURVE[0], np.diff(shape, prepend=0.0))
    force = participation * np.outer(GEM_CURVE[1], np.cumsum((mass * shape)[::-1])[::-1])
    p = building.parameters
    np.testing.assert_allclose(p["yield_force"], force[0], rtol=1e-12)
    np.testing.assert_allclose(p["stiffness"], force[0] / drift[0], rtol=1e-12)
    for i in (2, 3, 4):
        np.testing.assert_allclose(p[f"ductility_{i}"], drift[i - 1] / drift[0], rtol=1e-12)
        np.testing.assert_allclose(p[f"force_ratio_{i}"], force[i - 1] / force[0], rtol=1e-12)
    np.testing.assert_allclose(p["drift_capacity"], drift[-1], rtol=1e-12)


def test_soft_storey_is_that_of_gems_toolkit() -> None:
    """Its first mode is of the matrix with 1.2 in the first place: a first storey of 0.2 of the others' stiffness."""
    mass = np.array([1.0e5, 1.0e5, 1.0e5, 0.75e5])
    building = wd.ShearBuilding.from_capacity([0.03, 0.3], [1e6, 1.5e6], 4, mass, 3.0, distribution="soft_storey")
    matrix = 2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    matrix[0, 0], matrix[3, 3] = 1.2, 1
    shape = np.ones(4)  # on its way to the first eigenvector, by the power method
    for _ in range(400):
        shape = np.linalg.solve(matrix, mass * shape)
        shape /= shape[-1]
    np.testing.assert_allclose(building.modal()["shape"].values[0] / shape, building.modal()["shape"].values[0][-1])


@pytest.mark.parametrize(
    ("points", "corners"),
    [
        (([0.02, 0.08], [1e6, 1.3e6]), ([0.04, 0.06], [1.1e6, 1.2e6])),
        (([0.02, 0.06, 0.10], [1e6, 1.3e6, 0.9e6]), ([0.06, 0.08], [1.3e6, 1.1e6])),
    ],
)
def test_missing_corners_are_where_gem_has_them(points: tuple, corners: tuple) -> None:
    p = wd.ShearBuilding.from_capacity(*points, 1, 1.0e5, 3.0, law="pinching4").parameters
    for i, drift, force in zip((2, 3), *corners, strict=True):
        assert p[f"ductility_{i}"] == pytest.approx(drift / 0.02)
        assert p[f"force_ratio_{i}"] == pytest.approx(force / 1e6)


@pytest.mark.parametrize(
    ("curve", "law", "message"),
    [
        (
            RESIDUAL,
            "bilinear",
            r"falls after its peak, point 1, from 1.4e\+06 to 500000 at point 2, where law 'bilinear' has 2.15e\+06",
        ),
        (RESIDUAL, "bouc_wen", "law 'bouc_wen' has .*: use a law that falls .'hysteretic', 'ibarra"),
        (CAPPED, "quadrilinear", "falls after point 1, but law 'quadrilinear' cannot fall"),
        (RISING, "trilinear", "has 4 points, but law 'trilinear' needs two to 3"),
        (
            RISING,
            "hysteretic",
            "has 4 points, but law 'hysteretic' needs 3, or a last point of constant strength, within 1 %",
        ),
        (RISING, f"{IMK}_bilinear", "does not fall after its second corner"),
        (FALLING, f"{IMK}_bilinear", "falls after its yield point"),
        (FLAT_TOP, f"{IMK}_pinching", "does not fall after its second corner"),
        (
            ([0.02, 0.1, 0.2, 0.3], [1e6, 1.5e6, 1.2e6, 1.2e6]),
            f"{IMK}_bilinear",
            "residual strength .* is 1.2 times the",
        ),
        (
            ([0.02, 0.1, 0.2, 0.3, 0.4], [1e6, 1.5e6, 0.9e6, 0.5e6, 0.3e6]),
            "pinching4",
            "has 5 points without the origin",
        ),
        (([0.02, 0.03, 0.2], [1e6, 1.6e6, 1.7e6]), "pinching4", "stiffer before point 1 than at the origin"),
        (
            ([0, 0.02, 0.1, 0.2], [0, 1e6, 0.5e6, 0.52e6]),
            "pinching4",
            "rises again at point 3, .* falling from point 1",
        ),
        (([0.02, 0.1, 0.2, 0.3], [1e6, 0.5e6, 0.505e6, 0.4e6]), "pinching4", "rises again at point 2"),
        (([0.02, 0.1, 0.2, 0.3], [1e6, 1.1e6, 1.4e6, 1.6e6]), "quadrilinear", "bends up at its corner 2"),
        (([0.02], [1e6]), "pinching4", "needs a yield point and, after it, another point"),
    ],
)
def test_a_curve_that_a_law_cannot_follow_is_refused(curve: tuple, law: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wd.ShearBuilding.from_capacity(*curve, 3, 1.0e5, 3.0, law=law, **(PINCHED if law.endswith("ing") else {}))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"ductility_2": 3.0}, "ductility_2 follows from the capacity curve: remove"),
        ({"softening": "all"}, "unknown softening 'all'.*; allowed: 'one_storey', 'every_storey'"),
        ({"collapses_at_end": True, "drift_capacity": 0.1}, "drift_capacity follows from the capacity curve"),
        ({"storeys": 13, "distribution": "frame"}, "'frame' has at most 12 storeys, got 13"),
    ],
)
def test_what_follows_from_the_curve_is_not_taken_twice(changed: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wd.ShearBuilding.from_capacity(
            *RESIDUAL, **({"storeys": 3, "mass": 1.0e5, "height": 3.0, "law": "pinching4"} | changed)
        )


def test_a_storey_that_passes_the_curves_end_collapses() -> None:
    building = wd.ShearBuilding.from_capacity(
        [0.02, 0.1], [1e6, 1.5e6], 1, 2.0e5, 3.0, law="bilinear", collapses_at_end=True
    )
    assert building.parameters["drift_capacity"] == pytest.approx([0.1])


def test_a_fall_within_one_percent_of_the_bilinear_curve_is_taken() -> None:
    building = wd.ShearBuilding.from_capacity([0.02, 0.1, 0.101], [1e6, 1.5e6, 1.495e6], 1, 2.0e5, 3.0)
    assert building.parameters["hardening_ratio"] == pytest.approx([0.125])
    with pytest.raises(ValueError, match=r"from 1.5e\+06 to 1.495e\+06 at point 2, where law 'bilinear' has 2.75e\+06"):
        wd.ShearBuilding.from_capacity([0.02, 0.1, 0.3], [1e6, 1.5e6, 1.495e6], 1, 2.0e5, 3.0)


def test_storeys_of_the_curves_shape_fall_more_steeply() -> None:
    building = wd.ShearBuilding.from_capacity(*RESIDUAL, 2, 2.0e5, 3.0, law="pinching4", softening="every_storey")
    pushed = wd.pushover(building, [0.05, 0.10, 0.15], pattern="triangular")["base_shear"].values
    assert pushed[:2] == pytest.approx([1.15e6, 1.4e6])
    assert pushed[2] < 0.8 * 1.1e6


def test_two_points_leave_the_falling_branch_to_the_caller() -> None:
    building = wd.ShearBuilding.from_capacity(
        [0.02, 0.1], [1e6, 1.5e6], 2, 2.0e5, 3.0, law=f"{IMK}_bilinear", post_capping_drift=0.3
    )
    np.testing.assert_allclose(building.parameters["plastic_drift_to_capping"].sum(), 0.08)
    assert building.parameters["capping_force_ratio"] == pytest.approx([1.5, 1.5])
