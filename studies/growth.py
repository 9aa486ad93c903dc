"""Growth of the computing time of a run with the number of samples, storeys, steps and motions.

    python studies/growth.py --out results --device cuda:0 --samples 16777216

Each axis varies one of these numbers. If storeys, steps or motions increase, the number of samples is reduced, so that
all points have the same number of steps times storeys; ideally their computing time is constant. The figure shows the
time divided by steps times storeys. The study writes growth.csv and growth.png. It prints the exponent of the growth
along each axis, and every jump: a cost per storey and step that is more than 1.5 times the cost at the next smaller
size.
"""

from __future__ import annotations

import csv
from dataclasses import asdict

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from parts.command_line import read_arguments, save_figures
from parts.growth.axes import axes, exponent, measure, steps_of_cost
from tqdm import tqdm

CLIFF = 1.5  # ratio of the costs at two successive sizes above which a jump is printed
LABELS = {
    "samples": "samples of five storeys and 500 steps",
    "storeys": "storeys",
    "steps": "steps of a motion",
    "motions": "motions",
}


def draw(rows: list[dict[str, float]], device: str) -> Figure:
    """Draw the time per storey and step [ns] over each size: of `simulate` as a whole, and of its kernels."""
    figure, panels = plt.subplots(2, 2, figsize=(9, 6.5), sharey=True, layout="constrained")
    for panel, (axis, label) in zip(panels.flat, LABELS.items(), strict=True):
        found = [row for row in rows if row["axis"] == axis]
        sizes = [row[axis] for row in found]
        for part, style in (("simulate", "o-"), ("kernels", "s--")):
            panel.loglog(sizes, [1e9 * row[part] / row["storey_steps"] for row in found], style, label=part, ms=4)
        panel.set(xlabel=label)
        panel.grid(alpha=0.3)
    for panel in panels[:, 0]:
        panel.set_ylabel("time per storey and step [ns]")
    panels[0, 0].legend()
    figure.suptitle(f"Time per storey and step against the size of a run ({device})")
    return figure


def main() -> None:
    """Run the study from the command line: measure, print, write growth.csv and draw growth.png."""
    arguments = read_arguments(__doc__, 2**20, "the most samples")
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows: list[dict] = []
    device = arguments.device or "default device"
    for axis, sizes in axes(arguments.samples).items():
        for size in tqdm(sizes, desc=axis, unit="size", disable=None):
            told = {"axis": axis, **asdict(size), "storey_steps": size.storey_steps}
            rows.append(told | measure(size, arguments.device))
    with (arguments.out / "growth.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for axis in LABELS:
        found = [row for row in rows if row["axis"] == axis]
        sizes = np.array([row[axis] for row in found], float)
        for part in ("simulate", "kernels"):
            seconds = np.array([row[part] for row in found])
            costs = seconds / [row["storey_steps"] for row in found]
            grown = exponent(sizes, costs * sizes)
            cliffs = [f"{a:.0f} to {b:.0f}: {c:.2f}" for a, b, c in steps_of_cost(sizes, costs) if c > CLIFF]
            print(f"{axis:8} {part:8} time grows with the power {grown:.2f}; cliffs: {', '.join(cliffs) or 'none'}")
    save_figures({"growth": draw(rows, device)}, arguments.out)


if __name__ == "__main__":
    main()
