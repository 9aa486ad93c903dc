"""Every scatterable parameter with every storey law: drawn, checked and packed as kernels read it."""

import numpy as np
import pytest
from combination_cases import springs_of_laws

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration

pytestmark = pytest.mark.fast

STOREYS, STRUCTURES = 3, 5  # neither is the other, nor 1
MOTION = wd.GroundMotion(np.sin(0.4 * np.arange(30)), 0.02)
DEVICES = {
    "none": {},
    "viscous_damper": {"damper_coefficient": 2e3, "velocity_exponent": 0.5, "linear_velocity": 0.01},
    "friction_damper": {"slip_force": 100.0, "brace_stiffness": 1e5},
    "gap": {"clearance": 0.01, "contact_stiffness": 1e5},
}
CASES = {f"{spring}": (law, values, "none") for spring, (law, values) in springs_of_laws().items()}
CASES |= {f"elastic+{device}": ("elastic", {}, device) for device in DEVICES if device != "none"}
MIXED = ["bilinear", "ibarra_medina_krawinkler_bilinear", "elastic"]
CASES["mixed"] = (MIXED, dict(springs_of_laws()["ibarra_medina_krawinkler_bilinear"][1], hardening_ratio=0.05), "none")


@pytest.mark.parametrize("case", CASES)
def test_every_parameter_is_scattered(case):
    law, values, device = CASES[case]
    building = wd.ShearBuilding(
        np.full(STOREYS, 1e3),
        4e5,
        3.0,
        law=law,
        devices=() if device == "none" else (device,),
        damping="rayleigh",
        damping_ratio=0.05,
        gravity_load=100.0,
        drift_capacity=1.0,
        **values,
        **DEVICES[device],
    )
    nominal = building.nominal_values
    assert {"mass", "stiffness", "height", "damping_ratio", "gravity_load"} <= set(nominal)
    for name, value in nominal.items():
        # Within the parameter's bounds, and close enough to keep those between parameters.
        violates = building.parameter_table[name].violations
        taken = np.isfinite(value)
        low, high = (1.0 if violates(factor * value[taken]).any() else factor for factor in (0.999, 1.001))
        low, high = (1.0 if name == "beta" else low), (1.0 if name == "gamma" else high)  # gamma must not exceed beta
        scatter = {name: wd.RandomFactor(wd.Uniform(low, high if high > low else 1 + 1e-12))}
        if name == "counts_cycles":  # a switch
            scatter = {name: wd.GivenValues(np.broadcast_to(value, (STRUCTURES, STOREYS)))}
        scene = wd.Scene(building, MOTION, scatter=scatter)
        run = build_run(scene, STRUCTURES, Integration(), Execution(device="cpu"))
        drawn, vibration = run.draw(np.arange(STRUCTURES))
        assert drawn[name].shape == (STRUCTURES, *value.shape)
        packed = run.model.dynamics.pack(run.model.dynamics.parameters_of(drawn), vibration.rayleigh)
        assert {array.shape[-1] for array in packed.values()} <= {1, STRUCTURES}
        assert packed["coefficients"].shape[-1] == STRUCTURES


def test_scattered_beta_and_gamma_are_not_taken_for_equal():
    """A scene looks at a few values of each parameter; of two that are scattered alike these are the same."""
    alike, same = wd.RandomFactor(wd.Lognormal(1.0, 0.05)), wd.GivenValues([0.5] * STRUCTURES)
    building = wd.ShearBuilding([1e5, 1e5], 8e7, 3.0, law="bouc_wen", yield_force=3e5, hardening_ratio=0.05)
    rows = {
        "bouc_wen_1": [
            {"beta": alike, "gamma": alike},
            {"beta": wd.GivenValues(np.linspace(0.5, 0.7, STRUCTURES)), "gamma": alike},
        ],
        "bouc_wen_1_elastic_unloading": [{"yield_force": alike}, {"beta": same, "gamma": same}],
    }
    for row, scatters in rows.items():
        for scatter in scatters:
            assert str(dynamics_of(wd.Scene(building, MOTION, scatter=scatter)).law) == row, scatter


@pytest.mark.parametrize("exponent", [1.0, 2.0, 1.5])
def test_coefficients_of_a_structure_do_not_depend_on_the_others(exponent):
    # The kernel of the scene reads six coefficients. Storeys with exponent 1 or 2 alone would have three or five.
    stiffness, strength, ratio = 4e5, 2e3, 0.1
    building = wd.ShearBuilding(
        1e3, stiffness, 3.0, law="bouc_wen", yield_force=strength, hardening_ratio=ratio, exponent=1.5
    )
    scatter = {"exponent": wd.GivenValues([1.0, 2.0, 1.5])}
    dynamics = dynamics_of(wd.Scene(building, MOTION, scatter=scatter))
    parameters = {name: np.full((1, 1), np.ravel(value)[0]) for name, value in building.parameters.items()}
    packed = dynamics.pack(parameters | {"exponent": np.full((1, 1), exponent)}, np.zeros((1, 2)))
    rate = stiffness / strength
    expected = [ratio * stiffness, (1 - ratio) * strength, rate, 0.5 * rate, 0.5 * rate, exponent]
    np.testing.assert_allclose(packed["coefficients"][:, 0], expected, rtol=1e-12)
