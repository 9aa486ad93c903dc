"""The diagrams of the page on the architecture: layers and imports, the path of a run, the life of a kernel."""

from __future__ import annotations

import ast
import textwrap
from collections import Counter
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, PathPatch
from matplotlib.path import Path as Curve

import warpdyn as wd
from warpdyn.interfaces.plots.style import COLOURS

PACKAGE = Path(wd.__file__).parent
WIDTH = 8.1  # of the pictures [inch]
ROW = 0.37  # height of a package's row [inch]
TEXT, SMALL = 10, 9  # sizes of letters [pt]; the site shows at least 90 pixels per inch
GREY = "0.35"


def write_pictures(docs: Path) -> None:
    """Write the diagrams to docs/explanation/generated."""
    out = docs / "explanation" / "generated"
    out.mkdir(exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": "warpdyn"}):
        for name, draw in {"layers": draw_layers, "run": draw_run, "kernel": draw_kernel}.items():
            draw().savefig(out / f"{name}.svg", metadata={"Date": None})


# Layers


@cache
def imports() -> dict[str, set[str]]:
    """Return the packages that each package imports, as "layer.package", read from all import statements."""
    found: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        if len(parts) > 2:
            own = ".".join(parts[:2])
            found.setdefault(own, set()).update(_imported(path) - {own})
    return {package: others & found.keys() for package, others in found.items()}


def _imported(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return {".".join(name.split(".")[1:3]) for name in names if name.startswith("warpdyn.")}


def in_order(graph: dict[str, set[str]]) -> list[str]:
    """Return the packages so that each comes before those that it imports, one layer after another."""

    def depth(package: str) -> int:
        return 1 + max(map(depth, graph[package]), default=0)

    deepest = {layer: max(depth(each) for each in graph if layer_of(each) == layer) for layer in map(layer_of, graph)}
    return sorted(graph, key=lambda each: (-deepest[layer_of(each)], -depth(each), each))


def without_implied(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return the imports without those that follow from others: a imports b, b imports c, so a may import c."""

    def reached(package: str) -> set[str]:
        return graph[package].union(*map(reached, graph[package]))

    return {package: others - set().union(*map(reached, others)) for package, others in graph.items()}


def layer_of(package: str) -> str:
    """Return the layer of a package."""
    return package.partition(".")[0]


def draw_layers() -> Figure:
    """Draw the packages of each layer, and arrows to the packages that they import."""
    graph = imports()
    packages = in_order(graph)
    layers = list(dict.fromkeys(map(layer_of, packages)))
    height = ROW * (len(packages) + len(layers)) + 0.1
    figure, axes = _canvas(height)
    y, middle = height - 0.05, dict[str, float]()
    for layer, colour in zip(layers, COLOURS, strict=False):
        axes.text(0.05, y - 0.22, layer, size=TEXT + 1, weight="bold", color=colour, va="center")
        y -= ROW
        for package in (each for each in packages if layer_of(each) == layer):
            y -= ROW
            middle[package] = y + ROW / 2
            _box(axes, 0.2, y + 0.04, 1.35, ROW - 0.08, colour)
            axes.text(0.28, middle[package], package.partition(".")[2], size=TEXT, va="center")
            text = _first_sentence(PACKAGE / package.replace(".", "/") / "__init__.py")
            lines = "\n".join(textwrap.wrap(text, 62)[:2])
            axes.text(1.68, middle[package], lines, size=SMALL, va="center", color=GREY, linespacing=1.0)
    left, longest = 6.15, max(middle.values()) - min(middle.values())
    for package, others in without_implied(graph).items():
        for other in others:
            start, end = middle[package] - 0.05, middle[other] + 0.05
            reach = left + 0.15 + 4.2 * ((start - end) / longest) ** 0.7
            corners = [(left, start), (reach, start), (reach, end), (left + 0.06, end)]
            colour = COLOURS[layers.index(layer_of(package))]
            curve = Curve(corners, [Curve.MOVETO, Curve.CURVE4, Curve.CURVE4, Curve.CURVE4])
            axes.add_patch(PathPatch(curve, fill=False, color=colour, lw=1.0, alpha=0.8))
            axes.plot(left + 0.04, end, marker="<", ms=4, color=colour, mew=0)
    return figure


def _first_sentence(path: Path) -> str:
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return text.split("\n\n")[0].replace("\n", " ").partition(". ")[0].rstrip(".")


# Paths of boxes


class Box(NamedTuple):
    """A box of a diagram.

    Args:
        title: Its title; a function or class whose file is shown if it is one.
        text: One or two lines.
        defined: Name of the function or class that does it, if it is not the title; with its file,
            "campaigns/running/run.py:Run", if several files define that name.
    """

    title: str
    text: str
    defined: str = ""


RUN = (
    Box("Scene", "structure, excitation, scatter, recorders;\nall values are checked when it is made"),
    Box("simulate", "checks the request before it opens a file;\nchooses method, step and number type"),
    Box(
        "Run",
        "groups: buildings with the same kernel; regions:\nranges of structures; one sink for the results",
        "campaigns/running/run.py:Run",
    ),
    Box("Region", "runs on a worker: this process, or a process of\na Dask cluster; the same bits on each"),
    Box("Ensemble", "draws parameters, packs motions and steps of a\nblock of samples; repeats samples that failed"),
    Box("CudaQueue", "or CpuQueue: launches the kernel, one history\nper lane, and copies back the outputs"),
    Box(
        "Sink",
        "stores each region in memory, netCDF or Zarr, or as\nstatistics; finished regions are a checkpoint",
        "campaigns/running/sinks.py:Memory",
    ),
    Box("Dataset", "labelled, with units, status and provenance;\ninput of fragility, losses, plots and reports"),
)
KERNEL = (
    Box("Scene", "structure, excitation, scatter, recorders"),
    Box("Plan", "everything that decides the source: family,\nstoreys, law, damping, load, recorders, method"),
    Box("fitted", "adds lanes, unrolling and threads per sample\nthat suit the processor or the GPU"),
    Box(
        "wanted parts",
        "each part states whether the plan needs it:\nload, damping, law, collapse, recorders, ...",
        "all_parts",
    ),
    Box("check_parts", "compares each part with the table of slots;\nrefuses faults with file and line"),
    Box("compose", "replaces the slots of a skeleton by statements\nof the parts; removes variables that are not read"),
    Box("source text", "one Python function, shown by\nwd.kernels.source(scene)", "Composed"),
    Box("kernel_of", "Warp translates the text, with the device\nfunctions of the law, to C++ or CUDA"),
    Box(
        "kernel cache",
        "machine code on disk, by a hash of the source;\na damaged file is compiled again",
        "load_module",
    ),
    Box(
        "launch",
        "each thread integrates its samples from the\nfirst step to the last, and writes the outputs",
        "CudaQueue",
    ),
)


def draw_run() -> Figure:
    """Draw the path of a run, from the scene to the dataset."""
    figure, axes, places = _draw_boxes(RUN)
    right, top = places["Sink"]
    _, bottom = places["Region"]
    edge = right + 3.95
    axes.add_patch(
        FancyArrowPatch(
            (edge, top + 0.4),
            (edge, bottom + 0.4),
            connectionstyle="arc3,rad=0.35",
            arrowstyle="-|>",
            mutation_scale=12,
            color=GREY,
        )
    )
    axes.text(edge + 0.75, (top + bottom) / 2 + 0.4, "next\nregion", size=TEXT, color=GREY, va="center", ha="left")
    return figure


def draw_kernel() -> Figure:
    """Draw the life of a kernel, from the scene to the launch."""
    figure, _, _ = _draw_boxes(KERNEL)
    return figure


def _draw_boxes(boxes: Iterable[Box]) -> tuple[Figure, Axes, dict[str, tuple[float, float]]]:
    """Draw boxes from top to bottom with arrows between them and the file of each on the left."""
    boxes, high, gap, left = list(boxes), 0.8, 0.27, 2.75
    height = len(boxes) * (high + gap) - gap + 0.2
    figure, axes = _canvas(height)
    files, layers = definitions(), list(dict.fromkeys(map(layer_of, in_order(imports()))))
    places = {}
    for number, box in enumerate(boxes):
        y = height - 0.1 - high - number * (high + gap)
        places[box.title] = left, y
        file = files.get(box.defined or box.title, "")
        layer = file.partition("/")[0]
        _box(axes, left, y, 3.95, high, COLOURS[layers.index(layer)] if layer else GREY)
        axes.text(left + 0.12, y + high - 0.17, box.title, size=TEXT + 1, weight="bold", va="center")
        axes.text(left + 0.12, y + 0.28, box.text, size=TEXT, va="center", linespacing=1.1)
        axes.text(
            left - 0.15, y + high / 2, file.replace("/", "/\n", 1), size=SMALL, color=GREY, ha="right", va="center"
        )
        if number:
            axes.annotate(
                "",
                (left + 1.9, y + high + 0.02),
                (left + 1.9, y + high + gap - 0.02),
                arrowprops={"arrowstyle": "-|>", "color": GREY, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 12},
            )
    return figure, axes, places


@cache
def definitions() -> dict[str, str]:
    """Return the file that defines each class and function, relative to the package.

    A name that several files define has no entry; "file:name" has one for each.
    """
    found: dict[str, str] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef):
                file = path.relative_to(PACKAGE).as_posix()
                found[f"{file}:{node.name}"] = file
    count = Counter(map(_name_of, found))
    return found | {_name_of(key): file for key, file in found.items() if count[_name_of(key)] == 1}


def _name_of(definition: str) -> str:
    return definition.partition(":")[2]


def _canvas(height: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(WIDTH, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, WIDTH), ylim=(0, height))
    axes.axis("off")
    return figure, axes


def _box(axes: Axes, x: float, y: float, width: float, height: float, colour: str) -> None:
    style = "round,pad=0,rounding_size=0.06"
    axes.add_patch(FancyBboxPatch((x, y), width, height, boxstyle=style, fc=colour, ec="none", alpha=0.15))
    axes.add_patch(FancyBboxPatch((x, y), width, height, boxstyle=style, fc="none", ec=colour, lw=1.2))
