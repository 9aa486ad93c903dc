"""The documentation's pages on storey laws and devices, for tests that run what the pages show."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT

PAGES = ROOT / "docs" / "reference" / "laws"


def check_page(name: str, folder: Path) -> None:
    """Check that the picture on a law's or device's page is of today's device functions, and run the page's program.

    Args:
        name: The law or device.
        folder: Where the program writes its figure.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "studies")
        patch.syspath_prepend(ROOT / "docs")
        patch.chdir(folder)
        patch.setenv("MPLBACKEND", "agg")
        cycles, pages = (importlib.import_module(module) for module in ("law_cycles", "generate.laws"))
        with xr.open_dataset(PAGES / "cycles.nc") as kept:
            curves = kept.load()
        if name not in pages.DAMPERS:  # whose pictures are drawn from formulas
            assert pages.parameters_of(name, curves) == cycles.parameters_of(name)
            for key, found in zip(("force", "pushed_force"), cycles.curves(name), strict=True):
                drawn = curves[key].sel(element=name).values
                # Kept to a thousandth of the yield force; another last digit may round the other way.
                np.testing.assert_allclose(drawn, found, rtol=0, atol=0.6 * cycles.ROUNDING, err_msg=ADVICE)
        exec(pages.snippet(name, pages.parameters_of(name, curves)), {})
        assert Path("loops.png").stat().st_size > 5000


ADVICE = "the page's picture is out of date: run `python studies/law_cycles.py --out docs/reference/laws`"
