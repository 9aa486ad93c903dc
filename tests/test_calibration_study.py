"""The study of a calibrated column: data, priors and the figure, with few candidates of one law."""

from __future__ import annotations

import sys

import numpy as np
from conftest import ROOT

import warpdyn as wd

sys.path.insert(0, str(ROOT / "studies"))
import calibrate_column as study


def test_loop_and_figure(tmp_path):
    loop = wd.MeasuredLoop.example()
    assert loop.drift.size == 548
    few = wd.MeasuredLoop(loop.drift[:60], loop.force[:60], first=1)
    found = wd.calibrate("bouc_wen", few, study.SMOOTH, noise=study.NOISE, candidates=100)
    loops = study.posterior_loops("bouc_wen", found, few.drift, 5)
    assert loops.shape == (5, 60)
    assert np.isfinite(loops).all()
    figure = study.draw(few, {"bouc_wen": found, "baber_noori": found.assign(exponent=found["exponent"])})
    figure.savefig(tmp_path / "column.png")
    assert (tmp_path / "column.png").stat().st_size > 5000
