"""Plane frames with published or independently computed results: facts of textbooks, AISC 360, SAC and OpenSees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import warpdyn as wd

KIP, INCH = 4448.2216152605, 0.0254
KSI = 6.894757293168e6
GRAVITY = 9.80665
HINGE_RATIO = 10  # stiffness of hinge springs over 6 E I / L


def chain(start: str, end: str, a: Sequence[float], b: Sequence[float], parts: int, section: str) -> tuple[dict, dict]:
    """Return nodes and members of a straight line that is divided into equal members."""
    names = [start, *(f"{start}-{end} {i}" for i in range(1, parts)), end]
    a, b = np.array(a, dtype=float), np.array(b, dtype=float)
    nodes = {name: tuple(a + (b - a) * i / parts) for i, name in enumerate(names)}
    members = {f"{start}-{end} {i}": (names[i], names[i + 1], section) for i in range(parts)}
    return nodes, members


def moment_frame(
    *,
    bays: Sequence[float],
    storeys: Sequence[float],
    modulus: float,
    columns: Sequence[Sequence[tuple[float, float]]],
    beams: Sequence[Sequence[tuple[float, float]]],
    masses: Sequence[float],
    joint_loads: Sequence[Sequence[float]],
    leaning_loads: Sequence[float],
    has_hinges: bool = True,
) -> wd.Frame:
    """Return a frame of the reference set: n = 10 hinge springs, rigid floors and a leaning column.

    Args:
        bays: Widths [m].
        storeys: Heights [m].
        modulus: Elastic modulus [Pa].
        columns: (area [m2], second moment [m4]) of each storey and column line.
        beams: The same for each floor and bay.
        masses: Horizontal mass of each floor [kg].
        joint_loads: Gravity loads of the joints of each floor [N].
        leaning_loads: Gravity loads of the leaning column at each floor [N].
        has_hinges: Whether members have end springs and 1.1 I.
    """
    x, y = np.append(0.0, np.cumsum(bays)), np.append(0.0, np.cumsum(storeys))
    nodes, members, sections, supports, diaphragms = {}, {}, {}, {}, {}
    axis = x[-1] + (bays[-1] if len(bays) else 6.0)
    for level, height in enumerate(y):
        for line, place in enumerate(x):
            load = joint_loads[level - 1][line] if level else 0.0
            nodes[f"J{level}_{line + 1}"] = {"x": place, "y": height, "gravity_load": load}
        nodes[f"L{level}"] = {"x": axis, "y": height, "gravity_load": leaning_loads[level - 1] if level else 0.0}
        floor = [f"J{level}_{line + 1}" for line in range(len(x))]
        if level:
            diaphragms[f"floor {level}"] = [*floor, f"L{level}"]
        else:
            supports = dict.fromkeys(floor, "fixed") | {"L0": "pinned"}
    sections["leaning"] = {"elastic_modulus": modulus, "area": 1.0}

    def add(name, start, end, size, length):
        area, inertia = size
        factor = (HINGE_RATIO + 1) / HINGE_RATIO if has_hinges else 1.0
        sections[name] = {"elastic_modulus": modulus, "area": area, "second_moment": factor * inertia}
        members[name] = {"start": start, "end": end, "section": name}
        if has_hinges:
            spring = HINGE_RATIO * 6 * modulus * factor * inertia / length
            members[name] |= {"spring_start": spring, "spring_end": spring}

    for storey, height in enumerate(storeys):
        for line in range(len(x)):
            joints = f"J{storey}_{line + 1}", f"J{storey + 1}_{line + 1}"
            add(f"C{storey + 1}_{line + 1}", *joints, columns[storey][line], height)
        for bay, width in enumerate(bays):
            joints = f"J{storey + 1}_{bay + 1}", f"J{storey + 1}_{bay + 2}"
            add(f"B{storey + 1}_{bay + 1}", *joints, beams[storey][bay], width)
        leaning = {"start": f"L{storey}", "end": f"L{storey + 1}", "section": "leaning", "kind": "truss"}
        members[f"L{storey + 1}"] = leaning
    return wd.Frame(
        nodes,
        members,
        sections,
        supports=supports,
        diaphragms=diaphragms,
        masses={f"floor {floor + 1}": mass for floor, mass in enumerate(masses)},
    )


def portal() -> wd.Frame:
    return moment_frame(
        bays=[6.0],
        storeys=[4.0],
        modulus=200e9,
        columns=[[(1.184e-2, 1.492e-4)] * 2],
        beams=[[(8.446e-3, 2.313e-4)]],
        masses=[70e3],
        joint_loads=[[50e3] * 2],
        leaning_loads=[586.7e3],
    )


def two_storey() -> wd.Frame:
    """The frame of the OpenSees examples (Eads 2010), centre lines."""
    inch2, inch4 = INCH**2, INCH**4
    return moment_frame(
        bays=[360 * INCH],
        storeys=[180 * INCH, 144 * INCH],
        modulus=29000 * KSI,
        columns=[[(38.5 * inch2, 4020 * inch4)] * 2] * 2,
        beams=[[(30.0 * inch2, 3620 * inch4)]] * 2,
        masses=[535 * KIP / (386.2 * INCH), 525 * KIP / (386.2 * INCH)],
        joint_loads=[[68.49 * KIP] * 2, [66.845 * KIP] * 2],
        leaning_loads=[398.02 * KIP, 391.31 * KIP],
    )


def four_storey() -> wd.Frame:
    outer, inner = (0.01954835, 1.248694e-3), (0.02774188, 1.906340e-3)
    upper = [(0.01445158, 8.740860e-4), (0.01593545, 9.864685e-4)]
    deep, shallow = (0.01445158, 8.740860e-4), (0.01135482, 4.095717e-4)
    loads = [(188314.9, 125543.6), (186667.9, 124445.6), (186667.9, 124445.6), (154661.2, 103107.8)]
    return moment_frame(
        bays=[6.1] * 3,
        storeys=[4.3, 4.0, 4.0, 4.0],
        modulus=206e9,
        columns=[[outer, inner, inner, outer]] * 3 + [[upper[0], upper[1], upper[1], upper[0]]],
        beams=[[deep] * 3] * 2 + [[shallow] * 3] * 2,
        masses=[322917.0, 321573.0, 321573.0, 303646.0],
        joint_loads=[[a, b, b, a] for a, b in loads],
        leaning_loads=[3078215.5, 3070145.2, 3070145.2, 2761607.2],
    )


def eight_storey() -> wd.Frame:
    inch2, inch4 = INCH**2, INCH**4

    def of(area, inertia):
        return area * inch2, inertia * inch4

    outer = [of(43.0, 4580)] * 2 + [of(38.5, 4020)] * 2 + [of(27.7, 2700)] * 2 + [of(22.4, 2100)] * 2
    inner = [of(47.7, 5170)] * 4 + [of(38.5, 4020)] * 2 + [of(22.4, 2100)] * 2
    beams = [of(27.7, 3270)] * 2 + [of(27.7, 2700)] * 2 + [of(22.4, 2100)] * 2 + [of(14.7, 800)] * 2
    return moment_frame(
        bays=[6.099048] * 3,
        storeys=[4.599432] + [3.998976] * 7,
        modulus=29000 * KSI,
        columns=[[a, b, b, a] for a, b in zip(outer, inner, strict=True)],
        beams=[[beam] * 3 for beam in beams],
        masses=[265841.810] * 8,
        joint_loads=[[74429.9] * 4] * 8,
        leaning_loads=[2310050.4] * 8,
    )


def braced() -> wd.Frame:
    """Three storeys with one brace each; pinned continuous columns, no beams; weight on the leaning column."""
    height, width, modulus = 3.96, 9.15, 200e9
    masses = [240e3, 240e3, 220e3]
    nodes, members, sections = {}, {}, {}
    for level in range(4):
        for line in (1, 2):
            nodes[f"J{level}_{line}"] = (width * (line - 1), height * level)
        load = 9.81 * masses[level - 1] if level else 0.0
        nodes[f"L{level}"] = {"x": 2 * width, "y": height * level, "gravity_load": load}
    sections["column"] = {"elastic_modulus": modulus, "area": 0.017, "second_moment": 3.0e-4}
    sections["leaning"] = {"elastic_modulus": modulus, "area": 1.0}
    for storey, area in enumerate((6.0e-3, 5.0e-3, 3.0e-3)):
        for line in (1, 2):
            members[f"C{storey + 1}_{line}"] = (f"J{storey}_{line}", f"J{storey + 1}_{line}", "column")
        members[f"L{storey + 1}"] = (f"L{storey}", f"L{storey + 1}", "leaning", "truss")
        sections[f"brace {storey + 1}"] = {"elastic_modulus": modulus, "area": area}
        first = storey % 2 + 1
        brace = (f"J{storey}_{first}", f"J{storey + 1}_{3 - first}", f"brace {storey + 1}", "truss")
        members[f"D{storey + 1}"] = brace
    return wd.Frame(
        nodes,
        members,
        sections,
        supports={"J0_1": "pinned", "J0_2": "pinned", "L0": "pinned"},
        diaphragms={f"floor {i}": [f"J{i}_1", f"J{i}_2", f"L{i}"] for i in (1, 2, 3)},
        masses={f"floor {i}": masses[i - 1] for i in (1, 2, 3)},
    )


def fishbone(storeys: int = 10) -> wd.Frame:
    """Ten storeys, or the lowest ones: a column line and a half-beam to a roller at mid-span of each floor."""
    modulus, half, area = 200e9, 3.75, 1.0
    heights = ([4.5] + [3.6] * 9)[:storeys]
    columns = ([2.6e-3] * 4 + [2.0e-3] * 3 + [1.4e-3] * 3)[:storeys]
    beams = ([2.4e-3] * 4 + [1.9e-3] * 3 + [1.3e-3] * 3)[:storeys]
    y = np.append(0.0, np.cumsum(heights))
    nodes = {"J0": (0.0, 0.0), "L0": (7.5, 0.0)}
    members, diaphragms = {}, {}
    sections = {"leaning": {"elastic_modulus": modulus, "area": 1.0}}
    supports = {"J0": "fixed", "L0": "pinned"}
    factor = (HINGE_RATIO + 1) / HINGE_RATIO
    for i, (height, column, beam) in enumerate(zip(heights, columns, beams, strict=True), start=1):
        nodes |= {f"J{i}": (0.0, y[i]), f"R{i}": (half, y[i])}
        nodes[f"L{i}"] = {"x": 7.5, "y": y[i], "gravity_load": 50e3 * 9.81}
        supports |= {f"J{i}": "roller", f"R{i}": "roller"}
        diaphragms[f"floor {i}"] = [f"J{i}", f"R{i}", f"L{i}"]
        for name, inertia in ((f"C{i}", column), (f"B{i}", beam)):
            sections[name] = {"elastic_modulus": modulus, "area": area, "second_moment": factor * inertia}
        spring = HINGE_RATIO * 6 * modulus * factor * column / height
        ends = {"start": f"J{i - 1}", "end": f"J{i}", "section": f"C{i}"}
        members[f"C{i}"] = ends | {"spring_start": spring, "spring_end": spring}
        spring = HINGE_RATIO * 3 * modulus * factor * beam / half
        members[f"B{i}"] = {"start": f"J{i}", "end": f"R{i}", "section": f"B{i}", "spring_start": spring}
        members[f"L{i}"] = {"start": f"L{i - 1}", "end": f"L{i}", "section": "leaning", "kind": "truss"}
    masses = dict.fromkeys(diaphragms, 50e3)
    return wd.Frame(nodes, members, sections, supports=supports, diaphragms=diaphragms, masses=masses)


REFERENCE_MODELS = {each.__name__: each for each in (portal, two_storey, four_storey, eight_storey, braced, fishbone)}
