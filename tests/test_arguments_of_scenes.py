"""Functions of a scene tell what is wrong with their arguments, where Python would count them."""

import pytest

import warpdyn as wd

pytestmark = pytest.mark.fast

BUILDING = wd.ShearBuilding(mass=1e5, stiffness=[4e7, 3e7], height=3.0, damping="rayleigh", damping_ratio=0.05)
MOTIONS = [wd.GroundMotion([0.0, 1.0, -1.0, 0.5] * 25, 0.02, "wave")]
CLOUD = wd.Cloud(MOTIONS)
LIMITS = {"complete": 0.02}


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (
            lambda: wd.simulate(BUILDING, CLOUD),
            r"got ShearBuilding, Cloud; give simulate\(Scene\(structure, excitation",
        ),
        (lambda: wd.simulate(CLOUD, BUILDING), r"got Cloud, ShearBuilding; give simulate\("),
        (lambda: wd.simulate(BUILDING), r"takes a Scene, got ShearBuilding; give simulate\("),
        (lambda: wd.simulate(scene=BUILDING), r"takes a Scene, got ShearBuilding; give simulate\("),
        (lambda: wd.simulate(3), r"takes a Scene, got int; give simulate\("),
        (
            lambda: wd.simulate(wd.Scene(BUILDING, CLOUD), 4),
            "takes 1 positional arguments, got 2; give these by name: struct",
        ),
        (lambda: wd.simulate(wd.Scene(BUILDING, CLOUD), samples=4), "no argument 'samples'.*did you mean 'structures'"),
        (lambda: wd.simulate(wd.Scene(BUILDING, CLOUD), metod="rk4"), "no argument 'metod'.*did you mean 'method'"),
        (lambda: wd.plan(BUILDING), r"give plan\(Scene"),
        (lambda: wd.capacities(BUILDING, LIMITS), r"give capacities\(Scene"),
        (lambda: wd.fragility_to(BUILDING, LIMITS), r"give fragility_to\(Scene"),
        (lambda: wd.levels_for(BUILDING, LIMITS), r"give levels_for\(Scene"),
        (lambda: wd.Scene(BUILDING, MOTIONS), r"got list; give Cloud\(motions\)"),
        (lambda: wd.Scene(wd.ShearBuilding, CLOUD), r"the class ShearBuilding itself; give ShearBuilding\("),
        (lambda: wd.Scene(BUILDING, wd.Cloud), r"the class Cloud itself; give Cloud\("),
    ],
)
def test_what_is_wrong_is_told(call, told):
    with pytest.raises(TypeError, match=told):
        call()


GIVEN = wd.GivenValues


@pytest.mark.parametrize(
    ("scatter", "told"),
    [
        # The median of these values is 0: the message was "omega_i[0] is nan".
        ({"stiffness": GIVEN([1e7, -1e7])}, "the given stiffness is -1e[+]07 at structure 1; it must be finite and"),
        ({"mass": GIVEN([[1e5, 1e5], [1e5, -1e5]])}, "the given mass is -100000 at structure 1, storey 2; it must be"),
        ({"stiffness": GIVEN([[1e7, 1e7, 1e7]])}, r"^scatter\['stiffness'\] lists values of shape \(1, 3\)"),
        (
            {"stiffness": GIVEN([1e7, 1e7]), "damping_ratio": GIVEN([0.05])},
            "values for 1 structure, but the run has 2 structures: all GivenValues, and structures= if it is given",
        ),
    ],
)
@pytest.mark.meant_as_given("record_baseline")
def test_messages_about_given_values_name_them(scatter, told):
    with pytest.raises(ValueError, match=told):
        wd.simulate(wd.Scene(BUILDING, CLOUD, scatter), device="cpu")
