"""Problems on buildings: five storeys under El Centro, response spectrum analysis, torsion, soil, equipment."""

from __future__ import annotations

import numpy as np

import warpdyn as wd
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_damping_matrix as matrix_of_modal_damping

from . import buildings_truth as truth, chains_truth
from .buildings_truth import PULSE_STEP
from .el_centro import STEP, el_centro
from .problem import CLOSED, PUBLISHED, SCIPY, Outcome, Problem, Row, series
from .runs import AS_GIVEN, history
from .solvers import peak

GROUP = "Buildings: modes, earthquakes, torsion, soil and equipment"
TIME_AND_U = ("time [s]", "displacement [m]")
TOPS = "Both peaks are tops of parabolas through three steps; the method `exact` has rounding errors only."
MODES = ("mode 1", "mode 2", "mode 3", "mode 4", "mode 5", "all modes")
TWO = ("mode 1", "mode 2", "both modes")


def five_storeys() -> wd.ShearBuilding:
    """Return Chopra's uniform five-storey shear frame with modal damping."""
    return wd.ShearBuilding(
        np.full(5, chains_truth.FLOOR), chains_truth.STOREY, chains_truth.HEIGHT, damping="modal", damping_ratio=0.05
    )


def shortened(seconds: float) -> wd.GroundMotion:
    """Return the first part of El Centro."""
    return wd.GroundMotion(chains_truth.GRAVITY * el_centro()[: round(seconds / STEP) + 1], STEP)


def five_storey_modes() -> Outcome:
    """Modes of a ShearBuilding; heights from its shapes."""
    modes = five_storeys().modal()
    w, shape = modes["circular_frequency"].values, modes["shape"].values
    heights = (shape * np.arange(1, 6)).sum(axis=1) / shape.sum(axis=1)
    scaled = w / np.sqrt(chains_truth.STOREY / chains_truth.FLOOR)
    return Outcome([*modes["period"].values, *scaled, *(modes["effective_mass"].values / chains_truth.FLOOR), *heights])


def modal_run(building: wd.ShearBuilding, ratio: float, heights: np.ndarray, seconds: float = 15.0):
    """Return the peaks of modal_peaks, from a run of all modal equations at once; method `exact` at 1 ms."""
    modes = building.modal()
    w, share = modes["circular_frequency"].values, modes["participation_factor"].values
    count = len(w)
    system = wd.LinearSystem(np.ones(count), np.diag(2 * ratio * w), np.diag(w**2), influence=np.ones(count))
    run = history(system, shortened(seconds), 1e-3, "exact")
    floors = run["displacement"].values[0][:, None] * (modes["shape"].values.T * share)
    forces = floors * building.parameters["mass"][:, None] * w**2
    responses = (floors[:, -1], forces[:, -1], forces.sum(axis=1), np.einsum("tfm,f->tm", forces, heights))
    table = [[*(peak(each[:, m]) for m in range(count)), 0.0] for each in responses]
    return w, np.array(table)


def five_storey_histories() -> Outcome:
    """Modal equations by `exact`; all modes together as storeys with modal damping by rk4 at 1 ms."""
    heights = chains_truth.HEIGHT * np.arange(1, 6)
    _, table = modal_run(five_storeys(), 0.05, heights)
    run = history(five_storeys(), shortened(15.0), 1e-3)
    shears = run["storey_force"].values[0]
    roof = run["displacement"].values[0, :, 4]
    moment = chains_truth.HEIGHT * shears.sum(axis=1)
    table[:, -1] = [peak(each) for each in (roof, shears[:, 4], shears[:, 0], moment)]
    table *= np.array([100, 1e-3, 1e-3, 1e-3])[:, None]
    time = run["time"].values
    return Outcome(table.ravel(), {"roof displacement": (time[::5], roof[::5])})


def five_storey_spectrum() -> Outcome:
    """`response_spectra` at the periods of the building, combined with its effective masses."""
    building = five_storeys()
    modes = building.modal()
    with AS_GIVEN:
        spectra = wd.response_spectra(shortened(30.0), modes["period"].values[::-1], 0.05, device="cpu")
    peaks = spectra["spectral_displacement"].values.ravel()[::-1]
    w = modes["circular_frequency"].values
    parts = modes["effective_mass"].values * w**2 * peaks / 1e3
    return Outcome([*peaks, *chains_truth.combinations(w, 0.05, parts)])


def modal_damping_matrix() -> Outcome:
    """The matrix with which `damping="modal"` is computed [kN s/cm]."""
    found = matrix_of_modal_damping(np.array([2e5, 2e5, 1e5]), chain_stiffness_matrix(np.full(3, 1e8)), 0.05) / 1e5
    return Outcome([found[i, j] for i in range(3) for j in range(i, 3)])


def two_storeys() -> Outcome:
    """Modal equations by `exact`; storeys with modal damping by rk4 at 1 ms."""
    building = wd.ShearBuilding([5000.0, 2500.0], [394784.0, 197392.0], 3.0, damping="modal", damping_ratio=0.02)
    w, table = modal_run(building, 0.02, np.zeros(2))
    run = history(building, shortened(15.0), 1e-3)
    roof = run["displacement"].values[0, :, 1]
    table[0, -1], table[2, -1] = peak(roof), peak(run["storey_force"].values[0, :, 0])
    return Outcome([*w, *table[0], *(table[2] / 1e3)], {"top displacement": (run["time"].values[::5], roof[::5])})


def hazus_chain() -> Outcome:
    """`ShearBuilding.from_hazus`."""
    building = wd.ShearBuilding.from_hazus("C1M", "high", 5)
    p = building.parameters
    assert np.ptp(p["stiffness"]) == 0
    return Outcome([p["stiffness"][0], *p["yield_force"], building.fundamental_period])


def respond(mass, damping, stiffness, influence, base):
    """Return times, displacements [time, dof] and the system; method `exact` at 1 ms."""
    system = wd.LinearSystem(mass, damping, stiffness, influence=influence)
    run = history(system, wd.GroundMotion(base, PULSE_STEP), 1e-3, "exact")
    return run["time"].values, run["displacement"].values[0], system


def torsion() -> Outcome:
    """Matrix system with influence [0, 1, 0] and warpdyn's matrix of modal damping."""
    k = truth.TORSION_STIFFNESS
    damping = matrix_of_modal_damping(np.diag(truth.TORSION_MASS), k, 0.05)
    time, u, system = respond(truth.TORSION_MASS, damping, k, [0.0, 1.0, 0.0], truth.pulse(3.0, 1.0, 0.5, 10.0))
    w = system.modal()["circular_frequency"].values
    frame_a = u[:, 1] + truth.DECK["e"] * u[:, 2]
    values = [*w, peak(u[:, 1]), peak(frame_a), peak(truth.DECK["d"] * u[:, 2]), peak(u[:, 2])]
    return Outcome(values, {"rotation": (time[::5], u[::5, 2])})


def soil_structure() -> Outcome:
    """Full mass matrix with influence [0, 1, 0]; complex mode from free vibration in it."""
    matrices = truth.sway_rocking()
    time, u, system = respond(*matrices, [0.0, 1.0, 0.0], truth.pulse(3.0, 0.5, 0.5, 8.0))
    # Free vibration after 1.5 s contains only the first mode: the next ones are above 200 rad/s with 37 % damping.
    free = history(system, wd.FreeVibration(3.0, velocity=[1.0, 0.0, 0.0]), 5e-3, "exact")
    x = free["displacement"].values[0, 300:, 0]
    (sum_, product), *_ = np.linalg.lstsq(np.stack([x[1:-1], -x[:-2]], axis=1), x[2:], rcond=None)
    decay, turn = np.log(product) / 2 / 5e-3, np.arccos(sum_ / (2 * np.sqrt(product))) / 5e-3
    size = np.hypot(decay, turn)
    total = u[:, 0] + u[:, 1] + truth.SOIL["h"] * u[:, 2]
    values = [2 * np.pi / size, -decay / size, *(peak(each) for each in u.T[:2]), peak(total), peak(u[:, 2])]
    return Outcome(values, {"structural deformation": (time[::5], u[::5, 0])})


def tuned_equipment() -> Outcome:
    """Matrix system with three degrees of freedom."""
    values, curves = [], {}
    for share in truth.EQUIPMENT:
        time, u, _ = respond(*truth.equipped(share), np.ones(3), truth.pulse(2.0, 0.5, 0.4, 12.0))
        values += [peak(u[:, 1]), peak(u[:, 2] - u[:, 1])]
        if share == truth.EQUIPMENT[0]:
            curves["equipment"] = (time[::5], (u[:, 2] - u[:, 1])[::5])
    return Outcome(values, curves)


FRAME = (
    ("floors", "5 of 45", "Mg"),
    ("storey stiffness", "54.82", "kN/cm"),
    ("storey height", "4", "m"),
    ("damping ratio", "0.05 in each mode", ""),
)
QUAKE = ("ground motion", "El Centro 1940 NS as in Chopra's book, g = 9.81 m/s², linear between samples", "")
M5 = [
    17.084, 2.375, 0.606, 0.141, 0.025, 17.383, 75.874, 89.858, 57.004, 21.831, 5.032, 155.308,
    266.571, 108.154, 43.524, 12.975, 2.622, 323.062, 3746.2, 520.7, 132.93, 30.85, 5.47, 3811.79,
]  # fmt: skip
MODAL_TABLE = [
    ("T{} ", "s", [2, 0.6852, 0.4346, 0.3383, 0.2966]),
    ("ω{}/√(k/m)", "1", [0.285, 0.831, 1.31, 1.682, 1.919]),
    ("effective mass {} over m", "1", [4.398, 0.436, 0.121, None, 0.008]),
    ("effective height {} over h", "1", [3.51, -1.2, 0.76, -0.59, None]),
]
PROBLEMS = (
    Problem(
        "V19",
        "Five-storey shear frame: modes, effective masses and heights",
        GROUP,
        CLOSED,
        "Chopra, Dynamics of Structures, section 12.8 and tables 13.2.2 and 13.2.3. Closed form: ω = 2√(k/m) "
        "sin((2i - 1)π/22).",
        "Modes of the uniform frame of problems V20 and V21.",
        FRAME[:3],
        [row for name, unit, printed in MODAL_TABLE for row in series(name, range(1, 6), unit, printed)],
        ("chain", {"masses": 5}),
        chains_truth.five_storey_modes,
        five_storey_modes,
        1e-11,
        "Rounding of a 5 by 5 eigenvalue problem; the effective mass of mode 5 is a small difference.",
        scale="value",
    ),
    Problem(
        "V20",
        "Five-storey shear frame under El Centro: modal response histories",
        GROUP,
        PUBLISHED,
        "Chopra, Dynamics of Structures, 5th ed. 2020, section 13.2.6, figures 13.2.7 and 13.2.8, as reproduced in "
        "GeorgePapazafeiropoulos/LinDRHAMatlab, Documentation.pdf.",
        "Peaks of the first 15 s between samples too: roof displacement, shear of the fifth storey, base shear, base "
        "overturning moment, for each mode and for all modes.",
        (*FRAME, QUAKE, ("method and step", "exact (modes) and rk4 (storeys with modal damping), 1 ms", "")),
        [
            Row(f"{name}, {mode}", unit, M5[6 * i + j])
            for i, (name, unit) in enumerate((("u5", "cm"), ("V5", "kN"), ("Vb", "kN"), ("Mb", "kN m")))
            for j, mode in enumerate(MODES)
        ],
        ("chain", {"masses": 5, "motion": True}),
        chains_truth.five_storey_histories,
        five_storey_histories,
        1e-6,
        "Tops of parabolas through steps of 1 ms; the highest mode has ωh = 0.02 and a small share.",
        axes={"roof displacement": TIME_AND_U},
        notes="The printed peaks of modes 3 to 5 are peaks between samples: at the samples of 0.02 s they are 0.5 to "
        "1.7 % "
        "smaller. All 24 printed values agree within 0.34 %.",
    ),
    Problem(
        "V21",
        "Five-storey shear frame under El Centro: response spectrum analysis",
        GROUP,
        PUBLISHED,
        "Chopra, Dynamics of Structures, 5th ed., example 13.8.2 and section 13.8; values as in the package structdyn "
        "0.8.0, examples/mdf/eg_rsa.py.",
        "Spectral displacements of the five modes, and base shear by SRSS, CQC and absolute sum. warpdyn supplies "
        "spectra, "
        "modes and effective masses; the combination is one line of NumPy.",
        (*FRAME, QUAKE),
        [
            *series("D{}", range(1, 6), "m", [0.13649, 0.06557, 0.03823, 0.02227, 0.01657]),
            Row("base shear, SRSS", "kN", 291.2219012),
            Row("base shear, CQC", "kN"),
            Row("base shear, absolute sum", "kN"),
        ],
        ("chain", {"masses": 5, "motion": True}),
        chains_truth.five_storey_spectrum,
        five_storey_spectrum,
        1e-6,
        "The independent peak is the top of a parabola through points 1 ms apart.",
        scale="value",
        notes="The printed SRSS value uses peaks at the samples only.",
    ),
    Problem(
        "V22",
        "Damping matrix with the same ratio in all modes",
        GROUP,
        PUBLISHED,
        "Chopra, Dynamics of Structures, example 11.4; C33 as in structdyn 0.8.0, examples/mdf/eg_damping_mat.py.",
        'Superposition of modal damping matrices, as with `damping="modal"`.',
        (("masses", "200, 200, 100", "Mg"), ("storey stiffness", "3 of 1e8", "N/m"), ("damping ratio", "0.05", "")),
        [Row(f"C{i}{j}", "kN s/cm", 2.879834412 if i == j == 3 else None) for i in (1, 2, 3) for j in range(i, 4)],
        ("chain", {"masses": 3}),
        chains_truth.modal_damping_matrix,
        modal_damping_matrix,
        1e-12,
        "Rounding of a 3 by 3 eigenvalue problem.",
    ),
    Problem(
        "V23",
        "Two-storey building under El Centro",
        GROUP,
        PUBLISHED,
        "NPTEL web course Introduction to Earthquake Engineering, example 3.6, figures reproduced in "
        "GeorgePapazafeiropoulos/LinDRHAMatlab, Documentation.pdf.",
        "Peaks of top displacement and base shear of each mode and of both. The periods are 1.0 and 0.5 s.",
        (
            ("masses", "5000 (first floor), 2500 (top)", "kg"),
            ("storey stiffness", "394784, 197392", "N/m"),
            ("damping ratio", "0.02 in each mode", ""),
            QUAKE,
            ("method and step", "exact and rk4, 1 ms", ""),
        ),
        [
            *series("ω{}", (1, 2), "rad/s", [6.283, 12.566]),
            *[Row(f"u2, {m}", "m", p) for m, p in zip(TWO, (0.2, 0.022, 0.202), strict=True)],
            *[Row(f"Vb, {m}", "kN", p) for m, p in zip(TWO, (39.81, 8.85, 40.72), strict=True)],
        ],
        ("chain", {"masses": 2, "motion": True}),
        chains_truth.two_storeys,
        two_storeys,
        1e-6,
        "Tops of parabolas through steps of 1 ms, ωh = 0.013.",
        axes={"top displacement": TIME_AND_U},
        notes="The printed peaks of the modes are 0.2 to 3.4 % smaller than the exact peaks. Totals agree within 0.3 "
        "%.",
    ),
    Problem(
        "V24",
        "Shear building of a Hazus class",
        GROUP,
        CLOSED,
        "Hazus capacity curve C1M, high code; chain by Lu and Guan's formulas: K0 = 4π²λm/T², λ = 1/(4 sin²(π/(4N + "
        "2))), "
        "V_i = V_1 (1 - i(i - 1)/(N(N + 1))).",
        "`from_hazus` builds a uniform chain whose first period is that of the class.",
        (("class and code level", "C1M, high", ""), ("storeys", "5", ""), ("floor mass", "1e6", "kg")),
        [
            Row("storey stiffness", "N/m", 866317029.186),
            *series("yield force of storey {}", range(1, 6), "N", truth.DESIGN_FORCE),
            Row("first period", "s", 0.75),
        ],
        ("chain", {"masses": 5}),
        truth.hazus_chain,
        hazus_chain,
        2e-9,
        "The published strength of the first storey has 9 digits; stiffness and period agree to rounding.",
        scale="value",
    ),
    Problem(
        "V25",
        "One-storey building with eccentric stiffness",
        GROUP,
        SCIPY,
        "Plan of Chopra, Dynamics of Structures, example 10.6 (model as in GeorgePapazafeiropoulos/DRSAMatlab), in "
        "SI units.",
        "A rigid deck on one frame across and two frames along, moved across. A LinearSystem with the influence vector "
        "[0, 1, 0] represents displacement and rotation.",
        (
            ("deck", "9.144 by 6.096, 27215.5 kg", "m"),
            ("frame A at e = 0.4572 m", "1094542.72", "N/m"),
            ("frames B and C at ±3.048 m", "583756.117 each", "N/m"),
            ("damping ratio", "0.05 in each mode", ""),
            ("base acceleration", "3 sin(2πt) exp(-0.5t), sampled at 0.01 s", "m/s²"),
            ("method and step", "exact, 1 ms", ""),
        ),
        [
            *series("ω{}", (1, 2, 3), "rad/s", [5.878, 6.553, 6.794]),
            Row("peak of u_y", "m"),
            *[Row(f"peak deformation of frame {frame}", "m") for frame in "AB"],
            Row("peak rotation", "rad"),
        ],
        ("plan", {}),
        truth.torsion,
        torsion,
        1e-7,
        TOPS,
        scale="value",
        axes={"rotation": ("time [s]", "rotation [rad]")},
        notes="The printed frequencies belong to a mass that is rounded to 1.863 kip s²/ft.",
    ),
    Problem(
        "V26",
        "Oscillator on a swaying and rocking foundation (soil-structure interaction)",
        GROUP,
        SCIPY,
        "Eigenvalues of the state matrix and matrix exponentials. Springs and dashpots of the soil: Pais and Kausel "
        "(1988) "
        "as in NIST GCR 12-917-21.",
        "Deformation of the structure, sway and rocking of the base. The mass matrix is full; the influence vector is "
        "[0, 1, 0].",
        (
            ("mass and height", "500e3 kg at 12", "m"),
            ("period and damping on a fixed base", "0.4 s, 0.05", ""),
            ("foundation", "150e3 kg, 2.0e6 kg m²", ""),
            ("Kx, Kr", "1.80526547e9 N/m, 7.61376826e10 N m", ""),
            ("cx, cr", "64783675.5 N s/m, 207438885 N m s", ""),
            ("base acceleration", "3 sin(4πt) exp(-0.5t), sampled at 0.01 s", "m/s²"),
            ("method and step", "exact, 1 ms", ""),
        ),
        [
            Row("period of the first complex mode", "s"),
            Row("its damping ratio", "1"),
            *[Row(f"peak {name}", "m") for name in ("deformation", "sway", "displacement relative to the ground")],
            Row("peak rocking", "rad"),
        ],
        ("rocking", {}),
        truth.soil_structure,
        soil_structure,
        2e-6,
        "Tops of parabolas through steps of 1 ms and 0.5 ms of a response with ωh = 0.014; the base has frequencies of "
        "200 rad/s.",
        scale="value",
        axes={"structural deformation": TIME_AND_U},
    ),
    Problem(
        "V27",
        "Tuned equipment on a two-storey building",
        GROUP,
        SCIPY,
        "Matrix exponentials. Light equipment tuned to a mode makes the damping non-classical.",
        "The equipment on the second floor has the frequency of the first mode, 1 % damping and 0.1 % or 1 % of a "
        "floor's "
        "mass.",
        (
            ("floors", "2 of 100e3", "kg"),
            ("storey stiffness", "2 of 50e6", "N/m"),
            ("damping of the building", "0.05 in each mode", ""),
            ("equipment", "0.001 and 0.01 of a floor, 1 % damping", ""),
            ("base acceleration", "2 sin(4πt) exp(-0.4t), sampled at 0.01 s", "m/s²"),
            ("method and step", "exact, 1 ms", ""),
        ),
        [
            Row(f"peak {name}, {share:g} m", "m")
            for share in truth.EQUIPMENT
            for name in ("roof displacement", "equipment deformation")
        ],
        ("chain", {"masses": 2, "motion": True, "equipment": True}),
        truth.tuned_equipment,
        tuned_equipment,
        1e-7,
        TOPS,
        scale="value",
        axes={"equipment": ("time [s]", "deformation of the equipment [m]")},
    ),
)
