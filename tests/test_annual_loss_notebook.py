"""The notebook from records to annual loss runs, and its numbers follow from its fragility curves and hazard."""

import re

import nbformat
import numpy as np
import pandas as pd
from conftest import ROOT
from nbclient import NotebookClient
from scipy.stats import norm

import warpdyn as wd

# As the notebook has them; of Hazus' RES3 the tables 15.2 to 15.4 of the Hazus-MH manual.
INTENSITY = [0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4]
RATE = [2.0e-1, 8.0e-2, 3.5e-2, 1.2e-2, 3.0e-3, 5.0e-4, 5.0e-5, 3.0e-6, 1.0e-7]
LOSS_RATIOS = [0.02, 0.1, 0.413, 1.0]
STATES = ["slight", "moderate", "extensive", "complete"]


def test_the_notebook_s_losses_follow_from_its_curves_and_hazard(tmp_path, monkeypatch):
    monkeypatch.setenv("WARPDYN_RESULTS", str(tmp_path))
    path = ROOT / "studies" / "notebooks" / "annual_loss.ipynb"
    notebook = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # committed without outputs
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    text = "".join(output.get("text", "") for output in outputs)
    assert "Warning" not in text
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 4

    curves = pd.read_csv(tmp_path / "curves.csv").set_index("damage_state").loc[STATES]
    # Rates by the trapezoidal rule, from the hazard curve as straight lines of the logarithms.
    level = np.geomspace(INTENSITY[0], INTENSITY[-1], 20_001)
    hazard = np.exp(np.interp(np.log(level), np.log(INTENSITY), np.log(RATE)))
    median, dispersion = curves.fragility_median_g.values, curves.fragility_dispersion.values
    exceeded = norm.cdf(np.log(level / median[:, None]) / dispersion[:, None])
    rate = -(0.5 * (exceeded[:, 1:] + exceeded[:, :-1]) * np.diff(hazard)).sum(axis=1)
    rate += RATE[-1] * exceeded[:, -1]  # motions above the last point, at their least intensity
    for state, expected in zip(STATES, rate, strict=True):
        printed = float(re.search(rf"{state} +once in +(\d+) years", text)[1])
        # Printed to a year; motions above the last point, a hundredth of the rate of complete damage at most.
        assert abs(printed - 1 / expected) < 0.5 + 0.01 / expected
    expected = 1e6 * (-np.diff(rate, append=0.0) @ LOSS_RATIOS)
    loss, lower, upper = map(float, re.search(r"loss ([\d.]+) of 1,000,000 \(([\d.]+) to ([\d.]+)\)", text).groups())
    # Printed to 0.1; complete damage is a tenth of the loss, and a hundredth of its rate is above the last point.
    assert abs(loss - expected) < 0.05 + 0.002 * expected
    assert lower < loss < upper

    # The engine interpolates linearly, which errs by at most an eighth of the step squared (0.165 in the logarithm)
    # times curvature and slope: (0.24 / b^2 + 0.4 / b) 0.165^2 / 8 = 0.012 for the least dispersion b of 0.33.
    (taxonomy,) = model = wd.read_nrml_fragility(tmp_path / "fragility.xml")
    discrete = model[taxonomy]["exceedance_fraction"].interp(stripe=median).values.diagonal()
    np.testing.assert_allclose(discrete, 0.5, rtol=0, atol=0.012)
    assert wd.read_consequences(tmp_path / "consequences.csv")[taxonomy]["extensive"] == LOSS_RATIOS[2]
    assert wd.read_pelicun_demands(tmp_path / "demands.csv").sizes["sample"] == 44 * 8
