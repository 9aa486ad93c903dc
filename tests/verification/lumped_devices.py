"""Problems on lumped structures: isolators in two directions, vehicles, absorbers, angles of incidence, tanks."""

from __future__ import annotations

import numpy as np

import warpdyn as wd

from . import lumped_truth as truth
from .lumped import EXACT, GROUP, METHOD, MOTION, RK4, STEP, TIME_AND_U, peak_of
from .problem import CLOSED, SCIPY, Outcome, Problem, Row
from .runs import AS_GIVEN, frequencies, history, motion, pair, states


def point_mass(mass: float, springs: list) -> wd.LumpedStructure:
    """Return a mass that moves in x and y, each under one component of the motion; output: the resultant."""
    both = {"influence": [{"x": 1.0}, {"y": 1.0}], "outputs": {"resultant": [{"x": 1.0}, {"y": 1.0}]}}
    return wd.LumpedStructure({"x": mass, "y": mass}, springs, **both)


@AS_GIVEN
def isolator() -> Outcome:
    """BiaxialSpring.forces_along with steps of 0.02 mm and less."""
    p = truth.BEARING
    laws = (wd.laws.IsotropicBoucWen, wd.laws.ParkWenAng)
    straight = np.stack([p["radius"] * np.arange(1, 5001) / 5000, np.zeros(5000)], axis=1)
    q = 2 * np.pi * np.arange(1, 80001) / 40000
    path = np.vstack([straight, p["radius"] * np.stack([np.cos(q), np.sin(q)], axis=1)])
    rows = [4999 if place <= 1 else 4999 + round((place - 1) * 40000) for place in truth.PLACES]
    values = []
    for law in laws:
        own = law(yield_force=p["Q"] + p["k2"] * p["uy"], post_yield_stiffness=p["k2"])
        spring = wd.BiaxialSpring("bearing", {"x": 1.0}, {"y": 1.0}, law=own, stiffness=p["Q"] / p["uy"] + p["k2"])
        values.append(spring.forces_along(path)[rows])
    return Outcome([*values[0].ravel(), *values[1].ravel(), *values[0][-1]])


@AS_GIVEN
def friction_slider() -> Outcome:
    """BiaxialSpring with the law FrictionSlider, rk4 at 0.5 ms."""
    p = truth.SLIDER
    weight = p["mass"] * truth.GRAVITY
    law = wd.laws.FrictionSlider(
        fast_friction=p["fast"], slow_friction=p["slow"], rate_parameter=p["rate"], radius=p["radius"], weight=weight
    )
    stiffness = p["slow"] * weight / p["uy"] + weight / p["radius"]  # uy is that at rest
    slider = wd.BiaxialSpring("slider", {"x": 1.0}, {"y": 1.0}, law=law, stiffness=stiffness)
    both = pair(truth.pulse(4.0, 1.2, 0.4), truth.pulse(3.0, 0.8, 0.4))
    run = history(point_mass(p["mass"], [slider]), both, STEP, recorders=("output",))
    u, force = states(run, "displacement", ["x", "y"]), states(run, "spring_force", ["slider x", "slider y"])
    values = [*(peak_of(each) for each in u.T), run["peak_output"].item(), *(peak_of(each) for each in force.T)]
    return Outcome(values, {"path of the slider": (u[:, 0], u[:, 1])})


@AS_GIVEN
def quarter_car() -> Outcome:
    """QuarterCar on a bump, rk4 at 0.5 ms."""
    p = truth.CAR
    car = wd.QuarterCar(p["ms"], p["mu"], p["ks"], p["cs"], p["kt"])
    run = history(car, motion(truth.bump(), truth.CAR_STEP), truth.CAR_STEP / 2)
    travel, tyre = states(run, "spring_deformation", ["suspension", "tyre"]).T
    values = [*(frequencies(car) / (2 * np.pi)), peak_of(states(run, "acceleration", ["body"]))]
    return Outcome([*values, peak_of(travel), peak_of(tyre)], {"suspension travel": (run["time"].values, travel)})


@AS_GIVEN
def inerter() -> Outcome:
    """with_absorber on an oscillator, with the default frequency and damping; rk4 at 0.5 ms."""
    p = truth.INERTER
    stiffness = p["mass"] * (2 * np.pi / p["period"]) ** 2
    oscillator = wd.ShearBuilding([p["mass"]], [stiffness], 3.0, damping="modal", damping_ratio=p["ratio"])
    damped = wd.with_absorber(oscillator, "u1", mass_ratio=p["mu"], inertance_ratio=p["beta"])
    time = truth.STEP * np.arange(2001)
    run = history(damped, motion(np.sin(2 * np.pi * time / 2) * np.exp(-0.1 * time)), STEP)
    absorber = next(spring for spring in damped.springs if spring.name != "storey 1")
    u = states(run, "displacement", ["u1", absorber.name])
    stroke = states(run, "spring_deformation", [absorber.name])
    values = [absorber.stiffness, absorber.damping_coefficient, *(peak_of(each) for each in u.T), peak_of(stroke)]
    values.append(peak_of(states(run, "acceleration", ["u1"])))
    return Outcome(values, {"displacement of the structure": (run["time"].values, u[:, 0])})


@AS_GIVEN
def angles() -> Outcome:
    """A structure with two equal directions at given angles of incidence, rk4 at 0.5 ms; recorded peaks."""
    p = truth.OSCILLATOR
    own = {"stiffness": p["stiffness"], "damping_coefficient": p["damping"]}
    deck = point_mass(p["mass"], [wd.Spring(axis, {axis: 1.0}, **own) for axis in "xy"])
    turned = np.array([*truth.ANGLES, *range(0, 181, 5)])
    scatter = {"incidence_angle": wd.GivenValues(np.radians(turned))}
    both = pair(truth.pulse(5.0, 0.9, 0.6), truth.pulse(4.0, 0.6, 0.5))
    scene = wd.Scene(deck, both, scatter, recorders=("displacement", "output"), tail=0.0)
    run = wd.simulate(scene, step=STEP, method="rk4", dtype="float64", device="cpu")
    peaks, count = run["peak_displacement"].values, len(truth.ANGLES)
    values = [*peaks[:count].ravel(), run["peak_output"].values[0, 0]]
    return Outcome(values, {"peak displacement in x": (turned[count:].astype(float), peaks[count:, 0])})


@AS_GIVEN
def tank() -> Outcome:
    """HousnerTank, rk4 at 0.5 ms; recorded peaks of base shear and moment."""
    liquid = wd.housner_cylinder(truth.TANK["radius"], truth.TANK["depth"])
    built = wd.HousnerTank(liquid, impulsive_period=truth.TANK["period"])
    time = truth.STEP * np.arange(2001)
    load = motion(2.0 * np.sin(2 * np.pi * time / 4) * np.exp(-0.2 * time))
    run = history(built, load, STEP, recorders=("output",))
    u = states(run, "displacement", ["impulsive", "convective"])
    values = [liquid.impulsive_mass, liquid.convective_mass, liquid.impulsive_height, liquid.convective_height]
    values += [liquid.convective_period, *(peak_of(each) for each in u.T)]
    values += [run["peak_output"].sel(output=name).item() for name in ("base shear", "wall moment")]
    return Outcome(values, {"displacement of the sloshing mass": (run["time"].values, u[:, 1])})


PROBLEMS = [
    Problem(
        "V69",
        "Isolator in two directions: two forms of the Bouc-Wen law",
        GROUP,
        SCIPY,
        "SciPy's DOP853 along the path; steady state of the isotropic form in closed form, forces Q (u_y/R) + k₂ R "
        "along the radius and Q √(1 - (u_y/R)²) across. OpenSees' elastomericBearingBoucWen agrees within 0.04 N.",
        "The isolator moves along a straight line of 0.1 m and then along two turns of a circle.",
        (
            ("force at yield Q", "150", "kN"),
            ("yield displacement u_y", "0.04", "m"),
            ("stiffness after yield k₂", "1", "MN/m"),
            ("β, gamma, exponent", "0.5, 0.5, 2", ""),
            ("radius of the circle R", "0.1", "m"),
        ),
        [
            *(
                Row(f"F{axis}, {form}, after {place - 1:g} turns", "N")
                for form in ("isotropic", "Park-Wen-Ang")
                for place in truth.PLACES
                for axis in "xy"
            ),
            Row("steady radial force, isotropic", "N"),
            Row("steady tangential force, isotropic", "N"),
        ],
        ("law", {"shape": "smooth"}),
        truth.isolator,
        isolator,
        1e-7,
        "Each step of forces_along follows a chord of the circle of 16 µm.",
    ),
    Problem(
        "V70",
        "Friction slider with velocity-dependent friction in two directions",
        GROUP,
        SCIPY,
        "SciPy's LSODA in each sample of the motion, relative tolerance 1e-9. The friction is that of Constantinou, "
        "Mokha and Reinhorn (1990).",
        "A rigid mass on a friction pendulum; the direction of the friction force follows the velocity.",
        (
            ("mass", "100", "t"),
            ("radius", "2", "m"),
            ("friction, fast and slow", "0.08, 0.03", ""),
            ("rate parameter", "50", "s/m"),
            ("yield displacement", "1", "mm"),
            MOTION,
            ("A, T, b in x and y", "4, 1.2, 0.4; 3, 0.8, 0.4", "m/s², s, 1/s"),
            METHOD,
        ),
        [
            *(Row(f"peak u{axis}", "m") for axis in "xy"),
            Row("peak resultant displacement", "m"),
            *(Row(f"peak force in {axis}", "N") for axis in "xy"),
        ],
        ("isolated", {}),
        truth.friction_slider,
        friction_slider,
        2e-7,
        "rk4 at 0.5 ms: the direction of friction turns within 1 mm.",
        axes={"path of the slider": ("u_x [m]", "u_y [m]")},
    ),
    Problem(
        "V71",
        "Quarter car on a bump",
        GROUP,
        SCIPY,
        f"{EXACT}. The bump is h sin⁴(πx/L), as the acceleration of the road sampled at 1 ms.",
        "The base moves vertically with the road; displacements are relative to the road.",
        (
            ("body and wheel", "300, 60", "kg"),
            ("suspension", "16,000 N/m, 1,000 N s/m", ""),
            ("tyre", "190,000", "N/m"),
            ("bump h, L", "0.08, 2", "m"),
            ("speed", "10", "m/s"),
            METHOD,
        ),
        [
            *(Row(f"f{i}", "Hz") for i in (1, 2)),
            Row("peak acceleration of the body", "m/s²"),
            Row("peak suspension travel", "m"),
            Row("peak deflection of the tyre", "m"),
        ],
        ("oscillator", {"damper": True, "load": "road"}),
        truth.quarter_car,
        quarter_car,
        1e-6,
        RK4,
        axes={"suspension travel": ("time [s]", "travel [m]")},
    ),
    Problem(
        "V72",
        "Tuned mass damper with an inerter",
        GROUP,
        SCIPY,
        f"Closed form of the optimum of Marian and Giaralis (2014) for white noise; {EXACT}.",
        "The inertance is part of the mass matrix but not of the load. The builder has to find the optimum by itself.",
        (
            ("structure", "1,000 t, 2 s, damping ratio 0.02", ""),
            ("mass ratio, inertance ratio", "0.02, 0.1", ""),
            MOTION,
            ("A, T, b, duration", "1, 2, 0.1, 20", "m/s², s, 1/s, s"),
            METHOD,
        ),
        [
            Row("stiffness of the absorber", "N/m"),
            Row("dashpot of the absorber", "N s/m"),
            Row("peak displacement of the structure", "m"),
            Row("peak displacement of the absorber", "m"),
            Row("peak stroke of the absorber", "m"),
            Row("peak total acceleration of the structure", "m/s²"),
        ],
        ("chain", {"masses": 1, "equipment": True, "motion": True}),
        truth.inerter,
        inerter,
        1e-7,
        RK4,
        axes={"displacement of the structure": TIME_AND_U},
    ),
    Problem(
        "V73",
        "Angle of incidence of a pair of motions",
        GROUP,
        CLOSED,
        f"{EXACT} of both components; the response along an axis at the angle t is cos t times the first plus sin t "
        "times the second.",
        "A structure with two equal directions is turned below a pair of motions. The resultant does not depend on the "
        "angle.",
        (
            ("mass, stiffness, dashpot", "100 t, 20 MN/m, 100 kN s/m", ""),
            MOTION,
            ("A, T, b of both components", "5, 0.9, 0.6; 4, 0.6, 0.5", "m/s², s, 1/s"),
            ("angles", "0, 30, 75, 120, 210", "degrees"),
            METHOD,
        ),
        [
            *(Row(f"peak u{axis} at {angle:g}°", "m") for angle in truth.ANGLES for axis in "xy"),
            Row("peak resultant (SRSS at each time)", "m"),
        ],
        ("incidence", {}),
        truth.angles,
        angles,
        1e-7,
        RK4,
        axes={"peak displacement in x": ("angle [degrees]", "displacement [m]")},
    ),
    Problem(
        "V74",
        "Liquid storage tank after Housner",
        GROUP,
        SCIPY,
        f"Housner's formulas as in ACI 350.3 (rigid cylinder); {EXACT}.",
        "Impulsive and sloshing mass on their springs. Base shear and moment are those of the springs.",
        (
            ("radius and depth", "10, 8", "m"),
            ("impulsive period", "0.15 s, damping ratio 0.05", ""),
            ("damping ratio of the sloshing mass", "0.005", ""),
            MOTION,
            ("A, T, b, duration", "2, 4, 0.2, 20", "m/s², s, 1/s, s"),
            METHOD,
        ),
        [
            *(Row(f"{name} mass", "kg") for name in ("impulsive", "convective")),
            *(Row(f"height of the {name} mass", "m", tolerance=1e-9) for name in ("impulsive", "convective")),
            Row("sloshing period", "s"),
            *(Row(f"peak displacement, {name}", "m") for name in ("impulsive", "convective")),
            Row("peak base shear", "N"),
            Row("peak moment above the base", "N m"),
        ],
        ("oscillator", {"damper": True, "load": "a_g(t)"}),
        truth.tank,
        tank,
        1e-7,
        RK4,
        axes={"displacement of the sloshing mass": TIME_AND_U},
    ),
]
