"""Kernels that prepare structures and samples: they agree with the host, whose functions they are recorded from."""

import numpy as np
import pytest
from prepared_structures import by_host, check_rows, prepared

import warpdyn as wd
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.preparation import preparation
from warpdyn.engine.tracing.arrays import NotTraceableError, Traced, conditions
from warpdyn.engine.tracing.nodes import constant
from warpdyn.model.scene.sobol_points import BITS, SobolPoints

STRUCTURES = 60
# The same operations in the same order, with other functions for exponentials and with fused multiply-add; sums of a
# few storeys lose some units in the last place.
ROUNDING = 1e-13


def building(law=None, damping="rayleigh"):
    ratio = {} if damping in ("none", "storey") else {"damping_ratio": 0.05}
    named = {} if law is None else {"law": law}
    return wd.ShearBuilding(mass=[2e4] * 3, stiffness=[2e7] * 3, height=[3.0] * 3, damping=damping, **ratio, **named)


def scene(structure, sampling="sobol", design=None, scatter=None):
    generator = np.random.default_rng(1)
    motions = [wd.GroundMotion(2 * generator.normal(size=size), 0.01, f"motion of {size}") for size in (120, 90, 150)]
    spread = {
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.4), per="storey", storey_correlation=0.5),
        "mass": wd.RandomFactor(wd.Normal(1.0, 0.1)),
        "height": wd.RandomValue(wd.Uniform(2.5, 3.5)),
    }
    design = design or wd.Stripes(motions, [0.1, 0.4], wd.PeakGroundAcceleration())
    return wd.Scene(structure, design, spread if scatter is None else scatter, recorders=("drift",), sampling=sampling)


def at_sites(motions):
    """Return motions at four sites in two earthquakes, both components, for three draws of each structure."""
    generator = np.random.default_rng(2)
    return wd.MotionsAtSites(
        motions,
        site=generator.integers(4, size=(STRUCTURES, 3)),
        motion=generator.integers(len(motions), size=(4, 2, 2)),
        scale=generator.uniform(0.1, 0.6, size=(4, 2, 2)),
        earthquake=[1, 0, 1],
    )


@pytest.mark.parametrize(
    ("law", "damping", "sampling"),
    [
        (None, "rayleigh", "sobol"),
        (wd.laws.BoucWen(yield_force=2e5, hardening_ratio=0.05), "mass_proportional", "latin_hypercube"),
        (wd.laws.Bilinear(yield_force=2e5, hardening_ratio=0.05), "stiffness_proportional", "monte_carlo"),
    ],
)
def test_structures_agree_with_the_host(law, damping, sampling):
    how, where = Integration(method="rk4", dtype="float64"), Execution(device="cpu")
    run = build_run(scene(building(law, damping), sampling), STRUCTURES, how, where, seed=3)
    expected, vibration = by_host(run)
    first = 7
    fields, found, refused, extremes = prepared(run, first, STRUCTURES)
    assert refused == 0
    of_part = {name: values[..., first:] for name, values in expected.items()}, vibration[:, first:]
    check_rows((fields, found), of_part, rounding=ROUNDING)
    np.testing.assert_array_equal(extremes, [found[0].max(), found[2].min()])


def test_structures_out_of_bounds_are_counted():
    how, where = Integration(method="rk4", dtype="float64"), Execution(device="cpu")
    spread = {"mass": wd.RandomFactor(wd.Normal(1.0, 0.5))}  # of 60 masses, a few are below 0
    run = build_run(scene(building(), scatter=spread), STRUCTURES, how, where, seed=3)
    normals = run.sampler._normals(np.arange(STRUCTURES))
    expected = np.count_nonzero(1 + 0.5 * normals[0] <= 0)
    assert expected > 0
    assert prepared(run, 0, STRUCTURES)[2] == expected


@pytest.mark.parametrize("kind", ["crossed", "one motion each", "one structure", "at sites"])
def test_runs_agree_with_the_host(monkeypatch, kind):
    law = wd.laws.Bilinear(yield_force=2e5, hardening_ratio=0.05)
    chosen = scene(building(law), scatter={} if kind == "one structure" else None)
    if kind == "one motion each":
        chosen = scene(building(law), design=wd.OneMotionPerStructure(chosen.excitation.motions))
    elif kind == "at sites":
        chosen = wd.Scene(chosen.structure, at_sites(chosen.excitation.motions), chosen.scatter, recorders=("drift",))
    count = 1 if kind == "one structure" else STRUCTURES
    by_host = wd.simulate(chosen, structures=count, device="cpu", dtype="float64")
    blocks = []
    begin = preparation.Preparation.begin
    monkeypatch.setattr(preparation, "is_large_on_gpu", lambda run: True)
    monkeypatch.setattr(
        preparation.Preparation, "begin", lambda self, *block: blocks.append(block) or begin(self, *block)
    )
    by_device = wd.simulate(chosen, structures=count, device="cpu", dtype="float64")
    assert len(blocks) == 1
    assert by_device["integration_step"].identical(by_host["integration_step"])
    for name in ("status", "structure", "motion_index", "scale_factor_of_motion", "im_level"):
        np.testing.assert_array_equal(by_device[name], by_host[name])
    # Coefficients differ by rounding, and yielding amplifies the difference.
    np.testing.assert_allclose(by_device["peak_storey_drift"], by_host["peak_storey_drift"], rtol=1e-9)


@pytest.mark.fast
def test_digits_of_sobol_points_give_the_points():
    points = SobolPoints(3, np.random.default_rng(0), 5000)
    shift, *directions = points.digits
    for index in (0, 1, 2, 1023, 1024, 4999):
        word = shift.copy()
        for bit, direction in enumerate(directions):
            if (index ^ (index >> 1)) >> bit & 1:
                word ^= direction
        np.testing.assert_array_equal(word * 2.0**-BITS, points.at(np.array([index]))[0])


@pytest.mark.fast
def test_branches_on_values_are_not_recorded():
    values = Traced.inputs(lambda row, storey: f"x[{storey}]", 1, 2)
    with pytest.raises(NotTraceableError, match="branch"):
        bool(values[0, 0] > 1)
    with pytest.raises(NotTraceableError, match=r"numpy\.where"):
        values[values > 1] = 0.0
    with conditions() as found:
        assert not np.any(values > 1)
    assert len(found) == 2


@pytest.mark.fast
def test_constants_are_computed_when_a_function_is_recorded():
    values = Traced.inputs(lambda row, storey: f"x[{storey}]", 1, 2)
    assert (values * 1.0 + 0.0).nodes[0, 0] is values.nodes[0, 0]
    assert np.where(np.array([True, False]), values, 3.0).nodes[0, 1] is constant(3.0)
