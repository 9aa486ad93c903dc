"""Valid calls of public functions and methods: the function and its arguments, all by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from docstring_files import write_files

import warpdyn as wd

Call = tuple[Callable[..., Any], dict[str, Any]]

TIME = 0.02 * np.arange(200)
WAVE = 2.5 * np.sin(7 * TIME) * np.exp(-(((TIME - 2) / 1.2) ** 2))
OF_BUILDING = {"mass": [1e5, 1e5], "stiffness": [4e7, 3e7], "height": [3.0, 3.0], "law": "bilinear"}
OF_BUILDING |= {"yield_force": [3e5, 2e5], "hardening_ratio": 0.05, "damping": "rayleigh", "damping_ratio": 0.05}
LIMITS, RATIOS = {"slight": 0.005, "complete": 0.015}, {"slight": 0.05, "complete": 1.0}


def motions() -> list[wd.GroundMotion]:
    """Return four motions."""
    return [wd.GroundMotion((1 + 0.2 * i) * np.roll(WAVE, i), 0.02, f"wave {i}") for i in range(4)]


def shakemap(*, path: str) -> Any:
    """Read a ShakeMap, with its path by name."""
    return wd.sites.read_shakemap(path)


def margin(normals: np.ndarray) -> np.ndarray:
    """Return a limit-state function of standard normal values."""
    values: np.ndarray = 3.0 - normals.sum(axis=1)
    return values


def without_runs(folder: Path) -> dict[str, Call]:
    """Return calls that compile nothing; they read files that `write_files` writes."""
    write_files(folder)
    waves, building = motions(), wd.ShearBuilding(**OF_BUILDING)
    pga = wd.PeakGroundAcceleration()
    hazard = wd.HazardCurve([0.05, 0.2, 1.0, 4.0], [2e-2, 3e-3, 1e-4, 5e-7], measure="PGA")
    table = pd.DataFrame({"id": ["a", "b"], "longitude": [-122.3, -122.2], "latitude": [37.8, 37.8]})
    table = table.assign(structure_type=["W1", "C1L"], storeys=[2, 2], year=[1990, 1960], replacement_cost=[3e5, 2e6])
    inventory = wd.inventories.from_table(table)
    stock = wd.inventories.portfolio(inventory)
    system = {"mass": np.diag([2.0, 1.0]), "damping": np.eye(2), "stiffness": np.array([[300.0, -100], [-100, 100]])}
    field = wd.sites.read_shakemap(str(folder / "grid.xml"))["PGA"]
    pairs = [
        wd.GroundMotion(w.acceleration, 0.02, f"r{i}{c}", "", f"r{i}", c) for i, w in enumerate(waves) for c in "NE"
    ]
    grid = wd.sites.scale_records(field, waves)
    exact = {"mass": [2.0, 1.0], "stiffness": [300.0, 100.0], "yield_force": [2.0, 1.0], "damping": 0.1 * np.eye(2)}
    exact |= {"force": np.ones((5, 2)), "step": 0.01, "initial_velocity": 0.0}
    over_stock = {"limits": LIMITS, "demand": "peak_storey_drift_ratio", "over": ("motion",), "each_place": False}
    spectrum = wd.KanaiTajimi(0.01, 15.0, 0.6)
    isolators = {"law": "lead_rubber_bearing", "base_mass": 1e5, "displacement_capacity": 0.4, "stiffness": 1.2e7}
    isolators |= {"yield_force": 1.2e5, "post_yield_stiffness": 1.2e6, "damper_coefficient": 0.0}
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    rare = {"limit_state": margin, "variables": 2, "samples": 200, "confidence": 0.9, "seed": 1}
    return {
        "subset_simulation": (wd.subset_simulation, rare | {"level_probability": 0.2}),
        "importance_sampling": (wd.importance_sampling, rare | {"centres": [[1.5, 1.5]]}),
        "GroundMotion": (wd.GroundMotion, {"acceleration": WAVE, "step": 0.02, "name": "a", "component": "N"}),
        "GroundMotion.resampled": (waves[0].resampled, {"step": 0.01}),
        "ShearBuilding": (wd.ShearBuilding, OF_BUILDING | {"gravity_load": [1e6, 1e6], "drift_capacity": [0.3, 0.3]}),
        "ShearBuilding of devices": (
            wd.ShearBuilding,
            OF_BUILDING
            | {"devices": ["gap", "viscous_damper"], "clearance": 0.05, "contact_stiffness": 1e8}
            | {"damper_coefficient": 2e6, "damping_modes": (1, 2)},
        ),
        "ShearBuilding.from_hazus": (
            wd.ShearBuilding.from_hazus,
            {"building_type": "C1M", "design_level": "high", "storeys": 5, "floor_area": 800.0},
        ),
        "ShearBuilding.from_capacity": (
            wd.ShearBuilding.from_capacity,
            {"displacement": [0.03, 0.3], "capacity": [2e6, 3e6], "storeys": 4, "mass": 2e5, "height": 3.0},
        ),
        "ShearBuilding.from_periods": (
            wd.ShearBuilding.from_periods,
            {"period": [0.6], "storeys": 4, "mass": 2e5, "height": 3.0, "distribution": "uniform"},
        ),
        "ShearBuilding.on_isolators": (building.on_isolators, isolators),
        "ShearBuilding.with_tuned_mass_damper": (
            building.with_tuned_mass_damper,
            {"mass_ratio": 0.02, "frequency_ratio": 0.98, "damping_ratio": 0.1, "displacement_capacity": 1.0},
        ),
        "LinearSystem": (wd.LinearSystem, system | {"influence": [1.0, 1.0]}),
        "modal_table": (wd.modal_table, {"modes": building.modal()}),
        "hazus_drift_limits": (wd.hazus_drift_limits, {"building_type": "C1M", "design_level": "high"}),
        "laws.Bilinear": (wd.laws.Bilinear, {"yield_force": [3e5, 2e5], "hardening_ratio": 0.05}),
        "laws.BoucWen": (
            wd.laws.BoucWen,
            {"yield_force": 3e5, "hardening_ratio": 0.05, "beta": 0.5, "gamma": 0.5, "exponent": 2.0},
        ),
        "laws.Takeda": (wd.laws.Takeda, {"yield_force": 3e5, "hardening_ratio": 0.05, "unloading_exponent": 0.4}),
        "laws.FrictionPendulum": (
            wd.laws.FrictionPendulum,
            {"friction_coefficient": 0.05, "radius": 2.0, "weight": 3e6},
        ),
        "laws.ViscousDamper": (wd.laws.ViscousDamper, {"damper_coefficient": 2e6, "velocity_exponent": 0.4}),
        "laws.Gap": (wd.laws.Gap, {"clearance": 0.05, "contact_stiffness": 1e8, "restitution": 0.6}),
        "laws.Parameter": (
            wd.laws.Parameter,
            {"units": "N", "long_name": "force", "low": 0.0, "high": 9.0, "low_open": True},
        ),
        "Lognormal": (wd.Lognormal, {"median": 1.0, "dispersion": 0.3}),
        "Lognormal.from_mean": (wd.Lognormal.from_mean, {"mean": 1.0, "cov": 0.3}),
        "Normal": (wd.Normal, {"mean": 1.0, "standard_deviation": 0.2}),
        "Uniform": (wd.Uniform, {"low": 0.5, "high": 1.5}),
        "FilteredIncrementalVelocity": (
            wd.FilteredIncrementalVelocity,
            {"period": 0.5, "alpha": 0.7, "beta": 0.85},
        ),
        "Truncated": (wd.Truncated, {"distribution": wd.Normal(1.0, 0.2), "low": 0.5, "high": 1.5}),
        "Empirical": (wd.Empirical, {"values": [0.9, 1.0, 1.2]}),
        "RandomFactor": (
            wd.RandomFactor,
            {"distribution": wd.Normal(1.0, 0.2), "per": "storey", "storey_correlation": 0.5},
        ),
        "RandomValue": (wd.RandomValue, {"distribution": wd.Uniform(0.02, 0.05), "per": "building"}),
        "GivenValues": (wd.GivenValues, {"values": [3e5, 2e5]}),
        "GivenFactors": (wd.GivenFactors, {"values": [1.1, 0.9]}),
        "Archetype": (wd.Archetype, {"building": building, "count": 3, "scatter": scatter, "correlation": {}}),
        "Portfolio": (wd.Portfolio, {"archetypes": {"a": wd.Archetype(building, 3)}}),
        "Scene": (
            wd.Scene,
            {"structure": building, "excitation": wd.Cloud(waves), "scatter": scatter, "correlation": {}}
            | {"sampling": "sobol", "recorders": ("drift",), "collapse_drift_ratio": 0.1, "tail": 2.0, "title": "a"},
        ),
        "Scene.from_json": (
            wd.Scene.from_json,
            {"text": wd.Scene(building, wd.Cloud(waves)).to_json(), "motions": waves},
        ),
        "Cloud": (wd.Cloud, {"motions": waves, "measure": pga}),
        "Stripes": (
            wd.Stripes,
            {"motions": waves, "levels": [0.1, 0.3], "measure": pga, "structures_per_motion": 2},
        ),
        "OneMotionPerStructure": (
            wd.OneMotionPerStructure,
            {"motions": waves, "motion": [0, 1, 2], "scale": [1.0, 1.2, 0.8], "measure": pga},
        ),
        "MotionsAtSites": (
            wd.MotionsAtSites,
            {"motions": waves, "motion": [[[0]], [[1]]], "scale": 1.0, "site": [[0, 0], [1, 1]], "names": ["q"]},
        ),
        "EventSequence": (wd.EventSequence, {"events": {"first": wd.Cloud(waves), "second": wd.Cloud(waves[:2])}}),
        "WhiteNoise": (wd.WhiteNoise, {"intensity": 0.01}),
        "KanaiTajimi": (
            wd.KanaiTajimi,
            {"intensity": 0.01, "ground_frequency": 15.0, "ground_damping_ratio": 0.6},
        ),
        "KanaiTajimi.spectral_density": (spectrum.spectral_density, {"circular_frequency": [5.0, 10.0]}),
        "CloughPenzien": (
            wd.CloughPenzien,
            {"intensity": 0.01, "ground_frequency": 15.0, "ground_damping_ratio": 0.6}
            | {"filter_frequency": 1.5, "filter_damping_ratio": 0.6},
        ),
        "JenningsEnvelope": (wd.JenningsEnvelope, {"rise": 2.0, "strong": 4.0, "decay": 0.5}),
        "JenningsEnvelope.at": (wd.JenningsEnvelope(2.0, 4.0, 0.5).at, {"time": [1.0, 3.0]}),
        "FilteredNoise": (
            wd.FilteredNoise,
            {"spectrum": spectrum, "duration": 5.0, "interval": 0.02, "envelope": wd.JenningsEnvelope(1, 2, 1)},
        ),
        "FilteredNoise.motion": (wd.FilteredNoise(spectrum, 5.0, 0.02).motion, {"sample": 3, "seed": 1}),
        "HarmonicForce": (
            wd.HarmonicForce,
            {"amplitude": [0.0, 2e3], "circular_frequency": 20.0, "duration": 5.0, "phase": 0.1},
        ),
        "ForceHistory": (wd.ForceHistory, {"force": [[0.0, 0.0], [1e4, 2e4]], "step": 0.1}),
        "FreeVibration": (wd.FreeVibration, {"duration": 2.0, "displacement": [0.0, 0.0], "velocity": [0.0, 0.5]}),
        "SpectralAcceleration": (wd.SpectralAcceleration, {"period": 0.5, "damping_ratio": 0.05}),
        "AverageSpectralAcceleration": (
            wd.AverageSpectralAcceleration,
            {"periods": [0.2, 0.5, 1.0], "damping_ratio": 0.05},
        ),
        "SignificantDuration": (wd.SignificantDuration, {"start": 0.05, "end": 0.95}),
        "RotatedSpectralAcceleration": (
            wd.RotatedSpectralAcceleration,
            {"period": 0.5, "damping_ratio": 0.05, "percentile": 50.0},
        ),
        "GeometricMean": (wd.GeometricMean, {"measure": pga}),
        "LargerComponent": (wd.LargerComponent, {"measure": pga}),
        "Histories": (wd.Histories, {"samples": [0, 3], "every": 2}),
        "HazardCurve": (
            wd.HazardCurve,
            {"intensity": [0.1, 0.3, 1.0], "annual_rate": [1e-2, 1e-3, 5e-5], "measure": "PGA", "units": "g"},
        ),
        "HazardCurve.from_probabilities": (
            wd.HazardCurve.from_probabilities,
            {"intensity": [0.1, 0.5], "probability": [0.39, 0.02], "years": 50, "measure": "PGA", "units": "g"},
        ),
        "HazardCurve.from_openquake_csv": (
            wd.HazardCurve.from_openquake_csv,
            {"path": str(folder / "hazard_curve-mean-PGA_1.csv"), "site": (-122.4, 37.8)},
        ),
        "HazardCurve.from_usgs": (
            wd.HazardCurve.from_usgs,
            {"path": str(folder / "hazard.json"), "measure": "PGA"},
        ),
        "HazardCurve.rate_of": (hazard.rate_of, {"intensity": [0.1, 0.5]}),
        "HazardCurve.intensity_of": (hazard.intensity_of, {"rate": [1e-2, 1e-3]}),
        "HazardLogicTree": (wd.HazardLogicTree, {"curves": [hazard, hazard], "weights": [0.4, 0.6]}),
        "risk_targeted_intensity": (
            wd.risk_targeted_intensity,
            {"hazard": hazard, "dispersion": 0.6, "probability_of_collapse": 0.01, "years": 50.0}
            | {"conditional_probability": 0.1},
        ),
        "collapse_margin": (
            wd.collapse_margin,
            {"collapse_median": [2.4], "design_intensity": [1.5], "period": [0.7], "ductility": [6.0]}
            | {"design_category": "Dmax", "record_set": "far_field", "model": "C", "names": ["a"]},
        ),
        "spectral_shape_factor": (
            wd.spectral_shape_factor,
            {"period": [1.5], "ductility": [8.0], "design_category": "Dmax", "record_set": "far_field"},
        ),
        "hazus_loss_ratios": (wd.hazus_loss_ratios, {"occupancy": "COM4", "part": "structural"}),
        "DamageCounts": (wd.DamageCounts, over_stock | {"number": [1.0, 2.0], "labels": {}}),
        "DamageLoss": (
            wd.DamageLoss,
            {"limits": LIMITS, "loss_ratios": RATIOS, "replacement_values": [1e5], "over": "motion", "labels": {}},
        ),
        "DemandHistogram": (
            wd.DemandHistogram,
            {"demand": "peak_storey_drift_ratio", "edges": [0.0, 0.01, 0.1], "quantiles": (0.5,), "over": "motion"},
        ),
        "DemandMoments": (wd.DemandMoments, {"demand": "peak_storey_drift_ratio", "each_place": False, "over": ()}),
        "LargestDemand": (wd.LargestDemand, {"demand": "peak_storey_drift_ratio", "each_place": True, "over": ()}),
        "records.detrend": (wd.records.detrend, {"motion": waves[0], "trend": "linear"}),
        "records.band_pass": (
            wd.records.band_pass,
            {"motion": waves[0], "lowest": 0.5, "highest": 20.0, "order": 4},
        ),
        "records.trim": (wd.records.trim, {"motion": waves[0], "start": 0.05, "end": 0.95, "pad": 0.5}),
        "records.from_array": (
            wd.records.from_array,
            {"acceleration": WAVE / 9.81, "step": 0.02, "unit": "g", "name": "a"},
        ),
        "records.pairs": (wd.records.pairs, {"motions": pairs}),
        "records.near_field": (wd.records.near_field, {"subset": "pulse"}),
        "records.read_at2": (wd.records.read_at2, {"path": str(folder / "RSN6_IMPVALL.I_I-ELC180.AT2")}),
        "records.read_esm": (wd.records.read_esm, {"path": str(folder / "XX.STA1..HNN.ASC")}),
        "records.read_cosmos": (
            wd.records.read_cosmos,
            {"path": str(folder / "station.V2C"), "components": "all"},
        ),
        "records.read_directory": (
            wd.records.read_directory,
            {"path": str(folder), "pattern": "quake.csv", "components": "horizontal", "unit": "g"} | {"step": 0.01},
        ),
        "records.read_text": (
            wd.records.read_text,
            {"path": str(folder / "quake.csv"), "unit": "g", "delimiter": ",", "decimal_comma": False}
            | {"header_lines": 1, "acceleration_column": 1, "time_column": 0, "time_unit": "s"},
        ),
        "inventories.from_table": (wd.inventories.from_table, {"table": table, "columns": {"storeys": "storeys"}}),
        "inventories.portfolio": (
            wd.inventories.portfolio,
            {"inventory": inventory, "archetype_of": wd.inventories.HazusRule("4"), "scatter": {}, "unknown": "refuse"},
        ),
        "inventories.HazusRule": (wd.inventories.HazusRule, {"seismic_zone": "3"}),
        "inventories.read_r2d": (
            wd.inventories.read_r2d,
            {"path": str(folder / "buildings.csv"), "area_unit": "ft2", "columns": {}},
        ),
        "inventories.read_geojson": (
            wd.inventories.read_geojson,
            {"path": str(folder / "AnchorageBuildings.geojson"), "area_unit": "ft2"},
        ),
        "inventories.read_openquake": (
            wd.inventories.read_openquake,
            {"path": str(folder / "exposure_model.xml"), "costs": ("structural",)},
        ),
        "inventories.BuildingStock.buildings": (stock.buildings, {"inventory": inventory}),
        "inventories.BuildingStock.replacement_values": (stock.replacement_values, {"inventory": inventory}),
        "sites.read_shakemap": (shakemap, {"path": str(folder / "grid.xml")}),
        "sites.read_ground_motion_field": (
            wd.sites.read_ground_motion_field,
            {"fields": str(folder / "gmf-data_1.csv"), "sites": str(folder / "sitemesh_1.csv")},
        ),
        "sites.read_event_grid": (
            wd.sites.read_event_grid,
            {"path": str(folder / "records/EventGrid.csv"), "unit": "g"},
        ),
        "sites.read_intensity_grid": (
            wd.sites.read_intensity_grid,
            {"path": str(folder / "intensities/EventGrid.csv"), "unit": "g"},
        ),
        "sites.correlated_fields": (
            wd.sites.correlated_fields,
            {"median": field, "correlation": wd.sites.JayaramBaker2009(0.0), "between": 0.3, "within": 0.5}
            | {"draws": 3, "seed": 1},
        ),
        "sites.scale_records": (wd.sites.scale_records, {"field": field, "motions": waves, "seed": 1}),
        "sites.JayaramBaker2009": (wd.sites.JayaramBaker2009, {"period": 1.0, "is_clustered": True}),
        "sites.EspositoIervolino2012": (wd.sites.EspositoIervolino2012, {"period": 1.0, "region": "Italy"}),
        "sites.SpatialCorrelation.correlation": (
            wd.sites.JayaramBaker2009(1.0).correlation,
            {"distance": [0.0, 1e4]},
        ),
        "sites.within_event_residuals": (
            wd.sites.within_event_residuals,
            {"longitude": [-122.3, -122.2], "latitude": [37.8, 37.8], "correlation": wd.sites.JayaramBaker2009(1.0)}
            | {"draws": 3, "seed": 1},
        ),
        "sites.MotionGrid.at": (
            grid.at,
            {"inventory": inventory, "rows": stock, "draws": 5, "neighbours": 2, "reach": 1e5, "seed": 1},
        ),
        "truth.bilinear_chain_response": (wd.truth.bilinear_chain_response, exact | {"hardening_ratio": 0.05}),
        "truth.bouc_wen_chain_response": (
            wd.truth.bouc_wen_chain_response,
            exact | {"hardening_ratio": 0.05, "beta": 0.5, "gamma": 0.5, "exponent": 1.0},
        ),
        "truth.piecewise_linear_response": (
            wd.truth.piecewise_linear_response,
            system | {"force": np.ones((5, 2)), "step": 0.01},
        ),
        "truth.harmonic_response": (
            wd.truth.harmonic_response,
            system | {"amplitude": [1.0, 1.0], "frequency": 3.0, "phase": 0.1, "time": [0.0, 0.1]},
        ),
        "write_consequences": (
            wd.write_consequences,
            {"consequences": {"C1M_H": RATIOS}, "path": str(folder / "consequences.csv"), "loss_type": "structural"},
        ),
        "read_consequences": (
            wd.read_consequences,
            {"path": str(wd.write_consequences({"C1M_H": RATIOS}, folder / "c.csv")), "loss_type": "structural"},
        ),
        "write_taxonomy_mapping": (
            wd.write_taxonomy_mapping,
            {"mapping": {"CR": {"C1M_H": 0.7, "C1M_L": 0.3}, "W": "W1"}, "path": str(folder / "mapping.csv")},
        ),
        "meant_as_given": (lambda *, quantities: wd.meant_as_given(quantities).__enter__, {"quantities": "no_damping"}),
        "plots.building": (wd.plots.building, {"building": building}),
        "plots.ground_motions": (wd.plots.ground_motions, {"motions": waves, "damping_ratio": 0.05}),
    }
