"""The animation of the live display: `python docs/generate/live_display.py` writes it to `docs/_static/live`.

It needs the packages playwright and pillow, and the program Chromium (`--chromium`). `display.webp` is the animation,
`display.png` a still picture of it, for readers who prefer reduced motion.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright
from sway import ground_motion

import warpdyn as wd

FOLDER = Path(__file__).parents[1] / "_static" / "live"
WIDTH, HEIGHT = 1120, 700  # pixels
SAMPLES = 10  # samples of the motion in a packet, and in a frame
STILL = 70  # number of the frame that the still picture shows
# Times that depend on the computer are not shown, and the page has the height of the picture.
STYLE = "#status { display: none; } #shares { height: 20rem; } #drift, #loop { height: 15rem; } body { zoom: 0.97; }"


def live_ensemble() -> wd.Live:
    """Return 2,000 candidates of a five-storey building, which wait for a motion."""
    building = wd.ShearBuilding.from_hazus("C1M", "moderate", storeys=5)
    scatter = {
        "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1)),
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.25)),
    }
    motion = ground_motion()
    station = wd.GroundMotion(np.zeros(motion.acceleration.size), motion.step, "station")
    title = "Five-storey building, 2,000 candidates"
    scene = wd.Scene(building, station, scatter, recorders=("drift",), collapse_drift_ratio=0.1, title=title)
    return wd.Live(scene, 2000, limits=wd.hazus_drift_limits("C1M", "moderate"))


def main() -> None:
    """Push the packets of a motion one by one, and take a picture of the page after each of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--chromium", default="/usr/bin/chromium", help="the program [%(default)s]")
    chromium = parser.parse_args().chromium
    live, pictures = live_ensemble(), []
    motion = ground_motion()
    motion = wd.GroundMotion(motion.acceleration * 6.0 / motion.peak_ground_acceleration, motion.step, "artificial")
    with sync_playwright() as play, wd.LiveDisplay(live) as display:
        browser = play.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(display.url)
        page.add_style_tag(content=STYLE)
        for packet in wd.packets.from_motion(motion, SAMPLES):
            answer = live.push(packet)
            shown = f"time {float(answer['time']):.2f} s"
            page.wait_for_function("text => document.getElementById('status').textContent.startsWith(text)", arg=shown)
            with Image.open(io.BytesIO(page.screenshot())) as picture:
                pictures.append(picture.convert("RGB"))
        browser.close()
    FOLDER.mkdir(exist_ok=True)
    moving = FOLDER / "display.webp"
    first, *others = pictures
    first.save(moving, save_all=True, append_images=others, duration=100, loop=0, quality=60, method=4)
    pictures[STILL].quantize(256).save(FOLDER / "display.png", optimize=True)
    print(f"{moving}: {len(pictures)} frames, {moving.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
