"""Fingerprints of what stands around a run: scatter, sequences, portfolios, calibrations, spectra, fragility."""

from __future__ import annotations

import numpy as np
import xarray as xr
from fingerprint_face import (
    DAMPED,
    archetype,
    chain,
    dense,
    elastic,
    factor,
    fingerprint,
    folder,
    individual,
    listed,
    make_scene,
    motion,
    part_of_archetype,
    part_of_event,
    part_of_storeys,
    run,
    run_portfolio,
    sequence,
    spectra,
    spread,
    stripes,
    value,
)

import warpdyn as wd

# Scatter: every distribution, by building and by storey, correlated, by each way of sampling.

SCATTER = {
    "mass": factor(wd.Normal(1.0, 0.1)),
    "stiffness": factor(wd.Lognormal(1.0, 0.2), per="storey", storey_correlation=0.6),
    "yield_force": factor(wd.Lognormal.from_mean(1.1, 0.3), per="storey", storey_correlation=0.3),
    "height": value(wd.Uniform(2.8, 3.4)),
    "damping_ratio": value(wd.Uniform(0.02, 0.08)),
    "hardening_ratio": listed([0.07] * 37),
}
CORRELATION = {("stiffness", "yield_force"): 0.7, ("mass", "damping_ratio"): -0.4}
for sampling in ("monte_carlo", "latin_hypercube", "sobol"):

    @fingerprint(f"scatter/{sampling}", sampling)
    def drawn(sampling: str) -> xr.Dataset:
        rest = {"scatter": SCATTER, "correlation": CORRELATION, "sampling": sampling, "tail": 0.4}
        return run(make_scene(chain(3), motion(1, 6.0), **rest), 37, seed=11)


@fingerprint("scatter/listed")
def given() -> xr.Dataset:
    rows = {"stiffness": listed(np.linspace(3e5, 5e5, 15).reshape(5, 3)), "mass": listed([8e2, 9e2, 1e3, 1.1e3, 1.2e3])}
    scatter = rows | {"yield_force": value(wd.Normal(1500.0, 100.0))}
    return run(make_scene(chain(3), motion(1, 6.0), scatter=scatter, tail=0.4), 5, seed=11)


# Sequences of events.

LEVELS = {"mainshock": stripes(0.2, 0.7, 2.0), "aftershock": wd.Cloud([motion(5), motion(6, 6.0, 50)])}
DEGRADING = {
    "law": "ibarra_medina_krawinkler_peak_oriented",
    "hardening_ratio": None,
    "plastic_drift_to_capping": 0.015,
    "post_capping_drift": 0.08,
    "capping_force_ratio": 1.15,
    "strength_deterioration_drift": 0.3,
    "reloading_deterioration_drift": 0.3,
}
SHAKEN_TWICE = {
    "explicit": (chain(2), "rk4", "float64", None),
    "float32": (chain(2), "rk4", "float32", None),
    "implicit": (chain(2), "newmark_average", "float64", 1.0),
    "adaptive": (chain(2, law="bouc_wen"), "dormand_prince54", "float64", 1.0),
    "degrading": (chain(2, **DEGRADING), "velocity_verlet", "float64", 0.8),
    "leaning": (chain(2, hardening_ratio=0.02, gravity_load=[2e4, 3e4]), "rk4", "float32", 1.0),
}
for name, case in SHAKEN_TWICE.items():

    @fingerprint(f"sequence/{name}", *case)
    def shaken_twice(building, method: str, dtype: str, tail: float | None) -> dict[str, object]:
        """Some collapse in the first event already; every part is an ordinary run."""
        rest = {"scatter": spread("stiffness"), "collapse_drift_ratio": 0.02, "tail": tail}
        scene = make_scene(building, sequence(**LEVELS), **rest)
        share = None if method == "dormand_prince54" else 0.5
        whole = run(scene, 4, seed=2, method=method, dtype=dtype, checked_share=share)
        parts = {event: part_of_event(whole, event) for event in LEVELS}
        return {"whole": whole, **parts, "upper storey": part_of_storeys(whole, 2, 2)}


@fingerprint("sequence/of three events")
def shaken_thrice() -> dict[str, xr.Dataset]:
    drawn = individual([motion(7), motion(8)], scale=[1.5, 1.0, 2.0, 1.2, 1.8])
    last = individual([motion(7), motion(5)], measure=wd.CumulativeAbsoluteVelocity())
    scene = make_scene(chain(2, law="takeda"), sequence(first=drawn, second=stripes(0.3, 0.9), third=last), tail=0.5)
    whole = run(scene, 5, seed=2, checked_share=1.0)
    blocks = run(scene, 5, seed=2, memory=67_130_000, threads=2)
    with folder() as path, run(scene, 5, seed=2, path=path / "run.nc", memory=67_130_000) as found:
        file = found.load()
    return {"whole": whole, "second": part_of_event(whole, "second"), "blocks": blocks, "file": file}


# Portfolios.

TABLE = {"stiffness": listed(np.linspace(3e5, 6e5, 12).reshape(4, 3)), "mass": listed([8e2, 9e2, 1e3, 1.1e3])}
SMOOTH = {"law": "bouc_wen"}
STREET = wd.Portfolio(
    {
        "low": archetype(chain(1), 5, spread("stiffness") | {"damping_ratio": value(wd.Uniform(0.02, 0.08))}),
        "house": archetype(chain(2)),
        "table": archetype(chain(3), None, TABLE),
        "high": archetype(chain(3, hardening_ratio=0.1), 3, spread("mass", "stiffness"), {("mass", "stiffness"): 0.5}),
        "smooth": archetype(chain(2, **SMOOTH), 4, {"yield_force": factor(wd.Lognormal(1.0, 0.3))}),
        "linear": archetype(elastic(2), None, {"mass": listed([1e3, 2e3])}),
        "again": archetype(chain(2, stiffness=6e5), 2, {"yield_force": wd.GivenValues(np.full((2, 2), 1800.0))}),
    }
)
LIMITS = {"slight": 0.0015, "moderate": 0.004, "complete": 0.015}
OF_STREET = {"tail": 0.5, "collapse_drift_ratio": 0.03, "seed": 5}


@fingerprint("portfolio/stripes")
def street() -> dict[str, xr.Dataset]:
    whole = run_portfolio(STREET, stripes(0.2, 0.8), checked_share=1.0, **OF_STREET)
    shares = wd.damage_shares(whole, dict.fromkeys(STREET.archetypes, LIMITS))
    parts = {name: part_of_archetype(whole, name) for name in STREET.archetypes}
    return {"whole": whole, "shares": shares, **parts}


@fingerprint("portfolio/cloud")
def under_a_cloud() -> dict[str, xr.Dataset]:
    cloud = wd.Cloud([motion(seed, 6.0) for seed in (1, 2, 3, 4)])
    whole = run_portfolio(STREET, cloud, recorders=("drift",), dtype="float32", **OF_STREET)
    limits = dict.fromkeys(STREET.archetypes, LIMITS)
    shares = wd.damage_shares(whole, limits, events=["a", "a", "b", "b"])
    with folder() as path:
        settings = {"recorders": ("drift",), "dtype": "float32", "path": path / "run.nc", "memory": 67_112_000}
        with run_portfolio(STREET, cloud, **settings, **OF_STREET) as found:
            file = found.load()
    return {"whole": whole, "shares": shares, "file": file}


@fingerprint("portfolio/individual")
def each_its_own() -> xr.Dataset:
    count = STREET.buildings
    own = {"motion": np.arange(count) % 3, "scale": np.round(0.5 + 0.1 * np.arange(count), 3)}
    design = individual([motion(1), motion(2), motion(3)], **own)
    return run_portfolio(STREET, design, recorders=("drift",), dtype="float32", **OF_STREET)


@fingerprint("portfolio/hazus")
def hazus_street() -> dict[str, xr.Dataset]:
    kinds = {"houses": ("W1", "moderate", 1), "frames": ("C1L", "high", 2), "walls": ("URML", "pre", 2)}
    scatter = {"stiffness": factor(wd.Lognormal(1.0, 0.2))}
    buildings = {
        name: archetype(wd.ShearBuilding.from_hazus(*kind), 4, scatter if name == "houses" else {})
        for name, kind in kinds.items()
    }
    limits = {name: wd.hazus_drift_limits(*kind[:2]) for name, kind in kinds.items()}
    whole = run_portfolio(wd.Portfolio(buildings), stripes(0.3, 1.2), recorders=("drift",), tail=0.5)
    return {"whole": whole, "shares": wd.damage_shares(whole, limits)}


# Buildings from what is known of them.


def described(building: wd.ShearBuilding) -> dict[str, object]:
    modes = building.modal()
    return dict(building.parameters) | {"modes": modes, "table": wd.modal_table(modes)}


HAZUS = [("W1", "moderate", 1), ("C1M", "high", 5), ("S3", "low", 1), ("URML", "pre", 2), ("S1H", "moderate", 12)]


@fingerprint("calibration/from_hazus")
def from_hazus() -> dict[str, object]:
    return {
        f"{kind} {level} {storeys} {name}": part
        for kind, level, storeys in HAZUS
        for name, part in described(wd.ShearBuilding.from_hazus(kind, level, storeys=storeys)).items()
    } | {f"limits {kind} {level}": wd.hazus_drift_limits(kind, level) for kind, level, _ in HAZUS}


@fingerprint("calibration/from_capacity")
def from_capacity() -> dict[str, object]:
    displacement, force = np.array([0.0, 0.01, 0.02, 0.04, 0.08, 0.15]), 1e6 * np.array([0, 1.0, 1.7, 2.2, 2.5, 2.6])
    given = {"storeys": 4, "mass": 2e5, "height": 3.0}
    made = {}
    for distribution in ("triangular", "first_mode"):
        for curve, scale in (("pushover", 1.0), ("spectrum", 1 / 8e5)):
            how = {"curve": curve, "distribution": distribution} | given
            building = wd.ShearBuilding.from_capacity(displacement, scale * force, **how, **DAMPED)
            pushed = wd.pushover(building, np.round(np.linspace(0.002, 0.1, 50), 6), pattern="triangular")
            made |= {f"{distribution} {curve} {name}": part for name, part in described(building).items()}
            made |= {f"{distribution} {curve} pushed": pushed}
    return made


@fingerprint("calibration/from_periods")
def from_periods() -> dict[str, object]:
    given = {"storeys": 4, "mass": 2e5, "height": 3.0}
    uniform = wd.ShearBuilding.from_periods([0.60, 0.21], **given)
    linear = wd.ShearBuilding.from_periods(0.6, distribution="linear_mode", **given)
    leaning = wd.ShearBuilding.from_periods([0.6, 0.22, 0.14], gravity_load=2e6, **given)
    parts = {"uniform": uniform, "linear": linear, "leaning": leaning}
    return {f"{which} {name}": part for which, made in parts.items() for name, part in described(made).items()}


@fingerprint("calibration/modes")
def modes() -> dict[str, object]:
    parts = {"dense": dense(4).modal(), "chain": chain(5).modal(), "leaning": elastic(3, gravity_load=3e4).modal()}
    return parts | {f"table of {name}": wd.modal_table(part) for name, part in parts.items()}


# Motions.

MOTIONS = [motion(seed, 4.0, 60 + seed) for seed in range(1, 5)]


@fingerprint("motions/response_spectra")
def response_spectra() -> xr.Dataset:
    return spectra(MOTIONS, np.round(np.geomspace(0.01, 4.0, 40), 4), [0.0, 0.02, 0.05, 0.2])


@fingerprint("motions/intensity_measures")
def intensity_measures() -> dict[str, object]:
    measures = [
        wd.PeakGroundAcceleration(),
        wd.PeakGroundVelocity(),
        wd.PeakGroundDisplacement(),
        wd.AriasIntensity(),
        wd.CumulativeAbsoluteVelocity(),
        wd.SignificantDuration(),
        wd.SignificantDuration(0.1, 0.6),
        wd.SpectralAcceleration(0.4),
        wd.SpectralAcceleration(0.7, 0.1),
        wd.AverageSpectralAcceleration([0.2, 0.4, 0.9]),
    ]
    table = {"table": wd.intensity_measures(MOTIONS)}
    return table | {measure.name: measure.values(MOTIONS) for measure in measures}


# Fragility.


@fingerprint("fragility/of stripes")
def fragile() -> dict[str, xr.Dataset]:
    design = wd.Stripes(
        [motion(seed) for seed in range(1, 9)], [0.05, 0.15, 0.3, 0.5, 0.8], wd.SpectralAcceleration(0.5)
    )
    scatter = spread("stiffness", "yield_force", dispersion=0.3)
    scene = make_scene(chain(2), design, ("drift",), scatter=scatter, collapse_drift_ratio=0.02, tail=0.2)
    found = run(scene, 6, seed=9)
    limits = {"slight": 0.0012, "moderate": 0.003, "complete": 0.006}
    curves = wd.fragility(found, limits, seed=3)
    upper = wd.fragility(part_of_storeys(found, 2, 2), limits, confidence=0.9)
    return {"run": found, "curves": curves, "upper storey": upper}


@fingerprint("fragility/of damaged buildings")
def fragile_after() -> dict[str, xr.Dataset]:
    first = wd.Stripes([motion(seed) for seed in (1, 2)], [0.05, 0.15, 0.4], wd.PeakGroundAcceleration())
    second = wd.Stripes([motion(seed) for seed in (3, 4, 5)], [0.1, 0.3, 0.6, 1.2], wd.PeakGroundAcceleration())
    scene = make_scene(chain(2), sequence(first=first, second=second), scatter=spread("stiffness"), tail=0.4)
    found = run(scene, 3, seed=9, dtype="float32")
    parts = {name: part_of_event(found, name) for name in ("first", "second")}
    limits = {"slight": 0.005, "extensive": 0.012}
    curves = {f"{name} curves": wd.fragility(part, limits) for name, part in parts.items()}
    return parts | curves
