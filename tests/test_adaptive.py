"""Adaptive Dormand-Prince against scipy's eighth-order method and the event-exact chain; what it tells of its steps."""

import numpy as np
import pytest
from matrices import chain_matrix
from method_sources import thorough_unless
from scipy.linalg import eigh

import warpdyn as wd
from warpdyn.truth import bilinear_chain_response, bouc_wen_chain_response, piecewise_linear_response

pytestmark = pytest.mark.meant_as_given(
    "drift_ratio_of_force", "first_period", "force_over_weight", "integration_step", "no_damping", "storey_height"
)

MASS, STIFFNESS, STEP = np.array([1e5, 1e5, 8e4]), np.array([8e7, 6e7, 5e7]), 0.02
YIELD_FORCE, HARDENING = np.array([2.2e5, 1.8e5, 1.2e5]), 0.05
BASE = 2.5 * np.sin(np.arange(300) * 0.37) * np.random.default_rng(5).normal(size=300)  # m/s2
DAMPERS = 2e5
FORCE = -BASE[:, None] * MASS
MATRICES = (MASS, DAMPERS * chain_matrix(np.ones(3)), chain_matrix(STIFFNESS))
FASTEST = np.sqrt(eigh(MATRICES[2], np.diag(MASS), eigvals_only=True)[-1])  # rad/s
LAWS = {
    "elastic": {},
    "bilinear": {"yield_force": YIELD_FORCE, "hardening_ratio": HARDENING},
    **{
        f"bouc_wen {n:g}": {"yield_force": YIELD_FORCE, "hardening_ratio": HARDENING, "exponent": n} for n in (2.0, 3.0)
    },
    # Beta differs from gamma: the usual case of exponent 1 has device functions of its own.
    "bouc_wen 1": {"yield_force": YIELD_FORCE, "hardening_ratio": HARDENING, "beta": 0.6, "gamma": 0.4},
}


def simulate(law, tolerance, **settings):
    building = wd.ShearBuilding(
        MASS, STIFFNESS, 3.0, law=law.split()[0], damping="storey", damping_coefficient=DAMPERS, **LAWS[law]
    )
    return wd.simulate(
        wd.Scene(building, wd.GroundMotion(BASE, STEP), tail=0.0, recorders=("drift", "energy")),
        method="dormand_prince54",
        tolerance=tolerance,
        step=STEP,
        dtype="float64",
        device="cpu",
        **settings,
    )


def exact_displacement(law):
    if law == "elastic":
        return piecewise_linear_response(*MATRICES, FORCE, STEP)[0]
    if law == "bilinear":
        chain = bilinear_chain_response(MASS, STIFFNESS, YIELD_FORCE, HARDENING, MATRICES[1], FORCE, STEP)
    else:
        own = {name: LAWS[law][name] for name in ("exponent", "beta", "gamma") if name in LAWS[law]}
        chain = bouc_wen_chain_response(MASS, STIFFNESS, YIELD_FORCE, HARDENING, MATRICES[1], FORCE, STEP, **own)
    return chain.displacement


@pytest.mark.parametrize("law", [thorough_unless(law not in ("bouc_wen 1", "bouc_wen 3"), law) for law in LAWS])
def test_against_the_truth(law):
    exact = exact_displacement(law)
    scale = np.abs(exact).max()
    errors = {}
    for tolerance in (1e-6, 1e-8):
        run = simulate(law, tolerance, histories=wd.Histories((0,)))
        assert run.status.item() == 0
        errors[tolerance] = np.abs(run.displacement.values[0] - exact).max() / scale
        # A step of the record has at least one part; whatever was rejected was tried again.
        assert run.accepted_steps.item() >= BASE.size - 1
        assert run.rejected_steps.item() >= 0
        # Each part's error is held to the tolerance, relative to the largest motion so far, and nothing magnifies it
        # later: to push a floor by a share of its largest velocity moves no floor by more than 0.7 of that share of the
        # largest displacement. So the errors add up to at most the tolerance times the number of parts. The estimate
        # may tell too little of a part that meets a corner of the law (storeys turn 150 times in 2500 parts); all other
        # parts err less by far. How parts meet corners is up to rounding: among stiffnesses equal to 13 digits the
        # error at a tolerance of 1e-8 varies from 6.6e-7 to 1.1e-6 (bouc_wen 2), from 9.3e-7 to 2.9e-6 (bilinear).
        bound = tolerance * run.accepted_steps.item()
        if law == "elastic":
            # Without corners, a part that turns the fastest mode by an angle z errs by z^6 / 3600, the first term of
            # the method's stability polynomial that is not the exponential's, where 97 z^5 / 120000 is estimated: by no
            # more than this share of the tolerance, and the angles add up to that of the whole run.
            bound = tolerance * FASTEST * STEP * (BASE.size - 1) / 3600 / (97 / 120000)
        assert errors[tolerance] < bound
    assert errors[1e-6] > errors[1e-8]  # the tolerance, not something else, is what the error follows
    if law != "elastic":
        # It yielded: the truth without yielding is far away.
        assert np.abs(exact - exact_displacement("elastic")).max() > 0.05 * scale


def test_a_tighter_tolerance_takes_more_steps_and_no_more_than_are_told():
    loose, tight = (simulate("bouc_wen 2", tolerance) for tolerance in (1e-4, 1e-8))
    assert tight.accepted_steps.item() > 2 * loose.accepted_steps.item()
    assert tight.attrs["tolerance"] == 1e-8
    assert tight.accepted_steps.attrs["units"] == "1"


def test_each_sample_has_steps_of_its_own():
    # Stiff and soft oscillators side by side in the lanes of one row: each takes what it takes alone, bit for bit.
    stiffness = 10.0 ** np.linspace(0, 6, 17)
    wave = wd.GroundMotion(BASE, STEP)

    def run(chosen):
        scene = wd.Scene(
            wd.ShearBuilding([1.0], 1.0, 1.0), wave, scatter={"stiffness": wd.GivenValues(stiffness[chosen])}, tail=0.3
        )
        return wd.simulate(
            scene,
            structures=len(stiffness[chosen]),
            method="dormand_prince54",
            step=STEP,
            dtype="float64",
            device="cpu",
        )

    together = run(slice(None))
    assert together.accepted_steps.values[-1] > 5 * together.accepted_steps.values[0]
    for index in (0, 8, 16):
        alone = run(slice(index, index + 1))
        for name in ("accepted_steps", "rejected_steps", "peak_storey_drift", "input_energy", "residual_drift_ratio"):
            assert np.array_equal(alone[name].values[0], together[name].values[index]), name


def test_energy_closes_though_steps_were_rejected():
    run = simulate("bilinear", 1e-8)
    assert run.rejected_steps.item() > 100
    # Stages' powers are summed by the method's weights: as exact as the motion, but for corners of the law.
    assert abs(run.energy_balance_error.item()) < 1e-5


def test_a_dense_system_takes_the_same_steps():
    chain = wd.ShearBuilding(MASS, STIFFNESS, 3.0, damping="storey", damping_coefficient=DAMPERS)
    runs = [
        wd.simulate(
            wd.Scene(structure, wd.ForceHistory(FORCE, STEP), tail=0.0, recorders=("energy",)),
            method="dormand_prince54",
            tolerance=1e-7,
            step=STEP,
            dtype="float64",
            device="cpu",
            histories=wd.Histories((0,)),
        )
        for structure in (chain, wd.LinearSystem(*MATRICES))
    ]
    one, other = (run.displacement.values[0] for run in runs)
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * np.abs(one).max())  # rounding, grown over the run
    assert runs[0].accepted_steps.item() == pytest.approx(runs[1].accepted_steps.item(), abs=3)


def test_a_blow_up_ends():
    # A load beyond float32: the steps shrink to the shortest and the run still ends, with nothing called a response.
    scene = wd.Scene(wd.ShearBuilding([1.0], 100.0, 1.0), wd.HarmonicForce([3e38], 10.0, 20.0))
    with pytest.warns(UserWarning, match="diverged"):
        run = wd.simulate(scene, method="dormand_prince54", dtype="float32", device="cpu", on_unstable="flag")
    assert run.status.item() == 2


def test_a_tolerance_belongs_to_an_adaptive_method():
    scene = wd.Scene(wd.ShearBuilding([1.0], 100.0, 1.0), wd.FreeVibration(1.0, velocity=1.0))
    with pytest.raises(ValueError, match=r"'rk4' does not use a tolerance: .* choose dormand_prince54"):
        wd.simulate(scene, tolerance=1e-6)
    with pytest.raises(ValueError, match=r"tolerance .*0"):
        wd.simulate(scene, method="dormand_prince54", tolerance=0.0)
