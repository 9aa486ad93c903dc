"""Devices: their force paths beside OpenSees' materials, and the motions they give against closed forms."""

import re

import numpy as np
import pytest
from method_sources import thorough_unless
from opensees import finer, growing, material_forces, ratcheting, wandering
from scipy.linalg import eigh, expm
from scipy.special import gamma
from validation import difference

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("first_period", "initial_velocity", "stop_stiffness_over_storey")

STIFFNESS = 2.0e7
PROTOCOLS = {
    "growing": growing(0.005 * np.array([0.5, 1, 2, 4, 6, 8]), 50),
    "random": wandering(0.04, 40, 37, seed=1),
    "ratcheting": ratcheting(0.04, 12, 0.015, 40),
}
along_protocols = pytest.mark.parametrize("protocol", PROTOCOLS)
# Of each kind of method one; velocities and forces of oscillators are theirs at a short step.
KINDS = [("rk4", "float64"), ("dormand_prince54", "float64"), ("newmark_average", "float64"), ("rk4", "float32")]
SHOWN = KINDS[::2]  # one explicit and one implicit kernel
every_kind = pytest.mark.parametrize(("method", "dtype"), [thorough_unless(kind in SHOWN, *kind) for kind in KINDS])


def every_power(*exponents):
    """Return cases of dampers of several exponents."""
    return pytest.mark.parametrize(
        ("method", "dtype", "exponent"),
        [thorough_unless(kind in SHOWN, *kind, exponent) for kind in KINDS for exponent in exponents],
    )


def storey(**parameters):
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, **parameters)


def forces(drift, **parameters):
    return wd.storey_hysteresis(storey(**parameters), drift).storey_force.values[:, 0]


def history(building, load, step, method="rk4", dtype="float64", **options):
    """Return the run of one structure with its whole history."""
    scene = wd.Scene(building, load, tail=0.0, recorders=("drift", "energy"), **options)
    run = wd.simulate(scene, method=method, dtype=dtype, step=step, histories=wd.Histories(), device="cpu")
    assert run.status.item() == 0
    return run


@along_protocols
@pytest.mark.parametrize("law", ["elastic", "bilinear", "bouc_wen"])
def test_friction_damper_beside_a_law(law, protocol, measured):
    drift = PROTOCOLS[protocol]
    own = {} if law == "elastic" else {"yield_force": 1e5, "hardening_ratio": 0.05}
    device = {"devices": ("friction_damper",), "slip_force": 4e4, "brace_stiffness": 8e7}
    theirs = material_forces("ElasticPP", [8e7, 4e4 / 8e7], drift)
    assert np.ptp(theirs) == pytest.approx(8e4)
    ours = forces(drift, law=law, **own, **device) - forces(drift, law=law, **own)
    measured(
        "forces of `friction_damper` parallel to three laws, over the yield force",
        truth="OpenSees' ElasticPP",
        value=difference(ours, theirs) / 1e5,
        bound=1e-9,  # the same rules, rounded otherwise
    )


@along_protocols
@pytest.mark.parametrize("device", ["gap", "one_sided_gap"])
def test_gap_that_gives_all_back(device, protocol, measured):
    drift = PROTOCOLS[protocol]
    parameters = {"clearance": 0.012, "contact_stiffness": 3e8}
    theirs = material_forces("ElasticPPGap", [3e8, 1e12, 0.012], drift)
    if device == "gap":
        theirs = theirs + material_forces("ElasticPPGap", [3e8, -1e12, -0.012], drift)
    assert np.abs(theirs).max() > 1e6
    ours = forces(drift, devices=(device,), **parameters) - STIFFNESS * drift
    claim, error = f"forces of `{device}` that gives all energy back, over the largest", difference(ours, theirs)
    measured(claim, truth="OpenSees' ElasticPPGap", value=error / np.abs(theirs).max(), bound=1e-9)


def test_gap_keeps_its_share_of_the_work():
    restitution, stiffness, clearance = 0.6, 3e8, 0.01
    device = {"devices": ("gap",), "contact_stiffness": stiffness, "restitution": restitution}
    drift = finer(np.array([0.03, 0.0, -0.02, 0.0, 0.02, 0.017, 0.02, 0.0]), 2000)
    found = wd.storey_hysteresis(storey(clearance=clearance, **device), drift).dissipated_energy.values[:, 0]
    # Pressed in by 20 mm, 10 mm the other way and 10 mm again, there let go a little: that far it is elastic.
    lost = (1 - restitution**2) * 0.5 * stiffness * np.array([0.02, 0.01, 0.01]) ** 2
    # Steps of 5 to 15 um, where the trapezoidal rule passes a corner: one step's width times the force there.
    assert found[4000 - 1] == pytest.approx(lost[0], rel=1e-3)
    assert found[-1] == pytest.approx(lost.sum(), rel=1e-3)
    assert np.diff(found).min() > -1e-3 * lost[1] / 100


ISOLATORS = {
    "lead_rubber_bearing": {"yield_force": 1e5, "post_yield_stiffness": 1.5e6},
    "friction_pendulum": {"friction_coefficient": 0.05, "radius": 2.0, "weight": 3e6},
}


@along_protocols
def test_lead_rubber_bearing(protocol, measured):
    drift = PROTOCOLS[protocol]
    theirs = material_forces("Steel01", [1e5, STIFFNESS, 1.5e6 / STIFFNESS], drift)
    ours = forces(drift, law="lead_rubber_bearing", **ISOLATORS["lead_rubber_bearing"])
    claim = "forces of storeys of law `lead_rubber_bearing`, over the yield force"
    measured(claim, truth="OpenSees' Steel01", value=difference(ours, theirs) / 1e5, bound=1e-9)


@along_protocols
def test_friction_pendulum_against_the_bearing_element(protocol, measured):
    from opensees import opensees

    drift = PROTOCOLS[protocol]
    p = ISOLATORS["friction_pendulum"]
    ours = forces(drift, law="friction_pendulum", **p)
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.node(1, 0.0, 0.0)
    ops.node(2, 0.0, 0.0)
    ops.fix(1, 1, 1, 1)
    ops.fix(2, 0, 0, 1)
    ops.frictionModel("Coulomb", 1, p["friction_coefficient"])
    ops.uniaxialMaterial("Elastic", 1, 1e12)
    ops.uniaxialMaterial("Elastic", 2, 1e3)
    ops.element("singleFPBearing", 1, 1, 2, 1, p["radius"], STIFFNESS, "-P", 1, "-Mz", 2, "-orient", 0, 1, 0, -1, 0, 0)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(2, 0.0, -p["weight"], 0.0)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormUnbalance", 1e-3, 100)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    assert ops.analyze(1) == 0
    ops.loadConst("-time", 0.0)
    ops.pattern("Plain", 2, 1)
    ops.load(2, 1.0, 0.0, 0.0)
    theirs, at = np.full(drift.size, np.nan), 0.0
    for step, value in enumerate(drift):
        ops.integrator("DisplacementControl", 2, 1, float(value - at))
        assert ops.analyze(1) == 0
        ops.reactions()
        theirs[step], at = -ops.nodeReaction(1, 1), value
    ops.wipe()
    # The bearing's normal force is not quite the weight: along the slope of the surface, d / R, the shear adds to it.
    # Ours leaves out that share, (mu + d / R) d / R, of the force: at most 0.2 % here.
    slope = np.abs(drift).max() / p["radius"]
    share = (p["friction_coefficient"] + slope) * slope
    assert share < 2.2e-3
    largest = p["weight"] * (p["friction_coefficient"] + slope)
    claim = "forces of storeys of law `friction_pendulum`: errors over the share of the force that it leaves out"
    measured(claim, truth="OpenSees' singleFPBearing", value=difference(ours, theirs) / (share * largest), bound=1.1)


DISSIPATIVE = {
    "friction damper": {"devices": ("friction_damper",), "slip_force": 4e4, "brace_stiffness": 8e7},
    "gap": {"devices": ("gap",), "clearance": 0.01, "contact_stiffness": 3e8, "restitution": 0.5},
    "lead-rubber bearing": {"law": "lead_rubber_bearing", **ISOLATORS["lead_rubber_bearing"]},
    "friction pendulum": {"law": "friction_pendulum", **ISOLATORS["friction_pendulum"]},
    "all in a Bouc-Wen storey": {
        "law": "bouc_wen", "yield_force": 1e5, "hardening_ratio": 0.05, "devices": ("friction_damper", "gap"),
        "slip_force": 4e4, "brace_stiffness": 8e7, "clearance": 0.01, "contact_stiffness": 3e8, "restitution": 0.5,
    },
}  # fmt: skip


@along_protocols
@pytest.mark.parametrize("name", DISSIPATIVE)
def test_dissipated_energy_never_falls(name, protocol):
    fine = finer(PROTOCOLS[protocol], 40)
    found = wd.storey_hysteresis(storey(**DISSIPATIVE[name]), fine)
    dissipated = found.dissipated_energy.values[:, 0]
    assert dissipated[-1] > 100
    # A step across a corner of the path misses the triangle there: at most the change of stiffness times step^2 / 8.
    corner = 1.2e9 * np.abs(np.diff(fine)).max() ** 2 / 8
    assert np.diff(dissipated).min() > -corner


@every_kind
def test_friction_takes_the_same_off_each_swing(method, dtype):
    # Coulomb friction F beside a spring k: each half swing is shorter by 2 F / k (Den Hartog 1931); the brace is stiff.
    mass, stiffness, slip = 1e5, 4e6, 2e4
    building = wd.ShearBuilding(
        mass, stiffness, 3.0, devices=("friction_damper",), slip_force=slip, brace_stiffness=2000 * stiffness
    )
    period = 2 * np.pi * np.sqrt(mass / stiffness)
    velocity = 0.6
    run = history(building, wd.FreeVibration(3 * period, velocity=velocity), 3 * period / 30000, method, dtype)
    u = run.displacement.values[0, :, 0]
    first = -slip / stiffness + np.sqrt((slip / stiffness) ** 2 + mass * velocity**2 / stiffness)
    swings = first - 2 * slip / stiffness * np.arange(6)
    swings = swings[swings > 1.2 * slip / stiffness]  # those that pass the middle
    halves = np.split(np.abs(u), np.flatnonzero(u[1:-1] * u[2:] < 0) + 2)
    found = [half.max() for half in halves[: swings.size]]
    # The joint gives by F / (2000 k) before it slips: a thousandth of the loss, once a swing.
    np.testing.assert_allclose(found, swings, rtol=0, atol=4e-3 * slip / stiffness)
    assert swings.size >= 4


FREE = 1e-3  # N/m: a storey that is as good as none
SPRINGLESS = {"mass": 1e5, "stiffness": FREE, "height": 3.0}


@pytest.mark.parametrize("restitution", [1.0, 0.7, 0.3])
@every_kind
def test_a_stop_turns_the_velocity_back(method, dtype, restitution):
    building = wd.ShearBuilding(
        **SPRINGLESS, devices=("one_sided_gap",), clearance=0.02, contact_stiffness=1e8, restitution=restitution
    )
    run = history(building, wd.FreeVibration(0.2, velocity=0.5), 5e-5, method, dtype)
    velocity = run.velocity.values[0, :, 0]
    # It meets the stop after 40 ms and is free again after at most 140 ms; corners within a step of 50 us are missed.
    assert velocity[-1] == pytest.approx(-restitution * 0.5, rel=2e-3 if dtype == "float64" else 5e-3)
    lost = 0.5 * 1e5 * 0.5**2 * (1 - restitution**2)
    assert run.hysteretic_energy.sum().item() == pytest.approx(lost, rel=5e-3, abs=20)
    assert abs(run.energy_balance_error.item()) < 2e-3


@pytest.mark.meant_as_given("damper_damping_ratio")  # a mass with hardly a spring, which the damper alone stops
@every_power(1.0, 0.5, 0.3)
def test_viscous_damper_stops_a_mass(method, dtype, exponent):
    # m v' = -c v^a has v^(1-a) = v0^(1-a) - (1-a) c t / m, down to the range in which the force is linear.
    mass, coefficient, start, end = 1e5, 2e5, 1.0, 0.1
    building = wd.ShearBuilding(
        **SPRINGLESS, devices=("viscous_damper",), damper_coefficient=coefficient, velocity_exponent=exponent
    )
    duration = 1.0
    if exponent == 1:
        expected = start * np.exp(-coefficient / mass * np.linspace(0, duration, 1001))
    else:
        rest = start ** (1 - exponent) - (1 - exponent) * coefficient / mass * np.linspace(0, duration, 1001)
        expected = np.maximum(rest, 0) ** (1 / (1 - exponent))
    run = history(building, wd.FreeVibration(duration, velocity=start), 1e-3, method, dtype)
    moves = expected > end
    assert moves.sum() > 100
    # Of second order in the step of 1 ms, where v changes within 0.1 s; float32 by its roundings.
    np.testing.assert_allclose(run.velocity.values[0, moves, 0], expected[moves], rtol=1e-5)
    assert abs(run.energy_balance_error.item()) < 1e-4
    left = 0.5 * mass * run.velocity.values[0, -1, 0] ** 2
    assert run.viscous_energy.item() == pytest.approx(0.5 * mass * start**2 - left, rel=1e-4)


@every_power(1.0, 0.6, 0.3)
def test_viscous_damper_dissipates_per_cycle(method, dtype, exponent):
    # Taken through A (1 - cos w t) by the force that this needs, it dissipates lambda c w^a A^(1+a) a cycle, lambda =
    # 2^(2+a) Gamma(1 + a/2)^2 / Gamma(2 + a) (FEMA 274, equation C9-36).
    mass, stiffness, coefficient, amplitude, omega, cycles = 1e5, 4e6, 2e5, 0.05, 8.0, 3
    interval = 2 * np.pi / omega / 800
    time = interval * np.arange(800 * cycles + 1)
    velocity = amplitude * omega * np.sin(omega * time)
    force = mass * amplitude * omega**2 * np.cos(omega * time) + stiffness * amplitude * (1 - np.cos(omega * time))
    force += coefficient * np.sign(velocity) * np.abs(velocity) ** exponent
    building = wd.ShearBuilding(
        mass, stiffness, 3.0, devices=("viscous_damper",), damper_coefficient=coefficient, velocity_exponent=exponent,
        linear_velocity=1e-3,
    )  # fmt: skip
    run = history(building, wd.ForceHistory(force[:, None], interval), interval / 4, method, dtype)
    factor = 2 ** (2 + exponent) * gamma(1 + exponent / 2) ** 2 / gamma(2 + exponent)
    expected = cycles * factor * coefficient * omega**exponent * amplitude ** (1 + exponent)
    # The force is linear between samples and where the velocity turns: it misses the power's kink by a sample.
    assert run.viscous_energy.item() == pytest.approx(expected, rel=3e-3)


@pytest.mark.usefixtures("unoptimised")  # one run is held to another
def test_devices_of_no_strength_change_nothing():
    frame = {"law": "bilinear", "yield_force": 4e4, "hardening_ratio": 0.1, "damping": "rayleigh"}
    frame |= {"mass": [2e3, 1e3], "stiffness": [6e5, 4e5], "height": 3.0, "damping_ratio": 0.05}
    devices = {
        "devices": ("friction_damper", "viscous_damper", "gap"), "slip_force": 0.0, "brace_stiffness": 1e6,
        "damper_coefficient": 0.0, "velocity_exponent": 0.5, "clearance": 0.01, "contact_stiffness": 0.0,
    }  # fmt: skip
    load = wd.GroundMotion(8 * np.sin(0.3 * np.arange(100)), 0.02)
    scenes = [wd.Scene(wd.ShearBuilding(**frame, **own), load, tail=1.0) for own in ({}, devices)]
    plain, with_devices = (wd.simulate(scene, step=0.002, dtype="float64", device="cpu") for scene in scenes)
    for name in ("peak_storey_drift_ratio", "hysteretic_energy", "viscous_energy"):
        np.testing.assert_allclose(with_devices[name], plain[name], rtol=1e-10, atol=1e-12)


FRICTION = {"devices": ("friction_damper",), "slip_force": 1.0, "brace_stiffness": 1.0}
VISCOUS = {"devices": ("viscous_damper",), "damper_coefficient": 1.0}
GAP = {"devices": ("gap",), "clearance": 0.1, "contact_stiffness": 1.0}
BOUC_WEN = {"yield_force": 1.0, "hardening_ratio": 0.1}
OF_STOREYS = {"damping": "rayleigh", "damping_ratio": 0.05}
BEARINGS = {"law": ("elastic", "lead_rubber_bearing"), "yield_force": 1.0}
OF_ONE = {"law": "bouc_wen", "yield_force": 1.0, "hardening_ratio": 0.1}
MIXED = OF_ONE | {"law": ("bouc_wen", "elastic")}
PENDULUM = {"law": "friction_pendulum", "friction_coefficient": 0.1, "weight": 1.0}


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (FRICTION | {"brace_stiffness": [1.0, 0.0]}, ["brace_stiffness", "storey 2", "above 0"]),
        (FRICTION | {"slip_force": [1.0, -10.0]}, ["slip_force", "storey 2", "at least 0"]),
        (VISCOUS | {"velocity_exponent": 1.5}, ["velocity_exponent", "storey 1", "at most 1"]),
        (GAP | {"clearance": -0.1}, ["clearance", "storey 1", "at least 0"]),
        (GAP | {"restitution": 1.2}, ["restitution", "storey 1", "at most 1"]),
        ({"devices": ("gap",), "clearance": 0.1}, ["contact_stiffness", "missing"]),
        ({"devices": ("spring",)}, ["device 'spring'", "friction_damper"]),
        ({"devices": ("gap", "one_sided_gap")}, ["share", "'clearance'"]),
        ({"law": ("bilinear", "bouc_wen"), **BOUC_WEN, "yield_force": [1.0, np.nan]}, ["yield_force", "storey 2"]),
        ({"law": ("bilinear", "bouc_wen"), "hardening_ratio": 0.1}, ["yield_force is missing at storey 1", "bilinear"]),
        ({"law": ("elastic", "bouc_wen"), **BOUC_WEN, "gamma": 0.9}, ["gamma", "storey 2", "<= beta"]),
        ({"law": ("elastic", "plastic")}, ["storey law 'plastic'", "bilinear"]),
        (
            PENDULUM | {"radius": 2.0, "friction_coefficient": 5},
            ["friction_coefficient is 5 at", "below 1; 5 % is 0.05"],
        ),
        ({"law": ("elastic",) * 3}, ["mass has 2 values and law has 3"]),
        (MIXED | {"damping": "rayleigh"}, ["damping_ratio (viscous damping ratio) is missing"]),
        (MIXED | {"devices": ("gap",), "contact_stiffness": 1.0}, ["clearance (", ") is missing"]),
        (MIXED | {"yield_force": [np.nan, 1.0]}, ["yield_force is nan at storey 1; it must be finite and above 0"]),
        (MIXED | {"exponent": [np.nan, 1.0]}, ["exponent is nan at storey 1"]),
        (
            {"law": ("elastic", "bilinear"), "yield_force": 1.0},
            ["hardening_ratio is missing at storey 2", "'bilinear'"],
        ),
        (BEARINGS | {"post_yield_stiffness": 1e3}, ["post_yield_stiffness", "storey 2", "below"]),
        (PENDULUM | {"radius": 1e-3}, ["weight over radius", "storey 1", "below"]),
        (OF_STOREYS | {"damped_storeys": (1, 3)}, ["damped_storeys", "1 to 2"]),
        (OF_STOREYS | {"damped_storeys": (1, 2), "damping_modes": (1, 2)}, ["damping_modes", "given together"]),
    ],
)
def test_bad_devices(parameters, words):
    with pytest.raises(ValueError, match=".*".join(map(re.escape, words))):
        wd.ShearBuilding([1.0, 1.0], 100.0, 3.0, **parameters)


def test_defaults_are_those_of_each_law():
    building = wd.ShearBuilding([1.0, 1.0], 100.0, 3.0, **MIXED)
    assert building.parameters["exponent"][0] == wd.ShearBuilding(1.0, 100.0, 3.0, **OF_ONE).parameters["exponent"][0]


def test_bad_scatter_of_a_device_names_it():
    building = wd.ShearBuilding(
        [1e3, 1e3], 1e5, 3.0, law=("lead_rubber_bearing", "elastic"), yield_force=1e3, post_yield_stiffness=1e4
    )
    scene = wd.Scene(
        building,
        wd.FreeVibration(1.0, velocity=0.1),
        scatter={"post_yield_stiffness": wd.RandomValue(wd.Uniform(1e5, 2e5))},
    )
    with pytest.raises(ValueError, match=r"post_yield_stiffness .*structure 0, storey 1.*below"):
        wd.simulate(scene, structures=4, device="cpu")


@pytest.mark.parametrize(
    "damping",
    [
        {"damping": "none"},
        {"damping": "storey", "damping_coefficient": [1e5, 0.0, 2e5]},
        {"damping": "rayleigh", "damping_ratio": 0.03},
        {"damping": "mass_proportional", "damping_ratio": 0.03},
        {"damping": "modal", "damping_ratio": 0.03},
    ],
    ids=lambda damping: damping["damping"],
)
def test_linear_dampers_on_elastic_storeys_are_integrated_exactly(damping):
    mass, stiffness, dampers = np.array([2e5, 2e5, 1e5]), np.array([2e8, 1.6e8, 1.2e8]), np.array([0.0, 2e6, 5e5])
    device = {"devices": ("viscous_damper",), "damper_coefficient": dampers}
    building = wd.ShearBuilding(mass, stiffness, 3.0, **device, **damping)
    scene = wd.Scene(building, wd.FreeVibration(2.0, velocity=[0.1, 0.3, 0.2]), recorders=("drift", "energy"))
    run = wd.simulate(scene, method="exact", step=0.02, dtype="float64", device="cpu", histories=wd.Histories())
    steps = np.eye(3) - np.eye(3, k=-1)
    own = np.array(damping.get("damping_coefficient", [0.0] * 3), float)
    elastic, viscous = (steps.T @ np.diag(values) @ steps for values in (stiffness, own + dampers))
    squared, shape = eigh(elastic, np.diag(mass))
    omega, ratio = np.sqrt(squared), damping.get("damping_ratio", 0.0)
    of_modes = {
        "rayleigh": 2 * ratio / (omega[0] + omega[1]) * (omega[0] * omega[1] + squared),
        "mass_proportional": np.full(3, 2 * ratio * omega[0]),
        "modal": 2 * ratio * omega,
    }
    inverse = shape.T * mass
    viscous += inverse.T @ np.diag(of_modes.get(damping["damping"], np.zeros(3))) @ inverse
    rates = np.block([[np.zeros((3, 3)), np.eye(3)], [-elastic / mass[:, None], -viscous / mass[:, None]]])
    state = expm(rates * 2.0) @ [0, 0, 0, 0.1, 0.3, 0.2]
    np.testing.assert_allclose(run.displacement.values[0, -1], state[:3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.velocity.values[0, -1], state[3:], rtol=0, atol=1e-11)
    assert abs(run.energy_balance_error.item()) < 1e-3  # its viscous work is summed up step by step


def test_exact_does_not_take_power_law_dampers():
    power = {"devices": ("viscous_damper",), "damper_coefficient": 1e5, "velocity_exponent": 0.5}
    scene = wd.Scene(wd.ShearBuilding(2e5, 2e8, 3.0, **power), wd.FreeVibration(1.0, velocity=0.1))
    with pytest.raises(ValueError, match="needs a linear structure, whose viscous dampers have the exponent 1"):
        wd.simulate(scene, method="exact", device="cpu")
    scattered = {"velocity_exponent": wd.RandomValue(wd.Uniform(0.5, 1.0))}
    linear = wd.ShearBuilding(2e5, 2e8, 3.0, **power | {"velocity_exponent": 1.0})
    with pytest.raises(ValueError, match="'exact' does not fit"):
        wd.simulate(
            wd.Scene(linear, wd.FreeVibration(1.0, velocity=0.1), scatter=scattered), method="exact", structures=2
        )
