"""Kinds of damping: one-sided Rayleigh against closed forms, Rayleigh of the tangent stiffness against OpenSees."""

import numpy as np
import pytest
from method_sources import shown, thorough_unless
from opensees import chain_drifts

import warpdyn as wd
from warpdyn.engine.methods.table import METHODS, fitting_methods

pytestmark = pytest.mark.meant_as_given("damping_ratio")

MASS, STIFFNESS, RATIO = np.array([2.0e5, 1.5e5, 1.0e5]), np.array([9.0e7, 7.0e7, 4.0e7]), 0.05
TANGENT = fitting_methods(wd.laws.BoucWen.forces, "rayleigh_tangent")
OTHERS = [name for name in TANGENT if name not in shown(TANGENT)]


def building(damping, law="elastic", **parameters):
    return wd.ShearBuilding(MASS, STIFFNESS, 3.2, law=law, damping=damping, damping_ratio=RATIO, **parameters)


@pytest.mark.parametrize("method", ["rk4", thorough_unless(False, "newmark_average"), "exact"])
@pytest.mark.parametrize("damping", ["mass_proportional", "stiffness_proportional"])
@pytest.mark.parametrize("mode", [0, 2])
def test_modes_decay_as_they_should(damping, mode, method):
    modal = building(damping).modal()
    omega, shape = modal["circular_frequency"].values, modal["shape"].isel(mode=mode).values
    ratio = RATIO * (omega[0] / omega[mode] if damping == "mass_proportional" else omega[mode] / omega[0])
    damped, cycles = omega[mode] * np.sqrt(1 - ratio**2), 4
    end = 2 * np.pi * cycles / damped
    scene = wd.Scene(building(damping), wd.FreeVibration(end, displacement=0.01 * shape))
    steps = 4000
    kept = {"histories": wd.Histories((0,), steps)} if method != "exact" else {"histories": wd.Histories((0,), 1)}
    run = wd.simulate(scene, method=method, step=end / steps, dtype="float64", device="cpu", **kept)
    # After whole cycles the mode is where it was, by the factor exp(-zeta omega t).
    last = run["displacement"].values[0, -1] / (0.01 * shape)
    expected = np.exp(-ratio * omega[mode] * end)
    # RK4 at 1,000 steps a cycle is exact to 1e-10; Newmark's period is off by (omega h)^2 / 12 of the phase.
    np.testing.assert_allclose(last, expected, rtol=1e-3 if method == "newmark_average" else 1e-8)


@pytest.mark.parametrize(
    ("law", "methods"),
    [
        thorough_unless(methods == shown(TANGENT), law, methods)
        for law, sets in {
            "bilinear": (shown(TANGENT), OTHERS),
            "bouc_wen": (["rk4"], [name for name in TANGENT if name != "rk4"]),
        }.items()
        for methods in sets
    ],
)
def test_tangent_rayleigh_against_opensees(law, methods):
    strength = np.array([9.0e5, 7.0e5, 4.0e5])
    yielding = building("rayleigh_tangent", law, yield_force=strength, hardening_ratio=0.03)
    step, seconds = 0.01, 6.0
    time = np.arange(0, seconds, step)
    acceleration = 4.0 * np.sin(5.0 * time) * np.exp(-(((time - 2.5) / 1.5) ** 2))
    scene = wd.Scene(yielding, wd.Cloud([wd.GroundMotion(acceleration, step)]), tail=1.0, recorders=("drift",))
    peaks = {m: wd.simulate(scene, method=m, step=step / 10, dtype="float64", device="cpu") for m in methods}
    modes = yielding.modal()["circular_frequency"].values
    of_mass, of_stiffness = np.array([modes[0] * modes[1], 1]) * 2 * RATIO / (modes[0] + modes[1])
    rate = 0.5 * STIFFNESS / strength
    materials = [
        ("Steel01", [f, k, 0.03]) if law == "bilinear" else ("BoucWen", [0.03, k, 1.0, r, r, 1.0, 0.0, 0.0, 0.0])
        for f, k, r in zip(strength, STIFFNESS, rate, strict=True)
    ]
    theirs = chain_drifts(
        MASS, materials, (of_mass, np.zeros(3)), np.zeros(3), acceleration, step, 700, 50, of_tangent=of_stiffness
    )
    expected = np.abs(theirs).max(axis=0)
    assert (expected > 2 * strength / STIFFNESS).any()
    fixed = wd.simulate(
        wd.Scene(
            building("rayleigh", law, yield_force=strength, hardening_ratio=0.03),
            scene.excitation,
            recorders=("drift",),
        ),
        dtype="float64",
        device="cpu",
    )
    # It fades as storeys yield: more than what the comparison below could miss.
    assert np.abs(fixed["peak_storey_drift"].values[0] / expected - 1).max() > 0.02
    for method, run in peaks.items():
        # Steps of 1 ms here, of .2 ms there with a dashpot that lags.
        rtol = 0.02 if method in ("heun", "midpoint", "central_difference_lagged", "velocity_verlet") else 5e-3
        np.testing.assert_allclose(run["peak_storey_drift"].values[0], expected, rtol=rtol, err_msg=method)


def test_energy_closes_with_tangent_damping():
    yielding = building("rayleigh_tangent", "bilinear", yield_force=5e5, hardening_ratio=0.03)
    motion = wd.GroundMotion(4.0 * np.sin(5.0 * np.arange(0, 5, 0.01)), 0.01)
    run = wd.simulate(wd.Scene(yielding, wd.Cloud([motion])), longest_step=1e-3, dtype="float64", device="cpu")
    assert abs(float(run["energy_balance_error"][0])) < 1e-3
    assert float(run["viscous_energy"][0]) > 0


@pytest.mark.parametrize("method", [name for name in METHODS if METHODS[name].kind == "implicit"])
def test_implicit_methods_refuse_it(method):
    yielding = building("rayleigh_tangent", "bilinear", yield_force=5e5, hardening_ratio=0.03)
    scene = wd.Scene(yielding, wd.FreeVibration(1.0, velocity=0.1))
    with pytest.raises(ValueError, match=r"does not fit damping 'rayleigh_tangent'.*choose method= from these: heun"):
        wd.simulate(scene, method=method, device="cpu")


def test_no_damping_on_falling_branches():
    capped = {"plastic_drift_to_capping": 0.01, "post_capping_drift": 0.005, "capping_force_ratio": 1.05}
    falling = wd.ShearBuilding(
        2e4,
        2e6,
        3.0,
        law="ibarra_medina_krawinkler_peak_oriented",
        yield_force=2e4,
        damping="rayleigh_tangent",
        damping_ratio=0.2,
        **capped,
    )
    spent = []
    for end in (0.085, 0.09, 0.1, 0.11):
        scene = wd.Scene(falling, wd.FreeVibration(end, velocity=0.3), recorders=("energy", "drift"))
        spent.append(float(wd.simulate(scene, step=5e-4, dtype="float64", device="cpu")["viscous_energy"][0]))
    assert (np.diff(spent) >= 0).all()  # OpenSees' would give 10 % of it back


def test_devices_are_not_in_tangent_damping():
    with pytest.raises(ValueError, match="'rayleigh_tangent' cannot be used with a friction_damper"):
        building("rayleigh_tangent", devices=("friction_damper",), slip_force=1e5, brace_stiffness=1e8)


def test_the_step_holds_for_the_stiffest_tangent():
    # With gamma below beta a Bouc-Wen storey unloads more stiffly than it was at first, and damps so.
    strong = wd.ShearBuilding(
        2e4,
        2e6,
        3.0,
        law="bouc_wen",
        yield_force=6e4,
        hardening_ratio=0.02,
        beta=0.5,
        gamma=-0.45,
        damping="rayleigh_tangent",
        damping_ratio=0.4,
    )
    motion = wd.GroundMotion(6.0 * np.sin(np.arange(400) * 0.2), 0.02)
    runs = [
        wd.simulate(wd.Scene(strong, wd.Cloud([motion])), dtype="float64", device="cpu", longest_step=step)
        for step in (0.02, 2e-4)
    ]
    assert all(int(run["status"][0]) == 0 and abs(float(run["energy_balance_error"][0])) < 0.02 for run in runs)
    coarse, fine = (float(run["peak_storey_drift"].values.max()) for run in runs)
    assert coarse == pytest.approx(fine, rel=0.03)
