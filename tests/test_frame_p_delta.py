"""P-Delta of reduced frames: equilibrium of their outputs, and columns with the closed solution of Euler."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import four_storey

import warpdyn as wd

pytestmark = pytest.mark.fast
HEIGHT, BENDING, MASS = 4.0, 2e6, 2e4  # m, N m2, kg
EULER = np.pi**2 * BENDING / (4 * HEIGHT**2)  # buckling load of the cantilever [N]


def of_one(structure: wd.LumpedStructure, **values) -> dict[str, np.ndarray]:
    return {name: np.asarray(values.get(name, each))[None] for name, each in structure.parameters.items()}


def under(structure: wd.LumpedStructure, load: np.ndarray) -> tuple[np.ndarray, dict[str, float]]:
    """Return the displacements and outputs of a structure under static forces on its degrees of freedom."""
    values = of_one(structure)
    moved = np.linalg.solve(structure.stiffness_matrices(values)[0], load)
    return moved, dict(zip(structure.outputs, structure.output_matrices(values)[0] @ moved, strict=True))


def cantilever(load: float, parts: int = 16) -> wd.Frame:
    """Return a cantilever with a mass and a gravity load at its tip."""
    names = [f"{place}" for place in range(parts + 1)]
    nodes = {name: {"x": 0.0, "y": HEIGHT * place / parts} for place, name in enumerate(names)}
    nodes[names[-1]]["gravity_load"] = load
    return wd.Frame(
        nodes,
        {f"M{place}": (names[place], names[place + 1], "s") for place in range(parts)},
        {"s": {"elastic_modulus": 2e11, "area": 1.0, "second_moment": BENDING / 2e11}},
        supports={"0": "fixed"},
        masses={names[-1]: {"ux": MASS}},
        geometric_stiffness="consistent",
    )


def euler_stiffness(load: float, bending: float) -> float:
    """Return the lateral stiffness of a cantilever under an axial load: P / (L (tan a / a - 1)) [N/m]."""
    angle = HEIGHT * np.sqrt(load / bending)
    return float(load / (HEIGHT * (np.tan(angle) / angle - 1)))


@pytest.mark.parametrize("share", [0.2, 0.65])
def test_static_condensation_is_exact_for_consistent_geometric_stiffness(share):
    # Between the kept tip and the base, the shape depends on the axial force.
    structure = cantilever(share * EULER).lumped(p_delta=True)
    assert structure.dofs == 1
    due = 2 * np.pi * np.sqrt(MASS / euler_stiffness(share * EULER, BENDING))
    assert structure.fundamental_period == pytest.approx(due, rel=1e-6)
    assert structure.matrices["stiffness_matrix"].item() == pytest.approx(3 * BENDING / HEIGHT**3, rel=1e-9)
    stiffer = of_one(structure, second_moment=1.5 * structure.parameters["second_moment"])
    found = structure.stiffness_matrices(stiffer).item()
    assert found == pytest.approx(euler_stiffness(share * EULER, 1.5 * BENDING), rel=1e-6)


def test_forces_of_a_cantilever_under_gravity_are_in_equilibrium():
    load = 0.65 * EULER
    frame = cantilever(load)
    structure = frame.lumped(p_delta=True, outputs=["base_shear", "member_force"], members=["M0", "M9"])
    moved, found = under(structure, np.array([1e3]))
    assert found["base shear"] == pytest.approx(1e3, rel=1e-9)
    assert found["M0 moment start"] == pytest.approx(1e3 * HEIGHT + load * moved[0], rel=1e-6)
    for name in ("M0 shear start", "M9 shear start", "M9 shear end"):
        assert abs(found[name]) == pytest.approx(1e3, rel=1e-6)


@pytest.mark.parametrize("kind", ["string", "consistent"])
def test_shear_forces_of_a_storey_add_up_to_the_load_above_it(kind):
    frame = wd.Frame(**(four_storey().description() | {"geometric_stiffness": kind}))
    structure = frame.lumped(p_delta=True, outputs=["base_shear", "member_force"])
    moved, found = under(structure, np.full(4, 1e5))
    assert found["base shear"] == pytest.approx(4e5, rel=1e-9)
    for storey in (1, 2, 3, 4):
        columns = [f"C{storey}_{line}" for line in (1, 2, 3, 4)] + [f"L{storey}"]
        total = sum(found[f"{name} shear start"] for name in columns)
        assert total == pytest.approx(1e5 * (5 - storey), rel=1e-9)
    weight = 3078215.5 + 2 * 3070145.2 + 2761607.2
    assert found["L1 shear start"] == pytest.approx(-weight * moved[0] / 4.3, rel=1e-9)
    # The axial forces that the lateral load adds change single moments of `static` slightly, not those of the storey.
    loads = {f"floor {floor}": {"fx": 1e5} for floor in (1, 2, 3, 4)}
    forces = frame.static(loads, gravity=True, p_delta=True) - frame.static(gravity=True, p_delta=True)
    for member in ("C1_1", "C1_2"):
        due = forces["end_force"].sel(member=member, end="start", action="moment").item()
        assert found[f"{member} moment start"] == pytest.approx(due, rel=1e-3)


def test_sections_with_which_a_part_between_kept_degrees_of_freedom_buckles_are_refused():
    frame = wd.Frame(
        {"A": (0.0, 0.0), "M": (0.0, 2.0), "B": {"x": 0.0, "y": 4.0, "gravity_load": 1e5}, "C": (4.0, 0.0)},
        {"low": ("A", "M", "s"), "high": ("M", "B", "s"), "brace": ("C", "B", "s", "truss")},
        {"s": {"elastic_modulus": 2e11, "area": 0.01, "second_moment": 1e-5}},
        supports={"A": "pinned", "C": "pinned"},
        masses={"B": {"ux": 1e4}},
        geometric_stiffness="consistent",
    )
    structure = frame.lumped(p_delta=True)
    stiffness = structure.stiffness_matrices(of_one(structure)).item()
    assert stiffness > 0
    # The buckling load of the pinned column, pi2 EI / L2, is 1.23 times the load with 1e-6 m4.
    found = structure.stiffness_matrices(of_one(structure, second_moment=np.full(3, 1e-6))).item()
    assert found == pytest.approx(stiffness, rel=0.05)
    with pytest.raises(ValueError, match="buckles under gravity between the kept degrees of freedom"):
        structure.stiffness_matrices(of_one(structure, second_moment=np.full(3, 0.7e-6)))
    for first in range(7):  # found by bisection
        values = np.full((7, 3), 1e-5)
        values[[first, 6]] = 0.7e-6
        problem = structure.problem(dict(structure.parameters) | {"second_moment": values})
        assert problem.startswith(f"structure {first}: ")
    given = wd.GivenValues([[1e-5] * 3, [0.7e-6] * 3])
    scene = wd.Scene(structure, wd.GroundMotion(np.sin(np.arange(200) / 10), 0.01), {"second_moment": given})
    text = r"structure 1: .*buckles under gravity between .*reduce the scatter"
    with wd.meant_as_given("no_damping"), pytest.raises(ValueError, match=text):
        wd.simulate(scene, device="cpu")


def test_a_force_that_is_zero_only_with_equal_sections_has_its_true_coefficients():
    # A balanced bridge: two paths of two equal bars from B to the support G, and a bar between their middles P and Q.
    modulus = 2.0**37
    places = {"G": 0.0, "P": 1.0, "Q": 3.0, "B": 4.0}
    areas = {"BP": 3.0, "PG": 1.0, "BQ": 1.0, "QG": 3.0, "PQ": 4.0}  # area over length: 1, in the bridge 2
    frame = wd.Frame(
        {name: (x, 0.0) for name, x in places.items()},
        {name: (*name, name, "truss") for name in areas},
        {name: {"elastic_modulus": modulus, "area": area} for name, area in areas.items()},
        supports={"G": "pinned", "P": "roller", "Q": "roller", "B": "roller"},
        masses={"B": {"ux": 1e4}},
    )
    structure = frame.lumped(outputs=["member_force"])
    assert dict(structure.outputs["PQ axial"][0]) == {"B ux": 0.0}
    areas = np.array([6.0, 1.0, 1.0, 3.0, 4.0])  # BP has twice its area
    values = {"area": areas[None], "mass": structure.parameters["mass"][None]}
    found = dict(zip(structure.outputs, structure.output_matrices(values)[0, :, 0], strict=True))
    # Equilibrium of P and Q for a unit displacement of B.
    moved = np.linalg.solve([[2 + 1 + 2, -2], [-2, 1 + 1 + 2]], [2, 1])
    assert found["PQ axial"] == pytest.approx(2 * modulus * (moved[1] - moved[0]), rel=1e-12)
    equipped = wd.with_equipment(structure, "B ux", 1e2, period=0.1, damping_ratio=0.02)
    assert "PQ axial" not in equipped.outputs
    assert "BP axial" in equipped.outputs
