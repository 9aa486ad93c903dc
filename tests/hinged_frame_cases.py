"""Reference models of frames with hinges: laws of the hinges, and histories of an independent program."""

from __future__ import annotations

import frame_cases
import numpy as np

import warpdyn as wd

# Factors of Rayleigh damping, of the mass [1/s] and of the initial stiffness of the floors without P-Delta [s].
DAMPING = {
    "portal": (0.53126396, 0.0047057587),
    "two_storey": (0.24275322, 0.0010723528),
    "four_storey": (0.16159482, 0.0011970561),
    "eight_storey": (0.093807135, 0.0024288369),
}

# Yield moment [N m], plastic rotations to capping and from capping to 0, ultimate rotation [rad], ratios of capping and
# residual moment, rotations of deterioration (S, C, K) [rad]; members.
TWO_STOREY = (
    ((2299241.27, 0.025, 0.3, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "C1_1 C1_2 C2_1 C2_2"),
    ((1235828.06, 0.02, 0.16, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "B1_1 B2_1"),
)

FOUR_STOREY = (
    ((1545097.55, 0.0214640327, 0.101278779, 0.15, 1.0, 0.4469, 3.0, 2.7, 2.7), "C1_1 C1_4"),
    ((2393544, 0.0433920599, 0.196944801, 0.15, 1.24373556, 0.47505, 3.0, 2.7, 2.7), "C1_2 C1_3"),
    ((1573955.64, 0.0256376043, 0.127410372, 0.15, 1.06901297, 0.46085, 3.0, 2.7, 2.7), "C2_1 C2_4"),
    ((2413772, 0.0500277816, 0.234435196, 0.15, 1.3, 0.4816, 3.0, 2.7, 2.7), "C2_2 C2_3"),
    ((1602606.87, 0.0268306208, 0.137645655, 0.15, 1.0761143, 0.4747, 3.0, 2.7, 2.7), "C3_1 C3_4"),
    ((2433845.59, 0.0506442093, 0.240450824, 0.15, 1.3, 0.4881, 3.0, 2.7, 2.7), "C3_2 C3_3"),
    ((1159199.96, 0.0184408836, 0.117742205, 0.15, 1.01810948, 0.4845, 3.0, 2.7, 2.7), "C4_1 C4_4"),
    ((1308399.11, 0.0213954955, 0.130926254, 0.15, 1.0456503, 0.4906, 3.0, 2.7, 2.7), "C4_2 C4_3"),
    (
        (1130707.42, 0.0195747734, 0.115987008, 0.2, 1.1, 0.4, 0.882389481, 0.882389481, 0.882389481),
        "B1_1 B1_3 B2_1 B2_3",
    ),
    ((1130707.42, 0.0195741504, 0.115993068, 0.2, 1.1, 0.4, 0.882443968, 0.882443968, 0.882443968), "B1_2 B2_2"),
    ((695385.061, 0.0374574986, 0.194344238, 0.2, 1.1, 0.4, 1.36810211, 1.36810211, 1.36810211), "B3_1 B3_3 B4_1 B4_3"),
    ((695385.061, 0.0374516987, 0.194344238, 0.2, 1.1, 0.4, 1.36810211, 1.36810211, 1.36810211), "B3_2 B4_2"),
)

EIGHT_STOREY = (
    ((2597521.22, 0.025, 0.3, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "C1_1 C1_4 C2_1 C2_4"),
    ((2908229.5, 0.025, 0.3, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "C1_2 C1_3 C2_2 C2_3 C3_2 C3_3 C4_2 C4_3"),
    ((2299241.27, 0.025, 0.3, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "C3_1 C3_4 C4_1 C4_4 C5_2 C5_3 C6_2 C6_3"),
    ((1578398.06, 0.025, 0.3, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "C5_1 C5_4 C6_1 C6_4"),
    ((1242833.12, 0.025, 0.3, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "C7_1 C7_2 C7_3 C7_4 C8_1 C8_2 C8_3 C8_4"),
    ((1727538.04, 0.02, 0.16, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "B1_1 B1_2 B1_3 B2_1 B2_2 B2_3"),
    ((1578398.06, 0.02, 0.16, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "B3_1 B3_2 B3_3 B4_1 B4_2 B4_3"),
    ((1242833.12, 0.02, 0.16, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "B5_1 B5_2 B5_3 B6_1 B6_2 B6_3"),
    ((627630.725, 0.02, 0.16, 0.4, 1.05, 0.4, 0.0, 0.0, 0.0), "B7_1 B7_2 B7_3 B8_1 B8_2 B8_3"),
)

# Motion and level (m/s2, or factor on the record): peak storey drift ratios, peak floor accelerations [m/s2], mean
# drift ratios of the last 5 s, the largest hinge rotation [rad], and the largest hinge moment [N m]. RK4 with Newton's
# method at 0.0005 s (four_storey: 0.000625 s, eight_storey: 0.00125 s); OpenSeesPy agrees with it within 1e-5.
HISTORIES = {
    "portal": {
        ("pulse_1", 1): (
            (0.005514826,),
            (2.445448,),
            (-1.98236e-08,),
            ("C1_2 start", 0.0004063291),
            ("C1_1 start", 200060.2),
        ),
        ("pulse_1", 4): (
            (0.02137983,),
            (5.041146,),
            (0.00250364,),
            ("C1_2 start", 0.0128287),
            ("C1_1 start", 366728.1),
        ),
        ("pulse_1", 8): (
            (0.04860545,),
            (5.484308,),
            (-0.0027897,),
            ("C1_1 start", 0.03931329),
            ("C1_1 start", 403288.7),
        ),
        ("pulse_2", 1.5): (
            (0.004028469,),
            (1.782325,),
            (3.02037e-08,),
            ("C1_2 start", 0.0002968152),
            ("C1_1 start", 146139.9),
        ),
        ("pulse_2", 4.5): (
            (0.01317965,),
            (4.642832,),
            (-0.00284769,),
            ("C1_1 start", 0.004851716),
            ("C1_1 start", 355716.2),
        ),
        ("pulse_2", 7): (
            (0.06683017,),
            (5.396966,),
            (-0.0373069,),
            ("C1_1 start", 0.05682129),
            ("C1_1 start", 427457.6),
        ),
        ("LOS270", 0.2): (
            (0.00432009,),
            (1.919012,),
            (-3.13977e-07,),
            ("C1_1 start", 0.0003183017),
            ("C1_2 start", 156719.0),
        ),
        ("LOS270", 1): (
            (0.01690933,),
            (4.903032,),
            (0.00336828,),
            ("C1_1 start", 0.008479879),
            ("C1_1 start", 360724.7),
        ),
        ("LOS270", 3): (
            (0.05612793,),
            (6.197472,),
            (-0.0290855,),
            ("C1_2 start", 0.04654506),
            ("C1_1 start", 413271.8),
        ),
    },
    "two_storey": {
        ("pulse_1", 0.3): (
            (0.003655348, 0.003969304),
            (0.9388362, 1.784754),
            (-8.31886e-06, -9.0004e-06),
            ("B1_1 start", 0.0003434956),
            ("C1_1 start", 1061917.0),
        ),
        ("pulse_1", 4): (
            (0.01717058, 0.01696719),
            (3.451315, 4.463969),
            (0.00232868, 0.00231797),
            ("B1_1 start", 0.01167897),
            ("C1_1 start", 2341304.0),
        ),
        ("pulse_1", 7): (
            (0.05949005, 0.06140906),
            (5.212722, 5.748661),
            (-0.0539279, -0.0551271),
            ("B1_1 start", 0.05688145),
            ("C1_1 start", 2414197.0),
        ),
        ("pulse_2", 1): (
            (0.003521576, 0.003571964),
            (1.209197, 1.496375),
            (1.54052e-06, 1.66645e-06),
            ("B1_1 start", 0.00032047),
            ("C1_1 start", 1039736.0),
        ),
        ("pulse_2", 3): (
            (0.01404693, 0.01302111),
            (3.527005, 3.604107),
            (-0.00554899, -0.00399465),
            ("B1_1 start", 0.008038147),
            ("C1_1 start", 2328844.0),
        ),
        ("pulse_2", 4.5): (
            (0.04744781, 0.04970161),
            (4.235463, 4.050165),
            (-0.0233151, -0.0218906),
            ("B1_1 start", 0.04444318),
            ("C1_1 start", 2414110.0),
        ),
        ("LOS270", 0.25): (
            (0.00338185, 0.004568297),
            (1.990569, 2.623559),
            (1.92163e-06, 2.07236e-06),
            ("B1_1 start", 0.0003361218),
            ("C1_1 start", 1012888.0),
        ),
        ("LOS270", 1): (
            (0.01587896, 0.01646846),
            (6.6314, 5.756593),
            (-0.0055103, -0.00515037),
            ("B1_1 start", 0.01063663),
            ("C1_1 start", 2334702.0),
        ),
        ("LOS270", 4): (
            (0.06239234, 0.07260627),
            (13.77105, 7.92011),
            (0.05725, 0.067012),
            ("B2_1 start", 0.06642078),
            ("C1_1 start", 2414189.0),
        ),
    },
    "four_storey": {
        ("pulse_2", 0.5): (
            (0.002956537, 0.004315571, 0.004318431, 0.003745216),
            (0.4880238, 0.7507992, 0.9975142, 1.246686),
            (2.37114e-05, 3.60723e-05, 3.74212e-05, 3.30432e-05),
            ("B3_1 start", 0.0003407991),
            ("C1_2 start", 1065316.0),
        ),
        ("pulse_2", 2): (
            (0.01385363, 0.01512365, 0.01218344, 0.009047715),
            (2.777618, 2.859819, 3.52122, 3.638599),
            (0.00181075, 0.00198774, 0.00153224, 0.000684374),
            ("B1_1 start", 0.008438821),
            ("C1_3 start", 2484690.0),
        ),
        ("pulse_2", 4): (
            (0.07401655, 0.07119286, 0.05609204, 0.04356957),
            (3.417708, 3.508893, 3.568401, 4.09671),
            (-0.0704093, -0.0661755, -0.0510275, -0.0389665),
            ("C1_1 start", 0.07137296),
            ("C1_3 start", 2976917.0),
        ),
        ("LOS270", 0.3): (
            (0.004131327, 0.004718926, 0.006798118, 0.0081357),
            (3.058412, 3.187599, 2.171996, 3.857813),
            (-4.56175e-05, -6.93009e-05, -7.17212e-05, -6.31917e-05),
            ("B3_3 end", 0.0006311092),
            ("C1_2 start", 1575920.0),
        ),
        ("LOS270", 1): (
            (0.008883862, 0.0106558, 0.01428984, 0.01884741),
            (8.96181, 7.167265, 5.998946, 7.057592),
            (-0.00129418, -0.00269191, -0.00363908, -0.002274),
            ("B4_1 start", 0.008569856),
            ("C1_3 start", 2428932.0),
        ),
        ("LOS270", 2.2): (
            (0.02371867, 0.03086488, 0.04248093, 0.04834045),
            (10.22328, 9.972682, 7.688606, 7.338933),
            (0.00903599, 0.0122588, 0.0177282, 0.0194646),
            ("C4_2 end", 0.03626911),
            ("C1_2 start", 2605577.0),
        ),
    },
    "eight_storey": {
        ("pulse_2", 0.5): (
            (0.004737367, 0.006942548, 0.00749763, 0.00750829, 0.00773984, 0.0071916, 0.007743201, 0.006380692),
            (0.4293888, 0.4356052, 0.6068791, 0.8475794, 1.081772, 1.292486, 1.54054, 1.769897),
            (0.000130357, 0.000190066, 0.000204499, 0.000204473, 0.000210598, 0.000193672, 0.000206233, 0.000168994),
            ("B7_2 start", 0.0005497147),
            ("C1_2 start", 1846535.0),
        ),
        ("pulse_2", 2): (
            (0.009214658, 0.01508061, 0.01784365, 0.02031099, 0.02083621, 0.01634149, 0.01397201, 0.01211246),
            (1.769959, 2.070671, 2.227949, 1.96709, 2.551764, 3.074095, 3.094156, 4.010714),
            (-0.000131497, 0.000410268, 0.000693998, 0.00110088, 0.00176181, 0.00221861, 0.00187608, 0.001015),
            ("B4_2 end", 0.01138388),
            ("C1_3 start", 2914769.0),
        ),
        ("pulse_2", 3): (
            (0.02800707, 0.03466064, 0.03689943, 0.03200438, 0.02519044, 0.01911752, 0.01890373, 0.01735617),
            (2.570634, 2.489108, 2.610442, 2.931856, 2.760919, 3.271366, 3.748006, 4.91595),
            (-0.0206215, -0.0214948, -0.0206574, -0.0181519, -0.0139583, -0.00871055, -0.00189787, 0.000380435),
            ("B2_3 end", 0.02853161),
            ("C1_2 start", 3023928.0),
        ),
    },
}


def law_of(name: str, member: str) -> dict:
    """Return the law of both hinges of a member of a reference model."""
    if name == "portal":
        return {
            "law": "bilinear",
            "yield_force": 3e5 if member == "B1_1" else 3.5e5,
            "hardening_ratio": 0.0028037383177570096,
        }
    for values, members in {"two_storey": TWO_STOREY, "four_storey": FOUR_STOREY, "eight_storey": EIGHT_STOREY}[name]:
        if member in members.split():
            names = (
                *("yield_force", "plastic_drift_to_capping", "post_capping_drift", "ultimate_drift"),
                *("capping_force_ratio", "residual_force_ratio", "strength_deterioration_drift"),
                *("post_capping_deterioration_drift", "unloading_deterioration_drift"),
            )
            law = dict(zip(names, values, strict=True))
            kept = {key: value for key, value in law.items() if value}
            return {"law": "ibarra_medina_krawinkler_bilinear"} | kept
    raise KeyError(member)


def reference_model(name: str, **more) -> wd.HingedFrame:
    """Return a reference model with hinges at both ends of all columns and beams."""
    frame = getattr(frame_cases, name)()
    members = [member for member, row in frame.members.items() if row["kind"] == "beam"]
    hinges = {(member, end): law_of(name, member) for member in members for end in ("start", "end")}
    elastic = frame.lumped()
    stiffness = elastic.stiffness_matrices({key: each[None] for key, each in elastic.parameters.items()})[0]
    of_mass, of_stiffness = DAMPING[name]
    damping = of_mass * np.diag(elastic.nominal_mass) + of_stiffness * stiffness
    return wd.HingedFrame(frame, hinges, damping_matrix=damping, **more)


def irregular() -> wd.Frame:
    """Return a frame with unequal bays, a brace, offsets, a release, springs, a column in two parts and loads."""
    column, beam = {"section": "column"}, {"section": "beam", "spring_start": 4e8, "spring_end": 6e8}
    nodes = {
        "A0": (0, 0),
        "B0": (5, 0),
        "C0": (11, 0),
        "A1": (0, 4),
        "B1": (5, 4),
        "C1": (11, 4),
        "A2": (0, 7),
        "B2": (5, 7),
        "mid": (5, 2.5),
        "L0": (14, 0),
    }
    nodes |= {"L1": {"x": 14, "y": 4, "gravity_load": 2e6}, "L2": {"x": 14, "y": 7, "gravity_load": 1e6}}
    nodes["B2"] = {"x": 5, "y": 7, "gravity_load": 3e5}
    members = {
        "CA1": {"start": "A0", "end": "A1", "spring_start": 5e8, "spring_end": 5e8, "offset_end_y": -0.3, **column},
        "CB1": {"start": "B0", "end": "mid", "spring_start": 3e8, **column},
        "CB1 upper": {"start": "mid", "end": "B1", **column},
        "CC1": {"start": "C0", "end": "C1", "spring_start": 5e8, "release": "end", **column},
        "CA2": {"start": "A1", "end": "A2", "spring_end": 5e8, **column},
        "CB2": {"start": "B1", "end": "B2", **column},
        "BA1": {"start": "A1", "end": "B1", "offset_start_x": 0.25, "gravity_load": 20e3, **beam},
        "BB1": {"start": "B1", "end": "C1", **beam},
        "BA2": {"start": "A2", "end": "B2", "gravity_load": 15e3, **beam},
        "brace": {"start": "B1", "end": "A2", "section": "brace", "kind": "truss"},
        "L1": {"start": "L0", "end": "L1", "section": "column", "kind": "truss"},
        "L2": {"start": "L1", "end": "L2", "section": "column", "kind": "truss"},
    }
    sections = {
        "column": {"elastic_modulus": 2e11, "area": 0.015, "second_moment": 2.5e-4},
        "beam": {
            "elastic_modulus": 2e11,
            "area": 0.01,
            "second_moment": 3e-4,
            "shear_modulus": 8e10,
            "shear_area": 5e-3,
        },
        "brace": {"elastic_modulus": 2e11, "area": 2e-3},
    }
    return wd.Frame(
        nodes,
        members,
        sections,
        supports={"A0": "fixed", "B0": {"ux": True, "uy": True, "rz": 4e7}, "C0": "pinned", "L0": "pinned"},
        diaphragms={"roof": ["A2", "B2", "L2"], "floor": ["A1", "B1", "C1", "L1"]},
        masses={"floor": 6e4, "roof": 4e4},
    )
