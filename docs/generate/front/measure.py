"""Numbers and pictures of the front page: `python docs/generate/front/measure.py results/p695_fragility.nc`.

The file is the result of the first study. The script takes its fragility curves, runs variants of its building under
one record, and writes `docs/_static/front/numbers.json` and the pictures that are drawn from it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

DOCS = Path(__file__).resolve().parents[2]
FOLDER = DOCS / "_static" / "front"
VARIANTS = 48
RECORD = "Northridge 1994 MUL009"
LEVEL = 0.6  # g, Sa at the first period
EVERY = 4  # every fourth point of a curve is kept


def measure(study: Path) -> dict[str, Any]:
    """Return the numbers of the pictures: displacements of the variants [m], and fragility curves against Sa [g]."""
    import xarray as xr

    sys.path[:0] = [str(DOCS.parent / "studies")]
    import p695_fragility as first

    import warpdyn as wd

    motions = [motion for motion in wd.records.far_field() if RECORD in motion.name]
    measure = wd.SpectralAcceleration(first.BUILDING.fundamental_period)
    scene = wd.Scene(first.BUILDING, wd.Stripes(motions, [LEVEL], measure), scatter=first.SCATTER, recorders=("drift",))
    run = wd.simulate(scene, structures=VARIANTS, seed=0, device="cpu", histories=wd.Histories(list(range(VARIANTS))))
    displacement = run["displacement"].transpose("history", "time", "dof").values
    instant = int(np.abs(np.nanmedian(displacement[:, :, -1], axis=0)).argmax())
    sway = displacement[:, instant]
    with xr.open_dataset(study) as result:
        inside = result["intensity"].values[::EVERY]
        states = {}
        for state in result["damage_state"].values:
            row = result.sel(damage_state=state)
            states[str(state)] = {
                name: np.round(row[f"fragility_curve{end}"].values[::EVERY], 4).tolist()
                for name, end in (("curve", ""), ("lower", "_lower"), ("upper", "_upper"))
            } | {"median": round(float(row["fragility_median"]), 4)}
        return {
            "source": result.attrs["source"],
            "record": RECORD,
            "seconds": round(float(run["time"].values[instant]), 3),
            "sway": np.round(sway, 4).tolist(),
            "period": round(first.BUILDING.fundamental_period, 2),
            "histories": result.sizes["sample"],
            "intensity": np.round(inside, 4).tolist(),
            "states": states,
        }


if __name__ == "__main__":
    sys.path[:0] = [str(DOCS)]
    from generate.front.pictures import draw

    FOLDER.mkdir(parents=True, exist_ok=True)
    numbers = measure(Path(sys.argv[1]))
    (FOLDER / "numbers.json").write_text(json.dumps(numbers) + "\n", encoding="utf-8")
    draw(numbers, FOLDER)
