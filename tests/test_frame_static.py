"""Static analysis of frames: AISC 360's P-Delta benchmarks, textbook frames and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import INCH, KIP, KSI, chain

import warpdyn as wd

pytestmark = pytest.mark.fast
FOOT = 12 * INCH
W14X48 = {"elastic_modulus": 29000 * KSI, "area": 14.1 * INCH**2, "second_moment": 484 * INCH**4}
SHEAR = {"shear_modulus": 11200 * KSI, "shear_area": 4.692 * INCH**2}
LENGTH = 28 * FOOT


def column(parts: int, kind: str, *, is_cantilever: bool, **more: float) -> wd.Frame:
    nodes, members = chain("base", "top", (0, 0), (0, LENGTH), parts, "W14x48")
    supports = {"base": "fixed"} if is_cantilever else {"base": "pinned", "top": {"ux": True}}
    return wd.Frame(nodes, members, {"W14x48": W14X48 | more}, supports=supports, geometric_stiffness=kind)


def benchmark(case: int, load: float, parts: int, kind: str = "consistent", **more: float) -> tuple[float, float]:
    """Return the largest moment [N m] and deflection [m] of a P-Delta benchmark of AISC 360, chapter C (commentary)."""
    frame = column(parts, kind, is_cantilever=case == 2, **more)
    axial = {"top": {"fy": -load}}
    if case == 1:
        across = {name: {"qx": 0.2 * KIP / FOOT} for name in frame.members}
        found = frame.static(axial, across, p_delta=load > 0)
        middle = f"base-top {parts // 2}"
        moment = found["end_force"].sel(member=middle, end="start", action="moment")
        return abs(moment.item()), found["displacement"].sel(node=middle, direction="ux").item()
    found = frame.static({"top": {"fx": KIP, "fy": -load}}, p_delta=load > 0)
    moment = found["reaction"].sel(node="base", direction="rz").item()
    return abs(moment), found["displacement"].sel(node="top", direction="ux").item()


AISC = [  # case, P [kip], moment [N m], deflection [m]: closed forms
    (1, 0, 26574.032, 0.0050053563),
    (1, 150, 30380.501, 0.0057048558),
    (1, 300, 35422.61, 0.0066307986),
    (1, 450, 42416.133, 0.0079143243),
    (2, 0, 37962.903, 0.022881629),
    (2, 100, 52997.493, 0.033799104),
    (2, 150, 67638.819, 0.044476076),
    (2, 200, 95921.756, 0.065148343),
]


@pytest.mark.parametrize(("case", "load", "moment", "deflection"), AISC)
def test_p_delta_benchmarks_of_aisc_360(case, load, moment, deflection):
    found = benchmark(case, load * KIP, 64)
    np.testing.assert_allclose(found, [moment, deflection], rtol=2e-7)


@pytest.mark.parametrize(("load", "deflection"), [(0, 0.201537), (150, 0.2304656), (300, 0.2690513), (450, 0.3230954)])
def test_p_delta_benchmarks_with_shear_deformation(load, deflection):
    _, found = benchmark(1, load * KIP, 128, "string", **SHEAR)
    assert round(found / INCH, 7) == pytest.approx(deflection, abs=1e-7)
    if load:  # the exact solution of Engesser's equation
        assert benchmark(1, load * KIP, 128, **SHEAR)[1] / INCH == pytest.approx(engesser(load), rel=1e-6)


def engesser(load: float) -> float:
    """Return the deflection of case 1 with shear deformation [in]: y'' (1 - P / GA) + P y / EI = -M / EI - w / GA."""
    bending, shear, length, w = 29000.0 * 484, 11200 * 4.692, 336.0, 0.2 / 12
    softer = 1 - load / shear
    k = load / (bending * softer)
    square = w / (2 * bending * softer) / k
    linear, constant = -square * length, (-w / (shear * softer) - 2 * square) / k
    middle, root = length / 2, np.sqrt(k)
    ratio = (1 - np.cos(root * length)) / np.sin(root * length)
    free = np.cos(root * middle) + ratio * np.sin(root * middle)
    return float(square * middle**2 + linear * middle + constant - constant * free)


CONVERGENCE = [  # members; deflection [m] with both kinds of geometric stiffness
    (2, 0.059638094, 0.065108098),
    (4, 0.063635428, 0.06514575),
    (8, 0.064760785, 0.06514818),
    (16, 0.065050855, 0.065148333),
    (64, 0.065142238, 0.065148343),
]


@pytest.mark.parametrize(("parts", "string", "consistent"), CONVERGENCE)
def test_the_geometric_stiffness_converges_as_published(parts, string, consistent):
    for kind, due in (("string", string), ("consistent", consistent)):
        assert benchmark(2, 200 * KIP, parts, kind)[1] == pytest.approx(due, rel=1e-7)


def test_buckling_loads_are_those_of_euler():
    euler = np.pi**2 * W14X48["elastic_modulus"] * W14X48["second_moment"] / LENGTH**2
    for is_cantilever, factor in ((True, 0.25), (False, 1.0)):
        frame = column(32, "consistent", is_cantilever=is_cantilever)
        found = frame.buckling_factors({"top": {"fy": -1.0}}, count=2)
        ratio = 9 if is_cantilever else 4
        np.testing.assert_allclose(found / (factor * euler), [1.0, ratio], rtol=2e-5)


def test_the_gabled_frame_of_logan():
    # A First Course in the Finite Element Method, problem 5.30.
    xy = {"1": (0, 0), "2": (0, 360), "3": (180, 480), "4": (420, 480), "5": (600, 360), "6": (600, 0)}
    frame = wd.Frame(
        {name: (x * INCH, y * INCH) for name, (x, y) in xy.items()},
        {f"m{i}": (str(i), str(i + 1), "s") for i in range(1, 6)},
        {"s": {"elastic_modulus": 30000 * KSI, "area": 12 * INCH**2, "second_moment": 200 * INCH**4}},
        supports={"1": "fixed", "6": "fixed"},
    )
    found = frame.static({"3": {"fy": -30 * KIP}, "4": {"fy": -30 * KIP}})
    base = found["reaction"].sel(node="1").values
    apex = found["displacement"].sel(node="3").values
    got = [base[0] / KIP, abs(base[2]) / (KIP * INCH), apex[1] / INCH, abs(found["displacement"].sel(node="2")[2])]
    np.testing.assert_allclose(got[:3], [11.687683, 1810.074455, -6.66675711], rtol=5e-8)
    rotations = np.abs(found["displacement"].sel(direction="rz")).values
    assert np.abs(rotations - 0.031999732).min() < 1e-9
    total = found["reaction"].sum("node").values
    np.testing.assert_allclose(total[:2], [0.0, 60 * KIP], atol=1e-6)


H, B, MODULUS, COLUMN, BEAM = 4.0, 6.0, 200e9, 1.492e-4, 2.313e-4


def rigid_portal(**beam) -> wd.Frame:
    """The portal with members that are nearly axially rigid."""
    base = beam.pop("support", "fixed")
    top = beam.pop("column", {})
    return wd.Frame(
        {"A": (0, 0), "B": (0, H), "C": (B, H), "D": (B, 0)},
        {
            "left": {"start": "A", "end": "B", "section": "column"} | top,
            "right": {"start": "D", "end": "C", "section": "column"} | top,
            "beam": {"start": "B", "end": "C", "section": "beam"} | beam,
        },
        {
            "column": {"elastic_modulus": MODULUS, "area": 1e4, "second_moment": COLUMN},
            "beam": {"elastic_modulus": MODULUS, "area": 1e4, "second_moment": BEAM},
        },
        supports={"A": base, "D": base},
        diaphragms={"floor": ["B", "C"]},
        masses={"floor": 70e3},
    )


def sway_stiffness(frame: wd.Frame) -> float:
    found = frame.static({"floor": {"fx": 1e3}})
    return 1e3 / found["displacement"].sel(node="B", direction="ux").item()


def test_the_sway_stiffness_of_portals_has_closed_forms():
    unit = 24 * MODULUS * COLUMN / H**3
    rho = (BEAM / B) / (COLUMN / H)
    assert sway_stiffness(rigid_portal()) == pytest.approx(unit * (6 * rho + 1) / (6 * rho + 4), rel=1e-7)
    assert sway_stiffness(rigid_portal()) == pytest.approx(7899169.514, rel=1e-7)
    assert sway_stiffness(rigid_portal(support="pinned")) == pytest.approx(unit * rho / (4 * rho + 2), rel=1e-7)
    assert sway_stiffness(rigid_portal(release="both")) == pytest.approx(2797500, rel=1e-7)
    offsets = {"offset_start_x": 0.2, "offset_end_x": -0.2, "column": {"offset_end_y": -0.25}}
    assert sway_stiffness(rigid_portal(**offsets)) == pytest.approx(9221002.363, rel=1e-7)
    frequency = 1 / rigid_portal().modal()["period"].item()
    assert frequency == pytest.approx(1.69068161, rel=1e-7)


def moments_of_a_turned_end(spring_start: float, spring_end: float, support: str) -> np.ndarray:
    """Return the moments at both ends for a unit rotation of the start, times L / (E I) [1], n = 10."""
    inertia, length, n = 2e-4, 5.0, 10
    elastic = (n + 1) / n * inertia
    unit = 6 * n * MODULUS * elastic / length
    springs = {"spring_start": spring_start * unit, "spring_end": spring_end * unit}
    frame = wd.Frame(
        {"A": (0, 0), "B": (length, 0), "C": (length, 1)},
        {"m": {"start": "A", "end": "B", "section": "s"} | springs, "rest": ("B", "C", "s", "truss")},
        {"s": {"elastic_modulus": MODULUS, "area": 0.01, "second_moment": elastic}},
        supports={"A": "fixed", "B": support, "C": "pinned"},
    )
    found = frame.static(settlements={"A": {"rz": 1e-3}})["end_force"].sel(member="m", action="moment")
    return found.values / (1e-3 * MODULUS * inertia / length)


def test_end_springs_are_a_series_of_springs_and_a_beam():
    # Springs n 6 E I_e / L with I_e = (n + 1) / n I: exact in double curvature only (Zareian and Medina 2010).
    found = moments_of_a_turned_end(1.0, 1.0, "fixed")
    np.testing.assert_allclose(found, [4.064516, 1.935484], rtol=2e-7)
    assert found.sum() == pytest.approx(6.0, rel=1e-12)
    found = moments_of_a_turned_end(1.0, np.inf, "fixed")
    np.testing.assert_allclose(found, [1.1 * 240 / 64, 1.1 * 120 / 64], rtol=1e-12)
    # A half-beam with a spring n 3 E I_e / L' and a pin: exactly 3 E I / L'.
    np.testing.assert_allclose(moments_of_a_turned_end(0.5, 0.0, "fixed"), [3.0, 0.0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(moments_of_a_turned_end(0.5, np.inf, "pinned"), [3.0, 0.0], rtol=1e-12, atol=1e-12)


def beam_of(length: float, parts: int = 1, supports=None, **section) -> wd.Frame:
    nodes, members = chain("A", "B", (0, 0), (length, 0), parts, "s")
    inertia = {"elastic_modulus": 30e9, "area": 0.2, "second_moment": 1.6e-3}
    return wd.Frame(nodes, members, {"s": inertia | section}, supports=supports or {"A": "fixed", "B": "roller"})


def test_loads_on_members_give_the_moments_of_closed_forms():
    length, q, p = 8.0, -12e3, -40e3
    frame = beam_of(length)
    uniform = frame.static(member_loads={"A-B 0": {"qy": q}})
    assert uniform["reaction"].sel(node="A", direction="rz").item() == pytest.approx(-q * length**2 / 8, rel=1e-12)
    assert uniform["reaction"].sel(node="B", direction="uy").item() == pytest.approx(-3 * q * length / 8, rel=1e-12)
    a = 2.5
    point = frame.static(member_loads=[{"member": "A-B 0", "py": p, "at": a}])
    b = length - a
    due = -p * a * b * (length + b) / (2 * length**2)
    assert point["reaction"].sel(node="A", direction="rz").item() == pytest.approx(due, rel=1e-12)
    both = frame.static(member_loads={"A-B 0": [{"qy": q}, {"py": p, "at": a}]})
    for name in ("reaction", "end_force", "displacement"):
        np.testing.assert_allclose(both[name], uniform[name] + point[name], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("shear", [{}, {"shear_modulus": 12e9, "shear_area": 0.1}])
def test_a_load_on_a_member_is_that_of_divided_members(shear):
    length, a = 6.0, 1.5
    coarse = beam_of(length, **shear).static(member_loads=[{"member": "A-B 0", "py": -3e4, "at": a}])
    fine = beam_of(length, 4, **shear).static({"A-B 1": {"fy": -3e4}})
    np.testing.assert_allclose(
        coarse["reaction"].sel(node=["A", "B"]), fine["reaction"].sel(node=["A", "B"]), rtol=1e-10, atol=1e-8
    )


def test_a_released_member_carries_its_load_as_a_simple_beam():
    frame = wd.Frame(
        {"A": (0, 0), "B": (0, 3), "C": (5, 3), "D": (5, 0)},
        {
            "l": ("A", "B", "s"),
            "r": ("D", "C", "s"),
            "b": {"start": "B", "end": "C", "section": "s", "release": "both"},
        },
        {"s": {"elastic_modulus": 2e11, "area": 0.01, "second_moment": 1e-4}},
        supports={"A": "fixed", "D": "fixed"},
    )
    found = frame.static(member_loads={"b": {"qy": -10e3}})["end_force"].sel(member="b")
    np.testing.assert_allclose(found.sel(action="moment"), 0.0, atol=1e-8)
    np.testing.assert_allclose(found.sel(action="shear"), 25e3, rtol=1e-10)


def test_a_settlement_bends_a_beam_as_in_closed_form():
    length, settlement = 7.0, -0.02
    frame = beam_of(length, 2, supports={"A": "fixed", "B": "fixed"})
    found = frame.static(settlements={"B": {"uy": settlement}})
    due = 6 * 30e9 * 1.6e-3 * settlement / length**2
    moments = found["end_force"].sel(action="moment")
    np.testing.assert_allclose([moments[0, 0], moments[1, 1]], [-due, -due], rtol=1e-12)


def test_a_timoshenko_cantilever_and_a_spring_support():
    length, force = 2.0, 1e4
    frame = beam_of(length, supports={"A": {"ux": True, "uy": 5e6, "rz": 8e7}}, shear_modulus=12e9, shear_area=0.15)
    found = frame.static({"B": {"fy": force}})["displacement"].sel(node="B", direction="uy").item()
    bending = force * length**3 / (3 * 30e9 * 1.6e-3)
    shear = force * length / (12e9 * 0.15)
    support = force / 5e6 + force * length**2 / 8e7
    assert found == pytest.approx(bending + shear + support, rel=1e-12)


def test_a_truss_carries_only_axial_forces():
    frame = wd.Frame(
        {"A": (0, 0), "B": (4, 0), "C": (2, 1.5)},
        {"1": ("A", "B", "s", "truss"), "2": ("A", "C", "s", "truss"), "3": ("B", "C", "s", "truss")},
        {"s": {"elastic_modulus": 2e11, "area": 1e-3}},
        supports={"A": "pinned", "B": "roller"},
    )
    found = frame.static({"C": {"fy": -12e3}})
    np.testing.assert_allclose(found["axial_force"], [8e3, -10e3, -10e3], rtol=1e-12)
    assert frame.numbering.free_names == ("B ux", "C ux", "C uy")
