"""Guyan and Craig-Bampton reduction of frames, and fish-bones."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import chain
from scipy.linalg import eigh

import warpdyn as wd
from warpdyn.model.structures.frames.reduction import fixed_interface_modes, free_matrices

pytestmark = pytest.mark.fast


def divided_frame() -> wd.Frame:
    """Two bays of 6 m and three storeys of 3.5 m; four elements per member, consistent mass."""
    nodes, members = {}, {}

    def add(a, b, section):
        def place(level, line):
            return (6.0 * line, 3.5 * level)

        more_nodes, more_members = chain(f"{a[0]}{a[1]}", f"{b[0]}{b[1]}", place(*a), place(*b), 4, section)
        nodes.update(more_nodes)
        members.update(more_members)

    for level in range(3):
        for line in range(3):
            add((level, line), (level + 1, line), "column")
        for bay in range(2):
            add((level + 1, bay), (level + 1, bay + 1), "beam")
    common = {"elastic_modulus": 200e9, "area": 0.015}
    sections = {
        "column": common | {"second_moment": 2.5e-4, "mass_per_length": 117.75},
        "beam": common | {"second_moment": 3.0e-4, "mass_per_length": 4000.0},
    }
    supports = {f"0{line}": "fixed" for line in range(3)}
    return wd.Frame(nodes, members, sections, supports=supports, member_mass="consistent")


FULL = [1.3448595, 4.3569833, 7.2654677, 7.828207, 8.5924616, 8.8868777, 9.0969093, 10.020968]
FLOORS = ["10 ux", "20 ux", "30 ux"]
REDUCED = {
    ("guyan", 0): [1.3479591, 4.4623983, 8.1775057],
    ("craig_bampton", 3): [1.3479579, 4.4596636, 7.3300861, 8.2925764, 8.6030262, 8.8879788],
    ("craig_bampton", 10): [1.3449034, 4.3588881, 7.2680242, 7.8373363, 8.592577, 8.886893, 9.0969721, 10.020981],
    ("craig_bampton", 30): [1.3448629, 4.3571289, 7.2657124, 7.8290285, 8.5924693, 8.8868788, 9.0969148, 10.02097],
}


def frequencies(structure: wd.LumpedStructure, count: int) -> np.ndarray:
    return 1 / structure.modal()["period"].values[:count]


def test_the_full_frame_and_its_reductions_have_the_recomputed_frequencies():
    frame = divided_frame()
    assert frame.numbering.free.size == 162
    np.testing.assert_allclose(1 / frame.modal(modes=8)["period"].values, FULL, rtol=1e-7)
    for (reduction, modes), due in REDUCED.items():
        structure = frame.lumped(FLOORS, reduction=reduction, modes=modes)
        np.testing.assert_allclose(frequencies(structure, len(due)), due, rtol=1e-7)


CANTILEVER = {
    ("guyan", 0): [3.53273154, 34.8068931],
    ("craig_bampton", 1): [3.51723651, 22.1269478, 117.045232],
    ("craig_bampton", 4): [3.51603644, 22.0381461, 61.7539955, 121.19905, 200.796775],
}


def test_the_cantilever_and_its_reductions():
    nodes, members = chain("A", "B", (0, 0), (0, 1), 10, "s")
    section = {"elastic_modulus": 1.0, "area": 1e3, "second_moment": 1.0, "mass_per_length": 1.0}
    supports = {"A": "fixed"} | {name: {"uy": True} for name in nodes if name != "A"}
    frame = wd.Frame(nodes, members, {"s": section}, supports=supports, member_mass="consistent")
    full = frame.modal(modes=5)["circular_frequency"].values
    np.testing.assert_allclose(full, [3.51601828, 22.0352209, 61.712923, 121.01713, 200.363329], rtol=3e-9)
    for (reduction, modes), due in CANTILEVER.items():
        structure = frame.lumped(["B ux", "B rz"], reduction=reduction, modes=modes)
        omega = structure.modal()["circular_frequency"].values[: len(due)]
        np.testing.assert_allclose(omega, due, rtol=5e-9)
    stiffness, _, mass = free_matrices(frame)
    kept = np.array([frame.numbering.free_names.index(name) for name in ("B ux", "B rz")])
    shapes = fixed_interface_modes(stiffness, mass, kept, 4)
    omega = np.sqrt(np.diag(shapes.T @ stiffness @ shapes))
    np.testing.assert_allclose(omega, [22.3740605, 61.6889017, 121.02272, 200.387072], rtol=3e-9)


def test_the_load_of_a_reduced_frame_contains_the_eliminated_masses():
    frame = divided_frame()
    full = frame.modal()
    structure = frame.lumped(FLOORS, reduction="craig_bampton", modes=61)
    one = {name: each[None] for name, each in structure.parameters.items()}
    mass, stiffness = structure.mass_matrices(one)[0], structure.stiffness_matrices(one)[0]
    load = structure.load_masses(one)[0] @ structure.influence[:, 0]
    squared, shapes = eigh(stiffness, mass)
    assert (np.sqrt(squared[:8]) >= full["circular_frequency"].values[:8] * (1 - 1e-12)).all()
    effective = (load @ shapes) ** 2
    np.testing.assert_allclose(effective[:2], full["effective_mass"][:2], rtol=2e-5)
    # Without the load of the inner masses: only the product with the reduced mass matrix.
    wrong = ((mass @ structure.influence[:, 0]) @ shapes) ** 2
    assert abs(wrong[0] / full["effective_mass"][0].item() - 1) > 0.005


def test_static_condensation_needs_all_masses_and_guyan_does_not():
    frame = divided_frame()
    with pytest.raises(ValueError, match=r"has the mass .* and is not kept"):
        frame.lumped(FLOORS)
    with pytest.raises(ValueError, match="at most 64 are possible"):
        frame.lumped(FLOORS, reduction="craig_bampton", modes=62)


def uniform_frame(outer: float) -> wd.Frame:
    """Three storeys of 3.5 m, three bays of 6 m, axially rigid; outer columns: `outer` times the inner stiffness."""
    nodes = {f"{level}{line}": (6.0 * line, 3.5 * level) for level in range(4) for line in range(4)}
    members, sections = {}, {}
    for level, (column, beam) in enumerate(zip((3e-4, 3e-4, 2e-4), (4e-4, 3e-4, 2e-4), strict=True)):
        common = {"elastic_modulus": 200e9, "area": 1e4}
        sections[f"in{level}"] = common | {"second_moment": column}
        sections[f"out{level}"] = common | {"second_moment": outer * column}
        sections[f"beam{level}"] = common | {"second_moment": beam}
        for line in range(4):
            section = f"out{level}" if line in (0, 3) else f"in{level}"
            members[f"C{level}{line}"] = (f"{level}{line}", f"{level + 1}{line}", section)
        for bay in range(3):
            members[f"B{level}{bay}"] = (f"{level + 1}{bay}", f"{level + 1}{bay + 1}", f"beam{level}")
    return wd.Frame(
        nodes,
        members,
        sections,
        supports={f"0{line}": "fixed" for line in range(4)},
        diaphragms={f"floor {level}": [f"{level}{line}" for line in range(4)] for level in (1, 2, 3)},
        masses=dict.fromkeys(("floor 1", "floor 2", "floor 3"), 100e3),
    )


@pytest.mark.parametrize(
    ("outer", "due"), [(0.5, (1.119512, 3.213836, 5.724369)), (1.0, (1.189577, 3.518192, 6.500329))]
)
def test_frames_that_are_compared_with_fishbones(outer, due):
    found = 1 / uniform_frame(outer).modal()["period"].values
    np.testing.assert_allclose(found, due, rtol=5e-7)
