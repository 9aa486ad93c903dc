"""Periods of frames: textbooks, exact dynamic stiffness, SAC frames, reference models and member matrices."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import INCH, REFERENCE_MODELS, chain
from scipy.optimize import brentq

import warpdyn as wd
from warpdyn.model.structures.frames.members.elements import (
    Geometry,
    Sections,
    beam_stiffness,
    geometric_stiffness_of,
    mass_of,
    shear_ratio,
)

pytestmark = pytest.mark.fast

# Periods [s] without P-Delta, first period with it, floor stiffness [N/m]: own program and OpenSeesPy.
REFERENCE = {
    "portal": ((0.59134308,), 0.59787265),
    "two_storey": ((0.82356525, 0.21175537), 0.83372004),
    "four_storey": ((1.3364741, 0.44382542, 0.2188196, 0.13848291), 1.3648267),
    "eight_storey": ((2.2184314, 0.82386087, 0.46076153, 0.29360501), 2.2788466),
    "braced": ((0.76040167, 0.29972266, 0.18161342), 0.76642741),
    "fishbone": ((1.946446, 0.68794608, 0.39212538, 0.25536991), 1.9841149),
}
FLOOR_STIFFNESS = {
    "portal": [[7902759.09]],
    "two_storey": [[168475824, -82666505.2], [-82666505.2, 58129745.3]],
    "four_storey": [
        [372437030, -229554321, 57764685.8, -6943714.74],
        [-229554321, 325537298, -192508863, 40255690.2],
        [57764685.8, -192508863, 238434231, -94753328.6],
        [-6943714.74, 40255690.2, -94753328.6, 60258343.1],
    ],
}
# Rayleigh coefficients a0 [1/s] and a1 [s]: damping ratio, modes (the portal has one mode).
RAYLEIGH = {
    "two_storey": (0.02, (1, 2), 0.24275322, 0.0010723528),
    "four_storey": (0.02, (1, 3), 0.16159482, 0.0011970561),
    "eight_storey": (0.02, (1, 3), 0.093807135, 0.0024288369),
    "braced": (0.02, (1, 3), 0.26679765, 0.00093328278),
    "fishbone": (0.03, (1, 3), 0.16120573, 0.0031166502),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_reference_models_have_the_periods_of_opensees(name):
    frame = REFERENCE_MODELS[name]()
    periods, first = REFERENCE[name]
    np.testing.assert_allclose(frame.modal(modes=len(periods))["period"], periods, rtol=1e-7)
    assert frame.modal(p_delta=True)["period"][0].item() == pytest.approx(first, rel=1e-7)
    reduced = frame.lumped(p_delta=True)
    assert reduced.fundamental_period == pytest.approx(first, rel=1e-7)
    if name in FLOOR_STIFFNESS:
        due = np.array(FLOOR_STIFFNESS[name])
        np.testing.assert_allclose(reduced.matrices["stiffness_matrix"], due, rtol=1e-7, atol=5e-9 * due.max())


@pytest.mark.parametrize("name", RAYLEIGH)
def test_reference_models_have_the_rayleigh_damping_of_the_reference(name):
    # The reference takes frequencies without P-Delta.
    ratio, modes, a0, a1 = RAYLEIGH[name]
    frame = REFERENCE_MODELS[name]()
    structure = frame.lumped(damping="rayleigh", damping_ratio=ratio, damping_modes=modes)
    matrices = structure.central_matrices(structure.parameters)
    due = a0 * matrices["mass"] + a1 * matrices["stiffness"]
    np.testing.assert_allclose(matrices["damping"], due, rtol=1e-6, atol=1e-7 * due.max())


def test_the_p_delta_of_rigid_floors_is_the_weight_over_the_height():
    # K_G of a storey is -P/h on its drift, whichever column carries the load.
    frame = REFERENCE_MODELS["four_storey"]()
    loads = [3706000, 3692000, 3692000, 3277000]
    joints = [2 * a + 2 * b for a, b in ((188314.9, 125543.6), (186667.9, 124445.6), (186667.9, 124445.6))]
    joints.append(2 * (154661.2 + 103107.8))
    leaning = [3078215.5, 3070145.2, 3070145.2, 2761607.2]
    loads = [a + b for a, b in zip(joints, leaning, strict=True)]
    due = wd.geometric_stiffness(loads, [4.3, 4.0, 4.0, 4.0])
    found = frame.lumped(p_delta=True).matrices["geometric_stiffness"]
    np.testing.assert_allclose(found, due, rtol=1e-10, atol=1e-6)


def test_the_two_storey_frame_of_chopra():
    # Dynamics of Structures, examples on static condensation: stiffness times EI / h^3, frequencies times
    # sqrt(EI / (m h^3)).
    h, bending, mass, area = 3.0, 2e7, 1e4, 1e3
    xy = {"A": (0, 0), "B": (0, h), "C": (0, 2 * h), "D": (2 * h, 0), "E": (2 * h, h), "F": (2 * h, 2 * h)}
    stiff = {"elastic_modulus": 2e11, "area": area, "second_moment": 2 * bending / 2e11}
    soft = {"elastic_modulus": 2e11, "area": area, "second_moment": bending / 2e11}
    members = {"1": ("A", "B", "2EI"), "2": ("D", "E", "2EI"), "3": ("B", "C", "EI"), "4": ("E", "F", "EI")}
    members |= {"floor": ("B", "E", "2EI"), "roof": ("C", "F", "EI")}
    frame = wd.Frame(
        xy,
        members,
        {"2EI": stiff, "EI": soft},
        supports={"A": "fixed", "D": "fixed"},
        diaphragms={"u1": ["B", "E"], "u2": ["C", "F"]},
        masses={"u1": 2 * mass, "u2": mass},
    )
    found = frame.lumped().matrices["stiffness_matrix"] * h**3 / bending
    np.testing.assert_allclose(found, [[54.8852459, -17.5081967], [-17.5081967, 11.6065574]], rtol=5e-7)
    omega = frame.modal()["circular_frequency"].values / np.sqrt(bending / (mass * h**3))
    np.testing.assert_allclose(omega, [2.19747265, 5.84981147], rtol=2e-7)


PORTAL_ROOTS = [  # elements per member; lambda of consistent and of lumped masses
    (1, (1.79176623, 3.89046284, 5.71678241), (1.70243192,)),
    (2, (1.79028084, 3.56773539, 4.56766147), (1.77645072, 3.52044468, 4.26921655)),
    (8, (1.7901325, 3.55645264, 4.54206116), (1.78934725, 3.55635137, 4.53511792)),
    (16, (1.79013196, 3.55640765, 4.54193248), (1.78993627, 3.55640157, 4.54025666)),
]


@pytest.mark.parametrize(("parts", "consistent", "lumped"), PORTAL_ROOTS)
def test_the_square_portal_converges_to_the_dynamic_stiffness(parts, consistent, lumped):
    corners = {"A": (0, 0), "B": (0, 1), "C": (1, 1), "D": (1, 0)}
    nodes, members = {}, {}
    for start, end in ("AB", "BC", "CD"):
        more_nodes, more_members = chain(start, end, corners[start], corners[end], parts, "s")
        nodes |= more_nodes
        members |= more_members
    section = {"elastic_modulus": 1.0, "area": 1e7, "second_moment": 1.0, "mass_per_length": 1.0}
    for kind, due in (("consistent", consistent), ("lumped", lumped)):
        frame = wd.Frame(nodes, members, {"s": section}, supports={"A": "fixed", "D": "fixed"}, member_mass=kind)
        found = np.sqrt(frame.modal(modes=len(due))["circular_frequency"])
        np.testing.assert_allclose(found, due, rtol=3e-7)


INCHES = {  # area [in2], second moment [in4]
    "W14x257": (75.6, 3400),
    "W14x311": (91.4, 4330),
    "W33x118": (34.7, 5900),
    "W30x116": (34.2, 4930),
    "W24x68": (20.1, 1830),
    "W21x44": (13.0, 843),
    "W14x370": (109, 5440),
    "W14x500": (147, 8210),
    "W14x455": (134, 7190),
    "W14x283": (83.3, 3840),
    "W14x233": (68.5, 3010),
    "W36x160": (47.0, 9760),
    "W36x135": (39.7, 7800),
    "W30x99": (29.1, 3990),
    "W27x84": (24.8, 2850),
    "W14x68 weak": (20.0, 121),
}
SECTIONS = {
    name: {"elastic_modulus": 200e9, "area": area * INCH**2, "second_moment": inertia * INCH**4}
    for name, (area, inertia) in INCHES.items()
}


def test_sac_frame_of_three_storeys_has_the_recomputed_frequencies():
    # LA3, centre lines; Ohtori and co-authors (2004) quote 0.99, 3.056, 5.827 Hz.
    nodes = {f"{level}{line}": (9.15 * line, 3.96 * level) for level in range(4) for line in range(5)}
    columns = ["W14x257", "W14x311", "W14x311", "W14x257", "W14x68 weak"]
    girders = ["W33x118", "W30x116", "W24x68"]
    members = {}
    for level in range(3):
        for line, column in enumerate(columns):
            members[f"C{level}{line}"] = (f"{level}{line}", f"{level + 1}{line}", column)
        for bay in range(4):
            release = {"section": "W21x44", "release": "both"} if bay == 3 else {"section": girders[level]}
            members[f"B{level}{bay}"] = {"start": f"{level + 1}{bay}", "end": f"{level + 1}{bay + 1}"} | release
    masses = {}
    for level, mass in enumerate((9.57e5, 9.57e5, 1.04e6), start=1):
        for line in range(5):
            share = 0.125 if line in (0, 4) else 0.25
            masses[f"{level}{line}"] = mass / 2 * share
    frame = wd.Frame(
        nodes,
        members,
        SECTIONS,
        supports={f"0{line}": "fixed" for line in range(5)},
        diaphragms={f"floor {level}": [f"{level}{line}" for line in range(5)] for level in (1, 2, 3)},
        masses=masses,
    )
    found = 1 / frame.modal(modes=6)["period"].values
    np.testing.assert_allclose(found, [0.989549, 3.056437, 5.831812, 7.224354, 9.965713, 10.952331], rtol=6e-7)


# Columns of LA9 below and above the splice in each storey, from the basement up; girder above the storey.
NINE_STOREYS = [
    (3.65, "370", "370", "500", "500", "W36x160"),
    (5.49, "370", "370", "500", "500", "W36x160"),
    (3.96, "370", "370", "500", "455", "W36x160"),
    (3.96, "370", "370", "455", "455", "W36x135"),
    (3.96, "370", "283", "455", "370", "W36x135"),
    (3.96, "283", "283", "370", "370", "W36x135"),
    (3.96, "283", "257", "370", "283", "W36x135"),
    (3.96, "257", "257", "283", "283", "W30x99"),
    (3.96, "257", "233", "283", "257", "W27x84"),
    (3.96, "233", "233", "257", "257", "W24x68"),
]
SPLICE = 1.83  # height above the floor [m]


def test_sac_frame_of_nine_storeys_has_the_recomputed_frequencies():
    # LA9: pinned at the basement, ground floor held horizontally; Ohtori and co-authors (2004) quote 0.443, 1.178,
    # 2.047, 3.095, 4.274 Hz. The girder of the last bay is pinned at its outer end.
    masses_of_floors = [9.65e5, 1.01e6, *[9.89e5] * 7, 1.07e6]
    nodes = {f"0-{line}": (9.15 * line, 0.0) for line in range(6)}
    members, masses, height = {}, {}, 0.0
    for level, (storey, *outer_inner, girder) in enumerate(NINE_STOREYS):
        for line in range(6):
            below, above = outer_inner[:2] if line in (0, 5) else outer_inner[2:]
            top = f"{level + 1}-{line}"
            nodes[top] = (9.15 * line, height + storey)
            masses[top] = masses_of_floors[level] / 2 * (0.1 if line in (0, 5) else 0.2)
            start = f"{level}-{line}"
            if below != above:
                nodes[f"s{top}"] = (9.15 * line, height + SPLICE)
                members[f"c{top}"] = (start, f"s{top}", f"W14x{below}")
                start = f"s{top}"
            members[f"C{top}"] = (start, top, f"W14x{above}")
        for bay in range(5):
            girders = {"start": f"{level + 1}-{bay}", "end": f"{level + 1}-{bay + 1}", "section": girder}
            members[f"B{level}-{bay}"] = girders | {"release": "end" if bay == 4 else "none"}
        height += storey
    frame = wd.Frame(
        nodes,
        members,
        SECTIONS,
        supports={f"0-{line}": "pinned" for line in range(6)} | {"1-0": {"ux": True}},
        diaphragms={f"floor {level}": [f"{level}-{line}" for line in range(6)] for level in range(1, 11)},
        masses=masses,
    )
    found = 1 / frame.modal(modes=5)["period"].values
    np.testing.assert_allclose(found, [0.442694, 1.179120, 2.048440, 3.098584, 4.254724], rtol=1e-6)
    assert next(iter(frame.storey_drifts)) == "drift 1"
    assert frame.storey_drifts["drift 1"] == ("floor 2", None, pytest.approx(5.49))


def test_timoshenko_matrices_are_integrals_of_their_shapes():
    """Consistent mass and geometric stiffness against numerical integration of the shapes of a Timoshenko beam."""
    length, shear = 2.0, 0.7
    geometry = Geometry(
        np.array([length]), np.eye(6)[None], np.array([shear]), np.full((1, 2), np.inf), np.array([False]), np.ones(1)
    )
    sections = Sections(np.array([3.0]), np.array([1.0]), np.array([0.4]))
    phi = shear_ratio(geometry, sections)
    stiffness = beam_stiffness(geometry, sections)[0]
    x = (np.polynomial.legendre.leggauss(12)[0] + 1) * length / 2
    weight = np.polynomial.legendre.leggauss(12)[1] * length / 2
    shapes, slopes = [], []
    for place in (1, 2, 4, 5):  # the deflection is that of a cantilever under its end forces
        displacement = np.eye(6)[place]
        force = stiffness @ displacement
        bending = 3.0 * 0.4
        shear_stiffness = 3.0 / shear
        v0, r0, shear_force, moment = displacement[1], displacement[2], force[1], force[2]
        rotation = r0 - moment * x / bending + shear_force * x**2 / (2 * bending)
        slope = rotation + shear_force / shear_stiffness * -1.0
        deflection = v0 + r0 * x - moment * x**2 / (2 * bending) + shear_force * x**3 / (6 * bending)
        deflection = deflection - shear_force * x / shear_stiffness
        shapes.append(deflection)
        slopes.append(slope)
    shapes, slopes = np.array(shapes), np.array(slopes)
    places = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    mass = mass_of(geometry, "consistent", phi)[0][places]
    np.testing.assert_allclose(mass, (shapes * weight) @ shapes.T, rtol=1e-12)
    geometric = geometric_stiffness_of(geometry, "consistent", phi)[0][places]
    np.testing.assert_allclose(geometric, (slopes * weight) @ slopes.T, rtol=1e-11, atol=1e-13)


def test_a_lumped_mass_is_not_on_rotations():
    nodes, members = chain("A", "B", (0, 0), (0, 6), 3, "s")
    section = {"elastic_modulus": 3e10, "area": 0.1, "second_moment": 1e-3, "mass_per_length": 250.0}
    frame = wd.Frame(nodes, members, {"s": section}, supports={"A": "fixed"})
    assert frame.modal().sizes["mode"] == 6
    assert frame.mass().sum() == pytest.approx(2 * 250.0 * 6)


def test_a_hinged_bar_has_the_frequency_of_a_pinned_beam():
    # cos is 0: a pinned-pinned beam has lambda = pi.
    nodes, members = chain("A", "B", (0, 0), (5, 0), 12, "s")
    section = {"elastic_modulus": 2e11, "area": 0.01, "second_moment": 1e-4, "mass_per_length": 80.0}
    frame = wd.Frame(nodes, members, {"s": section}, supports={"A": "pinned", "B": "roller"}, member_mass="consistent")
    root = brentq(np.sin, 3, 3.3)
    due = root**2 * np.sqrt(2e11 * 1e-4 / (80.0 * 5**4))
    assert frame.modal()["circular_frequency"][0].item() == pytest.approx(due, rel=2e-5)
