"""A scene from its JSON equals the scene in every number; an error names values that the JSON does not contain."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.foundations.core.description import fingerprint

TIME = np.arange(200) / 100
MOTIONS = [
    wd.GroundMotion(np.sin(7 * TIME + i) * np.exp(-TIME), 0.01, f"{i}", "by hand", f"r{i // 2}", "EN"[i % 2])
    for i in range(4)
]
SA = wd.SpectralAcceleration(0.5)
PLAIN = wd.ShearBuilding(2e5, [2.4e8, 2e8], 3.2)
BILINEAR = wd.laws.Bilinear(yield_force=1e6, hardening_ratio=0.05)
MIXED = wd.ShearBuilding(
    mass=2.0e5,
    stiffness=[2.4e8, 2.0e8, 1.4e8],
    height=[4.0, 3.2, 3.2],
    law=[BILINEAR, "elastic", wd.laws.BoucWen(yield_force=8e5, hardening_ratio=0.1)],
    devices=(wd.laws.ViscousDamper(damper_coefficient=(4e5, 0.0, 0.0), velocity_exponent=0.4),),
    damping="rayleigh",
    damping_ratio=0.05,
    damping_modes=(1, 3),
    gravity_load=2e6,
    drift_ratio_capacity=[0.05, 0.06, 0.07],
)
HAZUS = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5, damped_storeys=(1, 5))
BASE = {"stiffness": 3.8e8, "yield_force": 2.9e6, "post_yield_stiffness": 3.8e7}
STRUCTURES = {
    "elastic": PLAIN,
    "storeys of three laws with dampers and gravity": MIXED,
    "pinching": wd.ShearBuilding.from_hazus("C1L", "high", 2),
    "on isolators": HAZUS.on_isolators("lead_rubber_bearing", 1e6, displacement_capacity=0.5, **BASE),
    "tuned mass damper": HAZUS.with_tuned_mass_damper(mass_ratio=0.05),
    "modal damping": wd.ShearBuilding(1e5, [1e8, 1e8], 3.0, damping="modal", damping_ratio=0.03),
    "lumped": wd.LumpedStructure(
        {"a": 1e5, "b": 2e5},
        [
            wd.Spring("one", {"a": 1.0}, law=BILINEAR, stiffness=2e8, damping_coefficient=1e3),
            wd.Spring("two", {"a": -1.0, "b": 1.0}, stiffness=1e8, deformation_capacity=0.2),
            wd.Spring("stop", {"b": 1.0}, law=wd.laws.OneSidedGap(clearance=0.1, contact_stiffness=1e9)),
        ],
        influence={"a": 1.0, "b": 0.5},
        mass_matrix=np.diag([0.0, 1e4]),
        load_mass=[1e5, 2e5],
        geometric_stiffness=np.diag([1e5, 1e5]),
        outputs={"sum": {"a": 1.0, "b": 1.0}},
        damping="rayleigh",
        damping_ratio=0.03,
    ),
    "matrices": wd.LinearSystem([1e5, 1e5], np.diag([1e4, 1e4]), [[2e8, -1e8], [-1e8, 1e8]], influence=[1.0, 0.5]),
}
LEVELS = [0.1, 0.3, 0.7]
EXCITATIONS = {
    "stripes": wd.Stripes(MOTIONS, LEVELS, SA),
    "stripes of a velocity": wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundVelocity()),
    "pairs": wd.Stripes(MOTIONS, LEVELS, wd.GeometricMean(wd.AverageSpectralAcceleration((0.2, 0.5, 1.0)))),
    "RotD50": wd.Stripes(MOTIONS, LEVELS, wd.RotatedSpectralAcceleration(0.5)),
    "cloud": wd.Cloud(MOTIONS, wd.SignificantDuration()),
    "motion": MOTIONS[2],
    "own motions": wd.OneMotionPerStructure(MOTIONS, motion=[3, 1, 2], scale=[1.0, 2.5, 0.3]),
    "motions at sites": wd.MotionsAtSites(MOTIONS, [[[0], [3]], [[1], [2]]], 2.0, site=[[0, 1], [1, 1], [1, 0]]),
    "drawn motions": wd.OneMotionPerStructure(MOTIONS, measure=wd.PeakGroundVelocity()),
    "sequence": wd.EventSequence({"main": wd.Stripes(MOTIONS[:2], LEVELS, SA), "after": wd.Cloud(MOTIONS)}),
    "noise": wd.FilteredNoise(
        wd.CloughPenzien(0.01, 15.0, 0.6, 1.5, 0.6), 20.0, 0.01, envelope=wd.JenningsEnvelope(2, 8, 0.3)
    ),
    "free vibration": wd.FreeVibration(3.0, velocity=[0.1, 0.2]),
    "harmonic": wd.HarmonicForce([1e4, 0.0], 3.0, 10.0, phase=0.1),
    "forces": wd.ForceHistory(np.outer(np.sin(TIME), [1e4, 2e4]), 0.01),
}
RANDOM = wd.RandomFactor(wd.Lognormal(1.0, 0.25), per="storey", storey_correlation=0.8)
SCATTERS = {
    "drawn": (
        {"mass": wd.RandomFactor(wd.Normal(1.0, 0.1)), "stiffness": RANDOM},
        {("stiffness", "mass"): 0.6},
    ),
    "given": ({"stiffness": wd.GivenValues([[2e8, 1.9e8], [2.1e8, 1.8e8], [1 / 3 * 1e9, 2e8]])}, {}),
    "a value": ({"mass": wd.RandomValue(wd.Uniform(1e5, 2e5))}, {}),
}
SCENES = {
    **{name: wd.Scene(structure, wd.Stripes(MOTIONS, LEVELS, SA)) for name, structure in STRUCTURES.items()},
    **{name: wd.Scene(PLAIN, excitation) for name, excitation in EXCITATIONS.items()},
    **{
        name: wd.Scene(PLAIN, MOTIONS[0], scatter, correlation, collapse_drift_ratio=0.1, tail=5.0, title="t")
        for name, (scatter, correlation) in SCATTERS.items()
    },
    "sobol": wd.Scene(PLAIN, MOTIONS[0], {"mass": RANDOM}, sampling="sobol", recorders=("drift", "residual")),
    "portfolio": wd.Scene(
        wd.Portfolio({"a": wd.Archetype(PLAIN, 3, {"mass": RANDOM}), "b": wd.Archetype(MIXED, 2)}),
        wd.Cloud(MOTIONS),
    ),
}


@pytest.mark.fast
@pytest.mark.parametrize("name", SCENES)
def test_a_scene_from_its_json_is_equal(name):
    scene = SCENES[name]
    text = scene.to_json()
    assert "NaN" not in text
    again = wd.Scene.from_json(text, MOTIONS[::-1])
    assert fingerprint(again) == fingerprint(scene)  # every number of every array
    assert again.to_json() == text


@pytest.mark.meant_as_given("no_damping", "strongest_motion")
def test_it_runs_again_to_the_same_bits():
    building = wd.ShearBuilding(1e5, [1e8, 0.7e8], 3.0, law="bilinear", yield_force=[3e5, 2e5], hardening_ratio=0.05)
    scene = wd.Scene(
        building, wd.Cloud(MOTIONS), {"yield_force": RANDOM}, recorders=("drift",), collapse_drift_ratio=0.1
    )
    run = wd.simulate(scene, structures=3, seed=5, device="cpu")
    again = wd.simulate(
        wd.Scene.from_json(run.attrs["scene"], MOTIONS), structures=3, seed=run.attrs["seed"], device="cpu"
    )
    assert again.attrs["fingerprint"] == run.attrs["fingerprint"]
    for name in run.variables:
        np.testing.assert_array_equal(run[name], again[name])


@dataclasses.dataclass(frozen=True)
class OwnMeasure(type(SA)):
    """A measure defined by a user."""


class OtherMeasure(OwnMeasure):
    """Another such measure, which JSON names with its module."""


@pytest.mark.fast
def test_values_that_json_does_not_contain_are_named():
    text = SCENES["stripes"].to_json()
    told = r"does not contain the samples of motion '0' \(200 at 0\.01 s, from by hand\)"
    with pytest.raises(ValueError, match=rf"{told}: give motions= that contain a motion with these samples"):
        wd.Scene.from_json(text)
    changed = wd.GroundMotion(np.nextafter(MOTIONS[0].acceleration, 1), 0.01, "0")
    with pytest.raises(ValueError, match=rf"{told}: none of the 4 given motions has them; give motions="):
        wd.Scene.from_json(text, [changed, *MOTIONS[1:]])
    many = wd.Scene(PLAIN, MOTIONS[0], {"mass": wd.GivenValues(np.linspace(1e5, 2e5, 2000))})
    with pytest.raises(ValueError, match=r"values of scatter\.mass\.values are not in the JSON, .* \(\(2000,\)\)"):
        wd.Scene.from_json(many.to_json(), MOTIONS)
    for kind in (OwnMeasure, OtherMeasure):
        own = wd.Scene(PLAIN, wd.Cloud(MOTIONS, kind(0.5)))
        with pytest.raises(
            ValueError, match=rf"excitation\.measure is of the class '\w+\.{kind.__name__}', which warpdyn does not"
        ):
            wd.Scene.from_json(own.to_json(), MOTIONS)


@pytest.mark.fast
def test_other_text_than_a_scene_is_refused():
    with pytest.raises(TypeError, match="takes the text of a dataset's attribute 'scene', got dict"):
        wd.Scene.from_json({})
    for text in ("{", "[]", "{}", json.dumps({"structure": 1})):
        with pytest.raises(ValueError, match="give a dataset's attribute 'scene'"):
            wd.Scene.from_json(text)


@pytest.mark.fast
def test_texts_are_short_and_notebooks_have_tables():
    for scene in SCENES.values():
        for each in (scene, scene.structure, scene.excitation):
            assert len(repr(each)) < 400
            assert "\n" not in repr(each)
            table = each._repr_html_()
            assert table.startswith("<table>")
            assert table.count("<tr>") == table.count("</tr>") > 1
    assert repr(SCENES["stripes"]).endswith("Stripes(4 motions, Sa(0.5 s, 5 %) at 3 levels))")
    rows = PLAIN._repr_html_()
    assert '<th scope="row" style="text-align:left">floor mass</th>' in rows
    assert '<th scope="col" style="text-align:left"></th>' not in rows
    assert ">200000 (all 2)</td>" in rows
    assert ">2.4e+08, 2e+08</td>" in rows
    motion = MOTIONS[1]._repr_html_()
    for part in ("1.99 s, 200 samples every 0.01 s", "PGA", "r0, component N", "by hand"):
        assert part in motion
    tenth = wd.GroundMotion([0.0, -0.980665, 0.0], 0.5, "tenth")
    assert repr(tenth) == "GroundMotion('tenth', 1 s at steps of 0.5 s, PGA 0.1 g (0.9807 m/s2))"
    assert "&lt;b&gt;" in wd.GroundMotion([0.0, 1.0], 0.1, "<b>")._repr_html_()
    law = BILINEAR._repr_html_()
    assert "storey yield force" in law
    assert "0.05" in law
    assert wd.modal_table(PLAIN.modal())._repr_html_().startswith("<pre>mode")


# The path of a key in the JSON, its replacement (None: removed), and text of the error.
EDITED = {
    "renamed": (
        ("recorders",),
        "recorder",
        "the scene has unknown 'recorder' (did you mean 'recorders'?); allowed are",
    ),
    "parameter left out": (("structure", "height"), None, "structure has no 'height'; it has 'law', 'damping'"),
    "kind left out": (("structure", "type"), None, "structure has no 'type'"),
    "of a distribution": (
        ("scatter", "mass", "distribution", "dispersion"),
        "sigma",
        "scatter.mass.distribution has no 'dispersion'; it has 'median', 'sigma'",
    ),
    "of a scatter": (("scatter", "mass", "per"), "by", "scatter.mass has unknown 'by'; allowed are distribution, per"),
}


@pytest.mark.fast
@pytest.mark.parametrize("case", EDITED)
def test_an_edited_key_is_named(case):
    *path, key = EDITED[case][0]
    edited = json.loads(wd.Scene(PLAIN, MOTIONS[0], {"mass": RANDOM}).to_json())
    part = edited
    for each in path:
        part = part[each]
    value = part.pop(key)
    if EDITED[case][1]:
        part[EDITED[case][1]] = value
    with pytest.raises(ValueError, match=re.escape(EDITED[case][2])):
        wd.Scene.from_json(json.dumps(edited), MOTIONS)
