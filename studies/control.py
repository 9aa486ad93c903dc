"""Active control of random buildings by one controller: when does it make the response worse, and with which delay?

    python studies/control.py --out results

An LQR regulator is designed for a building of three storeys with median properties: two actuators in the first and the
second storey, whose forces are limited to 10 % of the weight. It then controls buildings with random stiffness, mass,
strength and damping, each under its own random ground motion (Kanai-Tajimi noise), for delays from 0 to 60 ms. Each
building is also simulated without control under the same motion. The study computes the probability that control makes
the largest drift worse, and the share of buildings whose sampled loop is unstable while they are elastic. It writes
control.nc and a figure.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.foundations.files import netcdf

MASS, STIFFNESS, HEIGHT = 2.0e5, np.array([1.6e8, 1.3e8, 0.9e8]), 3.2
BUILDING = wd.ShearBuilding(
    MASS,
    STIFFNESS,
    HEIGHT,
    law="bilinear",
    yield_force=STIFFNESS * HEIGHT / 250,  # they yield at a drift ratio of 0.4 %
    hardening_ratio=0.05,
    damping="rayleigh",
    damping_ratio=0.03,
)
SCATTER = {
    "stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.25), per="building"),
    "mass": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.10), per="building"),
    "yield_force": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.20), per="building"),
    "damping_ratio": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.30)),
}
FORCE_LIMIT = 0.1 * 3 * MASS * STANDARD_GRAVITY
ACTUATORS = [wd.control.Actuator(storey, force_limit=FORCE_LIMIT) for storey in (1, 2)]
SAMPLING = 0.005  # s
REGULATOR = wd.control.lqr(BUILDING, ACTUATORS, force_weight=2e-8, sampling_interval=SAMPLING)
DELAYS = (0.0, 0.01, 0.015, 0.02, 0.025, 0.03, 0.035, 0.04, 0.05, 0.06)  # s
# Weak motions keep the buildings elastic and the actuators mostly below their limits; strong ones let them yield.
PEAKS = {"weak motion": 0.05, "strong motion": 0.4}  # rough peak ground accelerations [g]


GROUND_FREQUENCY, GROUND_DAMPING = 15.0, 0.6  # rad/s, 1
EIGENVALUES_OF = 400  # buildings whose loops are checked for stability


def motion_of(peak: float) -> wd.FilteredNoise:
    """Return random ground motions of 15 s whose peak acceleration [g] is about three standard deviations."""
    deviation = peak * STANDARD_GRAVITY / 3
    shape = np.pi * GROUND_FREQUENCY * (1 + 4 * GROUND_DAMPING**2) / (2 * GROUND_DAMPING)
    spectrum = wd.KanaiTajimi(deviation**2 / shape, GROUND_FREQUENCY, GROUND_DAMPING)
    return wd.FilteredNoise(spectrum, 15.0, SAMPLING, wd.JenningsEnvelope(rise=2.0, strong=8.0, decay=0.5))


def control_of(delay: float) -> wd.control.Control:
    """Return the control with a delay [s]."""
    return wd.control.Control(ACTUATORS, regulator=REGULATOR, sampling_interval=SAMPLING, delay=delay)


def largest_drifts(peak: float, delay: float | None, structures: int, seed: int, device: str | None) -> xr.Dataset:
    """Return a run whose buildings are controlled with a delay [s]; None: without control."""
    control = None if delay is None else control_of(delay)
    scene = wd.Scene(BUILDING, motion_of(peak), SCATTER, recorders=("drift",), control=control)
    return wd.simulate(scene, structures=structures, seed=seed, device=device, method="rk4")


def unstable_share(run: xr.Dataset, delay: float) -> float:
    """Return the share of buildings of a run whose elastic, sampled loop without force limits is unstable [1]."""
    count, control = min(EIGENVALUES_OF, run.sizes["sample"]), control_of(delay)
    drawn = {name: run[name].values[:count] for name in SCATTER}
    radius = [
        abs(wd.control.sampled_eigenvalues(BUILDING, control, {name: each[i] for name, each in drawn.items()})[0])
        for i in range(count)
    ]
    return float(np.mean(np.array(radius) >= 1.0))


def draw(result: xr.Dataset) -> Figure:
    """Return the figure: probability that control makes the response worse, and drifts with and without control."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    delay = 1e3 * result["delay"].values
    for number, motion in enumerate(result["motion_strength"].values):
        own = result.sel(motion_strength=motion)
        left.plot(
            delay, 100 * own["probability_worse"], marker="o", color=f"C{number}", label=f"larger drift, {motion}"
        )
        right.plot(delay, own["median_ratio"], marker="o", color=f"C{number}", label=f"median, {motion}")
        low, high = (own["quantile_ratio"].sel(quantile=q) for q in (0.05, 0.95))
        right.fill_between(delay, low, high, color=f"C{number}", alpha=0.2, label=f"5 to 95 %, {motion}")
    left.plot(delay, 100 * result["share_unstable"], color="0.3", linestyle="--", label="unstable while elastic")
    right.axhline(1.0, color="0.3", linewidth=0.8)
    left.set_ylabel("share of the buildings [%]")
    right.set_ylabel("largest drift with control / without control [1]")
    right.set_yscale("log")
    for axes in (left, right):
        axes.set_xlabel("delay of the control [ms]")
    left.legend(loc="upper left")
    right.legend(loc="lower right")
    return figure


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 4096, "number of random buildings", "structures")
    path = file_in(arguments.out, "control.nc")
    start = time.perf_counter()
    rows: dict[str, list[xr.Dataset]] = {}
    shares: list[float] = []
    for name, peak in PEAKS.items():
        common = arguments.structures, arguments.seed, arguments.device
        alone = largest_drifts(peak, None, *common)
        before = alone["peak_storey_drift_ratio"].max("storey")
        rows[name] = []
        for delay in DELAYS:
            run = largest_drifts(peak, delay, *common)
            ratio = run["peak_storey_drift_ratio"].max("storey") / before
            failed = run["status"] > 0
            rows[name].append(
                xr.Dataset(
                    {
                        "probability_worse": ((ratio > 1) | failed).mean(),
                        "median_ratio": ratio.median(),
                        "quantile_ratio": ratio.quantile([0.05, 0.95]),
                        "limited_share": run["limited_share"].mean(),
                    }
                )
            )
            if len(shares) < len(DELAYS):
                shares.append(unstable_share(run, delay))
    delay = xr.DataArray(list(DELAYS), dims="delay", attrs={"units": "s", "long_name": "delay of the control"})
    result = xr.concat([xr.concat(each, delay) for each in rows.values()], "motion_strength")
    result = result.assign_coords(motion_strength=list(rows), delay=delay)
    result["share_unstable"] = "delay", shares
    texts = {
        "probability_worse": "share of the buildings with a larger drift with control than without",
        "median_ratio": "median of the largest drift with control over that without",
        "quantile_ratio": "quantiles of the largest drift with control over that without",
        "limited_share": "mean share of the samples at which a force was limited",
        "share_unstable": "share of the buildings whose elastic loop is unstable",
    }
    for name, text in texts.items():
        result[name].attrs = {"units": "1", "long_name": text}
    result.attrs = {
        **netcdf.trace("Active control of random buildings", "studies/control.py"),
        "seed": arguments.seed,
        "method": "rk4",
    }
    netcdf.write(result, path)
    save_figures({"control": draw(result)}, arguments.out)
    table = result[["probability_worse", "median_ratio", "limited_share"]].to_dataframe().unstack("motion_strength")
    print(table.round(3).to_string())
    print("unstable while elastic:", dict(zip(DELAYS, np.round(shares, 3), strict=True)))
    histories = len(PEAKS) * (len(DELAYS) + 1) * arguments.structures
    print(f"{histories} histories in {time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    main()
