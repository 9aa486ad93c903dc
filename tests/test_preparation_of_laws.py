"""Kernels that prepare structures with every law, device and damping: they agree with the host.

Kernels are compiled for a few laws by default. For the others, NumPy computes what was recorded for the kernels.
"""

import numpy as np
import pytest
from law_contract import ELEMENTS, ROWS, STIFFNESS, STOREYS, drawn_storeys
from law_rows import VARIANTS
from method_sources import thorough_unless
from prepared_structures import DEVICES, by_host, check_divisions, check_rows, prepared, recorded

import warpdyn as wd
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.sampler import Sampler
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.preparation import preparation
from warpdyn.engine.laws.law import StoreyElement
from warpdyn.model.structures.shear_building import DAMPING

SEED, LEVELS = 3, 2
# Stiffnesses of the springs of an asymmetric multilinear storey are differences of sums of up to 5 stiffnesses.
ROUNDING_OF_SPRINGS = 5 * np.finfo(float).eps * STIFFNESS
# Of each group of laws with similar coefficients the variant with the most coefficients.
COMPILED = (
    "hysteretic_asymmetric",
    "ibarra_medina_krawinkler_pinching_asymmetric",
    "multilinear_3_asymmetric",
    "pinching4_energy_damage_asymmetric",
    "gap",
    "saws",
)
# It takes 5 s to find parameters for these; the other variants of their laws have all of their coefficients.
SLOWLY_DRAWN = ("multilinear_3", "pinching4_cycle_damage", "pinching4_cycle_damage_asymmetric")
# Of each law or device whose parameters may contradict each other: a parameter, and a value that is within its bounds.
# Gaps have only bounds.
CONTRADICTIONS = {
    "bouc_wen": ("gamma", 1e3),
    "baber_noori": ("gamma", 1e3),
    "hysteretic": ("ductility_2", 0.5),
    "ibarra_medina_krawinkler_bilinear": ("capping_force_ratio", 1e6),
    "ibarra_medina_krawinkler_peak_oriented": ("capping_force_ratio", 1e6),
    "ibarra_medina_krawinkler_pinching": ("capping_force_ratio", 1e6),
    "lead_rubber_bearing": ("post_yield_stiffness", 2 * STIFFNESS),
    "friction_pendulum": ("weight", 1e12),
    "menegotto_pinto": ("transition_curvature", 0.5),
    "trilinear": ("force_ratio_2", 1e3),
    "quadrilinear": ("force_ratio_3", 1e3),
    "peak_oriented": ("cracked_stiffness_ratio", 1e-6),
    "takeda": ("cracked_stiffness_ratio", 1e-6),
    "pinching4": ("unloading_force", 0.999),
    "saws": ("drift_at_peak_force", 1e-9),
    "self_centring": ("slip_drift", 1e-6),
    "friction_damper": ("brace_stiffness", 0.0),
    "maxwell_damper": ("brace_stiffness", 0.0),
    "gap": ("restitution", 2.0),
    "one_sided_gap": ("restitution", 2.0),
}
PEAK_ORIENTED = {"yield_force": 3e5, "cracking_ratio": 0.4, "cracked_stiffness_ratio": 0.5, "hardening_ratio": 0.02}
BY_HOST = ("modal",)  # its damping matrix needs the modes
DAMPINGS = [name for name in DAMPING if name not in BY_HOST]


def varied(name, row):
    """Return the parameters of a law or device: those of the nominal building, and those of each drawn building."""
    element, drawn = ELEMENTS[name], drawn_storeys(name, row)
    values = {key: np.ravel(drawn[key]) for key in element.parameters if key in drawn}
    # The storeys of a building have parameters of two storeys that were drawn.
    given = {
        key: np.stack([np.roll(each, level) for level in range(LEVELS)], axis=1)
        for key, each in values.items()
        if np.ptp(each)
    }
    return {key: float(each[0]) for key, each in values.items()}, given


def run_of(name, row, damping, contradiction=None):
    """Return a run of buildings whose parameters all vary that may vary without another set of device functions.

    Args:
        name: Name of the law or device.
        row: Name of its set of device functions.
        damping: Damping of the buildings.
        contradiction: A parameter and its value at the second storey of structure 7.
    """
    nominal, given = varied(name, row)
    if contradiction is not None:
        key, value = contradiction
        given.setdefault(key, np.full((STOREYS, LEVELS), nominal[key]))[7, 1] = value
    element = ELEMENTS[name]
    own = {"devices": [element(**nominal)]} if element.is_device else {"law": element(**nominal)}
    ratio = {"none": {}, "storey": {"damping_coefficient": [1e5, 0.0]}}.get(damping, {"damping_ratio": 0.05})
    building = wd.ShearBuilding(
        mass=[2e4] * LEVELS, stiffness=[STIFFNESS] * LEVELS, height=[3.0] * LEVELS, damping=damping, **ratio, **own
    )
    spread = {key: wd.GivenValues(each) for key, each in given.items()}
    spread["mass"] = wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="storey", storey_correlation=0.5)
    spread["stiffness"] = wd.RandomFactor(wd.Lognormal(1.0, 0.001))
    motion = wd.GroundMotion(np.random.default_rng(1).normal(size=50), 0.01, "noise")
    scene = wd.Scene(building, wd.Stripes([motion], [0.1], wd.PeakGroundAcceleration()), spread, recorders=("drift",))
    how, where = Integration(method="rk4", dtype="float64"), Execution(device="cpu")
    return build_run(scene, STOREYS, how, where, seed=SEED)


def slack_of(row, name, count):
    """Return the absolute tolerances of the rows of a field."""
    if name != "coefficients" or not row.startswith("multilinear"):
        return [0.0] * count
    names = VARIANTS[row].coefficients * LEVELS
    return [ROUNDING_OF_SPRINGS if each.startswith("stiffness_") else 0.0 for each in names]


def check_agreement(row, found, expected):
    """Compare fields and vibration with those of the host."""
    check_rows(found, expected, lambda name, count: slack_of(row, name, count))


@pytest.mark.parametrize(
    ("name", "row", "damping"),
    [
        thorough_unless(
            row in COMPILED or (damping == "rayleigh" and row not in SLOWLY_DRAWN),
            *(name, row, damping),
            id=f"{name}-{row}-{damping}",
        )
        for name, row in ROWS
        for damping in DAMPINGS
        if damping != "rayleigh_tangent" or row != "gap"  # gaps need another damping
        if damping != "storey" or name != "elastic"  # linear buildings need the eigenvalues of full matrices
    ],
)
def test_recorded_computation_agrees_with_the_host(name, row, damping):
    run = run_of(name, row, damping)
    found = recorded(run)
    assert found[2] == 0
    check_agreement(row, found[:2], by_host(run))


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    ("name", "row"), [thorough_unless(row in COMPILED and name != "one_sided_gap", name, row) for name, row in ROWS]
)
def test_kernels_agree_with_the_host_in_every_division(name, row, device):
    run = run_of(name, row, "rayleigh")
    fields, vibration, refused, _ = prepared(run, 0, STOREYS, device)
    assert refused == 0
    check_agreement(row, (fields, vibration), by_host(run))
    check_divisions(run, STOREYS, device)


def different_laws(value=None):
    """Return a run of buildings with a law for each storey, a friction damper and both kinds of drift capacity.

    Args:
        value: Ratio of the hardening to the initial stiffness at the second storey of structure 7.
    """
    laws = [wd.laws.Bilinear(yield_force=2e5, hardening_ratio=0.05), wd.laws.PeakOriented(**PEAK_ORIENTED)]
    building = wd.ShearBuilding(
        mass=[2e4] * LEVELS,
        stiffness=[STIFFNESS] * LEVELS,
        height=[3.0] * LEVELS,
        law=laws,
        devices=[wd.laws.FrictionDamper(slip_force=[1e5, 0.0], brace_stiffness=2e7)],
        drift_capacity=0.12,
        drift_ratio_capacity=0.05,
    )
    hardening = np.linspace(0.01, 0.3, 2 * STOREYS).reshape(STOREYS, LEVELS)
    hardening[7, 1] = hardening[7, 1] if value is None else value
    spread = {
        "hardening_ratio": wd.GivenValues(hardening),
        "cracking_ratio": wd.RandomFactor(wd.Uniform(0.9, 1.1)),
        "drift_capacity": wd.RandomFactor(wd.Lognormal(1.0, 0.3), per="storey"),
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="storey"),
    }
    motion = wd.GroundMotion(np.random.default_rng(1).normal(size=50), 0.01, "noise")
    scene = wd.Scene(building, wd.Stripes([motion], [0.1], wd.PeakGroundAcceleration()), spread, recorders=("drift",))
    how, where = Integration(method="rk4", dtype="float64"), Execution(device="cpu")
    return build_run(scene, STOREYS, how, where, seed=SEED)


def test_different_laws_in_the_storeys_agree_with_the_host():
    run = different_laws()
    found = recorded(run)
    assert found[2] == 0
    check_agreement("", found[:2], by_host(run))


# Beyond the bounds of the law of this storey, or the law's own limit.
@pytest.mark.parametrize("value", [1.0, 0.6])
def test_a_contradiction_in_the_law_of_a_storey_is_refused(value, monkeypatch):
    monkeypatch.setattr(Sampler, "check_given_and_medians", lambda sampler: None)  # it refuses values beyond bounds
    run = different_laws(value)
    with pytest.raises(ValueError, match=r"structure 7, storey 2"):
        run.draw(np.arange(STOREYS))
    assert recorded(run)[2] == 1


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_contradiction_in_one_structure_is_refused_as_by_the_host(name, monkeypatch):
    monkeypatch.setattr(Sampler, "check_given_and_medians", lambda sampler: None)  # it refuses values beyond bounds
    row = next(row for each, row in ROWS if each == name)
    run = run_of(name, row, "none", CONTRADICTIONS[name])
    with pytest.raises(ValueError, match=r"structure 7, storey 2"):
        run.draw(np.arange(STOREYS))
    assert recorded(run)[2] == 1


def test_a_run_reports_a_contradiction_as_the_host_does(monkeypatch):
    name, blocks = "trilinear", []
    scene = run_of(name, "multilinear_2", "rayleigh", CONTRADICTIONS[name]).model.scene
    begin = preparation.Preparation.begin
    monkeypatch.setattr(preparation.Preparation, "begin", lambda *block: blocks.append(block) or begin(*block))
    with pytest.raises(ValueError, match=r"^drawn: force_ratio_2 is .* structure 7, storey 2") as by_host:
        wd.simulate(scene, structures=STOREYS, device="cpu")
    assert not blocks
    monkeypatch.setattr(preparation, "is_large_on_gpu", lambda run: True)
    with pytest.raises(ValueError, match=r"^drawn: force_ratio_2 ") as by_device:
        wd.simulate(scene, structures=STOREYS, device="cpu")
    assert len(blocks) == 1
    assert str(by_device.value) == str(by_host.value)


def test_the_rows_of_contradictions_are_the_laws_and_devices_that_can_have_them():
    can = {name for name, element in ELEMENTS.items() if element.problem is not StoreyElement.problem}
    assert can <= CONTRADICTIONS.keys()
