"""The generated diagrams of the architecture: their arrows are imports, and their labels are readable."""

import sys
from itertools import combinations
from pathlib import Path

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))
from generate import architecture
from generate.architecture import KERNEL, RUN, definitions, draw_kernel, draw_layers, draw_run, imports, without_implied

pytestmark = pytest.mark.fast

PIXELS_PER_INCH = 90  # the site's column of 730 pixels shows a picture of 8.1 inch


def test_arrows_are_imports():
    graph = imports()
    assert "foundations.core" in graph["engine.kernels"]
    assert graph["foundations.core"] == set()
    order = architecture.in_order(graph)
    assert order[-1] == "foundations.core"
    for package, others in graph.items():
        assert all(order.index(package) < order.index(other) for other in others), package


def reached(graph, package):
    return graph[package].union(*(reached(graph, other) for other in graph[package]))


def test_arrows_that_are_left_out_follow_from_others():
    graph = {"a": {"b", "c", "d"}, "b": {"c"}, "c": {"d"}, "d": set()}
    assert without_implied(graph) == {"a": {"b"}, "b": {"c"}, "c": {"d"}, "d": set()}
    graph = imports()
    reduced = without_implied(graph)
    assert all(reached(reduced, package) == reached(graph, package) for package in graph)


def test_boxes_name_the_file_of_their_function():
    files = definitions()
    named = {box.defined or box.title for box in (*RUN, *KERNEL)}
    assert named - files.keys() == {"Dataset"}  # of xarray
    assert "Run" not in files  # two files define it, so its box names the file
    assert files["campaigns/running/run.py:Run"] == "campaigns/running/run.py"
    assert files["simulate"] == "campaigns/running/simulate.py"


@pytest.mark.parametrize("draw", [draw_layers, draw_run, draw_kernel])
def test_labels_are_readable(draw):
    figure = draw()
    FigureCanvasAgg(figure)
    figure.set_dpi(PIXELS_PER_INCH)
    renderer = figure.canvas.get_renderer()
    texts = [text for text in figure.axes[0].texts if text.get_text()]
    boxes = [text.get_window_extent(renderer) for text in texts]
    assert len(texts) > 10
    assert min(text.get_size() for text in texts) * PIXELS_PER_INCH / 72 >= 10  # pixels
    for one, other in combinations(boxes, 2):
        assert not one.overlaps(other)
    for text, box in zip(texts, boxes, strict=True):
        assert box.x0 >= 0, text
        assert box.y0 >= 0, text
        assert box.x1 <= figure.bbox.width, text
        assert box.y1 <= figure.bbox.height, text
