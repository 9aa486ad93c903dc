"""Contacts between degrees of freedom: restitution of free impacts, and pounding of two oscillators."""

from __future__ import annotations

import re

import numpy as np
import pytest
from lumped_cases import Case, pounding, pulse
from scipy.integrate import solve_ivp

import warpdyn as wd
from warpdyn import laws

# Structures of the cases are round, and some are undamped.
pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]

MASSES = 200e3, 350e3  # kg
IMPACT_MASS = MASSES[0] * MASSES[1] / sum(MASSES)
LINEAR = {"clearance": 0.02, "contact_stiffness": 93.5e6, "impact_mass": IMPACT_MASS}
HERTZ = {"clearance": 0.02, "hertz_stiffness": 2.75e9}
SETTINGS = {"dtype": "float64", "device": "cpu"}
# Coefficient of restitution wanted: (obtained, peak force [N]), of an event-exact solution.
FREE_IMPACTS = {
    laws.MuthukumarDesRochesContact: {
        0.4: (0.701635, 7.12602e6),
        0.65: (0.774819, 7.19136e6),
        0.9: (0.913177, 7.52736e6),
    },
    laws.YeLiZhuContact: {0.4: (0.362872, 7.83107e6), 0.65: (0.63033, 7.13358e6), 0.9: (0.893921, 7.46349e6)},
    laws.JankowskiContact: {0.4: (0.392977, 7.84287e6), 0.65: (0.647029, 5.65269e6), 0.9: (0.899723, 7.00209e6)},
    laws.KelvinVoigtContactWithTension: {0.4: (0.4, 2.7967e6), 0.65: (0.65, 2.94155e6), 0.9: (0.9, 3.28367e6)},
    laws.KelvinVoigtContact: {0.4: (0.472014, 2.7967e6), 0.65: (0.674751, 2.94155e6), 0.9: (0.902026, 3.28367e6)},
}


def impact(law: laws.Contact, step: float = 1e-4, **settings: object):
    """Return the ratio of speeds after and before an impact of two masses at 1 m/s, and the run; springs are soft."""
    soft = (2 * np.pi / 2000) ** 2
    springs = [wd.Spring(name, {name: 1.0}, stiffness=mass * soft) for name, mass in zip("12", MASSES, strict=True)]
    pair = wd.LumpedStructure(
        dict(zip("12", MASSES, strict=True)), [*springs, wd.Spring("contact", {"1": 1.0, "2": -1.0}, law=law)]
    )
    scene = wd.Scene(pair, wd.FreeVibration(0.3, 0.0, [1.0, 0.0]), recorders=("spring",))
    run = wd.simulate(scene, step=step, histories=wd.Histories([0]), **SETTINGS | settings)
    first, second = run["velocity"].isel(history=0, time=-1).values
    return second - first, run


@pytest.mark.parametrize(("kind", "wanted"), [(kind, e) for kind, values in FREE_IMPACTS.items() for e in values])
def test_restitution_and_force_of_a_free_impact(kind, wanted):
    held = LINEAR if "contact_stiffness" in kind.parameters else HERTZ | {"impact_mass": IMPACT_MASS}
    law = kind(restitution=wanted, **{name: value for name, value in held.items() if name in kind.parameters})
    obtained, run = impact(law)
    due, force = FREE_IMPACTS[kind][wanted]
    # Forces of Kelvin-Voigt contacts jump at the first touch, those of Jankowski's have an infinite slope there: errors
    # are proportional to the step.
    assert obtained == pytest.approx(due, rel=1e-3 if "impact_mass" in kind.parameters else 3e-6)
    assert run["peak_spring_force"].sel(spring="contact").item() == pytest.approx(force, rel=4e-4)


def test_a_hertz_contact_has_the_penetration_of_its_closed_form():
    obtained, run = impact(laws.HertzContact(**HERTZ))
    assert obtained == pytest.approx(1.0, abs=1e-6)
    path = run["displacement"].isel(history=0)
    penetration = (path.sel(dof="1") - path.sel(dof="2")).max().item() - 0.02
    assert penetration == pytest.approx((5 * IMPACT_MASS / (4 * HERTZ["hertz_stiffness"])) ** 0.4, rel=3e-6)
    assert run["peak_spring_force"].sel(spring="contact").item() == pytest.approx(7883522.0, rel=3e-6)


@pytest.mark.parametrize("method", ["kutta3", "velocity_verlet", "nystroem4", "dormand_prince5"])
def test_other_methods_give_the_same_impact(method):
    obtained, _ = impact(laws.YeLiZhuContact(restitution=0.65, **HERTZ), method=method)
    assert obtained == pytest.approx(0.63033, rel=2e-5)


def test_the_speed_at_first_touch_of_each_contact_counts():
    # A mass that rebounds from a wall at 0.02 m again and again, each time at a lower speed.
    mass, stiffness, hertz, wall = 200e3, 200e3 * (2 * np.pi) ** 2, HERTZ["hertz_stiffness"], HERTZ["clearance"]
    factor = 8 * (1 - 0.65) / (5 * 0.65)

    def free(time, state):
        return [state[1], -stiffness * state[0] / mass]

    def pressed(time, state, touch):
        d = max(state[0] - wall, 0.0)
        return [state[1], -(stiffness * state[0] + hertz * d**1.5 * (1 + factor * state[1] / touch)) / mass]

    def crosses(time, state, *_):
        return state[0] - wall

    crosses.terminal = True
    time, state, is_free, starts = 0.0, [0.0, 1.0], True, []
    while time < 2.0:
        crosses.direction = 1 if is_free else -1
        arguments = {} if is_free else {"args": (state[1],)}
        starts += [] if is_free else [state[1]]
        found = solve_ivp(
            *(free if is_free else pressed, (time, 2.0), state), events=crosses, rtol=1e-11, atol=1e-13, **arguments
        )
        time, state, is_free = found.t[-1], found.y[:, -1], not is_free
    assert len(starts) == 3
    assert starts[2] < 0.5 * starts[0]
    springs = [
        wd.Spring("spring", {"1": 1.0}, stiffness=stiffness),
        wd.Spring("wall", {"1": 1.0}, law=laws.YeLiZhuContact(restitution=0.65, **HERTZ)),
    ]
    scene = wd.Scene(wd.LumpedStructure({"1": mass}, springs), wd.FreeVibration(2.0, 0.0, [1.0]), recorders=("spring",))
    run = wd.simulate(scene, step=1e-4, histories=wd.Histories([0]), **SETTINGS)
    for name, due in zip(("displacement", "velocity"), state, strict=True):
        assert run[name].sel(time=2.0, method="nearest").item() == pytest.approx(due, abs=2e-5 * starts[0])


def with_contact(law: laws.Contact) -> Case:
    """Return the case of two oscillators (L04) with another contact."""
    case = pounding()
    springs = [*case.structure.springs[:2], wd.Spring("contact", {"1": 1.0, "2": -1.0}, law=law)]
    masses = dict(zip("12", case.structure.parameters["mass"], strict=True))
    return Case(wd.LumpedStructure(masses, springs), pulse(6.0, 0.7, 0.4), {})


@pytest.mark.parametrize(
    ("kind", "peaks", "last"),
    [
        (
            laws.KelvinVoigtContactWithTension,
            (0.2151704, 0.07633299, 6931603.0, 43.25171, 15.53343),
            (-0.0315532, -0.00480048),
        ),
        (laws.KelvinVoigtContact, (0.2172359, 0.07639323, 6952900.0, 43.44379, 14.95033), (-0.0319216, -0.00481231)),
    ],
)
def test_pounding_of_two_oscillators_with_kelvin_voigt_contact(kind, peaks, last):
    law = kind(clearance=0.02, contact_stiffness=93.5e6, restitution=0.65, impact_mass=IMPACT_MASS)
    case = with_contact(law)
    run = wd.simulate(wd.Scene(case.structure, case.motion), step=1e-4, histories=wd.Histories([0]), **SETTINGS)
    found = [*run["peak_displacement"].values[0], run["peak_spring_force"].sel(spring="contact").item()]
    found += [*run["peak_acceleration"].values[0]]
    np.testing.assert_allclose(found, peaks, rtol=2e-3)
    np.testing.assert_allclose(
        run["displacement"].isel(history=0).sel(time=8.0, method="nearest"), last, atol=1e-3 * peaks[0]
    )


@pytest.mark.parametrize("step", [1e-3, 5e-4, 2.5e-4, 1.25e-4])
def test_errors_of_kelvin_voigt_contact_are_proportional_to_the_step(step):
    law = laws.KelvinVoigtContact(clearance=0.02, contact_stiffness=93.5e6, restitution=0.65, impact_mass=IMPACT_MASS)
    case = with_contact(law)
    run = wd.simulate(wd.Scene(case.structure, case.motion, recorders=("spring",)), step=step, **SETTINGS)
    force = run["peak_spring_force"].sel(spring="contact").item()
    assert force == pytest.approx(6952900.0, rel=1.5 * step)  # s


def test_contacts_act_beside_other_laws():
    # A yielding spring and two kinds of contact in one structure: each contact acts as if it were alone.
    springs = [
        wd.Spring("yielding", {"1": 1.0}, law="bilinear", stiffness=1.2e7, yield_force=3e5, hardening_ratio=0.05),
        wd.Spring("smooth", {"2": 1.0}, law="bouc_wen", stiffness=6e7, yield_force=5e5, hardening_ratio=0.05),
        wd.Spring("right", {"1": 1.0}, law=laws.YeLiZhuContact(restitution=0.65, **HERTZ)),
        wd.Spring("left", {"2": 1.0}, law=laws.KelvinVoigtContact(restitution=0.65, **LINEAR)),
    ]
    motion = pulse(6.0, 0.7, 0.4)
    both = wd.LumpedStructure({"1": 200e3, "2": 350e3}, springs)
    run = wd.simulate(wd.Scene(both, motion, recorders=("spring",)), step=1e-4, **SETTINGS)
    for dof, mass, own in (("1", 200e3, springs[::2]), ("2", 350e3, springs[1::2])):
        alone = wd.simulate(
            wd.Scene(wd.LumpedStructure({dof: mass}, own), motion, recorders=("spring",)), step=1e-4, **SETTINGS
        )
        for name in ("peak_spring_deformation", "peak_spring_force"):
            for spring in own:
                due = alone[name].sel(spring=spring.name).item()
                assert due > 0
                assert run[name].sel(spring=spring.name).item() == pytest.approx(due, rel=1e-10)


@pytest.mark.parametrize("kind", FREE_IMPACTS)
def test_energies_of_an_impact(kind):
    # The dashpot of the contact dissipates the kinetic energy that the rebound lacks.
    held = LINEAR if "contact_stiffness" in kind.parameters else HERTZ | {"impact_mass": IMPACT_MASS}
    law = kind(restitution=0.65, **{name: value for name, value in held.items() if name in kind.parameters})
    obtained, _ = impact(law)
    soft = (2 * np.pi / 2000) ** 2
    springs = [wd.Spring(name, {name: 1.0}, stiffness=mass * soft) for name, mass in zip("12", MASSES, strict=True)]
    springs.append(wd.Spring("contact", {"1": 1.0, "2": -1.0}, law=law))
    pair = wd.LumpedStructure(dict(zip("12", MASSES, strict=True)), springs)
    scene = wd.Scene(pair, wd.FreeVibration(0.3, 0.0, [1.0, 0.0]), recorders=("energy",))
    run = wd.simulate(scene, step=1e-4, **SETTINGS)
    lost = run["hysteretic_energy"].sel(spring="contact").item()
    assert lost == pytest.approx(0.5 * IMPACT_MASS * (1 - obtained**2), rel=3e-3)
    assert run["energy_balance_error"].item() < 2e-3


@pytest.mark.parametrize("kind", [*FREE_IMPACTS, laws.HertzContact])
def test_single_precision_gives_the_same_peaks(kind):
    held = LINEAR if "contact_stiffness" in kind.parameters else HERTZ | {"impact_mass": IMPACT_MASS}
    values = {name: value for name, value in (held | {"restitution": 0.65}).items() if name in kind.parameters}
    case = with_contact(kind(**values))
    scene = wd.Scene(case.structure, case.motion, recorders=("spring",))
    one, other = (wd.simulate(scene, step=1e-3, dtype=dtype, device="cpu") for dtype in ("float32", "float64"))
    for name in ("peak_spring_deformation", "peak_spring_force"):
        np.testing.assert_allclose(one[name], other[name], rtol=1e-3)


MISTAKES = {
    "unknown parameter": (
        lambda: wd.Spring("wall", {"1": 1.0}, law="ye_li_zhu_contact", restitution=0.6, stiffnes=1.0, **HERTZ),
        "spring 'wall': unknown parameter 'stiffnes'",
    ),
    "missing": (
        lambda: wd.Spring("wall", {"1": 1.0}, law="jankowski_contact", restitution=0.6, **HERTZ),
        "spring 'wall': impact_mass (mass of the impact, m1 m2 / (m1 + m2)) is missing",
    ),
    "restitution": (
        lambda: laws.YeLiZhuContact(restitution=65.0, **HERTZ),
        "restitution is 65; it must be finite and above 0 and at most 1; 65 % is 0.65",
    ),
    "stiffness": (
        lambda: wd.Spring("wall", {"1": 1.0}, law=laws.HertzContact(**HERTZ), stiffness=1e6),
        "spring 'wall': 'hertz_contact' takes no stiffness",
    ),
    "given twice": (
        lambda: wd.Spring("wall", {"1": 1.0}, law=laws.HertzContact(**HERTZ), clearance=0.1),
        "spring 'wall': clearance is given twice",
    ),
    "only a contact": (
        lambda: wd.LumpedStructure({"1": 1e5}, [wd.Spring("wall", {"1": 1.0}, law=laws.HertzContact(**HERTZ))]),
        "degree of freedom '1' can move freely",
    ),
    "storey": (
        lambda: wd.ShearBuilding(1e5, 1e7, 3.0, law="hertz_contact", **HERTZ),
        "'hertz_contact' is a contact, which only a Spring of a LumpedStructure can have",
    ),
    "device": (
        lambda: wd.ShearBuilding(1e5, 1e7, 3.0, devices=(laws.HertzContact(**HERTZ),)),
        "'hertz_contact' is a contact, which only a Spring of a LumpedStructure can have",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes(mistake):
    make, text = MISTAKES[mistake]
    with pytest.raises((ValueError, TypeError), match=re.escape(text)):
        make()
