"""Condensation of many frames against matrices that NumPy eliminates one after the other."""

import numpy as np
import pytest
from hinged_frame_cases import irregular

import warpdyn as wd
from warpdyn.campaigns.integration.lumped.dynamics import LumpedDynamics
from warpdyn.engine.methods.table import METHODS
from warpdyn.model.structures.frames.members.condensation import BUCKLES, Condensation
from warpdyn.model.structures.frames.members.elements import (
    Geometry,
    Sections,
    beam_stiffness,
    local_axes,
    stiffness_coefficients,
)

ROUNDING = 1e-10  # entries of a condensed matrix over its largest one: digits that numbers from 1e5 to 1e10 lose


def without(matrix, forces, left):
    """Return a stiffness and forces after the elimination of displacements."""
    kept = np.setdiff1d(np.arange(len(matrix)), left)
    follows = np.linalg.solve(matrix[np.ix_(left, left)], np.column_stack([matrix[np.ix_(left, kept)], forces[left]]))
    return (
        matrix[np.ix_(kept, kept)] - matrix[np.ix_(kept, left)] @ follows[:, :-1],
        forces[kept] - matrix[np.ix_(kept, left)] @ follows[:, -1],
    )


# The second value makes 12 E I / (G A_s L^2) larger than 2, so that the far end turns against the near one.
@pytest.mark.parametrize("shear", [0.0, 2e4])
@pytest.mark.parametrize(
    "springs", [(np.inf, np.inf), (3e7, 5e8), (0.0, 4e7), (np.inf, 6e6), (2e7, 0.0)], ids=lambda each: f"{each}"
)
def test_members_in_series_with_springs_of_their_ends(springs, shear):
    length, axes = local_axes(np.zeros((1, 2)), np.array([[3.0, 4.0]]), np.zeros((1, 2, 2)))
    geometry = Geometry(length, axes, np.array([2.5e2]), np.array([springs]), np.zeros(1, bool), np.array([shear]))
    sections = Sections(np.array([2e11]), np.array([0.01]), np.array([3e-4]))
    # Local displacements of the member, and then the rotations of both joints.
    whole = np.zeros((8, 8))
    whole[:6, :6] = beam_stiffness(geometry, sections)[0]
    rotation = np.eye(8)
    for end, spring in zip((2, 5), springs, strict=True):
        turn = rotation[end] - rotation[6 if end == 2 else 7]
        whole += (1e16 if np.isinf(spring) else spring) * np.outer(turn, turn)
    expected, _ = without(whole, np.zeros(8), [2, 5])  # axial, transverse, axial, transverse, rotations
    axial, start, both, end = stiffness_coefficients(geometry, sections)[0]
    chord = np.array([0, 1, 0, -1]) / length
    turned = np.array([[*chord, 1, 0], [*chord, 0, 1]])
    found = turned.T @ [[start, both], [both, end]] @ turned
    found[0, 0] += axial
    found[2, 2] += axial
    found[0, 2] -= axial
    found[2, 0] -= axial
    # 1e16 N m/rad instead of a rigid connection: an error of about EI / (L 1e16)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def random_sections(frame, count):
    random = np.random.default_rng(3)
    return [each * random.uniform(0.7, 1.4, (count, each.size)) for each in vars(frame.nominal).values()]


def test_frames_with_their_own_sections_and_loads():
    frame = irregular()
    numbering, free = frame.numbering, frame.numbering.free
    kept = np.array([place for place, name in enumerate(numbering.free_names) if name in frame.diaphragms])
    geometric = frame.geometric(frame.gravity)[free][:, free].toarray()
    condensation = Condensation(frame.deformations, np.diag(numbering.springs[free]) + geometric, kept)
    count = 19  # more than a thread computes at once
    values = random_sections(frame, count)
    loads = np.random.default_rng(4).normal(size=(count, free.size))
    coefficients = stiffness_coefficients(frame.geometry, Sections(*values))
    stiffness, forces = condensation.with_loads(coefficients, loads)
    left = np.setdiff1d(np.arange(free.size), kept)
    for structure in range(count):
        sparse = frame.stiffness(Sections(*(each[structure] for each in values)))
        dense = sparse[free][:, free].toarray() + geometric
        of_one, force = without(dense, loads[structure], left)
        np.testing.assert_allclose(stiffness[structure], of_one, rtol=0, atol=ROUNDING * np.abs(of_one).max())
        np.testing.assert_allclose(forces[structure], force, rtol=0, atol=ROUNDING * np.abs(force).max())


@pytest.mark.parametrize("place", [0, 15, 16, 18])
def test_one_unstable_frame_among_others_is_found(place):
    condensation = Condensation(np.eye(3)[None], np.zeros((3, 3)), np.array([0]))
    coefficients = np.tile([1.0, 2.0, 0.0, 3.0], (19, 1, 1))
    np.testing.assert_array_equal(condensation.condensed(coefficients), np.ones((19, 1, 1)))
    for wrong in (-2.0, 0.0, np.nan):
        coefficients[place, 0, 1] = wrong
        with pytest.raises(ValueError, match="nearly no stiffness"):
            condensation.condensed(coefficients)


def test_kept_displacements_may_be_uncoupled():
    condensation = Condensation(np.zeros((1, 3, 3)), np.diag([1.0, 2.0, 3.0]), np.array([0, 2]))
    np.testing.assert_array_equal(condensation.condensed(np.zeros((1, 1, 4)))[0], np.diag([1.0, 3.0]))


def test_buckling_between_floors_is_an_error():
    frame = irregular()
    free = frame.numbering.free
    kept = np.array([place for place, name in enumerate(frame.numbering.free_names) if name in frame.diaphragms])
    softening = -1e12 * np.eye(free.size)
    coefficients = stiffness_coefficients(frame.geometry, Sections(*random_sections(frame, 2)))
    with pytest.raises(ValueError, match="buckles under gravity between the kept degrees of freedom"):
        Condensation(frame.deformations, softening, kept, BUCKLES).condensed(coefficients)
    with pytest.raises(ValueError, match="nearly no stiffness between the kept degrees of freedom"):
        Condensation(frame.deformations, softening, kept).condensed(coefficients)


@pytest.mark.parametrize("size", [1, 7])
def test_no_bit_of_a_structure_depends_on_the_others(size):
    frame = irregular()
    members = [name for name, row in frame.members.items() if row["spring_start"] < np.inf and row["kind"] == "beam"]
    law = {"law": "bilinear", "yield_force": 2e5, "hardening_ratio": 0.02}
    structure = wd.HingedFrame(
        frame, {(member, "start"): law for member in members}, damping="rayleigh", damping_ratio=0.03
    )
    values = dict(zip(("elastic_modulus", "area", "second_moment"), random_sections(frame, 20), strict=True))
    dynamics = LumpedDynamics(structure, values)

    def prepared(structures):
        parameters = dynamics.parameters_of(values, structures)
        vibration = dynamics._vibration(parameters, METHODS["rk4"])
        return [*(each.T for each in vibration), *dynamics.pack(parameters, vibration[3]).values()]

    whole = prepared(slice(None))
    for first in range(0, 20, size):
        part = slice(first, first + size)
        for expected, found in zip(whole, prepared(part), strict=True):
            np.testing.assert_array_equal(found, expected[..., part])


@pytest.mark.parametrize(
    ("name", "value"), [("second_moment", 0.0), ("elastic_modulus", 0.0), ("elastic_modulus", -2e11), ("area", 0.0)]
)
def test_random_sections_without_stiffness_are_refused(name, value):
    frame = irregular()
    place, member = next((i, name) for i, (name, row) in enumerate(frame.members.items()) if row["kind"] == "beam")
    nominal = dict(zip(("elastic_modulus", "area", "second_moment"), vars(frame.nominal).values(), strict=True))
    values = np.tile(nominal[name], (3, 1))
    values[2, place] = value
    motion = wd.GroundMotion(np.sin(np.arange(50.0)), 0.01, "sine")
    damped = frame.lumped(damping="rayleigh", damping_ratio=0.03)
    scene = wd.Scene(damped, wd.Cloud([motion]), {name: wd.GivenValues(values)}, tail=0.0)
    with pytest.raises(ValueError, match=f"{name}.*{member}"):
        wd.simulate(scene, structures=3, device="cpu")
