"""All intervals of the amplitude of a motion in which a rocking block overturns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.contents.base_motions import base_motions, checked_factors, settings
from warpdyn.answers.contents.block_responses import rocked_blocks
from warpdyn.answers.contents.blocks import RockingBlock, checked_blocks
from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.ground_motions.motions import GroundMotion

SMALLEST_TOLERANCE = 1e-9  # relative; the rounding of the integration is not much smaller


@suggests_names
def overturning_intervals(
    motions: GroundMotion | Sequence[GroundMotion],
    blocks: RockingBlock | Mapping[str, RockingBlock],
    scale_factors: ArrayLike,
    *,
    tolerance: float = 1e-5,
    device: str | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Return all intervals of scale factors in which rocking blocks overturn under ground motions.

    Overturning is not monotonic in the amplitude: a block that overturns under a motion may survive a stronger one
    (Zhang and Makris 2001). The blocks are integrated at all given factors. Between two successive factors with
    different outcomes, a bisection finds the edge. Intervals that are narrower than the distance of two factors can be
    missed, so give many factors: 1,000 factors take a few milliseconds per motion.

    Args:
        motions: One ground motion or several.
        blocks: One block, or a dictionary of names and blocks.
        scale_factors: Increasing factors on the accelerations [1], at least 2.
        tolerance: Relative error of an edge [1].
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU.
        threads: Number of CPU threads; None: all cores that this process may use.

    Returns:
        Dataset with the dimensions (motion, block, interval): `overturning_from` and `overturning_to`, the edges of
        each interval of scale factors [1], in increasing order; NaN if there are fewer intervals. `overturning_from` is
        the first factor if the block overturns there, and `overturning_to` is infinite if it overturns at the last one.
        `interval_count(motion, block)` is the number of intervals, and `overturned(motion, block, scale_factor)` is the
        outcome at each factor (0 or 1).

    Raises:
        ValueError: If the factors are not above 0 and increasing, or the tolerance is not from 1e-9 to below 1.
        TypeError: If a motion is not a GroundMotion, or a block is not a RockingBlock.

    Example:
        >>> time = np.arange(0, 1.0, 0.001)
        >>> pulse = wd.GroundMotion(np.where(time < 0.47, np.sin(2 * np.pi / 0.47 * time), 0.0), 0.001, "sine")
        >>> block = wd.RockingBlock(half_width=0.25, half_height=1.0)
        >>> found = wd.overturning_intervals(pulse, block, np.linspace(2.5, 30.0, 500))
        >>> found["overturning_from"].values.round(2), found["overturning_to"].values.round(2)
        (array([[[ 7.  , 17.99]]]), array([[[16.46,   inf]]]))
    """
    name = "overturning_intervals"
    known = checked_blocks(name, blocks, RockingBlock)
    if isinstance(motions, xr.Dataset):
        raise TypeError(
            f"{name} scales ground motions, but a run is given, whose floor motions are not proportional to the ground "
            "motion: simulate stripes, give wd.rocking_response(run, blocks), and compare `overturned` by level"
        )
    moves, factors = base_motions(name, motions), checked_factors(name, scale_factors)
    if factors.size < 2 or np.any(np.diff(factors) <= 0):
        raise ValueError(
            f"{name}: scale_factors must be at least 2 increasing numbers, such as np.linspace(1, 10, 500)"
        )
    tolerance = real_number(f"{name}: tolerance", tolerance, least=SMALLEST_TOLERANCE)
    if tolerance >= 1:
        raise ValueError(f"{name}: tolerance is relative and must be below 1, got {tolerance:g}")
    where = settings(name, device, threads)
    shape = moves.count, len(known)

    def overturns(each: np.ndarray) -> np.ndarray:
        return np.isfinite(rocked_blocks(moves, known, each, *where)["time_of_overturning"])

    fallen = overturns(np.broadcast_to(factors, (*shape, factors.size)))
    changes = np.diff(fallen.astype(np.int8), axis=-1)
    edges = int(np.count_nonzero(changes, axis=-1).max())
    low, high = np.full((2, *shape, max(edges, 1)), factors[0])
    begins = np.zeros((*shape, max(edges, 1)), dtype=np.int8)  # 1: overturns above the edge, -1: below; 0: no edge
    for pair in np.ndindex(*shape):
        at = np.flatnonzero(changes[pair])
        low[pair][: at.size], high[pair][: at.size] = factors[at], factors[at + 1]
        begins[pair][: at.size] = changes[pair][at]
    while edges and np.any(high - low > tolerance * low):
        middle = 0.5 * (low + high)
        is_beyond = overturns(middle) == (begins > 0)
        low, high = np.where(is_beyond, low, middle), np.where(is_beyond, middle, high)
        low, high = np.where(begins, low, factors[0]), np.where(begins, high, factors[0])
    edge = 0.5 * (low + high)
    most = (edges + 2) // 2
    start, end = np.full((2, *shape, most), np.nan)
    count = np.zeros(shape, dtype=np.int32)
    for pair in np.ndindex(*shape):
        rising = [*([factors[0]] if fallen[pair][0] else []), *edge[pair][begins[pair] > 0]]
        falling = [*edge[pair][begins[pair] < 0], *([np.inf] if fallen[pair][-1] else [])]
        count[pair] = len(rising)
        start[pair][: len(rising)], end[pair][: len(falling)] = rising, falling
    used = max(1, int(count.max()))
    dims = (*moves.dims, "block")
    words = f"edges to {tolerance:g}; intervals narrower than {np.diff(factors).max():.3g} can be missed"
    return xr.Dataset(
        {
            "overturning_from": variable(
                (*dims, "interval"), start[..., :used], "scale factor from which the block overturns", comment=words
            ),
            "overturning_to": variable(
                (*dims, "interval"), end[..., :used], "scale factor up to which the block overturns", comment=words
            ),
            "interval_count": variable(dims, count, "number of intervals of scale factors with overturning"),
            "overturned": variable((*dims, "scale_factor"), fallen.astype(np.int8), "1 if the block overturns"),
        },
        {
            **moves.coordinates,
            "block": ("block", np.array(list(known)), {"long_name": "block"}),
            "scale_factor": variable("scale_factor", factors, "factor on the accelerations"),
        },
        trace("Overturning of rigid blocks", name),
    )
