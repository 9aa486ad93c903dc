"""The ten-storey fish-bone frame with hinges of the reference set: model, motions and histories."""

from __future__ import annotations

import numpy as np
from frame_cases import fishbone

import warpdyn as wd

HEIGHTS = np.array([4.5] + [3.6] * 9)  # m
A0, A1 = 0.16120573, 0.0031166502  # 1/s, s: 3 % in modes 1 and 3, without P-Delta
STRENGTHS = [(5.2e6, 2.6e6)] * 4 + [(4.1e6, 2.1e6)] * 3 + [(2.9e6, 1.5e6)] * 3  # N m: columns and beams of a storey
PULSES = {"pulse_1": (0.8, 0.4), "pulse_2": (2.0, 0.35)}  # period [s], decay [1/s]

# The ten-storey reference model: hinges of Ibarra, Medina and Krawinkler without deterioration at both ends of columns
# and at half-beams, P-Delta; RK4 with Newton's method at 0.0005 s. Motion and level (m/s2, or factor on the record):
# peak storey drift ratios, peak floor accelerations [m/s2], mean drift ratios of the last 5 s, the largest hinge
# rotation [rad], and the largest hinge moment [N m].
HISTORIES = {
    ("pulse_1", 1): (
        (
            0.002535951,
            0.003296864,
            0.002781528,
            0.0027186,
            0.002960654,
            0.003107995,
            0.003483448,
            0.004170948,
            0.003829311,
            0.002502779,
        ),
        (0.9384111, 1.328568, 1.638726, 1.78886, 1.707037, 1.355973, 0.9739629, 0.8787495, 1.74064, 2.317808),
        (
            3.37008e-05,
            4.86915e-05,
            4.96657e-05,
            4.82981e-05,
            5.06019e-05,
            4.87409e-05,
            4.30663e-05,
            4.08695e-05,
            3.23577e-05,
            1.93835e-05,
        ),
        ("B8 start", 0.0003126318),
        ("C1 start", 1152318.0),
    ),
    ("pulse_1", 6): (
        (
            0.01126409,
            0.01967181,
            0.02211391,
            0.02256184,
            0.02245067,
            0.02310158,
            0.02050432,
            0.01931493,
            0.01449533,
            0.008089833,
        ),
        (6.113898, 6.590882, 7.588663, 6.527148, 7.42472, 6.310109, 5.228045, 6.446314, 5.89839, 7.684458),
        (
            -0.00322131,
            -0.0086898,
            -0.0122662,
            -0.013728,
            -0.0137326,
            -0.01208,
            -0.00950519,
            -0.00675017,
            -0.00378231,
            -0.00159475,
        ),
        ("B5 start", 0.01471719),
        ("C1 start", 4380162.0),
    ),
    ("pulse_1", 10): (
        (
            0.02678005,
            0.0436514,
            0.04916693,
            0.04643022,
            0.04333537,
            0.04241634,
            0.0442857,
            0.04245103,
            0.03344617,
            0.01972657,
        ),
        (9.196599, 8.159971, 7.780697, 8.169759, 9.673234, 9.949287, 7.563008, 7.931802, 6.721269, 9.620982),
        (
            -0.0176202,
            -0.0275099,
            -0.033492,
            -0.0361134,
            -0.0352257,
            -0.0323613,
            -0.0286013,
            -0.0233833,
            -0.0170359,
            -0.0108548,
        ),
        ("B3 start", 0.04131538),
        ("C1 start", 5352699.0),
    ),
    ("pulse_2", 0.5): (
        (
            0.00421408,
            0.006063322,
            0.006141363,
            0.005914381,
            0.006119808,
            0.005817425,
            0.005071249,
            0.004746294,
            0.003717862,
            0.002211465,
        ),
        (0.4264223, 0.4289108, 0.6394287, 0.8459622, 1.062978, 1.272249, 1.45738, 1.633844, 1.774917, 1.860286),
        (
            6.8895e-05,
            9.91562e-05,
            0.000100446,
            9.67093e-05,
            9.99931e-05,
            9.49499e-05,
            8.26607e-05,
            7.72379e-05,
            6.04176e-05,
            3.59028e-05,
        ),
        ("B2 start", 0.0004598915),
        ("B2 start", 1942582.0),
    ),
    ("pulse_2", 2): (
        (
            0.009125636,
            0.01640639,
            0.01973105,
            0.02000985,
            0.01886272,
            0.01534809,
            0.01073727,
            0.01035745,
            0.008549093,
            0.005805107,
        ),
        (1.913313, 2.495064, 2.575067, 2.871307, 3.245169, 3.621605, 3.910408, 3.659566, 4.213952, 5.808355),
        (
            0.000589785,
            0.00137988,
            0.00187661,
            0.00230691,
            0.0023984,
            0.0022254,
            0.00187765,
            0.0013177,
            0.000623759,
            0.000163438,
        ),
        ("B3 start", 0.01234937),
        ("C1 start", 3552595.0),
    ),
    ("pulse_2", 5): (
        (
            0.03698933,
            0.05419623,
            0.06029599,
            0.05990517,
            0.05495852,
            0.04348814,
            0.03088566,
            0.02380569,
            0.01632507,
            0.008449777,
        ),
        (4.528678, 4.158915, 4.021803, 3.669487, 3.885641, 5.335977, 4.864936, 4.180095, 5.083677, 7.141571),
        (
            -0.0240083,
            -0.0277367,
            -0.0289248,
            -0.0288404,
            -0.0270686,
            -0.0237818,
            -0.0197491,
            -0.014502,
            -0.00797973,
            -0.00292089,
        ),
        ("B3 start", 0.05387506),
        ("C1 start", 5486957.0),
    ),
    ("LOS270", 0.4): (
        (
            0.003531572,
            0.004487088,
            0.004134816,
            0.003539083,
            0.003006023,
            0.004235941,
            0.004980797,
            0.006039712,
            0.006178118,
            0.004337782,
        ),
        (2.020367, 2.8822, 3.314528, 3.312459, 2.751291, 2.387557, 1.863769, 1.68554, 2.631874, 4.264971),
        (
            -5.35871e-05,
            -7.73136e-05,
            -7.86529e-05,
            -7.61914e-05,
            -7.94147e-05,
            -7.60622e-05,
            -6.68068e-05,
            -6.30002e-05,
            -4.96313e-05,
            -2.96314e-05,
        ),
        ("B8 start", 0.0004799354),
        ("C1 start", 1616042.0),
    ),
    ("LOS270", 2): (
        (
            0.009302412,
            0.01530518,
            0.01565751,
            0.01361055,
            0.01269341,
            0.01261608,
            0.01731541,
            0.01968776,
            0.02039233,
            0.01587255,
        ),
        (7.342229, 8.17712, 8.733899, 8.69576, 8.663034, 8.496513, 6.892559, 6.552179, 7.030512, 10.89611),
        (
            0.000624526,
            0.00146878,
            0.00177802,
            0.00199194,
            0.00248063,
            0.00290908,
            0.00228925,
            0.00126795,
            0.000499398,
            0.00124843,
        ),
        ("B8 start", 0.01129476),
        ("C1 start", 3774943.0),
    ),
    ("LOS270", 6): (
        (
            0.03879139,
            0.04781001,
            0.04431682,
            0.03994449,
            0.03611742,
            0.03000074,
            0.03315134,
            0.0334172,
            0.02747804,
            0.02442897,
        ),
        (26.42578, 20.0816, 21.33933, 19.76221, 17.2991, 16.85597, 16.03153, 12.97336, 10.88872, 15.10767),
        (
            -0.0233802,
            -0.0209361,
            -0.0184216,
            -0.015002,
            -0.00982965,
            -0.00520997,
            -0.00353058,
            -0.00418997,
            -0.00620426,
            -0.00898546,
        ),
        ("B2 start", 0.03962681),
        ("C1 start", 5537267.0),
    ),
}
NAMES = list(HISTORIES)


def steel(strength: float, plastic: float, post_capping: float) -> dict:
    return {
        "law": "ibarra_medina_krawinkler_bilinear",
        "yield_force": strength,
        "plastic_drift_to_capping": plastic,
        "post_capping_drift": post_capping,
        "capping_force_ratio": 1.08,
        "residual_force_ratio": 0.3,
        "ultimate_drift": 0.3,
    }


def reference_model(hinge=steel, **more) -> wd.HingedFishbone:
    """Return the reference model; `hinge` returns the law from yield moment and the two plastic rotations."""
    frame = fishbone()
    hinges = {}
    for storey, (column, beam) in enumerate(STRENGTHS, start=1):
        hinges[f"C{storey}", "start"] = hinges[f"C{storey}", "end"] = hinge(column, 0.03, 0.20)
        hinges[f"B{storey}", "start"] = hinge(beam, 0.025, 0.16)
    elastic = frame.lumped()
    stiffness = elastic.stiffness_matrices({name: each[None] for name, each in elastic.parameters.items()})[0]
    damping = A0 * 50e3 * np.eye(10) + A1 * stiffness
    return wd.HingedFishbone(frame, hinges, damping_matrix=damping, **more)


def motion(name: str, level: float) -> wd.GroundMotion:
    """Return a motion of the reference set, with zeros up to the end of the run."""
    if name == "LOS270":
        [record] = [each for each in wd.records.far_field() if "LOS270" in each.name]
        return wd.GroundMotion(np.append(level * record.acceleration, np.zeros(1001)), 0.01, f"{name} {level}")
    period, decay = PULSES[name]
    time = 0.01 * np.arange(1001)
    shaken = level * np.sin(2 * np.pi * time / period) * np.exp(-decay * time)
    return wd.GroundMotion(np.append(shaken, np.zeros(1000)), 0.01, f"{name} {level}")
