"""Buildings pushed slowly: piecewise lines by hand, OpenSees' displacement control, and energy."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from labels import check_labels
from opensees import opensees
from validation import Measured, difference

import warpdyn as wd

STIFFNESS = np.array([1.0e8, 2.0e8, 1.5e8, 0.8e8])
STRENGTH = np.array([2.0e6, 2.2e6, 1.5e6, 0.4e6])
HARDENING = np.array([0.05, 0.02, 0.1, 0.03])
TO_AND_FRO = np.concatenate([np.linspace(a, b, 120)[1:] for a, b in pairwise([0, 0.1, -0.15, 0.2, -0.05, 0.3])])


def bilinear(hardening: float | np.ndarray = HARDENING) -> wd.ShearBuilding:
    return wd.ShearBuilding(2.0e5, STIFFNESS, 3.0, law="bilinear", yield_force=STRENGTH, hardening_ratio=hardening)


def softening(hardening: list[float], strength: list[float]) -> wd.ShearBuilding:
    """Storeys that a building refuses, since these have no end of their softening: a law's own branch stands still."""
    building = wd.ShearBuilding(2.0e5, [1.0e8] * 3, 3.0, law="bilinear", yield_force=strength, hardening_ratio=0.1)
    building.parameters = building.parameters | {"hardening_ratio": np.array(hardening)}
    return building


def leaning(hardening: float | np.ndarray) -> wd.ShearBuilding:
    """The chain under floor loads that take 3 to 8 % of its storeys' stiffness."""
    return wd.ShearBuilding(
        2.0e5,
        STIFFNESS,
        [4.0, 3.0, 3.0, 3.0],
        law="bilinear",
        yield_force=STRENGTH,
        hardening_ratio=hardening,
        gravity_load=[1.0e7, 6.0e6, 4.0e6, 8.0e6],
    )


# Loads above each storey over its height, by hand.
WEIGHT_OVER_HEIGHT = np.array([28.0e6 / 4, 18.0e6 / 3, 12.0e6 / 3, 8.0e6 / 3])


def roof_of(shear: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Roof displacement of a bilinear chain under a rising base shear: the sum of the storeys' drifts, by hand."""
    force = shear[:, None] * np.cumsum(load[::-1])[::-1] / load.sum()
    beyond = np.maximum(force - STRENGTH, 0)
    return (np.minimum(force, STRENGTH) / STIFFNESS + beyond / (HARDENING * STIFFNESS)).sum(axis=1)


def check_balance(pushed: xr.Dataset, path: np.ndarray, leaning: float | np.ndarray = 0.0) -> None:
    shears = np.cumsum(pushed["floor_load"].values[::-1])[::-1]
    np.testing.assert_allclose(pushed["storey_drift"].sum("storey"), path, atol=1e-14)
    resistance = pushed["storey_force"].values - leaning * pushed["storey_drift"].values
    off = resistance - pushed["base_shear"].values[:, None] * shears
    assert np.abs(off).max() <= 1.0e-9 * np.abs(pushed["base_shear"]).max() * (1 + 1e-6)


@pytest.mark.parametrize(
    ("pattern", "load"),
    [
        ("uniform", [1, 1, 1, 1]),
        ("triangular", [1, 2, 3, 4]),
        ([0, 0, 0, 2.0], [0, 0, 0, 1]),
        ([3.0, 1.0, 0.5, 0.2], [3.0, 1.0, 0.5, 0.2]),
    ],
)
def test_monotonic_pushover_is_the_piecewise_line(pattern: str | list[float], load: list[float]) -> None:
    shear = np.linspace(0, 4.0e6, 400)[1:]
    roof = roof_of(shear, np.array(load, float))
    pushed = wd.pushover(bilinear(), roof, pattern=pattern)
    check_balance(pushed, roof)
    np.testing.assert_allclose(pushed["base_shear"], shear, rtol=1e-7)  # balance within 1e-9 of forces, soft branches


def test_step_length_has_no_say_for_a_path_without_turns() -> None:
    roof = np.array([0.02, 0.05, 0.3])
    few = wd.pushover(bilinear(), roof)
    many = wd.pushover(bilinear(), np.linspace(0, 0.3, 601)[1:])
    np.testing.assert_allclose(few["base_shear"], many["base_shear"].values[[39, 99, 599]], rtol=1e-8)


def test_gravity_turns_a_hardening_oscillator_into_one_that_softens() -> None:
    building = wd.ShearBuilding(
        1.0e5, 1.0e7, 3.0, law="bilinear", yield_force=1.0e5, hardening_ratio=0.02, gravity_load=1.0e6
    )
    roof = np.array([0.005, 0.01, 0.05, 0.1, 0.4, 0.39])
    pushed = wd.pushover(building, roof)
    spring = np.where(roof <= 0.01, 1.0e7 * roof, 1.0e5 + 0.02 * 1.0e7 * (roof - 0.01))
    spring[-1] = spring[-2] - 1.0e7 * 0.01
    np.testing.assert_allclose(pushed["storey_force"].values[:, 0], spring, rtol=1e-9)
    np.testing.assert_allclose(pushed["base_shear"], spring - 1.0e6 / 3 * roof, rtol=1e-8)
    assert float(pushed["base_shear"][3]) == pytest.approx(84_666.67)


def test_first_mode_pattern_is_of_the_building_under_gravity() -> None:
    building = leaning(HARDENING)
    shape = building.modal()["shape"].values[0]
    pushed = wd.pushover(building, [0.001])
    np.testing.assert_allclose(pushed["floor_load"], shape / shape.sum(), rtol=1e-12)
    # Loads in proportion to mass times a mode bend the elastic building into it.
    np.testing.assert_allclose(np.cumsum(pushed["storey_drift"].values[0]) / 0.001, shape / shape[-1], rtol=1e-8)


def test_under_gravity_the_storey_that_yields_falls_alone() -> None:
    """Without hardening the first storey to yield gives way under gravity, and the others unload."""
    roof = np.linspace(0, 0.3, 301)[1:]
    pushed = wd.pushover(leaning(0.0), roof, pattern=[1.0, 2.0, 3.0, 4.0])
    check_balance(pushed, roof, WEIGHT_OVER_HEIGHT)
    share, elastic = np.array([10, 9, 7, 4]) / 10, STIFFNESS - WEIGHT_OVER_HEIGHT
    shear_at_yield = elastic * (STRENGTH / STIFFNESS) / share
    weakest = int(np.argmin(shear_at_yield))
    peak = shear_at_yield.min()
    rising = 1 / (share / elastic).sum()
    others = np.delete(np.arange(4), weakest)
    falling = 1 / (-share[weakest] / WEIGHT_OVER_HEIGHT[weakest] + (share / elastic)[others].sum())
    expected = np.where(roof < peak / rising, rising * roof, peak + falling * (roof - peak / rising))
    np.testing.assert_allclose(pushed["base_shear"], expected, rtol=0, atol=1e-7 * peak)
    assert expected[-1] < 0.5 * peak


@pytest.mark.parametrize("weight_over_height", [np.zeros(4), WEIGHT_OVER_HEIGHT], ids=["plain", "gravity"])
@pytest.mark.parametrize("pattern", ["first_mode", "triangular", "uniform"])
def test_cyclic_pushover_is_opensees(pattern: str, weight_over_height: np.ndarray, measured: Measured) -> None:
    """With gravity each storey has OpenSees' elastic material of negative stiffness -W / h beside its own."""
    hardening = HARDENING + 0.08  # which gravity leaves above 0: beyond, one of several balances is a matter of choice
    building = leaning(hardening) if weight_over_height.any() else bilinear(hardening)
    pushed = wd.pushover(building, TO_AND_FRO, pattern=pattern)
    check_balance(pushed, TO_AND_FRO, weight_over_height)
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(0, 0.0)
    ops.fix(0, 1)
    for storey in range(1, 5):
        ops.node(storey, 0.0)
        ops.uniaxialMaterial("Steel01", storey, STRENGTH[storey - 1], STIFFNESS[storey - 1], hardening[storey - 1])
        ops.uniaxialMaterial("Elastic", 10 + storey, -weight_over_height[storey - 1])
        ops.uniaxialMaterial("Parallel", 20 + storey, storey, 10 + storey)
        ops.element("zeroLength", storey, storey - 1, storey, "-mat", 20 + storey, "-dir", 1)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for floor, load in enumerate(pushed["floor_load"].values, start=1):
        ops.load(floor, float(load))
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-13, 100)
    ops.algorithm("Newton")
    shear = []
    for step in np.diff(TO_AND_FRO, prepend=0.0):
        ops.integrator("DisplacementControl", 4, 1, float(step))
        ops.analysis("Static")
        assert ops.analyze(1) == 0
        shear.append(ops.getLoadFactor(1))
    ops.wipe()
    measured(
        "base shears of cyclic pushovers, with gravity and without, over the largest",
        truth="OpenSeesPy's displacement control of the same chain",
        value=difference(pushed["base_shear"], shear) / np.abs(shear).max(),
        bound=1e-7,
    )


def test_first_mode_pattern_is_mass_times_mode() -> None:
    mass = np.array([3e5, 2e5, 2e5, 1e5])
    building = wd.ShearBuilding(mass, STIFFNESS, 3.0)
    pushed = wd.pushover(building, [0.01])
    load = mass * building.modal()["shape"].values[0]
    np.testing.assert_allclose(pushed["floor_load"], load / load.sum(), rtol=1e-12)
    flexibility = (np.cumsum((load / load.sum())[::-1])[::-1] / STIFFNESS).sum()
    assert float(pushed["base_shear"][0]) == pytest.approx(0.01 / flexibility, rel=1e-12)


def test_elastic_perfectly_plastic_chain_drifts_in_its_weakest_storey() -> None:
    pushed = wd.pushover(bilinear(0.0), np.linspace(0, 0.3, 301)[1:], pattern="triangular")
    share = np.array([10, 9, 7, 4]) / 10
    weakest = int(np.argmin(STRENGTH / share))
    base_shear = (STRENGTH / share).min()
    assert float(pushed["base_shear"][-1]) == pytest.approx(base_shear, rel=1e-8)
    others = np.delete(np.arange(4), weakest)
    expected = (base_shear * share / STIFFNESS)[others]
    np.testing.assert_allclose(pushed["storey_drift"].values[-1, others], expected, rtol=1e-7)


def test_two_storeys_that_yield_at_once_share_the_drift() -> None:
    building = wd.ShearBuilding(1.0, 1.0e8, 3.0, law="bilinear", yield_force=[2.0e6, 1.0e6], hardening_ratio=0.0)
    pushed = wd.pushover(building, np.linspace(0, 0.1, 51)[1:], pattern="uniform")
    check_balance(pushed, np.linspace(0, 0.1, 51)[1:])
    assert float(pushed["base_shear"][-1]) == pytest.approx(2.0e6, rel=1e-9)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 4.0])
def test_bouc_wen_chain_closes_its_energy(exponent: float) -> None:
    building = wd.ShearBuilding(
        2.0e5, STIFFNESS, 3.0, law="bouc_wen", yield_force=STRENGTH, hardening_ratio=0.05, exponent=exponent
    )
    path = np.concatenate([np.linspace(a, b, 600)[1:] for a, b in pairwise([0, 0.1, -0.15, 0.2])])
    pushed = wd.pushover(building, path)
    check_balance(pushed, path)
    dissipated = pushed["dissipated_energy"].values
    # The trapezoidal rule on steps of a fiftieth of the yield displacement.
    assert np.diff(dissipated.sum(axis=1)).min() > -1e-6 * dissipated.sum(axis=1).max()
    # What the roof's load did, less what the springs hold, whose hysteretic part is bounded by its yield energy.
    work = np.trapezoid(
        np.append(0, pushed["storey_force"].values[:, 0]), np.append(0, pushed["storey_drift"].values[:, 0])
    )
    assert work >= dissipated[-1, 0] > 0.5 * work


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.meant_as_given("pushed_drift_ratio")
def test_long_steps_of_bouc_wen_storeys_warn_of_no_overflow() -> None:
    """Far beyond yielding z is 1, so that the storeys are bilinear: F = r k u + (1 - r) Fy."""
    building = wd.ShearBuilding(
        mass=2.0e5,
        stiffness=[2.4e8, 2.0e8, 1.4e8],
        height=[4.0, 3.2, 3.2],
        law="bouc_wen",
        yield_force=[1.6e6, 1.3e6, 0.8e6],
        hardening_ratio=0.05,
    )
    pushed = wd.pushover(building, np.linspace(0.0, 3.0, 100), pattern="triangular")
    drift, force = pushed["storey_drift"].values[-1], pushed["storey_force"].values[-1]
    expected = 0.05 * np.array([2.4e8, 2.0e8, 1.4e8]) * drift + 0.95 * np.array([1.6e6, 1.3e6, 0.8e6])
    # 1 - z is below 1e-9 at drifts of a hundred times that of yielding.
    np.testing.assert_allclose(force, expected, rtol=1e-8)


def test_energy_of_a_bilinear_chain_is_its_plastic_work() -> None:
    pushed = wd.pushover(bilinear(), TO_AND_FRO)
    drift, force = pushed["storey_drift"].values, pushed["storey_force"].values
    # The sliding part's force times its plastic drift.
    sliding = (force - HARDENING * STIFFNESS * drift) / (1 - HARDENING)
    plastic = drift - sliding / STIFFNESS
    moved = np.diff(plastic, axis=0, prepend=0.0)
    expected = np.cumsum((1 - HARDENING) * STRENGTH * np.abs(moved), axis=0)
    # The trapezoidal rule cuts corners where a storey begins to yield within a step; seen: 0.2 %.
    np.testing.assert_allclose(pushed["dissipated_energy"], expected, atol=5e-3 * expected.max())
    assert (np.diff(pushed["dissipated_energy"], axis=0) > -1e-9 * expected.max()).all()


def test_past_the_peak_the_weakest_storey_softens_and_the_others_unload() -> None:
    chain = softening([-0.05] * 3, [1.0e6, 1.2e6, 1.3e6])
    roof = np.linspace(0, 0.2, 401)[1:]
    pushed = wd.pushover(chain, roof, pattern="uniform")
    share, stiffness = np.array([1, 2 / 3, 1 / 3]), 1.0e8
    rising = 1 / (share / stiffness).sum()
    falling = 1 / (1 / (-0.05 * stiffness) + (share[1:] / stiffness).sum())
    peak = 1.0e6 / rising
    expected = np.where(roof < peak, rising * roof, 1.0e6 + falling * (roof - peak))
    np.testing.assert_allclose(pushed["base_shear"], expected, atol=1e-2)  # of 1e6 N
    assert (np.diff(pushed["storey_drift"].values[-200:, 1:], axis=0) < 0).all()


def test_snap_back_ends_the_curve_at_its_peak() -> None:
    """The first storey softens faster than the two above it unload: the curve up to there is returned."""
    chain, roof = softening([-2.0, 0.0, 0.0], [1.0e6, 1.2e6, 1.3e6]), np.linspace(0, 0.1, 101)
    with pytest.warns(UserWarning, match=r"step \d+, to 0.0\d+ m: no equilibrium was found beyond .*Storey 1, which"):
        pushed = wd.pushover(chain, roof, pattern="uniform")
    rising = 1 / (np.array([1, 2 / 3, 1 / 3]) / 1.0e8).sum()
    found, peak = pushed["roof_displacement"].values, 1.0e6 / rising
    assert 10 < found.size < roof.size
    np.testing.assert_array_equal(found[:-1], roof[: found.size - 1])
    # The shortest step is 2^-10 of 1 mm.
    assert peak - 1e-6 <= found[-1] <= peak * (1 + 1e-9)
    np.testing.assert_allclose(pushed["base_shear"], rising * found, atol=1e-2)  # of 1e6 N
    assert all(np.isfinite(pushed[name]).all() for name in ("storey_drift", "storey_force", "dissipated_energy"))
    assert "(snap-back)" in pushed.attrs["stopped_because"]
    assert "stopped_because" not in wd.pushover(chain, found[:-1], pattern="uniform").attrs


@pytest.mark.parametrize(
    ("path", "pattern", "message"),
    [
        ([0.1, np.nan], "uniform", r"roof_displacement\[1\] is nan"),
        ([[0.1]], "uniform", r"roof_displacement must have shape \[step\], got \(1, 1\)"),
        ([], "uniform", "roof_displacement must have shape"),
        ([0.1], "mode", "unknown lateral load pattern 'mode'; allowed: 'first_mode', 'triangular', 'uniform'"),
        ([0.1], [1.0, 1.0], r"pattern must be one load per floor, shape \[4\]"),
        ([0.1], [1.0, -1.0, 1.0, 1.0], "the load on floor 2 is -1; it must be at least 0"),
        ([0.1], [1.0, 1.0, 1.0, 0.0], "the load on the roof is 0; it must be above 0"),
    ],
)
def test_bad_input_is_named(path: list, pattern: str | list, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wd.pushover(bilinear(), path, pattern=pattern)


def test_datasets_say_what_they_hold(tmp_path: Path) -> None:
    building = leaning(HARDENING)
    pushed, loops = wd.pushover(building, [0.01, 0.02]), wd.storey_hysteresis(building, [0.01, -0.01, 0.02])
    for made, function in ((pushed, "pushover"), (loops, "storey_hysteresis")):
        assert {"storey", "step"} <= set(made.coords)
        check_labels(made)
        own = {"pattern"} if function == "pushover" else set()
        assert set(made.attrs) == {"Conventions", "title", "history", "source", "building"} | own
        assert made.attrs["history"].endswith(f"warpdyn.{function}")
        told = json.loads(made.attrs["building"])
        assert told["law"] == "bilinear"
        assert told["yield_force"] == STRENGTH.tolist()
        made.to_netcdf(tmp_path / f"{function}.nc")
        with xr.open_dataset(tmp_path / f"{function}.nc") as read:
            assert read.load().identical(made)
    np.testing.assert_array_equal(pushed["floor"], [1, 2, 3, 4])
    np.testing.assert_array_equal(loops["step"], [0, 1, 2])


@pytest.mark.parametrize("steps", [1, 7, 100])
def test_of_storeys_that_come_to_their_peaks_together_one_softens(steps: int) -> None:
    """Equal storeys whose falling branches are such that the roof's is 4e6 N/m steep if all but one unload."""
    stiffness, strength, storeys = 1.0e8, 1.0e6, 4
    falling = 1 / (1 / -4.0e6 - (storeys - 1) / stiffness)
    ductility = 1 + 0.4 * stiffness / -falling  # to 0.6 of the strength
    corners = {"ductility_2": ductility, "force_ratio_2": 0.6, "ductility_3": 2 * ductility, "force_ratio_3": 0.5}
    building = wd.ShearBuilding(2.0e5, [stiffness] * 4, 3.0, law="hysteretic", yield_force=strength, **corners)
    peak = storeys * strength / stiffness
    roof = np.linspace(0, peak + 0.1, steps + 1)[1:]
    pushed = wd.pushover(building, roof, pattern=[0, 0, 0, 1.0])
    expected = np.interp(roof, [0, peak, peak + 0.1], [0, strength, strength - 4.0e5])
    # A step finds the peak within 2^-10 of its length.
    np.testing.assert_allclose(pushed["base_shear"], expected, rtol=0, atol=4.0e6 * 0.15 / steps * 2**-10)
    assert (np.diff(pushed["storey_drift"].values[-1]) == 0).sum() == storeys - 2  # all but the one that softens
