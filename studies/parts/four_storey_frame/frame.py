"""The published four-storey steel moment frame: sections, hinges, masses, loads, and reference results.

Archetype of Skiadopoulos and Lignos (2022), centre-line model without panel zones and splices, from the numbers in
WenchenLie/OpenSAS (models/MRF4S.py). Springs are at the joints. Units: kg, m, s, N.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import warpdyn as wd

MODULUS, BAY = 206e9, 6.1  # Pa, m
HEIGHTS = (4.3, 4.0, 4.0, 4.0)  # m
MASSES = (322917.0, 321573.0, 321573.0, 303646.0)  # kg
JOINT_LOADS = ((188314.9, 125543.6), (186667.9, 124445.6), (186667.9, 124445.6), (154661.2, 103107.8))  # N
LEANING_LOADS = (3078215.5, 3070145.2, 3070145.2, 2761607.2)  # N
RATIO = 10  # stiffness of springs over 6 E I / L of the elastic part of the member
# Sections: area [m2], second moment of area [m4]; outer and inner columns of storeys 1 to 4, beams of floors 1 to 4.
LOWER, UPPER = (
    ((0.01954835, 1.248694e-3), (0.02774188, 1.906340e-3)),
    ((0.01445158, 8.740860e-4), (0.01593545, 9.864685e-4)),
)
COLUMNS = (LOWER, LOWER, LOWER, UPPER)
DEEP, SHALLOW = (0.01445158, 8.740860e-4), (0.01135482, 4.095717e-4)
BEAMS = (DEEP, DEEP, SHALLOW, SHALLOW)
# Hinges: yield moment [N m], plastic rotation to capping, post-capping rotation, ultimate rotation [rad], capping and
# residual moment over yield moment, deterioration rotation [rad].
HINGES_OF_COLUMNS = (
    (
        (1545098, 0.02146403, 0.1012788, 0.15, 1.0, 0.4469, 3.0),
        (2393544, 0.04339206, 0.1969448, 0.15, 1.243736, 0.47505, 3.0),
    ),
    (
        (1573956, 0.02563760, 0.1274104, 0.15, 1.069013, 0.46085, 3.0),
        (2413772, 0.05002778, 0.2344352, 0.15, 1.3, 0.4816, 3.0),
    ),
    (
        (1602607, 0.02683062, 0.1376457, 0.15, 1.076114, 0.4747, 3.0),
        (2433846, 0.05064421, 0.2404508, 0.15, 1.3, 0.4881, 3.0),
    ),
    (
        (1159200, 0.01844088, 0.1177422, 0.15, 1.018109, 0.4845, 3.0),
        (1308399, 0.02139550, 0.1309263, 0.15, 1.04565, 0.4906, 3.0),
    ),
)
STRONG = (
    (1130707, 0.01957477, 0.1159870, 0.2, 1.1, 0.4, 0.8823895),
    (1130707, 0.01957415, 0.1159931, 0.2, 1.1, 0.4, 0.8824440),
)
WEAK = (
    (695385.1, 0.03745750, 0.1943442, 0.2, 1.1, 0.4, 1.368102),
    (695385.1, 0.03745170, 0.1943442, 0.2, 1.1, 0.4, 1.368102),
)
HINGES_OF_BEAMS = (STRONG, STRONG, WEAK, WEAK)  # outer bays, middle bay
OF_UNLOADING = {"column": 0.9, "beam": 1.0}  # capacities of capping and unloading over that of strength
DAMPING_RATIO, DAMPING_MODES = 0.02, (1, 3)  # Rayleigh damping
COEFFICIENTS = (0.16159482, 0.0011970561)  # of mass [1/s] and floor stiffness [s], without P-Delta

# Peak storey drift ratios of the whole frame by OpenSeesPy and a second program (they agree within 1e-5 at equal
# steps; converged steps): decaying pulses of 2 s, and record LOS270 of the far-field set, by level (m/s2, or factor).
PULSE = (2.0, 0.35, 10.0, 20.0)  # period [s], decay [1/s], duration of the pulse and of the run [s]
RECORD, RUN_TIME = "LOS270", 30.0  # s
REFERENCE = {
    ("pulse", 0.5): (0.002956537, 0.004315571, 0.004318431, 0.003745216),
    ("pulse", 2.0): (0.01385363, 0.01512365, 0.01218344, 0.009047715),
    ("pulse", 4.0): (0.07401655, 0.07119286, 0.05609204, 0.04356957),
    (RECORD, 0.3): (0.004131327, 0.004718926, 0.006798118, 0.0081357),
    (RECORD, 1.0): (0.008883862, 0.0106558, 0.01428984, 0.01884741),
    (RECORD, 2.2): (0.02371867, 0.03086488, 0.04248093, 0.04834045),
}


def hinge(values: tuple[float, ...], kind: str) -> dict[str, Any]:
    """Return the law of a hinge from its row of values."""
    strength, capping, post_capping, ultimate, cap, residual, capacity = values
    return {
        "law": "ibarra_medina_krawinkler_bilinear",
        "yield_force": strength,
        "plastic_drift_to_capping": capping,
        "post_capping_drift": post_capping,
        "ultimate_drift": ultimate,
        "capping_force_ratio": cap,
        "residual_force_ratio": residual,
        "strength_deterioration_drift": capacity,
        "post_capping_deterioration_drift": OF_UNLOADING[kind] * capacity,
        "unloading_deterioration_drift": OF_UNLOADING[kind] * capacity,
    }


def frame_and_hinges(*, columns_shorten: bool = True) -> tuple[wd.Frame, dict[tuple[str, str], dict[str, Any]]]:
    """Return the frame with end springs, and the laws of its 56 hinges by member and end.

    Args:
        columns_shorten: Whether axial forces shorten the columns. Otherwise no joint moves vertically, and the leaning
            column carries all weight: its P-Delta effect on a storey depends on the weight above only.
    """
    y = np.append(0.0, np.cumsum(HEIGHTS))
    nodes: dict[str, Any] = {}
    members: dict[str, Any] = {}
    sections: dict[str, Any] = {"leaning": {"elastic_modulus": MODULUS, "area": 1.0}}
    diaphragms, hinges = dict[str, list[str]](), dict[tuple[str, str], dict[str, Any]]()
    lines = (0, 1, 1, 0)  # outer, inner

    def add(name: str, start: str, end: str, size: tuple[float, float], length: float, law: dict[str, Any]) -> None:
        inertia = (RATIO + 1) / RATIO * size[1]
        sections[name] = {"elastic_modulus": MODULUS, "area": size[0], "second_moment": inertia}
        spring = RATIO * 6 * MODULUS * inertia / length
        members[name] = {"start": start, "end": end, "section": name, "spring_start": spring, "spring_end": spring}
        hinges[name, "start"] = hinges[name, "end"] = law

    for level, height in enumerate(y):
        for line, place in enumerate(lines):
            load = JOINT_LOADS[level - 1][place] if level and columns_shorten else 0.0
            nodes[f"J{level}_{line + 1}"] = {"x": BAY * line, "y": height, "gravity_load": load}
        weight = LEANING_LOADS[level - 1] if level else 0.0
        if level and not columns_shorten:
            weight += sum(JOINT_LOADS[level - 1][place] for place in lines)
        nodes[f"L{level}"] = {"x": 4 * BAY, "y": height, "gravity_load": weight}
        if level:
            diaphragms[f"floor {level}"] = [*(f"J{level}_{line}" for line in range(1, 5)), f"L{level}"]
    for storey in range(1, 5):
        height = HEIGHTS[storey - 1]
        for line, place in enumerate(lines, start=1):
            law = hinge(HINGES_OF_COLUMNS[storey - 1][place], "column")
            ends = f"J{storey - 1}_{line}", f"J{storey}_{line}"
            add(f"C{storey}_{line}", *ends, COLUMNS[storey - 1][place], height, law)
        for bay in range(1, 4):
            law = hinge(HINGES_OF_BEAMS[storey - 1][int(bay == 2)], "beam")
            add(f"B{storey}_{bay}", f"J{storey}_{bay}", f"J{storey}_{bay + 1}", BEAMS[storey - 1], BAY, law)
        ends = {"start": f"L{storey - 1}", "end": f"L{storey}"}
        members[f"L{storey}"] = ends | {"section": "leaning", "kind": "truss"}
    supports = {f"J0_{line}": "fixed" for line in range(1, 5)} | {"L0": "pinned"}
    if not columns_shorten:
        supports |= {joint: "roller" for floor in diaphragms.values() for joint in floor if joint.startswith("J")}
    masses = dict(zip(diaphragms, MASSES, strict=True))
    return wd.Frame(nodes, members, sections, supports=supports, diaphragms=diaphragms, masses=masses), hinges


def reference_motions() -> list[wd.GroundMotion]:
    """Return the motions of `REFERENCE`, with zeros up to the end of the run."""
    found = []
    period, decay, duration, end = PULSE
    time = 0.01 * np.arange(round(duration / 0.01) + 1)
    shape = np.sin(2 * np.pi * time / period) * np.exp(-decay * time)
    [record] = [each for each in wd.records.far_field() if RECORD in each.name]
    for name, level in REFERENCE:
        values, until = (shape, end) if name == "pulse" else (record.values, RUN_TIME)
        padded = np.append(level * values, np.zeros(round(until / 0.01) + 1 - len(values)))
        found.append(wd.GroundMotion(padded, 0.01, f"{name} {level:g}"))
    return found
