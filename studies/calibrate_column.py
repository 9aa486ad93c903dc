"""Calibration of storey laws to the measured loop of a reinforced-concrete column, compared by their evidence.

    python studies/calibrate_column.py --out results

The column of Soesianawati, Park and Priestley (1986) has a section of 0.4 m x 0.4 m, a length of 1.6 m and an axial
load of 744 kN. The study draws the posterior of three laws by tempered sequential Monte Carlo (`wd.calibrate`):
bilinear, Bouc-Wen, and Baber-Noori with loss of strength and stiffness and with pinching. The standard deviation of the
differences between test and model is unknown. The evidence compares the laws.

The study writes calibrate_column.nc and one figure.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn.foundations.files import netcdf

NOISE = wd.Lognormal(1.5e4, 0.5)  # N
YIELDING = {
    "stiffness": wd.Lognormal(1.2e7, 0.5),  # N/m
    "yield_force": wd.Lognormal(1.6e5, 0.3),  # N
    "hardening_ratio": wd.Truncated(wd.Normal(0.02, 0.05), low=0.0),
}
SMOOTH = YIELDING | {"exponent": wd.Lognormal(1.0, 0.5)}
DEGRADING = SMOOTH | {
    "strength_loss": wd.Lognormal(0.01, 1.0),
    "stiffness_loss": wd.Lognormal(0.02, 1.0),
    "total_slip": wd.Uniform(0.0, 0.95),
    "pinching_rate": wd.Lognormal(0.3, 1.0),
    "pinching_spread": wd.Lognormal(0.2, 0.7),
}
PRIORS = {"bilinear": YIELDING, "bouc_wen": SMOOTH, "baber_noori": DEGRADING}
NAMES = {"bilinear": "bilinear", "bouc_wen": "Bouc-Wen", "baber_noori": "Baber-Noori"}
SHOWN = ("bouc_wen", "baber_noori")


def posterior_loops(law: str, posterior: xr.Dataset, drift: np.ndarray, count: int) -> np.ndarray:
    """Return the forces of posterior samples [N], shape [sample, point]."""
    scatter = wd.posterior_scatter(posterior, structures=count)
    middle = {name: float(np.median(given.values)) for name, given in scatter.items()}
    storey = wd.ShearBuilding(1.0, middle.pop("stiffness"), 1.6, law=law, **middle)
    with wd.meant_as_given("pushed_drift_ratio"):
        return wd.storey_hysteresis(storey, drift, scatter=scatter)["storey_force"].values[:, :, 0]


def draw(loop: wd.MeasuredLoop, posteriors: dict[str, xr.Dataset]) -> Figure:
    """Return a figure of the measured loop with the posterior loops of two laws."""
    figure = Figure(figsize=(9.6, 4.2), layout="constrained")
    axes = figure.subplots(1, len(SHOWN), sharey=True)
    for place, law in enumerate(SHOWN):
        loops = posterior_loops(law, posteriors[law], loop.drift, 20)
        own, evidence = axes[place], float(posteriors[law]["log_evidence"])
        own.plot(1e3 * loop.drift, 1e-3 * loop.force, color="0.55", lw=1.0, label="measured")
        own.plot(1e3 * loop.drift, 1e-3 * loops.T, color=f"C{place}", lw=0.4, alpha=0.5)
        own.plot([], [], color=f"C{place}", label="20 posterior samples")
        noise = float(posteriors[law]["noise_standard_deviation"].mean())
        own.set_title(f"{NAMES[law]}: log evidence {evidence:.0f}, deviation {1e-3 * noise:.0f} kN", fontsize=11)
        own.set_xlabel("Displacement [mm]")
        own.legend(loc="upper left", frameon=False)
    axes[0].set_ylabel("Force [kN]")
    return figure


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 1000, meaning="candidates of each law", counted="candidates")
    target = file_in(arguments.out, "calibrate_column.nc")
    loop, posteriors = wd.MeasuredLoop.example(), {}
    for law, priors in PRIORS.items():
        started = time.perf_counter()
        execution = wd.Execution(device=arguments.device)
        posteriors[law] = found = wd.calibrate(
            law, loop, priors, noise=NOISE, candidates=arguments.candidates, seed=arguments.seed, execution=execution
        )
        seconds, count = time.perf_counter() - started, int(found["likelihood_evaluations"])
        print(f"\n{NAMES[law]}: {count:,} loops in {seconds:.1f} s")
        table = found[["posterior_mean", "posterior_mean_standard_error", "posterior_standard_deviation"]]
        print(table.to_dataframe().to_string(float_format="{:.4g}".format))
    compared = wd.compare_evidence(posteriors)
    print("\n" + compared[["log_evidence", "log_evidence_standard_error", "probability"]].to_dataframe().to_string())
    parts = [compared]
    for law, found in posteriors.items():
        kept = {"parameter": f"parameter_of_{law}", "stage": f"stage_of_{law}"}
        renamed = found.drop_vars("log_evidence_standard_error").rename(kept)
        names = {name: f"{name}_of_{law}" for name in renamed.data_vars}
        parts.append(renamed.rename(names).drop_attrs(deep=False))
    result = xr.merge(parts, combine_attrs="drop_conflicts", join="outer", compat="no_conflicts")
    result.attrs |= netcdf.trace("Storey laws calibrated to a reinforced-concrete column", "calibrate")
    netcdf.write(result, target)
    save_figures({"calibrate_column": draw(loop, posteriors)}, arguments.out)
    print(f"\nwrote {target} and calibrate_column.png")


if __name__ == "__main__":
    main()
