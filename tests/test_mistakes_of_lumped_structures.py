"""Invalid lumped structures, springs and pairs of motions: the message names the degree of freedom or the spring."""

import numpy as np
import pytest

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("no_damping")]
MASS = {"x": 1e5, "y": 1e5}
AXIAL = wd.Spring("a", {"x": 1.0}, stiffness=1e7)
LATERAL = wd.Spring("b", {"y": 1.0}, stiffness=1e7)
BOTH = [AXIAL, LATERAL]
MOTION = wd.GroundMotion(np.sin(np.arange(100)), 0.01, "first")


def structure(**changed):
    return wd.LumpedStructure(**{"mass": MASS, "springs": BOTH} | changed)


SPRINGS = [
    ({"direction": {}}, "spring 's' is connected to no degree of freedom"),
    ({"direction": {"x": 0.0}}, "spring 's' is connected to no degree of freedom"),
    ({"direction": {"x": np.nan}}, r"spring 's': direction\['x'\] must be a finite number"),
    ({"stiffness": None}, "spring 's': stiffness is missing"),
    ({"stiffness": 0.0}, r"spring 's': stiffness \[N/m\] must be a finite number above 0"),
    ({"law": "bilinear", "hardening_ratio": 0.05}, "spring 's': yield_force .* is missing: law 'bilinear' needs it"),
    ({"law": "bilinear", "yield_force": -1.0, "hardening_ratio": 0.05}, "spring 's': yield_force is -1"),
    (
        {"law": "bilinear", "yeild_force": 1.0},
        "spring 's': unknown parameter 'yeild_force'.*did you mean 'yield_force'",
    ),
    ({"law": "bilinar"}, "spring 's': unknown storey law 'bilinar'"),
    ({"law": "viscous_damper"}, "spring 's': 'viscous_damper' is a dashpot: give damping_coefficient="),
    ({"law": "gap", "clearance": 0.1, "contact_stiffness": 1.0}, "spring 's': 'gap' takes no stiffness"),
    ({"damping_coefficient": -1.0}, r"spring 's': damping_coefficient \[N s/m\] must be a finite number"),
    ({"deformation_capacity": 0.0}, r"spring 's': deformation_capacity \[m\] must be a finite number above 0"),
    (
        {"law": "bilinear", "yield_force": [1.0, 2.0], "hardening_ratio": 0.1},
        "spring 's': yield_force must be one value",
    ),
]


@pytest.mark.parametrize(("changed", "message"), SPRINGS)
def test_a_wrong_spring_is_named(changed, message):
    given = {"name": "s", "direction": {"x": 1.0}, "stiffness": 1e7} | changed
    with pytest.raises(ValueError, match=message):
        wd.Spring(**given)


STRUCTURES = [
    ({"mass": {"x": 1e5, "y": 0.0}}, "degree of freedom 'y' has no mass"),
    ({"mass_matrix": [[0.0, 1e5], [1e5, 0.0]]}, "the mass matrix is singular .* degree of freedom '[xy]'"),
    ({"mass_matrix": [[0.0, 2e5], [2e5, 0.0]]}, "the mass matrix is singular or has a negative eigenvalue"),
    ({"springs": [AXIAL]}, "degree of freedom 'y' can move freely"),
    ({"geometric_stiffness": np.diag([0.0, 2e7])}, "degree of freedom 'y' can move freely or buckles"),
    ({"springs": [*BOTH, AXIAL]}, "two springs have the name 'a'"),
    (
        {"springs": [*BOTH, wd.Spring("c", {"z": 1.0}, stiffness=1.0)]},
        "spring 'c' names the unknown degree of freedom 'z'",
    ),
    ({"springs": []}, "1 to 128 springs, got 0"),
    ({"mass": {}}, "1 to 64 degrees of freedom, got 0"),
    ({"influence": {"X": 1.0}}, "influence names the unknown degree of freedom 'X'"),
    ({"influence": [{"x": 1.0}, {"q": 1.0}]}, r"influence\[1\] names the unknown degree of freedom 'q'"),
    ({"mass_matrix": np.eye(3)}, r"mass_matrix must have a row and a column .* shape \[2, 2\], got \[3, 3\]"),
    ({"load_mass": [1e5]}, r"load_mass must have a row and a column .* got \[1, 1\]"),
    ({"damping_matrix": [[1e4, 0.0], [0.0, -1e4]]}, "negative eigenvalue -10000 N s/m.* of degree of freedom 'y'"),
    ({"damping_matrix": [[1.0, 2.0], [3.0, 4.0]]}, r"damping_matrix is not symmetric: \['x', 'y'\] is 2"),
    ({"stiffness_matrix": [[np.inf, 0.0], [0.0, 1.0]]}, r"stiffness_matrix\[0, 0\] is inf"),
    ({"outputs": {"corner": {"w": 1.0}}}, "output 'corner' names the unknown degree of freedom 'w'"),
    ({"outputs": {"corner": {}}}, "output 'corner' depends on no degree of freedom"),
    ({"damping": "rayleigh"}, "damping_ratio is missing"),
    ({"damping": "storey"}, "unknown damping 'storey'"),
    ({"damping_ratio": 0.05}, "damping 'none' takes no damping_ratio"),
    ({"damping": "modal", "damping_ratio": 5.0}, "damping_ratio is 5"),
    ({"damping": "rayleigh", "damping_ratio": 0.05, "damping_modes": (1, 3)}, "two different modes from 1 to 2"),
    ({"damping": "modal", "damping_ratio": 0.05, "damping_modes": (1, 2)}, "damping_modes needs damping='rayleigh'"),
]


@pytest.mark.parametrize(("changed", "message"), STRUCTURES)
def test_a_wrong_structure_is_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        structure(**changed)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"springs": "ab"}, "springs must be a list of Springs"),
        ({"mass": [1.0, 2.0]}, "mass must be a dictionary"),
        ({"influence": 1.0}, "influence must be a dictionary"),
        ({"outputs": [1.0]}, "outputs must be a dictionary"),
    ],
)
def test_a_wrong_kind_of_argument_is_refused(changed, message):
    with pytest.raises(TypeError, match=message):
        structure(**changed)


def test_too_large_structures_are_refused():
    names = [str(i) for i in range(65)]
    springs = [wd.Spring(name, {name: 1.0}, stiffness=1.0) for name in names]
    with pytest.raises(ValueError, match="1 to 64 degrees of freedom, got 65"):
        wd.LumpedStructure(dict.fromkeys(names, 1.0), springs)


def test_an_optional_parameter_is_given_in_all_springs_of_a_law_or_in_none():
    given = {"law": "trilinear", "stiffness": 1e7, "yield_force": 1e5, "hardening_ratio": 0.01}
    given |= {"ductility_2": 3.0, "force_ratio_2": 1.3}
    one = wd.Spring("one", {"x": 1.0}, yield_force_negative=2e5, **given)
    other = wd.Spring("other", {"y": 1.0}, **given)
    with pytest.raises(ValueError, match="spring 'other': yield_force_negative is missing"):
        structure(springs=[one, other])


PAIRS = [
    ({"y": wd.GroundMotion(np.ones(100), 0.02)}, "x has a step of 0.01 s and y one of 0.02 s"),
    ({"y": wd.GroundMotion(np.ones(99), 0.01)}, "x has 100 samples and y has 99"),
    ({"vertical": wd.GroundMotion(np.ones(99), 0.01)}, "x has 100 samples and vertical has 99"),
    ({"y": wd.GroundMotion(np.ones(100), 0.01, "up", component="UP")}, "y is 'up', a vertical component"),
]


@pytest.mark.parametrize(("changed", "message"), PAIRS)
def test_a_wrong_pair_is_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        wd.PairOfMotions(**{"x": MOTION, "y": MOTION} | changed)


def test_a_pair_of_something_else_is_refused():
    with pytest.raises(TypeError, match="y must be a GroundMotion, got float"):
        wd.PairOfMotions(MOTION, 1.0)


PAIR = wd.PairOfMotions(MOTION, MOTION)
TWO = [{"x": 1.0}, {"y": 1.0}]


@pytest.mark.parametrize(
    ("built", "excitation", "named", "message"),
    [
        (structure(), PAIR, {}, "1 influence vectors, but the base motion has 2 components"),
        (structure(influence=TWO), MOTION, {}, "2 influence vectors, but the base motion has 1 components"),
        (wd.ShearBuilding(1.0, 1.0, 3.0), PAIR, {}, "a pair of motions needs a LumpedStructure"),
        (structure(), MOTION, {"recorders": ("output",)}, "recorder 'output' needs outputs="),
        (structure(), MOTION, {"recorders": ("drift",)}, "recorder 'drift' needs storeys"),
        (structure(), MOTION, {"collapse_drift_ratio": 0.1}, "collapse_drift_ratio needs storeys"),
        (structure(), wd.FreeVibration(1.0, velocity=[1.0, 0.0, 0.0]), {}, "has 3 values, but the structure has 2"),
    ],
)
def test_a_scene_that_does_not_fit_is_refused(built, excitation, named, message):
    with pytest.raises(ValueError, match=message):
        wd.Scene(built, excitation, **named)


def test_a_set_of_motions_has_one_number_of_components():
    with pytest.raises(ValueError, match=r"motion 0 .* has 2 components, but motion 1 .* has 1"):
        wd.Cloud([PAIR, MOTION])


@pytest.mark.parametrize("method", ["exact", "central_difference_lagged", "dormand_prince54"])
def test_a_method_that_does_not_fit_is_refused(method):
    with pytest.raises(ValueError, match="does not support a LumpedStructure; these do: heun"):
        wd.simulate(wd.Scene(structure(), MOTION), method=method, device="cpu")


@pytest.mark.parametrize(
    ("scatter", "message"),
    [
        (
            {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="storey")},
            "one value per spring; use per='spring'",
        ),
        ({"mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="spring")}, "one value per dof; use per='dof'"),
        ({"mass": wd.GivenValues([[1.0, 2.0, 3.0]])}, r"it must be \[structure, 2\] or \[structure\]"),
        ({"height": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}, "unknown parameter 'height'"),
    ],
)
def test_scatter_that_does_not_fit_is_refused(scatter, message):
    with pytest.raises(ValueError, match=message):
        wd.Scene(structure(), MOTION, scatter)


@pytest.mark.parametrize(
    ("scatter", "message"),
    [
        ({"stiffness": [[1e7, 1e7], [1e7, -1.0]]}, "the given stiffness is -1 at structure 1, spring 'b'"),
        ({"mass": [[1e5, 1e5], [-1.0, 1e5]]}, "the given mass is -1 at structure 1, dof 'x'"),
        ({"mass": [[1e5, 1e5], [1e5, 0.0]]}, "degree of freedom 'y' has no mass"),
        ({"stiffness": [[1e7, 1e7], [1e7, 0.0]]}, "degree of freedom 'y' can move freely"),
    ],
)
def test_a_drawn_value_that_is_wrong_is_named(scatter, message):
    damped = structure(damping="rayleigh", damping_ratio=0.05)
    scene = wd.Scene(damped, MOTION, {name: wd.GivenValues(values) for name, values in scatter.items()})
    with pytest.raises(ValueError, match=message):
        wd.simulate(scene, device="cpu")


@pytest.mark.parametrize(
    ("load", "name"),
    [
        (wd.FreeVibration(1.0, velocity=0.1), "FreeVibration.velocity"),
        (wd.FreeVibration(1.0, displacement=0.1), "FreeVibration.displacement"),
        (wd.HarmonicForce([0.0, 0.0, 0.0], 1.0, 1.0, initial_velocity=0.1), "HarmonicForce.initial_velocity"),
    ],
)
def test_one_initial_value_for_translations_and_rotations_is_refused(load, name):
    turning = {"mass": MASS | {"theta": 1e6}, "influence": {"x": 1.0}}
    deck = structure(springs=[*BOTH, wd.Spring("c", {"theta": 1.0}, stiffness=1e8)], **turning)
    match = rf"{name} has 1 value \[m.*rad.*\], .* rotations \(theta\): give one value per degree of freedom, shape \[3"
    with pytest.raises(ValueError, match=match):
        wd.Scene(deck, load)
    wd.Scene(deck, wd.FreeVibration(1.0, velocity=[0.1, 0.1, 0.0]))
    wd.Scene(structure(rotations=["x", "y"], influence={"x": 1.0}), wd.FreeVibration(1.0, velocity=0.1))
