"""Valid calls of public functions that run a scene or use a run: the function and its arguments by name."""

from __future__ import annotations

import doctest
from dataclasses import replace
from pathlib import Path
from typing import Any

from sound_calls import LIMITS, RATIOS, Call

import warpdyn as wd


def with_runs(folder: Path) -> dict[str, Call]:
    """Return calls that run a scene, or use the run of the package's example."""
    (example,) = doctest.DocTestFinder(recurse=False).find(wd, "warpdyn", module=False, globs={})
    doctest.DocTestRunner().run(example, out=str, clear_globs=False)
    ns: dict[str, Any] = example.globs
    building, scene, run, curves, hazard, limits = (
        ns[name] for name in ("building", "scene", "run", "curves", "hazard", "limits")
    )
    falling = wd.laws.IbarraMedinaKrawinklerBilinear(
        yield_force=5e5, plastic_drift_to_capping=0.04, post_capping_drift=0.1, capping_force_ratio=1.1
    )
    falling = wd.ShearBuilding(1e5, 4e7, 3.0, law=falling)
    cloud = wd.simulate(wd.Scene(building, wd.Cloud(ns["motions"]), ns["scatter"]), structures=4)
    by_motion = wd.simulate(ns["region"], statistics=wd.DamageCounts(ns["stock"].limits, over=("building", "motion")))
    vector = {"run": run, "limits": {"slight": 0.005}, "motions": ns["motions"]}
    vector |= {"measures": (wd.SpectralAcceleration(0.05), wd.SpectralAcceleration(1.4))}
    twice = wd.EventSequence({"mainshock": ns["stripes"], "aftershock": ns["stripes"]})
    shocks = wd.simulate(wd.Scene(building, twice, ns["scatter"], recorders=("drift",)), structures=8)
    damaged = wd.state_dependent_fragility(shocks, {"slight": 0.004, "complete": 0.015})
    found = wd.capacities(scene, LIMITS, structures=2, keep_curves=True)
    losses, both = wd.vulnerability(curves, RATIOS), run.merge(curves, combine_attrs="no_conflicts")
    shares = wd.damage_shares(wd.simulate(ns["region"]), ns["stock"].limits)
    kept = wd.simulate(scene, histories=wd.Histories([0, 5]))
    values, out = ns["stock"].replacement_values(ns["inventory"]), str(folder / "out")
    costs = ns["stock"].replacement_costs(ns["inventory"])
    mean = wd.GeometricMean(wd.PeakGroundAcceleration())
    components = [replace(ns["motions"][place], record="quake", component="NE"[place]) for place in (0, 1)]
    asked = wd.DamageLoss(ns["stock"].limits, wd.hazus_loss_ratios("RES1"), costs, over="motion")
    counted_losses = wd.simulate(ns["region"], statistics=asked)
    fitted = {"dataset": run, "limits": limits, "intervals_over": "records", "replicates": 50, "confidence": 0.9}
    as_simulated = {"scene": scene, "structures": 2, "seed": 1, "method": "rk4", "dtype": "float32", "step": 0.01}
    as_simulated |= {"resample": False, "on_unstable": "substep", "keep_inputs": True, "threads": 2, "memory": 2**30}
    return {
        "simulate": (wd.simulate, as_simulated),
        "simulate to histories": (
            wd.simulate,
            {"scene": scene, "histories": wd.Histories([0]), "checked_share": 0.5, "statistics": None, "path": None},
        ),
        "simulate to statistics": (
            wd.simulate,
            {"scene": scene, "statistics": wd.DamageCounts(limits), "overwrite": False, "device": "cpu"},
        ),
        "plan": (wd.plan, {"scene": scene, "target_error": 0.05, "structures": 1, "seed": 1, "method": "rk4"}),
        "capacities": (
            wd.capacities,
            {"scene": scene, "limits": limits, "structures": 1, "tolerance": 0.05, "highest": 4.0, "ladder": 1.2}
            | {"reuse_elastic": True, "keep_curves": False, "seed": 1},
        ),
        "levels_for": (wd.levels_for, {"scene": scene, "limits": limits, "count": 4, "seed": 1}),
        "fragility_to": (
            wd.fragility_to,
            {"scene": scene, "limits": limits, "precision": 0.5, "confidence": 0.9, "seed": 1},
        ),
        "pushover": (
            wd.pushover,
            {"building": building, "roof_displacement": [0.0, 0.01, 0.02], "pattern": "first_mode"},
        ),
        "period_based_ductility": (
            wd.period_based_ductility,
            {"building": falling, "pushed": wd.pushover(falling, [0.0, 0.05, 0.1, 0.2]), "period": 0.8},
        ),
        "exceedance_probability": (
            wd.exceedance_probability,
            {"run": cloud.isel(sample=cloud["structure"].values == 0), "limits": limits}
            | {"demand": "peak_storey_drift_ratio", "confidence": 0.9},
        ),
        "state_dependent_fragility": (
            wd.state_dependent_fragility,
            {
                "run": shocks,
                "limits": {"slight": 0.004, "complete": 0.015},
                "event": "aftershock",
                "replicates": 20,
                "confidence": 0.9,
                "seed": 1,
            },
        ),
        "damage_in_time": (
            wd.damage_in_time,
            {"curves": damaged, "hazard": hazard, "years": [50.0], "confidence": 0.9},
        ),
        "compare_measures": (
            wd.compare_measures,
            {"run": cloud, "motions": ns["motions"], "measures": [wd.PeakGroundAcceleration()], "covariates": None}
            | {"confidence": 0.9},
        ),
        "fragility_surface": (wd.fragility_surface, vector | {"confidence": 0.9}),
        "convert_curves": (
            wd.convert_curves,
            {
                "curves": curves,
                "motions": ns["motions"],
                "measure": wd.PeakGroundAcceleration(),
                "to": vector["measures"][0],
            }
            | {"confidence": 0.9, "seed": 1},
        ),
        "SceneLimitState": (
            wd.SceneLimitState,
            {"scene": replace(scene, excitation=ns["motions"][0]), "limit": 0.01}
            | {"demand": "peak_storey_drift_ratio", "integration": wd.Integration(step=0.01)},
        ),
        "sobol_indices": (
            wd.sobol_indices,
            {"scene": scene, "base_structures": 32, "confidence": 0.9, "seed": 1, "limits": None},
        ),
        "tornado": (wd.tornado, {"scene": scene, "quantiles": (0.1, 0.9), "confidence": 0.9, "limits": None}),
        "correlation_ratios": (wd.correlation_ratios, {"run": wd.simulate(scene, structures=32), "confidence": 0.9}),
        "storey_hysteresis": (wd.storey_hysteresis, {"building": building, "drift": [0.0, 0.01, -0.01]}),
        "response_spectra": (
            wd.response_spectra,
            {"motions": ns["motions"], "periods": [0.2, 1.0], "damping_ratios": [0.05], "threads": 2},
        ),
        "intensity_measures": (wd.intensity_measures, {"motions": ns["motions"]}),
        "SpectralAcceleration.value": (wd.SpectralAcceleration(0.5).value, {"motion": ns["motions"][0]}),
        "fragility": (wd.fragility, fitted | {"estimator": "lognormal", "seed": 1}),
        "fragility_of_cloud": (wd.fragility_of_cloud, fitted | {"dataset": cloud}),
        "fragility_from_capacities": (
            wd.fragility_from_capacities,
            {"capacities": found, "intervals_over": "records", "replicates": 50, "confidence": 0.9, "seed": 1},
        ),
        "fragility_posterior": (
            wd.fragility_posterior,
            {"dataset": run, "limits": limits, "draws": 200, "confidence": 0.9, "seed": 1, "priors": None},
        ),
        "annual_rates": (wd.annual_rates, {"curves": curves, "hazard": hazard, "years": 50.0, "confidence": 0.9}),
        "annual_losses": (
            wd.annual_losses,
            {"curves": curves, "hazard": hazard, "loss_ratios": RATIOS, "replacement_value": 1e6}
            | {"return_periods": (10.0, 475.0), "confidence": 0.9},
        ),
        "check_risk_target": (
            wd.check_risk_target,
            {"curves": curves, "hazard": hazard, "design_intensity": 1.0, "years": 50.0}
            | {"probability_of_collapse": 0.01, "conditional_probability": 0.1, "damage_state": "complete"},
        ),
        "disaggregate": (
            wd.disaggregate,
            {"curves": curves, "hazard": hazard, "bins": 10, "lowest": 0.05, "highest": 4.0},
        ),
        "rates_by_record": (wd.rates_by_record, {"capacities": found, "hazard": hazard}),
        "vulnerability": (
            wd.vulnerability,
            {"curves": curves, "loss_ratios": RATIOS, "intensity": [0.5, 1.0], "confidence": 0.9},
        ),
        "expected_annual_loss": (
            wd.expected_annual_loss,
            {"vulnerability": losses, "hazard": hazard, "replacement_value": 1e6},
        ),
        "storey_losses": (
            wd.storey_losses,
            {"run": run, "drift_loss": ([0.0, 0.01, 0.03], [0.0, 0.1, 0.3]), "collapse_loss": 1.0}
            | {"acceleration_loss": ([0.0, 3.0, 12.0], [0.0, 0.0, 0.06])},
        ),
        "damage_shares": (wd.damage_shares, {"run": wd.simulate(ns["region"]), "limits": ns["stock"].limits}),
        "portfolio_losses": (
            wd.portfolio_losses,
            {"shares": shares, "loss_ratios": wd.hazus_loss_ratios("RES1"), "replacement_values": values}
            | {"event_rates": [0.001] * 8, "return_periods": (100.0,)},
        ),
        "building_annual_losses": (
            wd.building_annual_losses,
            {"counted": by_motion, "stock": ns["stock"], "inventory": ns["inventory"]}
            | {"loss_ratios": wd.hazus_loss_ratios("RES1"), "event_rates": [0.001] * 8, "hazard": None},
        ),
        "event_losses": (
            wd.event_losses,
            {"counted": counted_losses, "event_rates": [0.001] * 8, "return_periods": (10.0,)},
        ),
        "building_results": (
            wd.building_results,
            {name: ns[name] for name in ("counted", "stock", "inventory")}
            | {"loss_ratios": wd.hazus_loss_ratios("RES1")},
        ),
        "select_storeys": (wd.select_storeys, {"run": run, "first": 1, "last": 2}),
        "larger_of_components": (
            wd.larger_of_components,
            {"run": wd.simulate(wd.Scene(building, wd.Cloud(components, mean))), "motions": components},
        ),
        "select_archetype": (wd.select_archetype, {"run": wd.simulate(ns["region"]), "name": "W1 high 2"}),
        "summary": (wd.summary, {"run": run}),
        "report": (wd.report, {"dataset": both, "path": f"{out}.html", "title": "a"}),
        "write": (wd.write, {"dataset": curves, "path": f"{out}.nc"}),
        "write_table": (wd.write_table, {"dataset": curves, "path": f"{out}.csv", "rows": "damage_state"}),
        "write_building_results": (wd.write_building_results, {"results": ns["results"], "path": f"{out}.geojson"}),
        "write_openquake_damages": (
            wd.write_openquake_damages,
            {"results": ns["results"], "path": f"{out}_damages.csv", "loss_type": "structural"},
        ),
        "write_nrml_fragility": (
            wd.write_nrml_fragility,
            {"curves": {"CR": curves}, "path": f"{out}.xml", "minimum_intensity": 0.05, "no_damage_limit": 0.02}
            | {"format": "continuous", "loss_type": "structural", "description": "a"},
        ),
        "write_nrml_vulnerability": (
            wd.write_nrml_vulnerability,
            {"functions": {"CR": losses}, "path": f"{out}_v.xml", "distribution": "BT", "loss_type": "structural"},
        ),
        "write_pelicun_demands": (
            wd.write_pelicun_demands,
            {"run": run, "path": f"{out}_demands.csv", "level": 0.4, "collapse_drift_ratio": 0.1},
        ),
        "kernels.source": (wd.kernels.source, {"scene": scene, "method": "rk4", "dtype": "float32", "device": "cpu"}),
        "plots.fragility_curves": (wd.plots.fragility_curves, {"dataset": curves, "scale": "log"}),
        "plots.drift_over_height": (wd.plots.drift_over_height, {"dataset": run, "levels": 3}),
        "plots.drift_distributions": (wd.plots.drift_distributions, {"runs": {"a": run}, "level": 0.4}),
        "plots.histories": (wd.plots.histories, {"dataset": kept, "history": 1}),
        "plots.hysteresis": (wd.plots.hysteresis, {"dataset": kept, "history": 1}),
        "plots.hazard_and_rates": (wd.plots.hazard_and_rates, {"curves": curves, "hazard": hazard}),
        "plots.ida_curves": (wd.plots.ida_curves, {"dataset": both, "colour": "#0072B2", "scale": "linear"}),
        "plots.sensitivity": (wd.plots.sensitivity, {"dataset": wd.tornado(scene).isel(stripe=0)}),
        "plots.state_dependent_fragility": (wd.plots.state_dependent_fragility, {"dataset": damaged}),
        "plots.fragility_surface": (wd.plots.fragility_surface, {"dataset": wd.fragility_surface(**vector)}),
        "plots.vulnerability": (wd.plots.vulnerability, {"dataset": losses, "scale": "log"}),
    }
