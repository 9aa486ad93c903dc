"""Probability of the damage states of an ensemble while a record arrives, and the time that each answer takes.

    python studies/live_damage.py --out results

The Hazus C1M high-code building of studies/p695_fragility.py has random parameters. A far-field record of FEMA P-695,
scaled to a peak of 0.8 g, arrives in packets of 0.1 s. Some packets are late or repeated, as over a radio link. After
each packet, the study keeps the damage-state probabilities and the quantiles of the drift. Finally it compares the
result with `simulate` for the whole record, bit by bit. The study writes live_damage.nc and a figure. With --display it
prints the address of a page that shows the answers in a browser, and plays the record back in real time.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.foundations.files import netcdf
from warpdyn.model.ground_motions.records import far_field

BUILDING = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5, damped_storeys=(1, 5))
LIMITS = wd.hazus_drift_limits("C1M", "high")
PEAK = 0.8 * STANDARD_GRAVITY  # m/s2
SECONDS_OF_A_PACKET = 0.1
SCATTER = {
    "mass": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.10)),
    "stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.20)),
    "yield_force": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.25)),
}


def record() -> wd.GroundMotion:
    """Return the motion: the first record of the far-field set, scaled to the peak."""
    motion = far_field()[0]
    scaled = motion.acceleration * PEAK / motion.peak_ground_acceleration
    return wd.GroundMotion(scaled, motion.step, motion.name)


def disturbed(motion: wd.GroundMotion, random: np.random.Generator) -> Iterator[wd.packets.Packet]:
    """Yield the packets of a motion as a poor connection delivers them: 5 % are repeated, and 5 % are late by 0.5 s."""
    late: list[tuple[int, wd.packets.Packet]] = []
    packets = wd.packets.from_motion(motion, round(SECONDS_OF_A_PACKET / motion.step))
    for number, packet in enumerate(packets):
        if number and random.random() < 0.05:
            late.append((number + 5, packet))
        else:
            yield packet
            if random.random() < 0.05:
                yield packet
        yield from (each for due, each in late if due == number)
    yield from (each for due, each in late if due > number)


def in_real_time(packets: Iterable[wd.packets.Packet]) -> Iterator[wd.packets.Packet]:
    """Yield each packet when its last sample has been measured, or at once if that time has passed."""
    began = time.monotonic()
    for packet in packets:
        end = packet.start + np.size(packet.acceleration) * packet.step
        time.sleep(max(0.0, began + end - time.monotonic()))
        yield packet


def follow(
    scene: wd.Scene, structures: int, seed: int, device: str | None, is_shown: bool = False
) -> tuple[xr.Dataset, xr.Dataset]:
    """Return the answers over time, and the run of the whole record; `is_shown`: show them on a page, in real time."""
    execution = wd.Execution(device=device)
    live = wd.Live(scene, structures, seed=seed, limits=LIMITS, execution=execution)
    motion, found = scene.excitation.motions[0], []
    packets = disturbed(motion, np.random.default_rng(seed))
    with ExitStack() as stack:
        if is_shown:
            display = stack.enter_context(wd.LiveDisplay(live))
            input(f"open {display.url} in a browser, then press Enter to start the record ")
            packets = in_real_time(packets)
        for packet in packets:
            began = time.perf_counter()
            answer = live.push(packet)
            kept = answer[["damage_probability", "peak_storey_drift_ratio_quantile"]]
            seconds = ((), time.perf_counter() - began, {"long_name": "time that the answer took", "units": "s"})
            found.append(kept.assign(seconds_of_answer=seconds))
    counts = {name: answer.attrs[name] for name in ("packets", "duplicate_packets", "gaps_closed")}
    answers = xr.concat(found, "time", combine_attrs="drop_conflicts", data_vars="all").assign_attrs(counts)
    return answers, live.finish()


def draw(answers: xr.Dataset, motion: wd.GroundMotion) -> Figure:
    """Return a figure of the motion, the largest median drift and the damage-state probabilities over time."""
    figure = Figure(figsize=(8.0, 6.4), layout="constrained")
    above, middle, below = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.2, 2.0))
    above.plot(np.arange(motion.acceleration.size) * motion.step, motion.acceleration, color="0.3", linewidth=0.7)
    above.set_ylabel("ground acceleration\n[m/s2]")
    times = answers["time"].values
    drifts = 100 * answers["peak_storey_drift_ratio_quantile"].max("storey")
    middle.fill_between(times, *drifts.sel(quantile=[0.16, 0.84]).transpose("quantile", "time").values, alpha=0.3)
    middle.plot(times, drifts.sel(quantile=0.5))
    middle.set_ylabel("peak storey drift ratio\nso far [%]")
    middle.text(0.98, 0.08, "median, 16 % and 84 % of the ensemble", transform=middle.transAxes, ha="right")
    states = [str(state) for state in answers["damage_state"].values]
    colours = ("#4575b4", "#91bfdb", "#fee090", "#fc8d59", "#d73027")
    shares = answers["damage_probability"].transpose("damage_state", "time").values
    below.stackplot(times, shares, labels=states, colors=colours[: len(states)])
    below.set_ylabel("share of the ensemble")
    below.set_xlabel("time since the start of the record [s]")
    below.set(ylim=(0, 1), xlim=(times[0], times[-1]))
    below.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), title="damage state", reverse=True)
    return figure


def main() -> None:
    """Run the study from the command line."""
    shown = {"display": "show the answers in a browser of this computer, and play the record back in real time"}
    arguments = read_arguments(
        __doc__, 10_000, meaning="structures in the ensemble", counted="structures", switches=shown
    )
    target = file_in(arguments.out, "live_damage.nc")
    motion = record()
    scene = wd.Scene(
        BUILDING,
        motion,
        SCATTER,
        correlation={("stiffness", "yield_force"): 0.6},
        recorders=("drift",),
        collapse_drift_ratio=0.10,
        title="Damage of a five-storey building while a record arrives",
    )
    answers, run = follow(scene, arguments.structures, arguments.seed, arguments.device, arguments.display)
    whole = wd.simulate(scene, structures=arguments.structures, seed=arguments.seed, device=arguments.device)
    is_same = all(run[name].equals(whole[name]) for name in whole.variables)
    seconds = 1000 * answers["seconds_of_answer"].values[1:]  # the first answer takes longer
    print(f"{answers.attrs['packets']} packets, {answers.attrs['duplicate_packets']} of them repeated")
    print(f"answers: median {np.median(seconds):.1f} ms, 99 % within {np.quantile(seconds, 0.99):.1f} ms")
    print(f"the result {'has the bits' if is_same else 'DIFFERS from that'} of simulate for the whole record")
    last = answers["damage_probability"].isel(time=-1)
    print(
        "  ".join(f"{name} {float(value):.1%}" for name, value in zip(last["damage_state"].values, last, strict=True))
    )
    answers.attrs |= netcdf.trace(scene.title, "Live")
    netcdf.write(answers, target)
    save_figures({"live_damage": draw(answers, motion)}, arguments.out)


if __name__ == "__main__":
    main()
