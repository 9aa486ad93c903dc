"""Figures of plane frames: members, supports, names and displaced shapes."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from warpdyn.foundations.core.checks import check_dataset, check_kind, real_number, true_or_false
from warpdyn.interfaces.plots.style import COLOURS, SMALL, Drawn, literal, panels, title
from warpdyn.model.structures.frames.frame import Frame

MARKERS = {"fixed": "s", "pinned": "^", "roller": "o", "other": "D"}
SHOWN = 0.08  # largest drawn displacement over the size of the frame
SHORT = 0.06  # distance of the circle of a release from the node over the length of the member


def frame(
    frame: Frame,
    *,
    names: bool = True,
    displaced: xr.Dataset | None = None,
    scale: float | None = None,
    ax: Axes | None = None,
) -> Drawn:
    """Draw a plane frame to scale, with the names of nodes and members, supports, releases and rigid floors.

    Beams are solid, trusses dashed, rigid floors dotted; a circle near the end of a member is a release or a rotational
    spring.

    Args:
        frame: The frame.
        names: Whether nodes and members have their names.
        displaced: Result of `frame.static`, whose displacements are drawn as straight members.
        scale: Factor on the displacements [1]; None: the largest is 8 % of the size of the frame.
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        TypeError: If `frame` is not a Frame.
        ValueError: If `displaced` is not the result of `static`, or `scale` is not a number above 0.

    Example:
        >>> figure = wd.plots.frame(portal, displaced=portal.static({"floor": {"fx": 1e4}}))  # N
        >>> figure.savefig("portal.png")
    """
    check_kind("plots.frame", "a Frame", frame, Frame, argument="frame")
    true_or_false("names", names)
    result, (axes,) = panels("frame", ax, size=(6.4, 5.6))
    xy, size = frame.coordinates, float(np.ptp(frame.coordinates, axis=0).max())
    for nodes in frame.diaphragms.values():
        places = xy[[list(frame.nodes).index(node) for node in nodes]]
        places = places[np.argsort(places[:, 0])]
        axes.plot(*places.T, color="0.6", lw=1, ls=":", zorder=0)
    for place, (name, row) in enumerate(frame.members.items()):
        start, end = xy[frame.ends[place]]
        is_bar = row["kind"] == "truss"
        axes.plot(*np.transpose([start, end]), color=COLOURS[0], lw=1.5, ls="--" if is_bar else "-", zorder=1)
        for share, spring in zip((SHORT, 1 - SHORT), frame.geometry.end_springs[place], strict=True):
            if np.isfinite(spring):
                point = start + share * (end - start)
                axes.plot(*point, marker="o", ms=5, mfc="white", mec=COLOURS[0], zorder=3)
        if names:
            middle = (start + end) / 2
            axes.annotate(literal(name), middle, fontsize=SMALL, color=COLOURS[0], ha="center", va="center",
                          bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5}, zorder=4)  # fmt: skip
    _nodes(axes, frame, has_names=names)
    text = f"{len(frame.nodes)} nodes, {len(frame.members)} members"
    if displaced is not None:
        text += f"; displacements times {_displaced(axes, frame, displaced, scale, size):.3g}"
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.margins(0.08)
    title(axes, text)
    return result


def _nodes(axes: Axes, frame: Frame, *, has_names: bool) -> None:
    kinds = {"uxuyrz": "fixed", "uxuy": "pinned", "uy": "roller"}
    for name, (x, y) in zip(frame.nodes, frame.coordinates, strict=True):
        support = frame.supports.get(name)
        if support is None:
            axes.plot(x, y, marker=".", ms=5, color="0.2", zorder=2)
        else:
            held = "".join(direction for direction in ("ux", "uy", "rz") if support.get(direction) is True)
            marker = MARKERS[kinds.get(held, "other")]
            axes.plot(x, y, marker=marker, ms=9, mfc="0.8", mec="0.2", zorder=2)
        if has_names:
            axes.annotate(literal(name), (x, y), (4, 4), textcoords="offset points", fontsize=SMALL, zorder=5)


def _displaced(axes: Axes, frame: Frame, result: xr.Dataset, scale: float | None, size: float) -> float:
    """Draw the displaced members, and return the factor on the displacements."""
    check_dataset("plots.frame", result, "displacement", advice="give the result of static()", argument="displaced")
    moved = result["displacement"].sel(node=list(frame.nodes), direction=["ux", "uy"]).values
    largest = float(np.abs(moved).max())
    fitting = SHOWN * size / largest if largest else 1.0
    scale = fitting if scale is None else real_number("scale", scale, above=0)
    shape = frame.coordinates + scale * moved
    for start, end in shape[frame.ends]:
        axes.plot(*np.transpose([start, end]), color=COLOURS[3], lw=1, zorder=1)
    return scale
