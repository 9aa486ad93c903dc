"""Wrong units of buildings and excitations, each with text of its warning or error."""

import numpy as np
import xarray as xr

import warpdyn as wd

TIME = 0.01 * np.arange(1000)
RECORDS = [wd.GroundMotion(3.0 * np.sin((3 + i) * TIME) * np.exp(-TIME / 4), 0.01, f"record {i}") for i in range(3)]
PGA = wd.PeakGroundAcceleration()
LAW = {"law": "bilinear", "yield_force": [1.6e6, 1.3e6, 0.8e6], "hardening_ratio": 0.05}
DAMPED = {"damping": "rayleigh", "damping_ratio": 0.05}
G = 9.80665


def building(**changes):
    parameters = {"mass": 2.0e5, "stiffness": [2.4e8, 2.0e8, 1.4e8], "height": [4.0, 3.2, 3.2], **LAW, **DAMPED}
    return wd.ShearBuilding(**(parameters | changes))


def elastic(**changes):
    return wd.ShearBuilding(**({"mass": 2.0e5, "stiffness": [2.4e8, 2.0e8], "height": 3.2, **DAMPED} | changes))


def run(structure=None, excitation=RECORDS[0], settings=None, **scene):
    return wd.simulate(wd.Scene(structure or building(), excitation, **scene), **(settings or {}))


def scaled(factor, step=0.01):
    return wd.GroundMotion(factor * RECORDS[0].acceleration, step, "mistaken")


def shaking():
    """Return 30 s of an acceleration that leaves nearly no velocity behind [m/s2]."""
    time = 0.01 * np.arange(3000)
    return 2.7 * np.sin(9 * time) * (time / 3) ** 2 * np.exp(2 - time / 1.5)


def strong(*peaks):
    """Return motions of these peak accelerations [g]."""
    return [
        wd.GroundMotion(peak * G / 3 * np.roll(RECORDS[0].acceleration, i), 0.01, f"strong {i}")
        for i, peak in enumerate(peaks)
    ]


def capacity(displacement=(0.03, 0.30), shear=(2.0e6, 3.0e6), **changes):
    given = {"storeys": 4, "mass": 2.0e5, "height": 3.0} | changes
    return wd.ShearBuilding.from_capacity(displacement, shear, **given)


def demands():
    """Return a run on two stripes, for `fragility` and `damage_shares`."""
    flags = {
        "flag_values": np.arange(5, dtype=np.int8),
        "flag_meanings": "ok collapsed diverged unstable_step not_converged",
    }
    along = {
        "peak_storey_drift_ratio": (("sample", "storey"), np.full((8, 1), 0.01)),
        "status": ("sample", np.zeros(8, np.int8), flags),
    }
    coordinates = {
        "motion_index": ("sample", np.repeat([0, 1], 4)),
        "im_level": ("sample", np.tile([0.1, 0.2], 4), {"design": "stripes", "units": "g"}),
        "storey": [1],
    }
    return xr.Dataset(along, coordinates)


def portfolio(**changes):
    return wd.Portfolio({"sound": wd.Archetype(building()), "mistaken": wd.Archetype(building(**changes))})


def imk(**changes):
    given = {"yield_force": 1.6e6, "plastic_drift_to_capping": 0.06, "post_capping_drift": 0.2}
    given |= {"capping_force_ratio": 1.1} | changes
    law = "ibarra_medina_krawinkler_bilinear"
    return wd.ShearBuilding(2.0e5, [2.4e8, 2.0e8, 1.4e8], 3.2, law=law, **given, **DAMPED)


def factor(*distribution):
    return wd.RandomFactor(wd.Lognormal(*distribution))


def sequence(first, second):
    return wd.EventSequence({"mainshock": first, "aftershock": second})


UNIT_LAW = LAW | {"yield_force": 1.0}
TALL = {"mass": 2e5, "stiffness": [3e8] * 10, "height": 3.2, **DAMPED}
# A call with a mistake, the quantity that the message names, and more text of the message: the value in the unit in
# which it was read, and the likely mistake.
BUILDINGS = {
    "height in mm": (lambda: run(building(height=3200.0)), "storey height", "3200 m", "in mm", "3.2 m"),
    "height in cm": (lambda: run(building(height=320.0)), "storey height", "320 m", "in cm", "3.2 m"),
    "height in feet": (lambda: run(building(height=[13.0, 40.0, 13.0])), "storey height at storey 2", "in feet"),
    "height in km": (lambda: run(building(height=0.0032)), "storey height", "0.0032 m"),
    "mass in tonnes": (lambda: run(building(mass=200.0)), "first period", "0.0138", "mass given in tonnes"),
    "mass in tonnes, elastic": (lambda: run(elastic(mass=200.0)), "first period", "mass given in tonnes"),
    "mass in tonnes, tall": (lambda: run(elastic(**TALL | {"mass": 200.0})), "first period over height", "tonnes"),
    "mass as a weight in kN": (lambda: run(building(mass=1961.0)), "first period over height", "kN of weight"),
    "mass in tonnes, one storey": (
        lambda: run(wd.ShearBuilding(0.1, 400.0 * 100, 3.0, **DAMPED)),
        "first period",
        "0.00993",
    ),
    "stiffness in kN/m": (lambda: run(building(stiffness=2e5)), "first period over height", "stiffness given in kN/m"),
    "stiffness in N/mm": (lambda: run(elastic(stiffness=[2.4e5] * 2)), "first period over height", "or N/mm"),
    "stiffness in kN/mm": (lambda: run(building(stiffness=[240.0, 200.0, 140.0])), "first period", "kN/mm or MN/m"),
    "stiffness in MN/m, one storey": (lambda: run(wd.ShearBuilding(2e5, 50.0, 3.0, **DAMPED)), "first period", "MN/m"),
    "yield force in kN": (lambda: run(building(yield_force=1600.0)), "yield drift ratio", "yield_force given in kN"),
    "yield force in MN": (lambda: run(building(yield_force=1.6)), "yield drift ratio", "yield_force given in MN"),
    "yield force in tonnes": (lambda: run(building(yield_force=160.0)), "yield drift ratio", "in tonnes"),
    "yield force of one storey in kN": (
        lambda: run(building(yield_force=[1.6e6, 1300.0, 0.8e6])),
        "yield drift ratio at storey 2",
        "in kN",
    ),
    "Bouc-Wen's yield force in kN": (
        lambda: run(building(law="bouc_wen", yield_force=1600.0)),
        "yield drift ratio",
        "in kN",
    ),
    "one floor in tonnes": (
        lambda: run(building(mass=[2e5, 200.0, 2e5])),
        "mass of a floor over that of a neighbouring one is 1000",
        "with one given in tonnes",
    ),
    "roof as a weight in kN": (
        lambda: run(building(mass=[2e5, 2e5, 1961.0])),
        "mass of a floor over that of a neighbouring one is 101.9",
        "with one given in kN of weight",
    ),
    "one storey in kN/m": (
        lambda: run(elastic(**TALL | {"stiffness": [3e8] * 9 + [2e5]})),
        "stiffness of a storey over that of a neighbouring one is 1500",
        "with one given in kN/m",
    ),
    "one gravity load in kN": (
        lambda: run(building(gravity_load=[2e6, 2e3, 2e6])),
        "gravity load on a storey over that on a neighbouring one is 1000",
        "with one given in kN",
    ),
    "gravity in kN": (lambda: run(building(gravity_load=1961.0)), "gravity load over mass", "gravity_load given in kN"),
    "gravity in MN": (lambda: run(building(gravity_load=1.961)), "gravity load over mass", "gravity_load given in MN"),
    "gravity as mass": (lambda: run(building(gravity_load=2e4)), "gravity load over mass", "gravity_load given in kg"),
    "gravity in tonnes": (lambda: run(building(gravity_load=200.0)), "gravity load over mass", "in tonnes"),
    "P-Delta of nothing": (
        lambda: run(building(gravity_load=1961.0)),
        "P-Delta coefficient",
        "gravity_load given in kN",
    ),
    "damping in percent": (lambda: building(damping_ratio=5.0), ValueError, "damping_ratio is 5", "5 % is 0.05"),
    "damping of half a percent": (lambda: run(building(damping_ratio=0.5)), "damping ratio", "is 0.5", "in percent"),
    "damping of nearly nothing": (lambda: run(building(damping_ratio=5e-5)), "damping ratio", "5e-05"),
    "damping left out": (
        lambda: run(wd.ShearBuilding(2e5, 2e8, 3.2)),
        "damping ratio",
        "damping='none' is the default",
    ),
    "damping of a system left out": (
        lambda: run(wd.LinearSystem([2e5], [[0.0]], [[2e8]])),
        "damping ratio",
        "is 0 ",
    ),
    "dashpots in kN s/m": (
        lambda: run(dashpots(200.0)),
        "damping ratio",
        "kN s/m",
    ),
    "dashpots far too strong": (lambda: run(dashpots(2e8)), "damping ratio of the first mode"),
    "system in tonnes": (lambda: run(wd.LinearSystem([200.0], [[1e5]], [[2e8]])), "first period", "tonnes"),
    "system in kN/mm": (lambda: run(wd.LinearSystem([2e5], [[1.0]], [[200.0]])), "first period", "kN/mm"),
    "capping drift in mm": (lambda: run(imk(plastic_drift_to_capping=60.0)), "plastic drift to capping", "in mm"),
    "slip force in kN": (
        lambda: run(building(devices=("friction_damper",), slip_force=300.0, brace_stiffness=1e8)),
        "slip force",
        "in kN",
    ),
    "damper coefficient in kN s/m": (
        # In proportion b to the stiffnesses they add b omega / 2, with omega = 14.359 rad/s and b = 2e-5 s.
        lambda: run(building(devices=("viscous_damper",), damper_coefficient=[4800.0, 4000.0, 2800.0])),
        "damping ratio that the viscous dampers add to the first mode is 0.00014359",
        "damper_coefficient given in kN s/m, it would be 0.144",
    ),
    "damper coefficient in MN s/m": (
        lambda: run(building(devices=("viscous_damper",), damper_coefficient=[4.0, 4.0, 0.0])),
        "damping ratio that the viscous dampers add to the first mode",
        "damper_coefficient given in MN s/m",
    ),
    "coefficient of a power of the velocity in kN": (
        lambda: run(building(devices=("viscous_damper",), damper_coefficient=[400.0, 0, 0], velocity_exponent=0.4)),
        "force of a viscous damper at 1 m/s over the weight above at storey 1 is 6.798",  # e-5, of 5.884 MN
        "damper_coefficient given in kN (s/m)^exponent, it would be 0.068",
    ),
    "gap in mm": (
        lambda: run(building(devices=("gap",), clearance=50.0, contact_stiffness=1e9)),
        "clearance over storey height",
        "clearance given in mm",
    ),
    "isolators' capacity in mm": (
        lambda: run(building().on_isolators(**ISOLATORS | {"displacement_capacity": 500.0})),
        "displacement capacity at storey 1 is 500 m",
        "in mm",
    ),
    "periods in ms": (
        lambda: run(wd.ShearBuilding.from_periods([600.0], 4, 2e5, 3.0, **DAMPED)),
        "first period is 600 s",
        "given in ms",
    ),
    "capacity in mm and kN": (
        lambda: capacity((30.0, 300.0), (2e3, 3e3)),
        "first period of the chain",
        "572",
        "mm and capacity in kN",
    ),
    "capacity displacement in mm": (lambda: capacity((30.0, 300.0)), "yield drift ratio", "displacement given in mm"),
    "capacity in kN": (lambda: capacity(shear=(2e3, 3e3)), "strength of this capacity curve", "capacity given in kN"),
    "capacity of a height in mm": (lambda: capacity(height=3000.0), "yield drift ratio", "height given in mm"),
}
ISOLATORS = {
    "law": "lead_rubber_bearing",
    "base_mass": 2e5,
    "displacement_capacity": 0.5,
    "stiffness": 7.6e7,
    "yield_force": 5.8e5,
    "post_yield_stiffness": 7.6e6,
}


def dashpots(coefficient):
    return wd.ShearBuilding(2e5, [2.4e8, 2.0e8], 3.2, damping="storey", damping_coefficient=coefficient)


SHAKEN = {
    "records in g": (lambda: run(None, scaled(1 / G)), "strongest motion", "m/s2", "given in g, it would be"),
    "records in m/s2 read as g": (
        lambda: run(None, scaled(G)),
        "peak ground acceleration",
        "if given in m/s2 and read as g, it would be",
    ),
    "motion of nothing": (lambda: run(None, scaled(0.0)), "strongest motion is 0 m/s2", "it is zero in any unit"),
    "records in gal": (lambda: run(None, scaled(100.0)), "peak ground acceleration", "gal"),
    "records in mm/s2": (lambda: run(None, scaled(1000.0)), "peak ground acceleration", "mm/s2"),
    "records in g of a portfolio": (lambda: run(portfolio(), wd.Cloud([scaled(1 / G)])), "strongest motion", "in g"),
    "records in g of a sequence": (
        lambda: run(None, sequence(scaled(1 / G), scaled(1 / G))),
        "strongest motion",
        "in g",
    ),
    "records divided by g": (lambda: run(None, scaled(1e-5)), "peak ground acceleration", "m/s2"),
    "records in g, scaled": (
        lambda: run(None, wd.OneMotionPerStructure([scaled(1 / G)], scale=0.5)),
        "strongest motion",
        "given in g",
    ),
    "records in g on stripes": (
        lambda: run(None, wd.Stripes([scaled(1 / G)], [0.2, 0.5, 0.8], PGA)),
        "scale factor",
        "motions given in g",
    ),
    "one record in g": (
        lambda: run(None, wd.Cloud([*strong(0.3, 0.5, 0.4, 0.8, 0.35), scaled(1 / G)])),
        "over that of the next stronger motion of the set of motion 'mistaken' is",
        "given in g among motions in m/s2",
    ),
    "one record in g, scaled": (
        lambda: run(None, wd.OneMotionPerStructure([*strong(0.3, 0.5, 0.4, 0.8, 0.35), scaled(1 / G)])),
        "motion 'mistaken'",
        "given in g",
    ),
    "one record in g, measured": (
        lambda: wd.intensity_measures([*strong(0.3, 0.5, 0.4, 0.8, 0.35), scaled(1 / G)]),
        "motion 'mistaken'",
        "given in g",
    ),
    "record with an offset": (
        lambda: run(None, wd.GroundMotion(shaking() + 0.3, 0.01, "raw")),
        "baseline (a straight line fitted to the record) over the peak of motion 0 ('raw') is 0.1",
        "warpdyn.records.detrend",
    ),
    "record with a trend": (
        lambda: wd.response_spectra([wd.GroundMotion(shaking() + np.linspace(-0.5, 0.5, 3000), 0.01)], [1.0]),
        "baseline",
        "detrend",
    ),
    "ground's damping in percent": (
        lambda: run(None, wd.FilteredNoise(wd.KanaiTajimi(0.01, 15.0, 60.0), 20.0, 0.02)),
        "damping ratio of the filter (ground_damping_ratio) of the noise is 60",
        "given in percent, it would be 0.6",
    ),
    "filter's damping in percent": (
        lambda: run(None, wd.FilteredNoise(wd.CloughPenzien(0.01, 15.0, 0.6, 1.5, 60.0), 20.0, 0.02)),
        "damping ratio of the filter (filter_damping_ratio) of the noise is 60",
        "percent",
    ),
    "harmonic force in kN": (
        lambda: run(elastic(), wd.HarmonicForce([0.0, 800.0], 6.0, 5.0)),
        "static drift ratio under the largest force",
        "the force given in kN",
    ),
    "force history in kN": (
        lambda: run(elastic(), wd.ForceHistory(np.full((9, 2), 500.0), 0.1)),
        "static drift ratio under the largest force",
        "the force given in kN",
    ),
    "step of a record in ms": (lambda: run(None, scaled(1.0, 10.0)), "record step", "10 s", "in ms", "0.01 s"),
    "step of a record as a rate": (lambda: run(None, scaled(1.0, 200.0)), "record step", "200 s", "frequency in Hz"),
    "step of a record in us": (lambda: run(None, scaled(1.0, 1e-5)), "record step", "1e-05 s"),
    "levels in m/s2": (lambda: run(None, wd.Stripes(RECORDS, [2, 4, 8, 16], PGA)), "intensity level is 16 g", "m/s2"),
    "levels in percent": (lambda: run(None, wd.Stripes(RECORDS, [10, 20, 40], PGA)), "intensity level is 40 g", "% g"),
    "levels in gal": (lambda: run(None, wd.Stripes(RECORDS, [100, 200], PGA)), "intensity level is 200 g", "gal"),
    "velocities in cm/s": (
        lambda: run(None, wd.Stripes(RECORDS, [5, 30, 90], wd.PeakGroundVelocity())),
        "level of the peak ground velocity is 90 m/s",
        "given in cm/s, it would be 0.9 m/s",
        "lowest level of the peak ground velocity is 5 m/s",
    ),
    "one velocity in cm/s": (
        lambda: run(None, wd.Stripes(RECORDS, [30], wd.PeakGroundVelocity())),
        "level of the peak ground velocity is 30 m/s",
    ),
    "displacements in mm": (
        lambda: run(None, wd.Stripes(RECORDS, [50, 200, 800], wd.PeakGroundDisplacement())),
        "level of the peak ground displacement is 800 m",
        "given in mm, it would be 0.8 m",
    ),
    "Arias intensities in cm/s": (
        lambda: run(None, wd.Stripes(RECORDS, [30, 100, 600], wd.AriasIntensity())),
        "level of the Arias intensity is 600 m/s",
        "given in cm/s, it would be 6 m/s",
    ),
    "absolute velocities in cm/s": (
        lambda: run(None, wd.Stripes(RECORDS, [200, 1000], wd.CumulativeAbsoluteVelocity())),
        "level of the cumulative absolute velocity is 1000 m/s",
        "given in cm/s, it would be 10 m/s",
    ),
    "motions in g on levels of a velocity": (
        lambda: run(None, wd.Stripes(strong(0.005, 0.01), [0.5, 1.0], wd.PeakGroundVelocity())),
        "median scale factor",
        "motions given in g",
    ),
    "levels that begin high": (
        lambda: run(None, wd.Stripes(RECORDS, [2.0, 3.0], PGA)),
        "lowest intensity level",
        "m/s2",
    ),
    "scale in percent": (
        lambda: run(None, wd.OneMotionPerStructure(RECORDS, scale=100.0)),
        "scale factor",
        "scale given in percent",
    ),
    "scales of a million": (
        lambda: run(None, wd.Stripes([scaled(1e-6)], [0.3], PGA)),
        "median scale factor is 1.1",
    ),
    "noise in gal": (lambda: run(None, noise(100.0)), "peak ground acceleration of the noise", "gal"),
    "interval of the noise in ms": (lambda: run(None, noise(0.01, 10.0)), "record step of the noise is 10 s", "in ms"),
    "measure's period in ms": (
        lambda: run(None, wd.Cloud(RECORDS, Measured(600.0))),
        "period of the intensity measure",
        "600 s",
        "in ms",
    ),
    "initial displacement in mm": (
        lambda: run(elastic(), wd.FreeVibration(5.0, displacement=[10.0, 20.0])),
        "initial drift ratio",
        "displacement given in mm",
    ),
    "initial velocity in mm/s": (
        lambda: run(elastic(), wd.FreeVibration(5.0, velocity=500.0)),
        "initial velocity",
        "mm/s",
    ),
    "force in kN": (
        lambda: run(elastic(), wd.HarmonicForce([1.0, 1.0], 6.0, 5.0)),
        "largest force over the weight",
        "force given in kN",
    ),
    "step of forces in ms": (
        lambda: run(elastic(), wd.ForceHistory(np.full((9, 2), 1e4), 10.0)),
        "record step of the force history",
        "in ms",
    ),
}


class Measured(wd.SpectralAcceleration):
    """A spectral acceleration that is computed without a kernel."""

    def values(self, motions):
        return np.ones(len(motions))


def noise(times, interval=0.02):
    return wd.FilteredNoise(wd.KanaiTajimi(0.01 * times**2, 15.0, 0.6), 20.0, interval)
