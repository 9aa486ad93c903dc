"""Number type of lumped structures: float64 is the default if rounding in float32 would be too large."""

from __future__ import annotations

import warnings
from itertools import pairwise

import pytest
from lumped_cases import pulse

import warpdyn as wd
from warpdyn.campaigns.integration.lumped.rounding import LARGEST_ERROR, error_of_float32
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
MOTION = pulse(2.0, 1.2, 0.4, 12.0)


def tower(storeys: int, alpha0: float, **other) -> wd.FlexuralShearBuilding:
    """Return a tower with a period of 0.1 s per storey."""
    return wd.FlexuralShearBuilding([4e5] * storeys, 3.0, period=0.1 * storeys, alpha0=alpha0, **other)


def number_type(structure: wd.LumpedStructure, **integration) -> str:
    execution = Execution(device="cpu")
    return build_run(wd.Scene(structure, MOTION), 1, Integration(**integration), execution).integration.dtype


def stiff_base(factor: float) -> wd.LumpedStructure:
    """Return a chain on a base spring that is `factor` times as stiff as a storey."""
    names = ["base", "u1", "u2", "u3"]
    springs = [wd.Spring("base", {"base": 1.0}, stiffness=factor * 1e8)]
    springs += [wd.Spring(up, {up: 1.0, low: -1.0}, stiffness=1e8) for low, up in pairwise(names)]
    return wd.LumpedStructure(dict.fromkeys(names, 2e5), springs)


# Errors of peaks in float32, measured as the largest of four motions: deformations, displacements, accelerations.
@pytest.mark.parametrize(
    ("storeys", "alpha0", "measured"),
    [(10, 0.5, 6.2e-4), (10, 4.0, 1.7e-4), (20, 0.5, 1.7e-2), (20, 4.0, 1.7e-3), (20, 15.0, 2.0e-4), (40, 0.5, 0.15)],
)
def test_the_estimate_is_a_quarter_of_the_measured_error_or_more(storeys, alpha0, measured):
    assert 0.2 < error_of_float32(tower(storeys, alpha0)) / measured < 1.5


@pytest.mark.parametrize(("storeys", "alpha0", "dtype"), [(10, 4.0, "float32"), (20, 4.0, "float64")])
def test_tall_towers_are_integrated_in_float64_by_default(storeys, alpha0, dtype):
    building = tower(storeys, alpha0)
    assert number_type(building) == number_type(building, step=0.001) == dtype
    assert (error_of_float32(building) > LARGEST_ERROR) == (dtype == "float64")


def test_a_stiff_spring_in_series_does_not_need_float64():
    # Measured in float32 with 1e4: 1.1e-5. The ratio of frequencies alone would give 7e-3.
    assert error_of_float32(stiff_base(1e4)) < 2e-7
    assert number_type(stiff_base(1e4)) == "float32"


def test_a_default_run_of_a_tall_tower_has_the_peaks_of_another_program():
    # L03, NumPy in double precision: 0.3196972 m. In float32 the error is 0.1 %.
    stiffness = {"bending_stiffness": 2.39250923e11, "shear_stiffness": 1.06333744e9}
    building = wd.FlexuralShearBuilding([400e3] * 20, 3.0, **stiffness, damping="modal", damping_ratio=0.03)
    run = wd.simulate(wd.Scene(building, MOTION), device="cpu")
    assert run.attrs["dtype"] == "float64"
    assert run["peak_displacement"].sel(dof="u20").item() == pytest.approx(0.3196972, rel=1e-4)


def test_a_given_float32_is_kept_with_a_warning_that_names_the_error():
    with pytest.warns(UserWarning, match=r"in float32, rounding makes the peak displacements .* wrong by 0.0008"):
        assert number_type(tower(20, 4.0), dtype="float32") == "float32"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert number_type(tower(20, 4.0), dtype="float64") == "float64"
        assert number_type(tower(10, 4.0), dtype="float32") == "float32"
