"""The animation of the front page: `python docs/generate/sway.py` writes it to `docs/_static/front` (below 1 MB).

`sway.webp` is the animation, `sway.png` a still picture of it, for readers who prefer reduced motion.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

import warpdyn as wd

FOLDER = Path(__file__).parents[1] / "_static" / "front"
STILL = 60  # number of the frame that the still picture shows


def ground_motion() -> wd.GroundMotion:
    """Return filtered noise with an envelope, which may be distributed (recorded motions may not)."""
    noise = wd.FilteredNoise(
        wd.CloughPenzien(0.012, 12.0, 0.6, 2.5, 0.7), 12.0, 0.01, envelope=wd.JenningsEnvelope(2.0, 6.0, 0.5)
    )
    return wd.GroundMotion(noise.motion(3).acceleration, 0.01, "synthetic motion")


def main() -> None:
    """Run five variants of a building, and write the animation."""
    law = wd.laws.BoucWen(yield_force=np.array([2.6, 2.4, 2.0, 1.4]) * 1e5, hardening_ratio=0.1)  # N
    damped = dict(damping="rayleigh", damping_ratio=0.03)
    building = wd.ShearBuilding(8e4, [4e7, 3.8e7, 3.2e7, 2.4e7], 3.2, law=law, **damped)  # kg, N/m, m
    variants = {
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.3)),
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3)),
    }
    stripes = wd.Stripes([ground_motion()], [0.4], wd.PeakGroundAcceleration(), structures_per_motion="crossed")
    scene = wd.Scene(building, stripes, variants)
    run = wd.simulate(scene, structures=5, seed=2, device="cpu", histories=wd.Histories(range(5)))
    moving = FOLDER / "sway.webp"
    wd.plots.animate(run, time=(1.0, 9.0), fps=10).save(moving, dpi=120)
    with Image.open(moving) as frames:
        frames.seek(STILL)
        frames.convert("RGB").quantize(64).save(FOLDER / "sway.png", optimize=True)
    print(f"{moving}: {moving.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
