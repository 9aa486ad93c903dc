"""Fish-bone frames with hinges: invalid input, collapse, scatter of hinges, elastic limit, safe solutions, JSON."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import fishbone, portal
from hinge_cases import HEIGHTS, motion, reference_model, steel

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given(
    "no_damping",
    "damping_ratio",
    "first_period",
    "strongest_motion",
    "peak_ground_acceleration",
    "hinge_yield_rotation",  # hinges that stay elastic
)
HINGE = {"law": "bilinear", "yield_force": 5e6, "hardening_ratio": 0.02}


@pytest.mark.parametrize(
    ("frame", "hinges", "message"),
    [
        (portal, {("C1_1", "start"): HINGE}, "has 2 columns below it and 1 beams"),
        (fishbone, {("C11", "start"): HINGE}, "'C11'.*is not an end of a column.*did you mean 'C1"),
        (fishbone, {("B1", "end"): HINGE}, r"\('B1', 'end'\) is not an end"),
        (fishbone, {("C1", "start"): {"yield_force": 5e6}}, "needs a dictionary with 'law'"),
        (fishbone, {("C1", "start"): HINGE | {"stiffness": 1e9}}, "remove stiffness of .*: it is spring_start"),
        (fishbone, {("C1", "start"): {"law": "bouc_wen"}}, "hinge 'C1 start': 'bouc_wen' is not a law of hinges"),
        (fishbone, {("C1", "start"): {"law": "takeda"}}, "'takeda' is not a law of hinges; choose one of bilinear"),
        (fishbone, {("C1", "start"): {"law": "bilinar"}}, "did you mean 'bilinear'"),
        (fishbone, {}, "hinges is empty: give at least one hinge.*Frame.lumped"),
    ],
)
def test_wrong_hinges_are_named(frame, hinges, message):
    with pytest.raises(ValueError, match=message):
        wd.HingedFishbone(frame(), hinges)


def test_hinges_must_be_a_dictionary():
    with pytest.raises(TypeError, match="hinges must be a dictionary"):
        wd.HingedFishbone(fishbone(), [HINGE])


def test_hinge_at_an_end_without_a_spring_is_refused():
    arguments = fishbone().description()
    del arguments["members"]["C3"]["spring_end"]
    with pytest.raises(ValueError, match=r"\('C3', 'end'\) has no spring: give member 'C3' spring_end="):
        wd.HingedFishbone(wd.Frame(**arguments), {("C3", "end"): HINGE})


def test_energy_is_refused():
    scene_of = {"recorders": ("energy",)}
    with pytest.raises(ValueError, match="energies of a HingedFishbone are not recorded"):
        wd.Scene(reference_model(), wd.Cloud([motion("pulse_1", 1)]), **scene_of)


@pytest.mark.parametrize("outputs", [None, "drift", ("moment",)])
def test_wrong_outputs_are_named(outputs):
    with pytest.raises(ValueError, match=r"outputs of a HingedFishbone are \('drift',\) or \(\)"):
        wd.HingedFishbone(fishbone(), {("C1", "start"): HINGE}, outputs=outputs)


def test_gravity_on_a_vertical_support_is_refused_or_warned_of():
    told = fishbone().description()
    told["nodes"]["J3"]["gravity_load"] = 1e5
    frame = wd.Frame(**told)
    with pytest.raises(ValueError, match=r"gravity_load of node 'J3' has no P-Delta effect.*leaning column"):
        wd.HingedFishbone(frame, {("C1", "start"): HINGE})
    plain = wd.HingedFishbone(frame, {("C1", "start"): HINGE}, p_delta=False)
    assert not plain.p_delta
    for used in (frame.modal, frame.lumped):
        with pytest.warns(UserWarning, match="gravity_load of node 'J3' has no P-Delta effect"):
            used(p_delta=True)
    # The load has indeed no effect on the periods.
    with pytest.warns(UserWarning, match="has no P-Delta effect"):
        periods = frame.modal(p_delta=True)["period"].values
    np.testing.assert_allclose(periods, fishbone().modal(p_delta=True)["period"].values, rtol=1e-12)


@pytest.mark.parametrize("kind", ["none", "rayleigh", "modal"])
def test_strong_hinges_equal_the_elastic_frame(kind):
    frame = fishbone()
    damping = {"damping": kind, "damping_ratio": 0.03} if kind != "none" else {}
    structure = wd.HingedFishbone(frame, {("C1", "start"): HINGE | {"yield_force": 1e9}}, **damping)
    motions = wd.Cloud([motion("pulse_1", 1.0)])
    settings = {"device": "cpu", "method": "rk4", "step": 0.01, "dtype": "float64"}
    found = wd.simulate(wd.Scene(structure, motions, recorders=("spring", "output")), **settings)
    elastic = wd.simulate(
        wd.Scene(frame.lumped(p_delta=True, **damping), motions, recorders=("spring", "output")), **settings
    )
    both = [each["peak_spring_deformation"].values[:, :10] for each in (found, elastic)]
    np.testing.assert_allclose(*both, rtol=1e-9)
    both = [each["peak_output"].sel(output="drift 4").values for each in (found, elastic)]
    np.testing.assert_allclose(*both, rtol=1e-9)


def test_collapse_by_drift():
    structure = reference_model(drift_capacity=0.03)
    levels = [motion("pulse_2", level) for level in (2.0, 5.0)]
    result = wd.simulate(wd.Scene(structure, wd.Cloud(levels), recorders=("spring",)), device="cpu", method="leapfrog")
    assert result["status"].values.tolist() == [0, 1]
    assert result["spring_of_collapse"].values.tolist()[1] in (1, 2, 3)
    largest = (result["peak_spring_deformation"].values[:, :10] / HEIGHTS).max(axis=1)
    np.testing.assert_allclose(largest, [0.02000994, 0.03], rtol=0.01)
    assert (result["spring_without_equilibrium"].values == -1).all()


@pytest.mark.thorough
def test_random_hinges_agree_with_a_quarter_of_the_step():
    """No history may converge to a false root: hinges near collapse, 32 random frames at two levels."""
    motions = wd.Cloud([motion("LOS270", level) for level in (4.0, 7.0)])
    scatter = {
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring"),
        "post_capping_drift": wd.RandomFactor(wd.Lognormal(0.6, 0.3), per="spring"),
    }
    scene = wd.Scene(reference_model(drift_capacity=0.15), motions, scatter, recorders=("spring",))
    settings = {"structures": 32, "seed": 3, "device": "cpu", "method": "leapfrog"}
    coarse, fine = (wd.simulate(scene, step=step, **settings) for step in (0.005, 0.00125))
    assert (coarse["status"].values == fine["status"].values).all()
    assert (coarse["status"].values <= 1).all()
    drifts = [(each["peak_spring_deformation"].values[:, :10] / HEIGHTS).max(axis=1) for each in (coarse, fine)]
    np.testing.assert_allclose(*drifts, rtol=0.02)
    assert np.ptp(drifts[1][::2]) > 1e-3  # the frames differ


def test_scatter_of_initial_stiffness_is_refused():
    with pytest.raises(ValueError, match="initial stiffnesses of hinges belong to the frame"):
        wd.Scene(
            reference_model(),
            wd.Cloud([motion("pulse_1", 1)]),
            {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="spring")},
        )


def test_scene_from_json():
    used = motion("pulse_1", 1)
    hinges = {("B2", "start"): steel(2e6, 0.03, 0.1), ("C1", "start"): HINGE}
    structure = wd.HingedFishbone(fishbone(), hinges, damping="rayleigh", damping_ratio=0.03, damping_modes=(1, 3))
    scene = wd.Scene(structure, wd.Cloud([used]), recorders=("spring",))
    again = wd.Scene.from_json(scene.to_json(), motions=[used])
    assert again.to_json() == scene.to_json()
    assert again.structure.hinge_names == ("B2 start", "C1 start")


def test_buildings_of_a_portfolio_without_hinges_have_no_spring_without_equilibrium():
    building = wd.ShearBuilding([5e4, 5e4], 5e7, 3.6, damping="rayleigh", damping_ratio=0.03)
    town = wd.Portfolio({"stick": wd.Archetype(building, count=2), "hinged": wd.Archetype(reference_model())})
    scene = wd.Scene(town, wd.Cloud([motion("pulse_1", 1)]), recorders=("drift",))
    run = wd.simulate(scene, device="cpu")
    assert run["status"].values.tolist() == [0, 0, 0]
    assert run["spring_without_equilibrium"].values.tolist() == [-1, -1, -1]


def test_warning_of_hinges_without_equilibrium_recommends_a_shorter_step():
    def brittle(strength: float, plastic: float, post_capping: float) -> dict:
        return steel(strength, plastic, post_capping) | {"ultimate_drift": 0.03}

    scene = wd.Scene(reference_model(brittle), wd.Cloud([motion("pulse_2", 5)]), recorders=("spring",))
    with pytest.warns(UserWarning, match="not_converged: the hinges of a frame have no equilibrium") as caught:
        run = wd.simulate(scene, device="cpu", method="leapfrog", step=0.01, on_unstable="flag")
    assert run["status"].item() == 4
    assert run["spring_without_equilibrium"].item() >= 10
    [words] = [str(each.message) for each in caught if "not_converged" in str(each.message)]
    assert "Try a shorter step=" in words
    assert "explicit" not in words
