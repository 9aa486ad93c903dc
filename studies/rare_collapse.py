"""Rare collapse: probabilities down to 1e-6 by subset simulation and importance sampling, and their cost.

    python studies/rare_collapse.py --out results

Three problems under random ground motions (filtered noise):

- collapse of a building of three yielding storeys with P-Delta and random strength, for increasing intensity of the
  noise: by subset simulation, and by plain Monte Carlo where the collapse is not rare;
- first passage of a linear oscillator, by subset simulation and by importance sampling;
- first passage of a yielding oscillator, by subset simulation.

The study prints the probabilities with their intervals, and the number of histories for a coefficient of variation of
20 %. It writes rare_collapse.nc and one figure.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from parts.command_line import file_in, read_arguments, save_figures
from tqdm import tqdm

import warpdyn as wd
from warpdyn.foundations.files import netcdf

MASS = 1e5  # kg
TARGET = 0.2  # coefficient of variation at which costs are compared
INTENSITIES = (0.01, 0.015, 0.02, 0.03, 0.045)  # m2/s3, of the noise at the building
PLAIN_FROM = 0.03  # m2/s3, intensity from which plain Monte Carlo is run, too
LINEAR_LIMITS = (0.125, 0.155, 0.19)  # m
DUCTILITIES = (3.0, 4.0, 4.75)
YIELD_DRIFT = 0.02  # m


def building_scene(intensity: float) -> wd.Scene:
    """Return the scene of three yielding storeys with P-Delta, which collapse at a drift ratio of 6 %."""
    building = wd.ShearBuilding(
        mass=2e5,
        stiffness=[1.2e8, 1.0e8, 0.7e8],
        height=3.2,
        law=wd.laws.Bilinear(yield_force=[9e5, 7.5e5, 4.5e5], hardening_ratio=0.02),
        gravity_load=[2e6] * 3,
        damping="rayleigh",
        damping_ratio=0.05,
    )
    noise = wd.FilteredNoise(
        wd.KanaiTajimi(intensity, ground_frequency=15.0, ground_damping_ratio=0.6),
        duration=14.0,
        interval=0.02,
        envelope=wd.JenningsEnvelope(2.0, 6.0, 0.5),
    )
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    return wd.Scene(building, noise, scatter, recorders=("drift",), collapse_drift_ratio=0.06, tail=0.0)


def oscillator(period: float, noise: wd.FilteredNoise, **law: object) -> wd.Scene:
    """Return the scene of an oscillator with 5 % damping."""
    omega = 2 * np.pi / period
    structure = wd.ShearBuilding(
        MASS, MASS * omega**2, 3.0, damping="storey", damping_coefficient=2 * 0.05 * omega * MASS, **law
    )
    return wd.Scene(structure, noise, recorders=("drift",), tail=0.0)


def linear_scene() -> wd.Scene:
    """Return the scene of a linear oscillator under white noise, at rest at first."""
    return oscillator(1.0, wd.FilteredNoise(wd.WhiteNoise(0.01), 20.0, 0.02))


def yielding_scene() -> wd.Scene:
    """Return the scene of a bilinear oscillator under Kanai-Tajimi noise."""
    law = wd.laws.Bilinear(yield_force=MASS * (2 * np.pi / 0.6) ** 2 * YIELD_DRIFT, hardening_ratio=0.05)
    return oscillator(0.6, wd.FilteredNoise(wd.KanaiTajimi(0.006, 15.0, 0.6), 10.0, 0.01), law=law)


def rows_of(samples: int, seed: int, execution: wd.Execution) -> list[tuple[str, float, xr.Dataset]]:
    """Return (problem and method, intensity or limit, result) of all runs."""
    step = wd.Integration(method="rk4", step=0.005)
    found = []
    for intensity in tqdm(INTENSITIES, desc="collapse", disable=None):
        limit_state = wd.SceneLimitState(building_scene(intensity), np.inf, execution=execution)
        found.append(("collapse, subset", intensity, wd.subset_simulation(limit_state, samples=samples, seed=seed)))
    for limit in tqdm(LINEAR_LIMITS, desc="linear", disable=None):
        given = {"demand": "peak_storey_drift", "integration": step, "execution": execution}
        limit_state = wd.SceneLimitState(linear_scene(), limit, **given)
        found.append(("linear, subset", limit, wd.subset_simulation(limit_state, samples=samples, seed=seed)))
        weighted = wd.importance_sampling(limit_state, samples=2 * samples, seed=seed)
        found.append(("linear, importance sampling", limit, weighted))
    step = wd.Integration(method="rk4", step=0.0025)
    for ductility in tqdm(DUCTILITIES, desc="yielding", disable=None):
        given = {"demand": "peak_storey_drift", "integration": step, "execution": execution}
        limit_state = wd.SceneLimitState(yielding_scene(), ductility * YIELD_DRIFT, **given)
        found.append(("yielding, subset", ductility, wd.subset_simulation(limit_state, samples=samples, seed=seed)))
    return found


def plain(samples: int, seed: int, execution: wd.Execution) -> xr.Dataset:
    """Return collapse probabilities by plain Monte Carlo with their intervals, at the higher intensities."""
    found = []
    for intensity in (each for each in INTENSITIES if each >= PLAIN_FROM):
        run = wd.simulate(building_scene(intensity), structures=samples, seed=seed, execution=execution)
        found.append(wd.exceedance_probability(run, {"collapse": np.inf}).squeeze("damage_state", drop=True))
    at = [each for each in INTENSITIES if each >= PLAIN_FROM]
    return xr.concat(found, "intensity").assign_coords(intensity=at)


def table_of(rows: list[tuple[str, float, xr.Dataset]]) -> xr.Dataset:
    """Return all results along the dimension `run`, with the histories for a coefficient of variation of 20 %."""
    names = ("probability", "probability_lower", "probability_upper", "coefficient_of_variation", "evaluations")
    joined = xr.concat([result[list(names)] for _, _, result in rows], "run", combine_attrs="drop")
    cost = joined["evaluations"] * (joined["coefficient_of_variation"] / TARGET) ** 2
    return joined.assign(
        problem=("run", [name for name, _, _ in rows]),
        intensity_or_limit=("run", [value for _, value, _ in rows]),
        histories_for_target=cost,
    )


def draw(table: xr.Dataset, by_plain: xr.Dataset) -> Figure:
    """Draw the collapse probability against the intensity, and the cost of all methods against the probability."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    of_building = table.isel(run=table["problem"].values == "collapse, subset")
    for each, x, style, name in (
        (of_building["probability"], of_building["intensity_or_limit"].values, "o-", "subset simulation"),
        (by_plain["exceedance_probability"], by_plain["intensity"].values * 1.03, "s", "plain Monte Carlo"),
    ):
        source = of_building if name == "subset simulation" else by_plain
        low, high = (source[f"{each.name}_{end}"].values for end in ("lower", "upper"))
        left.errorbar(x, each.values, [each.values - low, high - each.values], fmt=style, capsize=3, ms=4, label=name)
    left.set(xscale="log", yscale="log", xlabel="intensity of the noise [m²/s³]", ylabel="probability of collapse")
    left.set_xticks(INTENSITIES, [f"{each:g}" for each in INTENSITIES], minor=False)
    left.minorticks_off()
    left.legend()
    for name, marker in zip(np.unique(table["problem"].values), "o^sD", strict=True):
        part = table.isel(run=table["problem"].values == name)
        right.plot(part["probability"], part["histories_for_target"], marker, label=name)
    p = np.geomspace(1e-7, 0.1, 50)
    right.plot(p, (1 - p) / (p * TARGET**2), "k--", label="plain Monte Carlo")
    right.set(xscale="log", yscale="log", xlabel="probability")
    right.set_ylabel(f"histories for a c.o.v. of {100 * TARGET:.0f} %")
    right.invert_xaxis()
    right.legend(fontsize="small")
    for panel in (left, right):
        panel.grid(alpha=0.3)
    return figure


def main() -> None:
    """Run the study from the command line: print and write the probabilities and costs, and draw the figure."""
    arguments = read_arguments(__doc__, 1000, "samples per level of subset simulation")
    path = file_in(arguments.out, "rare_collapse.nc")
    execution = wd.Execution(device=arguments.device)
    table = table_of(rows_of(arguments.samples, arguments.seed, execution))
    by_plain = plain(10 * arguments.samples, arguments.seed, execution)
    for run in range(table.sizes["run"]):
        row = table.isel(run=run)
        print(
            f"{row['problem'].item():28s} {row['intensity_or_limit'].item():6.3f}: {row['probability'].item():.3g} "
            f"({row['probability_lower'].item():.2g} to {row['probability_upper'].item():.2g}), "
            f"{row['evaluations'].item():,} histories; for 20 %: {row['histories_for_target'].item():,.0f}, "
            f"plain Monte Carlo {25 / row['probability'].item():,.0f}"
        )
    print("plain Monte Carlo:", by_plain["exceedance_probability"].values, "at", by_plain["intensity"].values)
    netcdf.write(table.merge(by_plain.drop_vars("damage_limit", errors="ignore")), path)
    save_figures({"rare_collapse": draw(table, by_plain)}, arguments.out)


if __name__ == "__main__":
    main()
