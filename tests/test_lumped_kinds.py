"""Units and groups of the places of lumped structures: in datasets, in fragility curves, in IDA and in reports."""

from __future__ import annotations

import numpy as np
import pytest
from lumped_cases import pulse

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
MOTIONS = [pulse(2.0, period, 0.4, 3.0) for period in (0.4, 0.6, 0.9)]
STRIPES = wd.Stripes(MOTIONS, [0.1, 0.2, 0.4, 0.8], wd.PeakGroundAcceleration())
SOIL = wd.FoundationSprings(2e8, 2e9, sway_dashpot=6e6, rocking_dashpot=2e8)


def chain() -> wd.ShearBuilding:
    return wd.ShearBuilding([1e5, 1e5], 5e7, 3.0, damping="rayleigh", damping_ratio=0.05)


def on_soil() -> wd.LumpedStructure:
    return wd.structure_on_soil(chain(), SOIL, foundation_mass=1e5, rocking_inertia=1e6)


def run_of(structure, excitation=MOTIONS[0], **other):
    recorders = ("spring", "displacement", "acceleration", "residual")
    return wd.simulate(wd.Scene(structure, excitation, recorders=recorders), device="cpu", **other)


def test_rotations_and_moments_have_their_units_in_the_dataset():
    run = run_of(on_soil(), histories=wd.Histories([0]))
    assert run["dof_unit"].values.tolist() == run["spring_unit"].values.tolist() == ["m", "m", "m", "rad"]
    units = {
        "peak_displacement": "m (rad for rotations)",
        "peak_acceleration": "m s-2 (rad s-2 for rotations)",
        "peak_spring_deformation": "m (rad for rotations)",
        "peak_spring_force": "N (N m for rotations)",
        "residual_deformation": "m (rad for rotations)",
        "velocity": "m s-1 (rad s-1 for rotations)",
    }
    assert {name: run[name].attrs["units"] for name in units} == units
    assert run["spring_group"].values.tolist() == ["building", "building", "soil", "soil"]


def test_a_structure_of_translations_has_plain_units():
    run = run_of(wd.lumped_chain(chain()))
    assert run["peak_displacement"].attrs["units"] == "m"
    assert not {"dof_unit", "spring_unit", "spring_group"} & {*run.coords}


def test_drawn_parameters_of_rotations_have_their_units():
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, 0.1)) for name in ("mass", "stiffness")}
    run = wd.simulate(wd.Scene(deck(), MOTIONS[0], scatter), structures=2, device="cpu")
    assert run["mass"].attrs["units"] == "kg (kg m2 for rotations)"
    assert run["stiffness"].attrs["units"] == "N m-1 (N m rad-1 for rotations)"


def deck(**other) -> wd.LumpedStructure:
    """Return a deck on two frames and a torsional spring."""
    springs = [
        wd.Spring("west", {"y": 1.0, "theta": -5.0}, stiffness=2e7),
        wd.Spring("east", {"y": 1.0, "theta": 5.0}, stiffness=3e7),
        wd.Spring("core", {"theta": 1.0}, stiffness=1e8),
    ]
    outputs = {"corner": {"y": 1.0, "theta": 8.0}, "shear": {"y": 5e7}}
    masses = {"y": 1e5, "theta": 4e6}
    return wd.LumpedStructure(masses, springs, influence={"y": 1.0}, outputs=outputs, **other)


@pytest.mark.parametrize(
    ("springs", "rotations", "rotating"),
    [
        ({"theta": 1.0}, None, True),  # by its name
        ({"theta3": -1.0}, None, True),
        ({"thetan": 1.0}, None, False),  # not a word of the list
        ({"theta": 4.0}, None, False),  # a lever arm
        ({"a": 1.0}, ("a",), True),
        ({"theta": 1.0}, (), False),
    ],
)
def test_a_spring_between_rotations_is_rotational(springs, rotations, rotating):
    structure = wd.LumpedStructure(
        dict.fromkeys(springs, 1.0),
        [wd.Spring("s", springs, stiffness=1.0)],
        influence=dict.fromkeys(springs, 1.0),
        rotations=rotations,
    )
    assert structure.kinds.rotating["spring"] == (rotating,)
    assert structure.kinds.units("spring", "N") == ("N m" if rotating else "N")


def test_rotational_overrides_the_rule():
    springs = [wd.Spring("lever", {"theta": 1.0}, stiffness=1.0, rotational=False)]
    structure = wd.LumpedStructure({"theta": 1.0}, springs, influence={"theta": 1.0})
    assert structure.kinds.units("spring", "m") == "m"
    with pytest.raises(TypeError, match="spring 'lever': rotational must be True or False, got 1"):
        wd.Spring("lever", {"theta": 1.0}, stiffness=1.0, rotational=1)


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"rotations": ["thet"]}, ValueError, "rotations names the unknown degree of freedom 'thet'"),
        ({"rotations": "theta"}, TypeError, "rotations must be a list of names"),
        ({"groups": {"walls": ["wst"]}}, ValueError, "groups\\['walls'\\] names 'wst', but no degree of freedom"),
        ({"groups": {"building": ["west"]}}, ValueError, "groups: 'building' is already a name of the structure"),
        ({"groups": {"a": ["west"], "b": ["west"]}}, ValueError, "'west' is in two groups, 'a' and 'b'"),
        ({"groups": ["west"]}, TypeError, "groups must be a dictionary"),
        ({"output_units": {"corne": "m"}}, ValueError, "output_units names the unknown output 'corne'"),
        ({"output_units": "m"}, TypeError, "output_units must be a dictionary"),
    ],
)
def test_wrong_kinds_are_refused_by_name(changed, error, message):
    with pytest.raises(error, match=message):
        deck(**changed)


def test_kinds_survive_the_json():
    given = {"rotations": ["y"], "groups": {"walls": ["west", "theta"]}, "output_units": {"corner": "m"}}
    scene = wd.Scene(deck(**given), MOTIONS[0])
    again = wd.Scene.from_json(scene.to_json(), MOTIONS).structure
    assert vars(again.kinds) == vars(scene.structure.kinds)
    assert again.kinds.groups["spring"] == ("walls", "building", "building")
    assert again.kinds.rotating["dof"] == (True, False)


def test_fragility_refuses_to_compare_metres_with_radians():
    run = run_of(deck(), STRIPES)
    limits = {"slight": 0.01, "complete": 0.05}
    with pytest.raises(ValueError, match="largest peak_spring_deformation of all places would compare m with rad"):
        wd.fragility(run, limits, demand="peak_spring_deformation")
    with pytest.raises(ValueError, match=r"largest peak_displacement .* run.isel\(dof=run\['dof_unit'\].values == 'm'"):
        wd.fragility(run, limits, demand="peak_displacement")
    metres = run.isel(spring=run["spring_unit"].values == "m")
    worst = metres["peak_spring_deformation"].max("spring")
    curves = wd.fragility(metres, limits, demand="peak_spring_deformation")
    due = [int((worst > limit).sum()) for limit in limits.values()]
    np.testing.assert_array_equal(curves["exceeding_samples"].sum("stripe").values, due)


def test_fragility_refuses_outputs_of_unknown_or_different_units():
    limits = {"slight": 0.01, "complete": 0.05}
    scene = wd.Scene(deck(), STRIPES, recorders=("output",))
    run = wd.simulate(scene, device="cpu")
    with pytest.raises(ValueError, match="the units of some outputs are unknown"):
        wd.fragility(run, limits, demand="peak_output")
    scene = wd.Scene(deck(output_units={"corner": "m", "shear": "N"}), STRIPES, recorders=("output",))
    run = wd.simulate(scene, device="cpu")
    with pytest.raises(ValueError, match="would compare m with N"):
        wd.fragility(run, limits, demand="peak_output")
    wd.fragility(run.sel(output=["corner"]), limits, demand="peak_output")


def test_soil_and_equipment_do_not_count_unless_they_are_selected():
    equipped = wd.with_equipment(on_soil(), "u2", 10.0, period=0.5, damping_ratio=0.01, name="chiller")
    run = run_of(equipped, STRIPES)
    deformation = run["peak_spring_deformation"]
    storeys, chiller = deformation.isel(spring=[0, 1]).max("spring"), deformation.sel(spring="chiller")
    assert (chiller > 2 * storeys).any()
    limits = {"slight": 0.005, "complete": 0.02}
    due = [int((storeys > limit).sum()) for limit in limits.values()]
    of_chiller = [int((chiller > limit).sum()) for limit in limits.values()]
    assert due != of_chiller
    curves = wd.fragility(run, limits, demand="peak_spring_deformation")
    np.testing.assert_array_equal(curves["exceeding_samples"].sum("stripe").values, due)
    curves = wd.fragility(run.sel(spring=["chiller"]), limits, demand="peak_spring_deformation")
    np.testing.assert_array_equal(curves["exceeding_samples"].sum("stripe").values, of_chiller)


def test_statistics_and_capacities_count_the_springs_of_the_building_only():
    limits = {"slight": 0.005, "complete": 0.02}
    scene = wd.Scene(on_soil(), STRIPES, recorders=("spring",))
    run = wd.simulate(scene, device="cpu")
    storeys = run["peak_spring_deformation"].isel(spring=[0, 1]).max("spring")
    counts = wd.DamageCounts(limits, over=("motion", "stripe", "structure_group"), demand="peak_spring_deformation")
    counted = wd.simulate(scene, device="cpu", statistics=counts)
    (name,) = (each for each in counted.data_vars if str(each).startswith("damage_count"))
    total = counted[name].sum([dim for dim in counted[name].dims if dim != "damage_state"])
    assert int(total.sel(damage_state="complete")) == int((storeys > 0.02).sum())
    found = wd.capacities(scene, limits, demand="peak_spring_deformation", device="cpu")
    per_g = storeys / run["im_level"]  # an elastic structure
    for motion in range(3):
        due = 0.02 / per_g[run["motion_index"].values == motion].values[0]
        own = found["capacity"].isel(motion=motion).sel(damage_state="complete").values.ravel()
        np.testing.assert_allclose(own, due, rtol=0.03)


def test_statistics_and_capacities_refuse_to_compare_different_units():
    scene, limits = wd.Scene(deck(), STRIPES, recorders=("spring",)), {"slight": 0.005, "complete": 0.02}
    with pytest.raises(ValueError, match=r"statistics: the largest peak_spring_deformation .* compare m with rad"):
        wd.simulate(scene, statistics=wd.DamageCounts(limits, over=("stripe",), demand="peak_spring_deformation"))
    with pytest.raises(ValueError, match=r"capacities: the largest peak_spring_deformation .* compare m with rad"):
        wd.capacities(scene, limits, demand="peak_spring_deformation")
    with pytest.raises(ValueError, match="has no demand 'peak_storey_drift_ratio': give demand=, such as"):
        wd.capacities(scene, limits)


def test_a_report_has_rows_by_unit_and_the_springs_that_collapsed(tmp_path):
    springs = [
        wd.Spring("weak", {"y": 1.0, "theta": -5.0}, stiffness=2e7, deformation_capacity=0.01),
        wd.Spring("east", {"y": 1.0, "theta": 5.0}, stiffness=3e7),
        wd.Spring("core", {"theta": 1.0}, stiffness=1e8),
    ]
    masses = {"y": 1e5, "theta": 4e6}
    run = run_of(wd.LumpedStructure(masses, springs, influence={"y": 1.0}), STRIPES)
    collapsed = int((run["status"] == 1).sum())
    assert 0 < collapsed < run.sizes["sample"]
    text = wd.report(run, tmp_path / "deck.html").read_text()
    for words in ("peak absolute deformation of the spring [m]", "peak absolute deformation of the spring [rad]"):
        assert words in text
    assert "peak absolute force of the spring's law [N m]" in text.replace("&#x27;", "'").replace("&#39;", "'")
    assert "Spring that collapsed first" in text
    assert "weak" in text
    assert f"collapsed in spring 'weak' ({collapsed})" in wd.summary(run)


def test_added_places_are_checked_for_units_if_they_count():
    limits = {"slight": 0.005, "complete": 0.02}
    scene, demand = wd.Scene(on_soil(), STRIPES, recorders=("spring",)), "peak_spring_deformation"
    given = {"demand": demand, "added_storeys": True}
    message = r": the largest peak_spring_deformation of all places would compare m with rad"
    for statistic in (
        wd.DamageCounts(limits, over=("stripe",), **given),
        wd.LargestDemand(demand, added_storeys=True),
        wd.DemandHistogram(demand, [0.001, 0.01, 0.1], added_storeys=True),
    ):
        with pytest.raises(ValueError, match="statistics" + message):
            wd.simulate(scene, statistics=statistic, device="cpu")
    with pytest.raises(ValueError, match="capacities" + message):
        wd.capacities(scene, limits, **given, device="cpu")
    run = wd.simulate(scene, device="cpu")
    one = run.isel(sample=[0])
    with pytest.raises(ValueError, match="exceedance_probability" + message):
        wd.exceedance_probability(one, limits, **given)
    with pytest.raises(ValueError, match="fragility" + message):
        wd.fragility(run, limits, **given)


def test_exceedance_probabilities_count_the_building_only():
    chiller = {"period": 0.5, "damping_ratio": 0.01, "name": "chiller"}
    equipped = wd.with_equipment(wd.lumped_chain(chain()), "u2", 10.0, **chiller)
    noise = wd.FilteredNoise(wd.WhiteNoise(0.01), duration=4.0, interval=0.02)
    scene = wd.Scene(equipped, noise, recorders=("spring",), tail=0.0)
    run = wd.simulate(scene, structures=200, seed=1, device="cpu")
    deformation = run["peak_spring_deformation"]
    storeys = deformation.isel(spring=[0, 1]).max("spring")
    limit = float(storeys.median())
    given = {"limits": {"state": limit}, "demand": "peak_spring_deformation"}
    found = wd.exceedance_probability(run, **given)
    assert int(found["exceeding_samples"][0]) == int((storeys > limit).sum()) == 100
    found = wd.exceedance_probability(run, **given, added_storeys=True)
    assert int(found["exceeding_samples"][0]) == int((deformation.max("spring") > limit).sum()) > 150


@pytest.mark.fast
@pytest.mark.parametrize(
    "name", ["theta", "thetaz", "THETA", "uTheta", "theta_x", "rotX", "rz", "RZ", "PHI2", "torsion"]
)
def test_a_rotation_recognised_by_its_name_needs_an_influence(name):
    springs = [wd.Spring("s", {"u": 1.0}, stiffness=1e7), wd.Spring("r", {name: 1.0}, stiffness=1e8)]
    with pytest.raises(ValueError, match=f"influence is missing: '{name}' is a rotation"):
        wd.LumpedStructure({"u": 1e5, name: 5e6}, springs)
    turning = wd.LumpedStructure({"u": 1e5, name: 5e6}, springs, influence={"u": 1.0})
    assert turning.influence.tolist() == [[1.0], [0.0]]
    moving = wd.LumpedStructure({"u": 1e5, name: 5e6}, springs, rotations=[])
    assert moving.influence.tolist() == [[1.0], [1.0]]


@pytest.mark.fast
@pytest.mark.parametrize("name", ["ux", "roof", "floor2", "r1", "error", "storey"])
def test_names_of_translations(name):
    structure = wd.LumpedStructure({name: 1e5}, [wd.Spring("s", {name: 1.0}, stiffness=1e7)])
    assert structure.influence.tolist() == [[1.0]]
