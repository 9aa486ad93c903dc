"""Equipment and absorbers: reference cases, closed forms, an independent integration, and invalid input."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import complex_modes, peak, response
from lumped_cases import pulse
from scipy.linalg import solve_continuous_lyapunov

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
SETTINGS = {"dtype": "float64", "device": "cpu"}


def run_of(building, motion, step=0.0005, tail=0.0, **changed):
    return wd.simulate(wd.Scene(building, motion, tail=tail), step=step, **SETTINGS, **changed)


def matrices_of(structure):
    found = structure.central_matrices(structure.parameters)
    return found["mass"], found["damping"], found["stiffness"]


# L18: mass over that of a floor; peaks; complex modes.
EQUIPMENT = {
    0.001: (
        (0.04878774, 9.179218, 99.86774, 0.5228149),
        (13.81759, 13.82141, 36.18119),
        (0.01519565, 0.04480823, 0.04999986),
    ),
    0.01: (
        (0.04555644, 8.434299, 81.55977, 0.4269732),
        (13.30908, 14.34644, 36.18889),
        (0.0294535, 0.03054309, 0.04999863),
    ),
}


@pytest.mark.parametrize("share", EQUIPMENT)
@pytest.mark.parametrize("is_lumped", [False, True])
def test_tuned_equipment_has_the_reference_response(share, is_lumped):
    peaks, frequencies, ratios = EQUIPMENT[share]
    building = wd.ShearBuilding([100e3] * 2, 50e6, 3.0, damping="modal", damping_ratio=0.05)
    carrier = wd.lumped_chain(building) if is_lumped else building
    equipped = wd.with_equipment(carrier, "u2", share * 100e3, tuned_to_mode=1, damping_ratio=0.01)
    size, ratio = complex_modes(*matrices_of(equipped))
    np.testing.assert_allclose(size, frequencies, rtol=4e-7)
    np.testing.assert_allclose(ratio, ratios, rtol=4e-7)
    run = run_of(equipped, pulse(2.0, 0.5, 0.4, 12.0))
    found = [
        run["peak_displacement"].sel(dof="u2").item(),
        run["peak_acceleration"].sel(dof="u2").item(),
        run["peak_acceleration"].sel(dof="equipment").item(),
        run["peak_spring_deformation"].sel(spring="equipment").item(),
    ]
    np.testing.assert_allclose(found, peaks, rtol=3e-5)


def oscillator() -> wd.LumpedStructure:
    """L16: m = 1000 t, T = 2 s, 2 %."""
    stiffness = 1e6 * np.pi**2
    dashpot = 2 * 0.02 * np.pi * 1e6
    return wd.LumpedStructure(
        {"structure": 1e6},
        [wd.Spring("structure", {"structure": 1.0}, stiffness=stiffness, damping_coefficient=dashpot)],
    )


def test_an_absorber_with_an_inerter_has_the_reference_response():
    damped = wd.with_absorber(oscillator(), "structure", mass_ratio=0.02, inertance_ratio=0.1)
    assert damped.springs[1].stiffness == pytest.approx(980073.636, rel=1e-9)
    assert damped.springs[1].damping_coefficient == pytest.approx(113864.491, rel=1e-8)
    size, ratio = complex_modes(*matrices_of(damped))
    np.testing.assert_allclose(size, [2.571473, 3.491457], rtol=3e-7)
    np.testing.assert_allclose(ratio, [0.08830185, 0.105152], rtol=1e-6)
    time = 0.01 * np.arange(2001)
    motion = wd.GroundMotion(np.sin(np.pi * time) * np.exp(-0.1 * time), 0.01)
    run = run_of(damped, motion, 0.001, tail=10.0, histories=wd.Histories([0], every=1))
    assert run["peak_displacement"].sel(dof="structure").item() == pytest.approx(0.2707331, rel=5e-6)
    assert run["peak_displacement"].sel(dof="absorber").item() == pytest.approx(0.6747053, rel=5e-6)
    assert run["peak_spring_deformation"].sel(spring="absorber").item() == pytest.approx(0.702425, rel=5e-6)
    assert run["peak_acceleration"].sel(dof="structure").item() == pytest.approx(2.676774, rel=5e-6)
    total = run["acceleration"].isel(history=0).sel(dof="absorber")
    ground = np.interp(total["time"], time, motion.acceleration)
    during = total["time"].values <= 20.0
    force = 0.1e6 * np.abs(total.values - ground)[during].max()
    assert force == pytest.approx(619038.9, rel=1e-5)
    alone = run_of(oscillator(), motion, 0.001, tail=10.0)
    assert alone["peak_displacement"].item() == pytest.approx(0.7252796, rel=5e-6)


# L16: minimum of the displacement variance of an undamped structure under white noise, omega = 1, two-sided density 1.
@pytest.mark.parametrize(
    ("mu", "beta", "variance"), [(0.02, 0.1, 18.42783), (0.02, 0.0, 45.65377), (0.1, 0.3, 11.00195)]
)
def test_the_default_absorber_has_the_least_variance_under_white_noise(mu, beta, variance):
    bare = wd.LumpedStructure({"u": 1.0}, [wd.Spring("k", {"u": 1.0}, stiffness=1.0)])

    def displacement_variance(frequency: float, ratio: float) -> float:
        structure = wd.with_absorber(
            bare, "u", mass_ratio=mu, inertance_ratio=beta, frequency_ratio=frequency, damping_ratio=ratio
        )
        mass, damping, stiffness = matrices_of(structure)
        inverse = np.linalg.inv(mass)
        system = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])
        load = np.concatenate([[0, 0], -inverse @ [1.0, mu]])
        return float(solve_continuous_lyapunov(system, -2 * np.pi * np.outer(load, load))[0, 0])

    default = wd.with_absorber(bare, "u", mass_ratio=mu, inertance_ratio=beta).springs[1]
    moving = mu + beta
    f = np.sqrt(default.stiffness / moving)
    zeta = default.damping_coefficient / (2 * moving * f)
    least = displacement_variance(f, zeta)
    assert least == pytest.approx(variance, rel=3e-7)
    for change in (0.99, 1.01):
        assert displacement_variance(change * f, zeta) > least
        assert displacement_variance(f, change * zeta) > least


def test_an_absorber_is_tuned_to_the_modal_mass():
    # A tuned mass damper without inerter is that of a ShearBuilding with the same ratios.
    building = wd.ShearBuilding([1e5] * 3, 1e8, 3.0)
    other = building.with_tuned_mass_damper(0.03, 0.95, 0.1)
    found = wd.with_absorber(building, "u3", mass_ratio=0.03, frequency_ratio=0.95, damping_ratio=0.1)
    np.testing.assert_allclose(found.parameters["mass"], other.parameters["mass"], rtol=1e-10)
    np.testing.assert_allclose(found.parameters["stiffness"], other.parameters["stiffness"], rtol=1e-10)
    assert found.modal()["period"].values == pytest.approx(other.modal()["period"].values, rel=1e-10)


def test_an_inerter_between_floors_has_the_response_of_an_independent_integration():
    # Modal damping of the bare building; the inerter connects the absorber with the first floor. Matrix exponential.
    mass, stiffness = np.array([2e5, 2e5, 1e5]), np.array([1e8, 8e7, 5e7])
    building = wd.ShearBuilding(mass, stiffness, 3.0, damping="modal", damping_ratio=0.03)
    ratios = {"mass_ratio": 0.02, "inertance_ratio": 0.1, "frequency_ratio": 0.9, "damping_ratio": 0.2}
    damped = wd.with_absorber(building, "u3", inerter_to="u1", **ratios)
    rows = np.eye(3) - np.eye(3, k=-1)
    elastic = rows.T @ np.diag(stiffness) @ rows
    root = np.sqrt(mass)
    squared, vectors = np.linalg.eigh(elastic / np.outer(root, root))
    shape = vectors / root[:, None]
    momentum = mass[:, None] * shape
    modal = (momentum * (0.06 * np.sqrt(squared))) @ momentum.T
    generalised = 1 / shape[2, 0] ** 2
    b, own = 0.1 * generalised, 0.02 * generalised
    omega = 0.9 * np.sqrt(squared[0])
    link = np.array([0.0, 0, -1, 1])
    inerter = np.array([-1.0, 0, 0, 1])
    m = np.diag([*mass, own]) + b * np.outer(inerter, inerter)
    k, c = np.zeros((4, 4)), np.zeros((4, 4))
    k[:3, :3], c[:3, :3] = elastic, modal
    k += (own + b) * omega**2 * np.outer(link, link)
    c += 2 * 0.2 * omega * (own + b) * np.outer(link, link)
    motion = pulse(3.0, 0.5, 0.4, 6.0)
    found = response(m, c, k, np.array([*mass, own]), motion.acceleration)
    due = [peak(found["time"], found["u"][:, i], found["v"][:, i])[0] for i in range(4)]
    np.testing.assert_allclose(run_of(damped, motion)["peak_displacement"][0], due, rtol=1e-5)


def test_equipment_on_a_rotating_floor_moves_with_its_place():
    frames = [wd.PlanFrame(f"{axis}{side}", (side, side), axis, 3e7) for axis in "xy" for side in (-4.0, 5.0)]
    plan = [[-10.0, 10.0], [-6.0, 6.0]]
    building = wd.TorsionalBuilding(
        [2e5, 1e5], plan, frames, mass_centre=(1.0, 2.0), damping="modal", damping_ratio=0.05
    )
    rigid = wd.with_equipment(
        building, {"ux2": 1.0, "theta2": -6.0}, 1.0, period=0.002, damping_ratio=0.05, name="panel"
    )
    both = wd.PairOfMotions(pulse(3.0, 0.7, 0.4, 3.0), pulse(2.0, 0.5, 0.4, 3.0))
    bare = run_of(wd.with_equipment(building, "ux1", 1.0, period=0.002, damping_ratio=0.05), both, 2e-4)
    run = run_of(rigid, both, 2e-4, histories=wd.Histories([0], every=1))
    np.testing.assert_allclose(run["peak_output"], bare["peak_output"], rtol=1e-4)
    last = run["displacement"].isel(history=0)
    place = last.sel(dof="ux2") - 6 * last.sel(dof="theta2")
    panel = last.sel(dof="panel")
    assert np.abs(panel - place).max() < 1e-3 * np.abs(place).max()
    assert np.abs(last.sel(dof="theta2")).max() * 6 > 0.05 * np.abs(place).max()


BUILDING = wd.ShearBuilding([1e5] * 2, 1e8, 3.0)
EQUIPPED = {"damping_ratio": 0.01}
WRONG = [
    (lambda: wd.with_equipment(BUILDING, "u2", 1e3, **EQUIPPED), "give period= in s or tuned_to_mode=.*got neither"),
    (lambda: wd.with_equipment(BUILDING, "u2", 1e3, **EQUIPPED, period=1.0, tuned_to_mode=1), "got both"),
    (
        lambda: wd.with_equipment(BUILDING, "u3", 1e3, **EQUIPPED, period=1.0),
        "at names the unknown degree of freedom 'u3'",
    ),
    (lambda: wd.with_equipment(BUILDING, {"u2": 0.0}, 1e3, **EQUIPPED, period=1.0), "coefficient other than 0"),
    (
        lambda: wd.with_equipment(BUILDING, "u2", 0.0, **EQUIPPED, period=1.0),
        r"mass \[kg\] must be a finite number above",
    ),
    (
        lambda: wd.with_equipment(BUILDING, "u2", 1e3, **EQUIPPED, tuned_to_mode=3),
        "tuned_to_mode must be a whole number",
    ),
    (
        lambda: wd.with_equipment(BUILDING, "u2", 1e3, **EQUIPPED, period=1.0, name="u1"),
        "already has the name 'u1': give another name=",
    ),
    (lambda: wd.with_absorber(BUILDING, "u2", mass_ratio=0.0), "mass_ratio must be a finite number above 0"),
    (lambda: wd.with_absorber(BUILDING, "u2", mass_ratio=0.02, inertance_ratio=-0.1), "inertance_ratio"),
    (
        lambda: wd.with_absorber(BUILDING, "u2", mass_ratio=0.02, inertance_ratio=0.1, inerter_to="u1"),
        "give frequency_ratio= and damping_ratio=",
    ),
    (lambda: wd.with_absorber(BUILDING, "u2", mass_ratio=0.02, inerter_to="u0"), "inerter_to names the unknown"),
    (lambda: wd.with_absorber(BUILDING, "u2", mass_ratio=0.02, mode=5), "mode must be a whole number"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_wrong_arguments_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_an_absorber_at_a_node_is_refused():
    frames = [wd.PlanFrame(f"{axis}{side}", (side, side), axis, 3e7) for axis in "xy" for side in (-5.0, 5.0)]
    symmetric = wd.TorsionalBuilding([1e5], [[-10.0, 10.0], [-6.0, 6.0]], frames)
    mode = 1 + int(np.abs(symmetric.modal()["shape"].sel(dof="theta1").values).argmax())
    with pytest.raises(ValueError, match=f"degree of freedom 'ux1' does not move in mode {mode}"):
        wd.with_absorber(symmetric, "ux1", mass_ratio=0.02, mode=mode)
    with pytest.raises(TypeError, match="takes a LumpedStructure or ShearBuilding, got dict"):
        wd.with_absorber({}, "u1", mass_ratio=0.02)
