"""Figures of frames."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from frame_cases import braced, portal

import warpdyn as wd

pytestmark = pytest.mark.fast


def test_a_figure_has_all_names_and_members():
    frame = braced()
    _, axes = plt.subplots()
    assert wd.plots.frame(frame, ax=axes) is axes
    texts = {text.get_text() for text in axes.texts}
    assert texts == {*frame.nodes, *frame.members}
    dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert len(dashed) == 6  # 3 braces and 3 leaning columns
    figure = wd.plots.frame(frame, names=False)
    assert not figure.axes[0].texts


def test_a_displaced_shape_is_scaled_and_end_springs_are_circles():
    frame = portal()
    found = frame.static({"floor 1": {"fx": 1e5}})
    figure = wd.plots.frame(frame, displaced=found, scale=10.0)
    (axes,) = figure.axes
    moved = found["displacement"].sel(node="J1_1", direction="ux").item()
    tops = [line.get_xdata()[1] for line in axes.lines if len(line.get_xdata()) == 2]
    assert np.isclose(tops, 10 * moved).any()
    assert axes.get_title().endswith("displacements times 10")
    hollow = [line for line in axes.lines if line.get_marker() == "o" and line.get_markerfacecolor() == "white"]
    assert len(hollow) == 6
    with pytest.raises(TypeError, match="takes a Frame"):
        wd.plots.frame("portal")
    with pytest.raises(ValueError, match="has no displacement"):
        wd.plots.frame(frame, displaced=frame.modal())
    with pytest.raises(ValueError, match="scale must be"):
        wd.plots.frame(frame, displaced=found, scale=0.0)
