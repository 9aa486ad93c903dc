"""Problems on storey laws along cycles, and on buildings under an earthquake, beside OpenSees."""

from __future__ import annotations

import functools

import numpy as np

import warpdyn as wd

from . import loops_truth as truth
from .el_centro import STEP, el_centro
from .loops_truth import STIFFNESS, YIELD
from .problem import OPENSEES, STORED, Outcome, Problem, Row
from .runs import AS_GIVEN, history, loop, storey

GROUP = "Storey laws and buildings compared with OpenSees"
AXES = {"loop": ("drift [m]", "force [N]")}


def sides(names: tuple[str, ...], values: dict) -> dict[str, float]:
    """Return parameters such as ductility_2, ductility_3 from their lists."""
    return {f"{name}_{i + 2}": v for name in names for i, v in enumerate(values[name])}


def law_of(name: str) -> wd.laws.Law:
    """Return the storey law with the parameters of OpenSees' material."""
    both = ("ductility", "force_ratio")
    if name == "hysteretic":
        rules = ("pinching_drift", "pinching_force", "damage_by_ductility", "damage_by_energy", "unloading_exponent")
        own = dict(zip(rules, truth.HYSTERETIC["rules"], strict=True))
        return wd.laws.Hysteretic(yield_force=YIELD, **sides(both, truth.HYSTERETIC), **own)
    if name == "pinching4":
        own = dict(
            zip(("reloading_drift", "reloading_force", "unloading_force"), truth.PINCHING4["pinching"], strict=True)
        )
        names = ("by_drift", "by_use", "drift_exponent", "use_exponent", "limit")
        for kind, values in truth.PINCHING4_DAMAGE.items():
            own |= {f"{kind}_damage_{each}": v for each, v in zip(names, values, strict=True)}
        return wd.laws.Pinching4(yield_force=YIELD, energy_factor=10.0, **sides(both, truth.PINCHING4), **own)
    if name == "peak_oriented":
        p = truth.PEAK_ORIENTED
        modes = ("strength", "post_capping", "unloading", "reloading")
        return wd.laws.IbarraMedinaKrawinklerPeakOriented(
            yield_force=YIELD,
            plastic_drift_to_capping=p["to_capping"],
            post_capping_drift=p["post_capping"],
            capping_force_ratio=p["capping"],
            residual_force_ratio=p["residual"],
            **{f"{mode}_deterioration_drift": p["lasting"] for mode in modes},
        )
    p = truth.STEEL
    return wd.laws.MenegottoPinto(
        yield_force=YIELD,
        hardening_ratio=p["hardening"],
        transition_curvature=p["curvature"],
        isotropic_hardening=p["isotropic"],
        isotropic_hardening_ductility=p["after"],
    )


def law_loop(name: str) -> Outcome:
    """Quasi-static forces along the same drifts."""
    force = loop(storey(1.0, STIFFNESS, law=law_of(name)), truth.DRIFT)
    return Outcome(force[truth.TURNS], {"loop": (truth.DRIFT, force)})


def flag_loop() -> Outcome:
    """Storey law `self_centring` along the path of the stored loop."""
    case = truth.flag_case()
    k1, k2, force, flag = case["opensees"][0][1:5]
    law = wd.laws.SelfCentring(yield_force=force, hardening_ratio=k2 / k1, flag_height=flag)
    drift, rows = truth.flag_path(case)
    found = loop(storey(1.0, k1, law=law), drift)
    return Outcome(found[rows[:, -1]], {"loop": (drift[rows.ravel()], found[rows.ravel()])})


def frame(name: str) -> Outcome:
    """Three storeys, Rayleigh damping, rk4 at 1 ms."""
    law = {
        "bilinear": {"law": "bilinear", "hardening_ratio": 0.03},
        "menegotto_pinto": {"law": "menegotto_pinto", "hardening_ratio": 0.02, "transition_curvature": 18.0},
    }[name]
    with AS_GIVEN:
        building = wd.ShearBuilding(
            np.full(3, truth.FRAME_MASS), truth.FRAME_STIFFNESS, truth.HEIGHT, yield_force=truth.FRAME_STRENGTH,
            damping="rayleigh", damping_ratio=0.05, **law,
        )  # fmt: skip
        motion = wd.GroundMotion(9.81 * el_centro()[: truth.INTERVALS + 1], STEP)
        run = history(building, motion, 1e-3)
    rows = truth.INTERVALS * truth.SUBSTEPS + 1
    u = run["displacement"].values[0, :rows]
    drift = np.diff(u, axis=1, prepend=0)
    curve = (run["time"].values[:rows:10], drift[::10, 0])
    return Outcome([*np.abs(drift).max(axis=0), *drift[-1]], {"drift of the first storey": curve})


TURN_ROWS = [Row(f"force at {sign}{cycle:g} yield drifts", "N") for cycle in truth.CYCLES for sign in ("+", "-")]
STOREY_INPUT = (
    ("stiffness", "2e7", "N/m"),
    ("yield force", "1e5", "N"),
    ("path", "cycles of 0.5, 2, 4 and 8 yield drifts, 100 steps from peak to peak", ""),
)


def law_problem(
    number: str, title: str, name: str, material: str, inputs, tolerance=1e-9, shape="degrading"
) -> Problem:
    """Return the problem of a storey law along cycles."""
    return Problem(
        number, title, GROUP, OPENSEES,
        f"OpenSees 3.7 (openseespy), uniaxialMaterial {material}, along the same steps.",
        f"The storey law `{name}` has the rules of {material}. Every force of the path is a test of its rules for "
        "unloading, reloading and deterioration; the table lists the forces at the turning points.",
        (*STOREY_INPUT, *inputs), TURN_ROWS, ("law", {"shape": shape}),
        functools.partial(truth.opensees_loop, name), functools.partial(law_loop, name), tolerance,
        "Both programs follow the same rules in the same steps; the difference is rounding.", axes=AXES,
    )  # fmt: skip


def frame_problem(number: str, title: str, name: str, inputs, tolerance: float, reason: str) -> Problem:
    """Return the problem of a frame under El Centro."""
    return Problem(
        number, title, GROUP, OPENSEES,
        "OpenSees 3.7 (openseespy): zero-length elements, average acceleration with Newton's iteration, 1 ms.",
        "Peak storey drifts of the first 15 s of El Centro, at steps, and storey drifts at the end.",
        (
            ("floors", "3 of 1e5", "kg"), ("storey stiffness", "1.2e8, 1.0e8, 7e7", "N/m"),
            ("yield forces", "2.4e5, 2.0e5, 1.2e5", "N"), *inputs, ("Rayleigh damping", "0.05 in modes 1 and 2", ""),
            ("ground motion", "El Centro 1940 NS as in Chopra's book, g = 9.81 m/s²", ""),
            ("method and step", "rk4, 1 ms", ""),
        ),
        [
            *[Row(f"peak drift of storey {i}", "m") for i in (1, 2, 3)],
            *[Row(f"drift of storey {i} at 15 s", "m") for i in (1, 2, 3)],
        ],
        ("chain", {"masses": 3, "motion": True}),
        functools.partial(truth.frame_outcome, name), functools.partial(frame, name), tolerance, reason,
        axes={"drift of the first storey": ("time [s]", "drift [m]")},
    )  # fmt: skip


PROBLEMS = (
    Problem(
        "V42",
        "Self-centring storey: flag-shaped loop",
        GROUP,
        STORED,
        "Solution that is exact for each segment (stored); parameters of OpenSees' SelfCentering.",
        "Cycles of growing amplitude with partial unloading. The table lists the forces at the turning points.",
        (
            ("stiffness", "2e7", "N/m"),
            ("post-activation stiffness", "1e6", "N/m"),
            ("activation force", "2e5", "N"),
            ("flag height", "0.8", ""),
        ),
        [Row(f"force at turning point {i + 1}", "N") for i in range(len(truth.flag_case()["turning_points"]))],
        ("law", {"shape": "flag"}),
        truth.flag_loop,
        flag_loop,
        1e-7,
        "Stored forces have 8 digits.",
        axes=AXES,
        notes="OpenSees' SelfCentering itself has an error of first order in the step, because it stores a branch "
        "that was "
        "passed within a step. So the exact loop is used.",
    ),
    law_problem(
        "V43",
        "Pinched trilinear storey with damage (Hysteretic)",
        "hysteretic",
        "Hysteretic",
        (
            ("corners", "ductility 4, 10; force 1.2, 0.6", ""),
            ("pinching, damage, unloading", "0.5, 0.4, 0.005, 0.02, 0.3", ""),
        ),
    ),
    law_problem(
        "V44",
        "Four-point storey with damage by drift and energy (Pinching4)",
        "pinching4",
        "Pinching4",
        (
            ("corners", "ductility 4, 7, 12; force 1.2, 1.3, 0.4", ""),
            ("reloading and unloading", "0.5, 0.25, 0.05", ""),
            ("damage", "stiffness, reloading and strength, by energy", ""),
        ),
        1e-8,
    ),
    law_problem(
        "V45",
        "Peak-oriented storey of Ibarra, Medina and Krawinkler",
        "peak_oriented",
        "IMKPeakOriented",
        (
            ("plastic drift to capping, post-capping drift", "0.02, 0.08", "m"),
            ("capping and residual force", "1.15, 0.1", ""),
            ("deterioration drifts", "1.0", "m"),
        ),
    ),
    law_problem(
        "V46",
        "Giuffrè-Menegotto-Pinto storey with isotropic hardening (Steel02)",
        "menegotto_pinto",
        "Steel02",
        (
            ("hardening ratio", "0.02", ""),
            ("R₀, cR₁, cR₂", "18, 0.925, 0.15", ""),
            ("isotropic hardening", "0.02, 3", ""),
        ),
        shape="smooth",
    ),
    frame_problem(
        "V47",
        "Three-storey bilinear frame under El Centro",
        "bilinear",
        (("hardening ratio", "0.03", ""),),
        2e-4,
        "Average acceleration at 1 ms changes the third frequency (about 50 rad/s) by (ωh)²/12 = 2e-4; rk4 does not.",
    ),
    frame_problem(
        "V48",
        "Three-storey frame of Menegotto-Pinto storeys under El Centro",
        "menegotto_pinto",
        (("hardening ratio, R₀", "0.02, 18", ""),),
        2e-4,
        "Average acceleration at 1 ms changes the third frequency (about 50 rad/s) by (ωh)²/12 = 2e-4; rk4 does not.",
    ),
)
