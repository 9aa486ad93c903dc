"""Kernels that prepare structures with damping that couples modes, or with gravity loads: they agree with the host."""

import numpy as np
import pytest
from method_sources import thorough_unless
from prepared_structures import DEVICES, by_host, check_divisions, check_rows, prepared, recorded

import warpdyn as wd
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.sampler import Sampler
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.preparation import preparation
from warpdyn.engine.kernels.auxiliary.decays import slowest_decays
from warpdyn.engine.methods.state_matrices import state_eigenvalues
from warpdyn.model.structures.modal import chain_stiffness_matrix

STRUCTURES, SEED, STOREYS = 40, 3, 3
BILINEAR = wd.laws.Bilinear(yield_force=2e5, hardening_ratio=0.05)
COEFFICIENTS = [2e5, 0.0, 3e5]  # N s/m; the second storey has no dashpot
LINEAR = wd.laws.ViscousDamper(damper_coefficient=COEFFICIENTS)
POWER = wd.laws.ViscousDamper(damper_coefficient=COEFFICIENTS, velocity_exponent=0.4)
GRAVITY = {"gravity_load": [2e5] * STOREYS}
BUILDINGS = {
    "storey": {"damping": "storey", "damping_coefficient": COEFFICIENTS},
    "storey, linear dampers": {"damping": "storey", "damping_coefficient": 1e5, "devices": [LINEAR]},
    "P-Delta": {"damping": "none", **GRAVITY},
    "P-Delta, mass": {"damping": "mass_proportional", **GRAVITY},
    "P-Delta, stiffness": {"damping": "stiffness_proportional", **GRAVITY},
    "P-Delta, Rayleigh": {"damping": "rayleigh", **GRAVITY},
    "P-Delta, tangent Rayleigh": {"damping": "rayleigh_tangent", **GRAVITY},
    "Rayleigh of storeys": {"damping": "rayleigh", "damped_storeys": (2, 3)},
    "linear dampers": {"damping": "none", "devices": [LINEAR]},
    "Rayleigh, linear dampers": {"damping": "rayleigh", "devices": [LINEAR]},
    "Rayleigh, power dampers": {"damping": "rayleigh", "devices": [POWER]},
    "elastic, power dampers": {"damping": "none", "devices": [POWER], "law": "elastic"},
    "P-Delta, tangent Rayleigh, power dampers": {"damping": "rayleigh_tangent", "devices": [POWER], **GRAVITY},
}
COMPILED = ("storey", "P-Delta, Rayleigh", "P-Delta, tangent Rayleigh, power dampers")
SPREADS = {
    "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="storey", storey_correlation=0.5),
    "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3), per="storey"),
    "damping_coefficient": wd.RandomFactor(wd.Lognormal(1.0, 0.6), per="storey"),
    "damping_ratio": wd.RandomFactor(wd.Lognormal(1.0, 0.3)),
    "damper_coefficient": wd.RandomFactor(wd.Lognormal(1.0, 0.6), per="storey"),
    "velocity_exponent": wd.RandomFactor(wd.Uniform(0.5, 1.5)),
    "gravity_load": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
}
# A value of structure 7 for which no building can stand, or that is out of its bounds.
MISTAKES = {
    "storey": ("damping_coefficient", -1.0),
    "P-Delta, Rayleigh": ("gravity_load", 1e9),
    "Rayleigh, power dampers": ("velocity_exponent", 1.5),
}


def scene_of(name, spread=None):
    """Return buildings whose parameters all vary."""
    given = {"law": BILINEAR, **BUILDINGS[name]}
    ratio = {} if given["damping"] in ("none", "storey") else {"damping_ratio": 0.05}
    building = wd.ShearBuilding(
        mass=[2e4] * STOREYS, stiffness=[2e7] * STOREYS, height=[3.0] * STOREYS, **ratio, **given
    )
    varied = {key: each for key, each in SPREADS.items() if key in building.parameters}
    if name.endswith("linear dampers"):
        varied.pop("velocity_exponent")
    motion = wd.GroundMotion(2 * np.random.default_rng(1).normal(size=150), 0.01, "noise")
    stripes = wd.Stripes([motion], [0.1, 0.4], wd.PeakGroundAcceleration())
    return wd.Scene(building, stripes, {**varied, **(spread or {})}, recorders=("drift", "residual"))


def run_of(name, method="rk4"):
    how, where = Integration(method=method, dtype="float64"), Execution(device="cpu")
    return build_run(scene_of(name), STRUCTURES, how, where, seed=SEED)


@pytest.fixture
def blocks(monkeypatch):
    """Count the blocks that kernels prepare."""
    found, begin = [], preparation.Preparation.begin
    monkeypatch.setattr(preparation.Preparation, "begin", lambda *block: found.append(block) or begin(*block))
    return found


@pytest.mark.parametrize(
    ("name", "method"),
    [
        (name, method)
        for name in BUILDINGS
        for method in ("rk4", "stoermer", "newmark_average")
        if method != "newmark_average" or "tangent" not in name  # a step may have no equilibrium
    ],
)
def test_recorded_computation_agrees_with_the_host(name, method):
    run = run_of(name, method)
    fields, vibration, refused = recorded(run)
    assert refused == 0
    check_rows((fields, vibration), by_host(run))


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", [thorough_unless(name in COMPILED, name) for name in BUILDINGS])
def test_kernels_agree_with_the_host_in_every_division(name, device):
    run = run_of(name)
    fields, vibration, refused, _ = prepared(run, 0, STRUCTURES, device)
    assert refused == 0
    check_rows((fields, vibration), by_host(run))
    check_divisions(run, STRUCTURES, device)


@pytest.mark.filterwarnings("ignore:implausible input")
@pytest.mark.parametrize("name", [thorough_unless(name in COMPILED, name) for name in BUILDINGS])
def test_runs_agree_with_the_host(name, blocks, monkeypatch):
    scene = scene_of(name)
    by_host = wd.simulate(scene, structures=STRUCTURES, device="cpu", dtype="float64")
    assert not blocks
    monkeypatch.setattr(preparation, "is_large_on_gpu", lambda run: True)
    by_device = wd.simulate(scene, structures=STRUCTURES, device="cpu", dtype="float64")
    assert len(blocks) == 1
    assert by_device["integration_step"].identical(by_host["integration_step"])
    for variable in ("status", "unreliable", "structure", "motion_index"):
        np.testing.assert_array_equal(by_device[variable], by_host[variable])
    # Coefficients differ by rounding, and yielding amplifies the difference.
    np.testing.assert_allclose(by_device["peak_storey_drift"], by_host["peak_storey_drift"], rtol=1e-9)


@pytest.mark.filterwarnings("ignore:implausible input")
@pytest.mark.parametrize("name", MISTAKES)
def test_a_faulty_structure_has_the_message_of_the_host(name, blocks, monkeypatch):
    parameter, value = MISTAKES[name]
    values = np.broadcast_to(np.ravel(scene_of(name).structure.parameters[parameter]), (STRUCTURES, STOREYS)).copy()
    values[7, 1] = value
    scene = scene_of(name, {parameter: wd.GivenValues(values)})
    monkeypatch.setattr(Sampler, "check_given_and_medians", lambda sampler: None)  # it refuses values beyond bounds
    with pytest.raises(ValueError, match=f"{parameter}.*structure 7, storey") as by_host:
        wd.simulate(scene, structures=STRUCTURES, device="cpu")
    assert not blocks
    monkeypatch.setattr(preparation, "is_large_on_gpu", lambda run: True)
    with pytest.raises(ValueError, match=parameter) as by_device:
        wd.simulate(scene, structures=STRUCTURES, device="cpu")
    assert len(blocks) == 1
    assert str(by_device.value) == str(by_host.value)


@pytest.mark.parametrize(
    ("given", "method"),
    [
        ({"damping": "modal", "damping_ratio": 0.05, "law": BILINEAR}, "rk4"),  # needs modes
        ({"damping": "storey", "damping_coefficient": 1e5, "law": BILINEAR}, "heun"),  # needs all eigenvalues
        ({"damping": "storey", "damping_coefficient": 1e5}, "rk4"),
        ({"damping": "rayleigh", "damping_ratio": 0.05}, "exact"),  # needs propagators
    ],
)
def test_the_host_prepares_what_cannot_be_recorded(given, method, monkeypatch):
    monkeypatch.setattr(preparation, "is_large_on_gpu", lambda run: True)
    building = wd.ShearBuilding(mass=[2e4] * STOREYS, stiffness=[2e7] * STOREYS, height=[3.0] * STOREYS, **given)
    scene = scene_of("storey")
    scene = wd.Scene(building, scene.excitation, {"mass": SPREADS["mass"]}, recorders=("drift",))
    run = build_run(scene, STRUCTURES, Integration(method=method), Execution(device="cpu"))
    assert preparation.preparation_of(run) is None


@pytest.mark.fast
@pytest.mark.parametrize("storeys", [1, 2, 3, 7, 20])
@pytest.mark.parametrize("kind", ["undamped", "mass", "dashpots", "some dashpots", "strong dashpots", "all"])
def test_decays_agree_with_numpy(storeys, kind):
    generator, shape = np.random.default_rng(storeys), (300, storeys)
    mass, stiffness = generator.uniform(0.3e4, 3e4, shape), 1e7 * 10 ** generator.uniform(-1, 1, shape)
    of_mass, dashpots = np.zeros(len(mass)), np.zeros(shape)
    if kind in ("mass", "all"):
        of_mass = 10 ** generator.uniform(-1, 3, len(mass))  # some buildings are overdamped
    if "dashpots" in kind or kind == "all":
        dashpots = 10 ** generator.uniform(3, 8 if kind == "strong dashpots" else 6, shape)
    if kind in ("some dashpots", "all"):
        dashpots *= generator.random(shape) < 0.4
    damping = chain_stiffness_matrix(dashpots) + of_mass[:, None, None] * mass[:, :, None] * np.eye(storeys)
    eigenvalues = state_eigenvalues(mass, damping, chain_stiffness_matrix(stiffness))
    expected = -eigenvalues.real.max(axis=1)
    found = slowest_decays(mass, stiffness, of_mass, dashpots)
    assert (found >= 0).all()
    # NumPy's eigenvalues have errors of 1e-14 to 1e-12 of the largest one, the more the stronger the dashpots.
    size = np.abs(eigenvalues).max(axis=1)
    assert (np.abs(found - expected) <= 1e-12 * size).all()
