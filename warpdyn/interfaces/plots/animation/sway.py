"""Animations of response histories: swaying buildings, roof displacements, and the hysteresis loop of one storey."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from warpdyn.foundations.core.checks import finite_numbers, real_number, shortened, whole_number
from warpdyn.interfaces.plots.animation.movie import FUNCTION, Movie
from warpdyn.interfaces.plots.histories import chosen_history, number_of_sample, sample_title, time_of_collapse
from warpdyn.interfaces.plots.style import (
    COLLAPSE_COLOUR,
    COLOURS,
    PALE,
    SMALL,
    TITLE,
    grid,
    literal,
    new_figure,
    title,
)

MOST_BUILDINGS = 6  # largest number of buildings in one figure; with more, each would be too narrow
MOST_FRAMES = 5_000
# WIDTH: width of a drawn building, SWAY: its largest displacement, both divided by the distance between two buildings.
WIDTH, SWAY = 0.42, 0.4
# SHAPE: width of the panel, WIDEST: largest distance between two buildings, both divided by the height of the building.
SHAPE, WIDEST = 1.3, 0.8
# Colours of text below the buildings: the colours of some buildings are too light for text (contrast below 4.5 to 1).
TEXT_COLOUR, COLLAPSE_TEXT = "0.15", "#a84200"
POINTS = 9  # number of drawn points of a column between two floors
# Displacement of a column that is clamped at both ends, divided by the storey drift, at these points.
COLUMN = 3 * np.linspace(0, 1, POINTS) ** 2 - 2 * np.linspace(0, 1, POINTS) ** 3


@dataclass(frozen=True, eq=False)
class _Shown:
    """Values of one response history that an animation draws.

    Args:
        sample: Index of the sample.
        displacement: Displacements of the floors at the frames [m], shape [frame, floor]. After a collapse, the last
            displacements before it are repeated.
        time: Times of the kept states up to the last frame or the collapse [s], shape [time].
        roof: Displacement of the roof at these times [m], shape [time].
        drift: Drift of the storey whose hysteresis loop is drawn, at these times [m], shape [time].
        force: Force of this storey at these times [N], shape [time].
        collapse: Time of collapse [s]; infinite without collapse.
    """

    sample: int
    displacement: np.ndarray
    time: np.ndarray
    roof: np.ndarray
    drift: np.ndarray
    force: np.ndarray
    collapse: float

    def until(self, time: float) -> slice:
        """Return the slice of the kept states up to a time [s]; it contains at least one state."""
        return slice(0, max(int(np.searchsorted(self.time, time * (1 + 1e-9), side="right")), 1))


def animate(
    dataset: xr.Dataset,
    histories: int | Sequence[int] | None = None,
    *,
    storey: int | None = None,
    time: tuple[float, float] | None = None,
    magnification: float | None = None,
    speed: float = 1.0,
    fps: float = 20.0,
) -> Movie:
    """Animate samples of a run: swaying buildings, roof displacements, and the hysteresis loop of one storey.

    The buildings sway next to each other, with magnified displacements. The hysteresis loop (force against drift) is
    that of one storey in the first history. After a collapse, a building is drawn in its last position.

    Args:
        dataset: Result of `simulate` for a ShearBuilding with histories,
            `simulate(scene, histories=wd.Histories([0, 1, 2]))`.
        histories: Index or indices of the histories, counted from 0, at most 6. None: the first histories, at most 6,
            whose samples did not fail.
        storey: Number of the storey whose hysteresis loop is drawn, counted from 1. None: the storey with the largest
            drift in the first history.
        time: Start and end [s] of the part of the histories that is shown; None: the complete histories.
        magnification: Factor by which displacements are magnified in the drawing [1]; None: chosen from 1, 2, 5, 10,
            ... The figure shows the factor.
        speed: Seconds of the histories per second of the animation [1]; 1: real time, 2: twice as fast.
        fps: Frames per second of the animation [Hz].

    Returns:
        The animation (`matplotlib.animation.FuncAnimation`). `animation.save("sway.gif")` writes it as GIF, WebP or MP4
        (MP4 needs the program ffmpeg). A notebook shows the animation if it is the last line of a cell.

    Raises:
        ValueError: If the dataset has no such history or storey, if all samples failed, or if a number is out of its
            range.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> run = wd.simulate(scene, structures=3, histories=wd.Histories([5, 53, 101]))
        >>> animation = wd.plots.animate(run, time=(2.0, 4.0), fps=10)
        >>> animation.save("sway.gif", dpi=60)
        >>> animation.frames
        21
    """
    chosen = [
        chosen_history(FUNCTION, dataset, each, "displacement", "storey_force") for each in _indices(dataset, histories)
    ]
    times = _frames(
        chosen[0]["time"].values, time, real_number("speed", speed, above=0) / real_number("fps", fps, above=0)
    )
    if magnification is not None:
        real_number("magnification", magnification, above=0)
    number = _storey(chosen[0], storey)
    shown = [_shown(dataset, each, times, number) for each in chosen]
    heights = _heights(dataset, shown[0].displacement.shape[1])
    figure = new_figure(9.0, 4.8)
    subfigures: Any = figure.subfigures(1, 2, width_ratios=(1.15, 1))
    left, right = subfigures
    sway, (roof, loop) = left.subplots(), right.subplots(2, 1, height_ratios=(1, 1.25))
    parts: list[_Buildings | _Roofs | _Loop] = [
        _Buildings(sway, shown, heights, times, magnification, _common_title(dataset, chosen)),
        _Roofs(roof, shown, times),
        _Loop(loop, shown[0], times, number),
    ]

    def draw(frame: int) -> list[Any]:
        return [artist for part in parts for artist in part.draw(frame)]

    draw(times.size - 1)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # keeps the positions of the axes in all frames
    return Movie(figure, draw, times.size, float(fps))


def _indices(dataset: xr.Dataset, histories: int | Sequence[int] | None) -> list[int]:
    """Return the indices of the histories that are drawn; None: those of the first samples that did not fail."""
    if histories is not None:
        if isinstance(histories, str) or not np.iterable(histories):
            return [histories]  # `chosen_history` checks it
        if not 0 < len(asked := list(histories)) <= MOST_BUILDINGS:
            raise ValueError(
                f"plots.{FUNCTION} draws 1 to {MOST_BUILDINGS} histories, got {len(asked)}: give histories=[0, 1, 2]"
            )
        return asked
    if not isinstance(dataset, xr.Dataset) or "displacement" not in dataset or "history" not in dataset.dims:
        return [0]  # `chosen_history` raises an error, or returns a single history
    finite = np.isfinite(dataset["displacement"].values).any(axis=(1, 2))
    return [int(place) for place in np.flatnonzero(finite)[:MOST_BUILDINGS]] or [0]


def _frames(kept: np.ndarray, time: tuple[float, float] | None, step: float) -> np.ndarray:
    """Return the times of the frames [s], shape [frame], `step` apart, within the part `time` of the histories."""
    first, last = float(kept[0]), float(kept[-1])
    if time is not None:
        given = finite_numbers("time [s]", time)
        if given.shape != (2,) or not first <= given[0] < given[1]:
            raise ValueError(
                f"plots.{FUNCTION}: time must be a start of at least {first:g} s and a later end [s], such as "
                f"time=({first:g}, {last:g}), got {shortened(time)}"
            )
        if given[0] >= last:
            raise ValueError(
                f"plots.{FUNCTION}: time begins at {given[0]:g} s, but the histories end at {last:g} s: give an "
                f"earlier start, such as time=({first:g}, {last:g})"
            )
        first, last = float(given[0]), min(float(given[1]), last)
    count = int((last - first) / step * (1 + 1e-9)) + 1
    if count > MOST_FRAMES:
        raise ValueError(
            f"plots.{FUNCTION} would draw {count:,} frames, more than {MOST_FRAMES:,}: give a shorter time=({first:g}, "
            f"{first + MOST_FRAMES * step / 2:.3g}), a larger speed= or fewer fps="
        )
    return first + step * np.arange(count)


def _storey(chosen: xr.Dataset, storey: int | None) -> int:
    """Return the number of the storey whose hysteresis loop is drawn, counted from 1."""
    drift = np.abs(np.diff(chosen["displacement"].values, axis=1, prepend=0.0))
    if storey is None:
        return 1 + int(np.argmax(np.nanmax(drift, axis=0)))
    if whole_number("storey", storey, 1) > drift.shape[1]:
        raise ValueError(f"plots.{FUNCTION}: storey={storey} does not exist; give 1 to {drift.shape[1]}")
    return storey


def _shown(dataset: xr.Dataset, chosen: xr.Dataset, times: np.ndarray, storey: int) -> _Shown:
    """Return the drawn values of a history: linearly interpolated at the times of the frames [s].

    After a collapse, the last state before it is repeated.
    """
    displacement, force = chosen["displacement"].values, chosen["storey_force"].values[:, storey - 1]
    known = np.isfinite(displacement).all(axis=1)
    at = np.minimum(times, chosen["time"].values[known][-1])
    kept = chosen["time"].values[known]
    floors = np.stack([np.interp(at, kept, floor) for floor in displacement[known].T], axis=1)
    inside = known & (chosen["time"].values >= times[0]) & (chosen["time"].values <= times[-1])
    inside[np.flatnonzero(known)[-1]] |= not inside.any()  # for a collapse before the first frame
    drift = np.diff(displacement[inside], axis=1, prepend=0.0)[:, storey - 1]
    collapse = (time_of_collapse(dataset, chosen) or (np.inf, ""))[0]
    time, roof = chosen["time"].values[inside], displacement[inside, -1]
    return _Shown(number_of_sample(chosen), floors, time, roof, drift, force[inside], collapse)


def _heights(dataset: xr.Dataset, storeys: int) -> np.ndarray:
    """Return the heights of the storeys [m] from the scene of the run; 1 m each if the dataset lacks them."""
    try:
        told = json.loads(str(dataset.attrs["scene"]))["structure"]["height"]
        heights = np.broadcast_to(np.array(told, dtype=float), (storeys,))
    except (KeyError, TypeError, ValueError):  # a run of a portfolio, or a dataset without a scene
        return np.ones(storeys)
    return np.maximum(heights, 0.1 * heights.max())  # so that isolators, whose height is small, are visible


def _common_title(dataset: xr.Dataset, chosen: Sequence[xr.Dataset]) -> str:
    """Return motion and intensity level of the samples as text, if they are the same for all samples; else ""."""
    texts = {sample_title(dataset, each).partition(": ")[2] for each in chosen}
    return texts.pop() if len(texts) == 1 else ""


def _round_number(value: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20, ... that is at most `value`; 1 if `value` is below 1."""
    power = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return float(max(factor * power for factor in (1, 2, 5) if factor * power <= max(value, 1.0)))


class _Buildings:
    """Panel of an animation that shows the swaying buildings."""

    def __init__(
        self,
        axes: Axes,
        shown: Sequence[_Shown],
        heights: np.ndarray,
        times: np.ndarray,
        scale: float | None,
        under: str,
    ) -> None:
        self.shown, self.times = shown, times
        self.level = np.concatenate([[0.0], np.cumsum(heights)])
        total = float(self.level[-1])
        distance = min(SHAPE / (len(shown) + 0.5), WIDEST) * total  # between two buildings
        largest = max(float(np.abs(each.displacement).max()) for each in shown) or 1.0
        self.scale = scale or _round_number(SWAY * distance / largest)
        self.centres = distance * np.arange(len(shown))
        self.half = WIDTH * distance / 2
        axes.set_xlim(-0.75 * distance, self.centres[-1] + 0.75 * distance)
        axes.set_ylim(-0.22 * total, 1.05 * total)
        axes.set_aspect("equal", adjustable="box")
        axes.set_axis_off()
        axes.axhline(0, color="0.3", lw=1.2)
        words = f"Displacements magnified {self.scale:g} times" if self.scale != 1 else "Displacements to scale"
        title(axes, f"{under}\n{words}" if under else words)
        self.lines, self.labels = [], []
        for i, each in enumerate(shown):
            colour = COLOURS[i % len(COLOURS)]
            (line,) = axes.plot([], [], color=colour, lw=1.6, solid_capstyle="round")
            self.lines.append(line)
            label = axes.text(
                self.centres[i],
                -0.03 * total,
                f"sample {each.sample}",
                color=TEXT_COLOUR,
                ha="center",
                va="top",
                fontsize=SMALL,
            )
            self.labels.append(label)
        middle = float(self.centres.mean())
        self.clock = axes.text(middle, -0.22 * total, "", ha="center", va="bottom", fontsize=TITLE)

    def draw(self, frame: int) -> list[Any]:
        """Draw a frame, given by its number, and return the drawn objects (artists of matplotlib)."""
        for i, (each, line) in enumerate(zip(self.shown, self.lines, strict=True)):
            x = self.centres[i] + self.scale * np.concatenate([[0.0], each.displacement[frame]])
            column = np.concatenate([low + (high - low) * COLUMN for low, high in itertools.pairwise(x)])
            height = np.concatenate([np.linspace(*pair, POINTS) for pair in itertools.pairwise(self.level)])
            gap = [np.nan]
            floors = [np.array([at - self.half, at + self.half, np.nan]) for at in x[1:]]
            levels = [np.array([at, at, np.nan]) for at in self.level[1:]]
            line.set_data(
                np.concatenate([column - self.half, gap, column + self.half, gap, *floors]),
                np.concatenate([height, gap, height, gap, *levels]),
            )
            if each.collapse <= self.times[frame]:
                line.set(color=COLLAPSE_COLOUR, ls=(0, (3, 1.5)))
                self.labels[i].set(color=COLLAPSE_TEXT, text=f"sample {each.sample}\ncollapsed")
            else:
                colour = COLOURS[i % len(COLOURS)]
                line.set(color=colour, ls="-")
                self.labels[i].set(color=TEXT_COLOUR, text=f"sample {each.sample}")
        self.clock.set_text(f"{self.times[frame]:.1f} s")
        return [*self.lines, *self.labels, self.clock]


class _Roofs:
    """Panel of an animation that shows roof displacements over time; values after the time of the frame are pale."""

    def __init__(self, axes: Axes, shown: Sequence[_Shown], times: np.ndarray) -> None:
        self.shown, self.times = shown, times
        self.lines, self.dots = [], []
        for i, each in enumerate(shown):
            axes.plot(each.time, 1000 * each.roof, color=PALE, lw=0.5)
            (line,) = axes.plot([], [], color=COLOURS[i % len(COLOURS)], lw=1.0)
            (dot,) = axes.plot([], [], "o", color=COLOURS[i % len(COLOURS)], ms=4)
            self.lines.append(line)
            self.dots.append(dot)
        axes.set_xlim(times[0], times[-1] if times.size > 1 else times[0] + 1)
        axes.set_xlabel("Time [s]", fontsize=SMALL)
        axes.set_ylabel("[mm]", fontsize=SMALL)
        axes.tick_params(labelsize=SMALL)
        title(axes, "Roof displacement")
        grid(axes)

    def draw(self, frame: int) -> list[Any]:
        """Draw a frame, given by its number, and return the drawn objects (artists of matplotlib)."""
        for each, line, dot in zip(self.shown, self.lines, self.dots, strict=True):
            until = each.until(self.times[frame])
            line.set_data(each.time[until], 1000 * each.roof[until])
            dot.set_data(each.time[until][-1:], 1000 * each.roof[until][-1:])
        return [*self.lines, *self.dots]


class _Loop:
    """Panel of an animation that shows the hysteresis loop of one storey in the first history."""

    def __init__(self, axes: Axes, shown: _Shown, times: np.ndarray, storey: int) -> None:
        self.shown, self.times = shown, times
        self.drift, self.force = 1000 * shown.drift, shown.force / 1e6
        axes.plot(self.drift, self.force, color=PALE, lw=0.5)
        (self.line,) = axes.plot([], [], color=COLOURS[0], lw=1.0)
        (self.dot,) = axes.plot([], [], "o", color=COLOURS[0], ms=4)
        axes.set_xlabel("Storey drift [mm]", fontsize=SMALL)
        axes.set_ylabel("[MN]", fontsize=SMALL)
        axes.tick_params(labelsize=SMALL)
        title(axes, literal(f"Force in storey {storey} of sample {shown.sample}"))
        grid(axes)

    def draw(self, frame: int) -> list[Any]:
        """Draw a frame, given by its number, and return the drawn objects (artists of matplotlib)."""
        until = self.shown.until(self.times[frame])
        self.line.set_data(self.drift[until], self.force[until])
        self.dot.set_data(self.drift[until][-1:], self.force[until][-1:])
        return [self.line, self.dot]
