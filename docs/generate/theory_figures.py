"""Figures of the theory manual that are drawn from formulas and from the functions of the package."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import ndtr
from scipy.stats import qmc

from generate.theory_style import BLUE, GREEN, GREY, INK, ORANGE, PINK, YELLOW, save
from warpdyn.answers.fragility.estimators.binomial import fit_probit
from warpdyn.engine.methods.stability_limits import stability_limit
from warpdyn.engine.methods.table import METHODS
from warpdyn.model.structures.modal import rayleigh_coefficients

SIZE = (8.6, 4.3)
SHOWN = {"rk4": BLUE, "stoermer": ORANGE, "velocity_verlet": GREEN, "newmark_average": INK, "hht_alpha": PINK}


def _axes(title: str, **labels: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    axes.set_title(title, loc="left")
    axes.set(**labels)  # type: ignore[arg-type]
    return figure, axes


def draw_forces(path: Path) -> None:
    """Draw a three-storey building, displaced, with the forces on its second floor."""
    figure, axes = _axes("Displacements are relative to the ground; a drift is the difference of two floors")
    shape, height = np.array([0.0, 0.5, 1.1, 1.6]), np.arange(4.0)
    for side in (-0.9, 0.9):
        axes.plot(np.full(4, side), height, color=GREY, lw=1, ls="--")
        axes.plot(shape + side, height, color=BLUE, lw=2)
    for level in range(1, 4):
        axes.plot(shape[level] + np.array([-1.1, 1.1]), [level, level], color=INK, lw=6, solid_capstyle="butt")
    axes.plot([-1.7, 1.9], [0, 0], color=INK, lw=1.5)
    axes.annotate("", (1.1 - 0.9, 2.34), (-0.9, 2.34), arrowprops={"arrowstyle": "->", "color": ORANGE})
    axes.text(-2.1, 2.5, "displacement u₂ > 0", color=ORANGE)
    axes.annotate("", (2.7, 2.28), (2.1, 2.28), arrowprops={"arrowstyle": "->", "color": ORANGE})
    axes.text(2.75, 2.24, "drift Δ₂ = u₂ - u₁")
    axes.plot([1.4, 1.4], [1, 2.34], color=GREY, lw=0.8, ls=":")
    axes.plot([2.0, 2.0], [2, 2.34], color=GREY, lw=0.8, ls=":")
    _free_body(axes, 5.6)
    axes.annotate("", (0.9, -0.35), (-0.7, -0.35), arrowprops={"arrowstyle": "->", "color": GREEN})
    axes.text(1.0, -0.42, "base acceleration a_g > 0")
    axes.set(xlim=(-2.2, 9.6), ylim=(-0.7, 3.7), xticks=[], yticks=[])
    axes.spines[["left", "bottom"]].set_visible(False)
    save(figure, path)


def _free_body(axes: Axes, x: float) -> None:
    axes.plot([x, x + 2.2], [2, 2], color=INK, lw=9, solid_capstyle="butt")
    for (end, start), words, place in (
        (((x + 2.0, 2.45), (x + 0.9, 2.45)), "f₃ from the storey above", (x + 0.1, 2.6)),
        (((x + 0.2, 1.55), (x + 1.3, 1.55)), "f₂ from the storey below", (x + 0.1, 1.22)),
        (((x + 3.3, 2.0), (x + 2.35, 2.0)), "force p₂", (x + 2.4, 2.14)),
    ):
        axes.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": BLUE, "lw": 2})
        axes.text(*place, words)
    axes.text(x, 3.15, "Forces on floor 2:\nm₂ (ü₂ + a_g) = f₃ - f₂ + p₂ - a₀ m₂ u̇₂", va="center")


def draw_p_delta(path: Path) -> None:
    """Draw a bilinear storey with and without P-Delta."""
    figure, axes = _axes(
        "Gravity tilts the curve by -W/h: equilibrium is lost where the tilted force is zero",
        xlabel="drift over yield drift",
        ylabel="force over yield force",
    )
    drift = np.linspace(0, 22, 400)
    spring = np.minimum(drift, 1 + 0.03 * (drift - 1))
    net = spring - 0.09 * drift
    axes.plot(drift, spring, color=BLUE, lw=2)
    axes.plot(drift, net, color=ORANGE, lw=2)
    zero = float(drift[np.argmin(np.abs(net[10:])) + 10])
    axes.axhline(0, color=GREY, lw=0.8)
    axes.plot(zero, 0, "o", color=INK)
    axes.annotate("equilibrium is lost", (zero, 0), (-40, 22), textcoords="offset points", ha="center")
    axes.annotate("force of the storey law", (11, 1.3), (0, 12), textcoords="offset points", color=BLUE, ha="right")
    axes.annotate("with P-Delta", (8, 0.49), (6, 10), textcoords="offset points", color=ORANGE)
    axes.set(xlim=(0, 22), ylim=(-0.45, 1.8))
    save(figure, path)


def draw_damping(path: Path) -> None:
    """Draw damping ratios against frequency, all 5 % in the first mode."""
    figure, axes = _axes(
        "Only modal damping has the same ratio at every frequency",
        xlabel="frequency over the first frequency",
        ylabel="damping ratio",
    )
    ratio, frequency = 0.05, np.geomspace(0.3, 12, 300)
    of_mass, of_stiffness = (float(part) for part in rayleigh_coefficients(1.0, 3.0, ratio))
    curves = {
        "mass proportional": (ratio / frequency, GREEN, (9.0, 0.012)),
        "stiffness proportional": (ratio * frequency, ORANGE, (2.9, 0.215)),
        "Rayleigh (modes at 1 and 3)": ((of_mass / frequency + of_stiffness * frequency) / 2, BLUE, (6.4, 0.128)),
        "modal": (np.full_like(frequency, ratio), INK, (9.9, 0.056)),
    }
    for words, (values, colour, place) in curves.items():
        axes.plot(frequency, values, color=colour, lw=2)
        axes.text(*place, words, color=colour, ha="right" if words.startswith("stiffness") else "left")
    axes.plot([1, 3], [ratio, ratio], "o", color=BLUE)
    axes.set(ylim=(0, 0.25), xlim=(0, 12))
    save(figure, path)


def draw_limits(path: Path) -> None:
    """Draw stability limits of methods against the damping ratio."""
    figure, axes = _axes(
        "Damping shortens the stable step of stoermer, but hardly that of rk4",
        xlabel="damping ratio of the mode",
        ylabel="largest ωh",
    )
    ratios = np.linspace(0, 1, 61)
    for name, colour in (
        ("rk4", BLUE),
        ("central_difference", INK),
        ("velocity_verlet", GREEN),
        ("central_difference_lagged", PINK),
        ("stoermer", ORANGE),
        ("heun", YELLOW),
    ):
        values = [stability_limit(METHODS[name], float(ratio)) for ratio in ratios]
        axes.plot(ratios, values, color=colour, lw=2)
        shift = {"heun": 0.10, "central_difference": -0.12}.get(name, 0.0)
        axes.text(1.01, values[-1] + shift, name, color="#8A6100" if name == "heun" else colour, va="center")
    axes.set(xlim=(0, 1.35), ylim=(0, 3.2), xticks=np.arange(0, 1.01, 0.2))
    save(figure, path)


def draw_errors(path: Path) -> None:
    """Draw period error and numerical damping of methods."""
    figure = Figure(figsize=SIZE, layout="constrained")
    left, right = figure.subplots(1, 2)
    steps = np.geomspace(0.05, 1.0, 60)
    for name, colour in SHOWN.items():
        growth = np.linalg.eigvals(METHODS[name].amplification(steps, np.zeros_like(steps)))  # type: ignore[union-attr]
        exact = np.exp(1j * steps)[:, None]
        root = growth[np.arange(steps.size), np.abs(growth - exact).argmin(axis=1)]
        left.loglog(steps, np.abs(steps / np.angle(root) - 1), color=colour, lw=2, label=name)
        right.semilogx(steps, -np.log(np.abs(root)) / np.angle(root), color=colour, lw=2)
    left.set_title("Period error: rk4 is of order 4", loc="left")
    right.set_title("Numerical damping grows with the step", loc="left")
    left.set(xlabel="ωh", ylabel="relative error of the period", ylim=(1e-8, 0.2))
    right.set(xlabel="ωh", ylabel="numerical damping ratio", ylim=(-0.005, 0.03))
    figure.legend(loc="outside lower center", ncols=5, frameon=False)
    save(figure, path)


def draw_sampling(path: Path) -> None:
    """Draw 256 points of a scrambled Sobol sequence and of independent random numbers."""
    figure = Figure(figsize=SIZE, layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(*qmc.Sobol(2, rng=np.random.default_rng(1)).random(256).T, "o", color=BLUE, ms=4)
    right.plot(*np.random.default_rng(1).uniform(size=(2, 256)), "o", color=ORANGE, ms=4)
    left.set_title("Sobol: 256 points fill the square evenly", loc="left")
    right.set_title("Monte Carlo: gaps and clusters", loc="left")
    for axes in (left, right):
        axes.set(xlabel="first variable", ylabel="second variable", aspect="equal", xlim=(0, 1), ylim=(0, 1))
    save(figure, path)


def draw_fragility(path: Path) -> None:
    """Draw a lognormal curve fitted to stripe counts."""
    figure, axes = _axes(
        "A lognormal curve is fitted to the exceedance counts of the stripes",
        xlabel="intensity [g]",
        ylabel="probability of exceedance",
    )
    levels, total = np.array([0.2, 0.4, 0.6, 0.8, 1.0, 1.3]), 44
    exceeding = np.array([1, 6, 17, 28, 34, 41])
    median, dispersion, _ = fit_probit(levels, exceeding, total)
    grid = np.linspace(0.02, 1.6, 200)
    axes.plot(grid, ndtr(np.log(grid / median) / dispersion), color=BLUE, lw=2)
    axes.plot(levels, exceeding / total, "o", color=INK, ms=7)
    for level, count in zip(levels, exceeding, strict=True):
        axes.annotate(f"{count} of {total}", (level, count / total), (8, -14), textcoords="offset points")
    axes.plot([0, float(median), float(median)], [0.5, 0.5, 0], color=GREY, lw=1, ls="--")
    words = f"median θ = {float(median):.2f} g\ndispersion β = {float(dispersion):.2f}"
    axes.text(0.05, 0.72, words, color=BLUE)
    axes.set(xlim=(0, 1.6), ylim=(0, 1.04))
    save(figure, path)


def draw_rate(path: Path) -> None:
    """Draw hazard, fragility and the rate from each intensity."""
    figure, axes = _axes(
        "Intensities below the median capacity contribute most of this annual rate",
        xlabel="intensity [g]",
        ylabel="over the largest value",
    )
    grid = np.geomspace(0.05, 3, 400)
    rate, curve = 1e-3 * (grid / 0.3) ** -2.5, ndtr(np.log(grid / 0.9) / 0.45)
    density = curve * 2.5 * rate
    axes.semilogx(grid, rate / rate[0], color=GREEN, lw=2)
    axes.semilogx(grid, curve, color=BLUE, lw=2)
    axes.fill_between(grid, density / density.max(), color=ORANGE, alpha=0.3, lw=0)
    axes.semilogx(grid, density / density.max(), color=ORANGE, lw=2)
    axes.axvline(0.9, color=GREY, lw=1, ls="--")
    axes.text(0.93, 0.03, "median")
    for words, place, colour in (
        ("hazard", (0.068, 0.62), GREEN),
        ("fragility", (1.35, 0.75), BLUE),
        ("rate per ln(intensity)", (0.19, 0.9), ORANGE),
    ):
        axes.text(*place, words, color=colour)
    axes.set(
        xlim=(0.05, 3), ylim=(0, 1.08), xticks=[0.05, 0.1, 0.2, 0.5, 1, 2], xticklabels=[0.05, 0.1, 0.2, 0.5, 1, 2]
    )
    axes.minorticks_off()
    save(figure, path)


FIGURES: dict[str, Callable[[Path], None]] = {
    "forces": draw_forces,
    "p_delta": draw_p_delta,
    "damping": draw_damping,
    "limits": draw_limits,
    "errors": draw_errors,
    "sampling": draw_sampling,
    "fragility": draw_fragility,
    "rate": draw_rate,
}
