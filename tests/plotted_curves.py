"""A run that figures are drawn of, and its fragility curves."""

from __future__ import annotations

import warnings

from plotted_runs import striped_run

import warpdyn as wd

RUN = striped_run()
LIMITS = {"slight": 0.004, "extensive": 0.02}
with warnings.catch_warnings():
    warnings.filterwarnings("ignore", "(?s).*(no interval is given|is an extrapolation|an extrapolation below)")
    CURVES = wd.fragility(RUN, LIMITS)
    CLOUD = wd.fragility_of_cloud(RUN, LIMITS, estimator="collapse")
MERGED = RUN.merge(CURVES, combine_attrs="no_conflicts")
