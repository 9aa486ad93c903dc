"""Implicit methods whose name gives a parameter, and what their recorded acceleration is."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.engine.methods.table import CHOICES, METHODS

OMEGA = 6 * np.pi  # of 1 kg, under a force of 1 N at 1.1 times its frequency, at rest (Code_Aster, test SDLD31)
STEP, STEPS = 0.01, 70


def force(time):
    return np.sin(1.1 * OMEGA * time)


def alpha_method(force_lag, mass_lag):
    """Return displacement, velocity, acceleration of the method and of equilibrium at the end, by Chung and Hulbert."""
    gamma, beta = 0.5 - mass_lag + force_lag, (1 - mass_lag + force_lag) ** 2 / 4
    u = v = a = 0.0
    for n in range(STEPS):
        known = u + STEP * v + STEP**2 * (0.5 - beta) * a
        load = (1 - force_lag) * force((n + 1) * STEP) + force_lag * force(n * STEP)
        rest = load - OMEGA**2 * ((1 - force_lag) * known + force_lag * u) - mass_lag * a
        new = rest / (1 - mass_lag + (1 - force_lag) * OMEGA**2 * STEP**2 * beta)
        u, v, a = known + STEP**2 * beta * new, v + STEP * ((1 - gamma) * a + gamma * new), new
    return u, v, a, force(STEPS * STEP) - OMEGA**2 * u


def simulated(method, structure):
    load = wd.HarmonicForce([1.0], 1.1 * OMEGA, STEP * STEPS)
    scene = wd.Scene(structure, load)
    run = wd.simulate(scene, method=method, step=STEP, dtype="float64", device="cpu", histories=wd.Histories((0,)))
    return [run[name].values[0, -1, 0] for name in ("displacement", "velocity", "acceleration")]


STRUCTURES = {
    "full matrices": lambda: wd.LinearSystem([1.0], [[0.0]], [[OMEGA**2]]),
    "chain": lambda: wd.ShearBuilding(1.0, OMEGA**2, 3.0, damping="none"),
}


@pytest.mark.meant_as_given("no_damping")
@pytest.mark.filterwarnings("ignore:the step is too long for the first period")
@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize(
    ("method", "force_lag", "mass_lag"),
    [
        ("hht_alpha", 0.1, 0.0),
        ("hht_alpha(alpha=-0.3)", 0.3, 0.0),
        ("generalised_alpha(spectral_radius=0.5)", 1 / 3, 0.0),
    ],
)
def test_parameters_against_the_recursion(method, force_lag, mass_lag, structure):
    u, v, own, of_equilibrium = alpha_method(force_lag, mass_lag)
    found = simulated(method, STRUCTURES[structure]())
    # Rounding over 70 steps. The acceleration that is recorded is that of the equation of motion at the instant.
    np.testing.assert_allclose(found, [u, v, of_equilibrium], rtol=1e-9)
    assert abs(own - of_equilibrium) > 0.01


def test_the_two_accelerations_of_hht_in_a_published_example():
    # At 0.7 s: the method's own acceleration is the one that other programs print, 2.5090; the mass feels 2.3952.
    u, _, own, of_equilibrium = alpha_method(0.1, 0.0)
    assert (round(own, 4), round(of_equilibrium, 4)) == (2.5090, 2.3952)
    assert u == pytest.approx(-0.0041244464532, rel=1e-9)


@pytest.mark.fast
def test_wilson_theta():
    # Wilson's recursion in closed form: u'' is linear over theta h, and equilibrium holds at its end.
    for theta in (1.4, 1.42):
        method = METHODS[f"wilson_theta(theta={theta})"]
        x = OMEGA * STEP
        start = np.array([0.3, -0.2, 0.1])  # u, h v, h^2 a
        reach = [1.0, theta, theta**2 / 3] @ start  # displacement at theta h without the change of acceleration
        end = -(x**2) * reach / (1 + x**2 * theta**2 / 6)  # h^2 a there, of u = reach + theta^2 a / 6
        k = start[2] + (end - start[2]) / theta
        due = [start[0] + start[1] + start[2] / 3 + k / 6, start[1] + (start[2] + k) / 2, k]
        np.testing.assert_allclose(method.amplification(np.array(x), np.array(0.0)) @ start, due, rtol=1e-12)


@pytest.mark.fast
def test_names_and_bounds():
    assert METHODS["hht_alpha(alpha=-0.1)"].beta == METHODS["hht_alpha"].beta
    assert set(CHOICES) < set(METHODS)  # names with a parameter are not listed
    assert "hht_alpha(alpha=-0.3)" in METHODS
    scene = wd.Scene(STRUCTURES["full matrices"](), wd.FreeVibration(1.0, velocity=0.1))
    for name, words in {
        "hht_alpha(alpha=-0.4)": r'alpha .* from -0.3333 to 0, got -0.4: method="hht_alpha\(alpha=-0.1\)"',
        "hht_alpha(alpha=nan)": "from -0.3333 to 0",
        "generalised_alpha(radius=0.5)": "has the parameter spectral_radius, not 'radius'",
        "wilson_theta(theta=1.2)": "theta .* from 1.37 to 2",
        "newmark_average(beta=0.3)": "unknown method .*: 'newmark_average' has no parameter, give method='newma",
        "hht_alpha(-0.3)": r"parameter of 'hht_alpha' without blanks, as in method=\"hht_alpha\(alpha=-0.1\)\"",
        "hht_alpha( alpha = -0.3 )": "unknown method 'hht_alpha.*without blanks",
        "hht_alpha(alpha=-0.3": "unknown method 'hht_alpha.*without blanks",
        "euler(alpha=-0.3)": "unknown method 'euler.*allowed: 'heun'",
    }.items():
        with pytest.raises(ValueError, match=words):
            wd.simulate(scene, method=name, device="cpu")
