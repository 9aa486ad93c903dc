"""Mistakes in the settings and the evaluation of runs, in the form of `mistakes`."""

import numpy as np
import pandas as pd
from mistakes import PGA, RECORDS, building, demands, factor, portfolio, run, scaled, sequence

import warpdyn as wd

CITY = wd.Portfolio({"a": wd.Archetype(building())})
RUNS = {
    "step in ms": (lambda: run(settings={"step": 10.0}), "integration step", "is 10 s", "in ms", "0.01 s"),
    "step as a rate": (lambda: run(settings={"step": 100.0}), "integration step", "frequency in Hz"),
    "longest step in ms": (lambda: run(settings={"longest_step": 5.0}), "integration step", "is 5 s", "in ms"),
    "tail in ms": (lambda: run(tail=20000.0), "tail is 20000 s", "in ms", "20 s"),
    "drift ratio capacity in percent": (
        lambda: run(building(drift_ratio_capacity=2.0)),
        "collapse drift ratio at storey",
        "percent",
        "0.02",
    ),
    "drift capacity in mm": (lambda: run(building(drift_capacity=60.0)), "collapse drift ratio at storey"),
    "spectrum at periods in ms": (
        lambda: wd.response_spectra(RECORDS, [0.5, 440.0], device="cpu"),
        "period of the intensity measure or spectrum is 440 s",
        "ms",
    ),
    "collapse in percent": (lambda: run(collapse_drift_ratio=10.0), "collapse drift ratio is 10", "percent", "0.1"),
    "factor of a value": (
        lambda: run(scatter={"stiffness": factor(2e8, 0.2)}),
        "random factor of stiffness is",
        "RandomValue takes it",
    ),
    "factor in percent": (lambda: run(scatter={"mass": factor(100.0, 0.1)}), "random factor of mass", "in percent"),
    "dispersion in percent": (lambda: run(scatter={"mass": factor(1.0, 20.0)}), "random factor", "dispersion"),
    "coefficient of variation in percent": (
        lambda: run(scatter={"mass": wd.RandomFactor(wd.Lognormal.from_mean(1.0, 30.0))}),
        "random factor of mass",
        "dispersion or deviation given in percent",
    ),
    "uniform factor in percent": (
        lambda: run(scatter={"mass": wd.RandomFactor(wd.Uniform(80.0, 120.0))}),
        "random factor of mass",
        "in percent",
    ),
    "value of a factor": (
        lambda: run(scatter={"stiffness": wd.RandomValue(wd.Lognormal(1.0, 0.2))}),
        "random value over the nominal one of stiffness",
        "RandomFactor takes it",
    ),
    "value in tonnes": (
        lambda: run(scatter={"mass": wd.RandomValue(wd.Lognormal(200.0, 0.1))}),
        "random value over the nominal one of mass",
    ),
    "value that is no scatter": (
        lambda: run(scatter={"damping_ratio": 0.2}),
        TypeError,
        "scatter['damping_ratio'] must be RandomFactor, RandomValue, GivenValues or GivenFactors, got 0.2",
        "damping_ratio= of the structure",
        "RandomFactor(Lognormal(1.0, dispersion))",
    ),
    "table in tonnes": (
        lambda: run(scatter={"mass": wd.GivenValues([2e5, 200.0])}, settings={"structures": 2}),
        "first period",
        "mass given in tonnes",
    ),
    "a portfolio's height in mm": (
        lambda: run(portfolio(height=3200.0), wd.Cloud(RECORDS)),
        "storey height of archetype 'mistaken'",
        "in mm",
    ),
    "a portfolio's factor": (
        lambda: run(wd.Portfolio({"b": wd.Archetype(building(), 3, {"mass": factor(2e5, 0.1)})}), wd.Cloud(RECORDS)),
        "random factor of mass of archetype 'b'",
    ),
    "a sequence's levels": (
        lambda: run(None, sequence(RECORDS[0], wd.Stripes(RECORDS, [10, 20], PGA))),
        "intensity level of event 'aftershock' is 20 g",
    ),
    "plan": (lambda: wd.plan(wd.Scene(building(mass=200.0), RECORDS[0])), "first period", "tonnes"),
    "limits in percent": (
        lambda: wd.fragility(demands(), {"slight": 0.3}),
        "drift limit of 'slight'",
        "is 0.3",
        "percent",
    ),
    "a limit in mm": (lambda: wd.fragility(demands(), {"slight": 0.003, "severe": 30.0}), "'severe'", "drift in mm"),
    "limits of a portfolio in percent": (
        lambda: wd.damage_shares(city_run(), {"a": {"slight": 0.3}}),
        "drift limit of 'slight' of 'a'",
        "percent",
    ),
    "pushed in mm": (lambda: wd.pushover(building(), [0.0, 100.0]), "largest drift over height", "given in mm"),
    "sheared in mm": (lambda: wd.storey_hysteresis(building(), [0.0, 30.0]), "largest drift over height", "in mm"),
    "spectra of gal": (lambda: wd.response_spectra([scaled(100.0)], [1.0]), "peak ground acceleration", "gal"),
    "measures of ms": (lambda: wd.intensity_measures([scaled(1.0, 10.0)]), "record step", "in ms"),
    "measure's damping in percent": (
        lambda: wd.SpectralAcceleration(1.0, 5.0),
        ValueError,
        "damping_ratio",
        "not including 1, got 5",
    ),
    "no step": (lambda: run(settings={"step": -1.0}), ValueError, "step [s] must be a finite number above 0, got -1"),
    "confidence in percent": (
        lambda: wd.fragility(demands(), {"slight": 0.005}, confidence="95%"),
        ValueError,
        "confidence must be a number between 0 and 1, such as 0.95, got '95%'",
    ),
    "limits as a Series": (
        lambda: wd.fragility(demands(), pd.Series({"slight": 0.005})),
        ValueError,
        "as the dictionary {'slight': 0.005",
        "got Series",
    ),
    "fragility of a portfolio": (
        lambda: wd.fragility(city_run(missing=True), {"slight": 0.005}),
        ValueError,
        "a run of a portfolio",
        "select_archetype(run, name)",
        "'a'",
    ),
    "limits of another archetype": (
        lambda: wd.damage_shares(city_run(), {}),
        ValueError,
        "limits lack archetype 'a'",
    ),
    "distributions of one run": (
        lambda: wd.plots.drift_distributions(demands()),
        TypeError,
        "needs a mapping from the name of each design to a run",
        "got Dataset",
    ),
    "distributions of a list": (
        lambda: wd.plots.drift_distributions({"as it is": [0.01]}),
        TypeError,
        "design 'as it is' must be a Dataset, got list: give a run",
    ),
    "record of no path": (
        lambda: wd.records.read_at2(None),
        TypeError,
        "path must be the name of a file, got None",
    ),
    "no storeys": (lambda: building(stiffness=[]), ValueError, "stiffness is empty: it must be one value or one per"),
    "error in percent": (lambda: run(settings={"target_error": 1.0}), ValueError, "target_error", "below 1"),
    "share in percent": (lambda: run(settings={"checked_share": 5.0}), ValueError, "checked_share", "at most 1"),
    "impulse": (  # 5e9 N over the weight of 6e5 kg
        lambda: run(building(), wd.ForceHistory([[0.0, 0.0, 0.0], [0.0, 0.0, 5e9], [0.0, 0.0, 0.0]], 0.1)),
        "largest force over the weight is 849.764",
    ),
    "memory in GB": (lambda: run(settings={"memory": 0.5}), ValueError, "memory [bytes]"),
    "hardening in percent": (lambda: building(hardening_ratio=5.0), ValueError, "hardening_ratio is 5", "below 1"),
}


def city_run(missing=False):
    archetypes = {
        "archetype": ("archetype", np.array(["a"])),
        "archetype_index": ("sample", np.zeros(8, np.int32)),
        "building": ("sample", np.arange(8) % 4),
        "motion": ("motion", [0, 1]),
    }
    run = demands().assign_coords(archetypes)
    return run.where(run["sample"] < 4).assign(status=run["status"]) if missing else run
