"""Responses of rocking and sliding blocks to ground motions or floor accelerations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.contents.base_motions import BaseMotions, Floors, base_motions, checked_factors, settings
from warpdyn.answers.contents.blocks import RockingBlock, SlidingBlock, checked_blocks
from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.ground_motions.motions import GroundMotion

BlockMotions = GroundMotion | Sequence[GroundMotion] | xr.Dataset


@suggests_names
def rocking_response(
    excitation: BlockMotions,
    blocks: RockingBlock | Mapping[str, RockingBlock],
    scale_factors: ArrayLike = 1.0,
    *,
    floors: Floors = None,
    device: str | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Return the peak rotations of rocking blocks, and whether they overturn.

    A block overturns if its rotation reaches 90 degrees. A rotation beyond the angle alpha is not yet overturning: the
    motion may bring the block back. The base acceleration is linear between its values and zero afterwards; after the
    end of the motion, the energy of the block decides whether it overturns. Overturning is not monotonic in the
    amplitude: `overturning_intervals` finds all amplitudes with overturning.

    Sources: Housner (1963), "The behavior of inverted pendulum structures during earthquakes"; Zhang and Makris (2001),
    "Rocking response of free-standing blocks under cycloidal pulses".

    Args:
        excitation: One ground motion or several; or a run of `simulate` with `histories=`, whose floors the blocks
            stand on. Blocks do not act on the floor. The motion of a building that collapses ends with the collapse.
        blocks: One block, or a dictionary of names and blocks.
        scale_factors: Factors on the accelerations [1], one number or a row.
        floors: Numbers of floors (or names of degrees of freedom) of the run; None: all.
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU.
        threads: Number of CPU threads; None: all cores that this process may use.

    Returns:
        Dataset with the dimensions (motion or sample and floor, block, and scale_factor if it is a row):
        `peak_rotation` [rad], `peak_rotation_ratio`, the rotation divided by alpha [1], `overturned` (0 or 1),
        `time_of_overturning` [s] (NaN: the block does not overturn) and `impacts`, the number of impacts during the
        motion.

    Raises:
        ValueError: If a floor is unknown, the run has no histories, or a factor is not above 0.
        TypeError: If a motion is not a GroundMotion, or a block is not a RockingBlock.

    Example:
        >>> block = wd.RockingBlock(half_width=0.2, half_height=1.0)
        >>> response = wd.rocking_response(motions, {"cabinet": block}, scale_factors=[1.0, 2.0])
        >>> response["overturned"].sum("motion").values
        array([[0, 5]])
    """
    name = "rocking_response"
    known = checked_blocks(name, blocks, RockingBlock)
    moves, factors = base_motions(name, excitation, floors), checked_factors(name, scale_factors)
    where = settings(name, device, threads)
    found = rocked_blocks(moves, known, np.broadcast_to(factors, (moves.count, len(known), factors.size)), *where)
    alpha = np.array([block.slenderness for block in known.values()])[:, None]
    overturned = np.isfinite(found["time_of_overturning"])
    variables = {
        "peak_rotation": (found["peak_rotation"], "largest rotation of the block", "rad"),
        "peak_rotation_ratio": (found["peak_rotation"] / alpha, "largest rotation over the angle alpha", "1"),
        "overturned": (overturned.astype(np.int8), "1 if the block overturns, otherwise 0", "1"),
        "time_of_overturning": (found["time_of_overturning"], "time at which the block lies on its side", "s"),
        "impacts": (found["impacts"], "number of impacts during the motion", "1"),
    }
    return _dataset(name, moves, list(known), scale_factors, variables)


@suggests_names
def sliding_response(
    excitation: BlockMotions,
    blocks: SlidingBlock | Mapping[str, SlidingBlock],
    scale_factors: ArrayLike = 1.0,
    *,
    floors: Floors = None,
    device: str | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Return the peak and residual displacements of sliding blocks relative to their base.

    The solution is exact for a base acceleration that is linear between its values and zero afterwards.

    Source: Newmark (1965), "Effects of earthquakes on dams and embankments".

    Args:
        excitation, scale_factors, floors, device, threads: As in `rocking_response`.
        blocks: One block, or a dictionary of names and blocks.

    Returns:
        Dataset with the dimensions of `rocking_response`: `peak_sliding_displacement` and
        `residual_sliding_displacement` (with its sign) [m].

    Raises:
        ValueError: If a floor is unknown, the run has no histories, or a factor is not above 0.
        TypeError: If a motion is not a GroundMotion, or a block is not a SlidingBlock.

    Example:
        >>> response = wd.sliding_response(motions, {"server": wd.SlidingBlock(0.1)})
        >>> response["peak_sliding_displacement"].dims
        ('motion', 'block')
    """
    from warpdyn.engine.kernels.blocks.sliding import slid  # importing it imports Warp

    name = "sliding_response"
    known = checked_blocks(name, blocks, SlidingBlock)
    moves, factors = base_motions(name, excitation, floors), checked_factors(name, scale_factors)
    where = settings(name, device, threads)
    resistances = np.array([block.resistance for block in known.values()])
    shape = moves.count, len(known), factors.size
    found = slid(moves.arrays, resistances, np.broadcast_to(factors, shape), *where)
    variables = {
        "peak_sliding_displacement": (found["peak_displacement"], "largest displacement relative to the base", "m"),
        "residual_sliding_displacement": (
            found["residual_displacement"],
            "last displacement relative to the base",
            "m",
        ),
    }
    return _dataset(name, moves, list(known), scale_factors, variables)


def rocked_blocks(
    moves: BaseMotions, blocks: Mapping[str, RockingBlock], factors: np.ndarray, device: str, threads: int
) -> dict[str, np.ndarray]:
    """Return the responses of rocking blocks, each of the shape of `factors`, [motion, block, factor]."""
    from warpdyn.engine.kernels.blocks.rocking import rocked  # importing it imports Warp

    each = list(blocks.values())
    arrays = {
        "slenderness": np.array([block.slenderness for block in each]),
        "frequency": np.array([block.frequency for block in each]),
        "restitution": np.array([block.coefficient_of_restitution for block in each]),
        "static_acceleration": np.array([block.static_acceleration for block in each]),
        "gravity": np.array(STANDARD_GRAVITY),
    }
    return rocked(moves.arrays, arrays, np.ascontiguousarray(factors), device, threads)


def _dataset(
    function: str,
    moves: BaseMotions,
    names: list[str],
    scale_factors: ArrayLike,
    variables: Mapping[str, tuple[np.ndarray, str, str]],
) -> xr.Dataset:
    """Return a dataset of responses with the shape [motion, block, factor], given as (values, long name, units)."""
    dims: tuple[str, ...] = (*moves.dims, "block")
    shape: tuple[int, ...] = (*moves.shape, len(names))
    coordinates: dict[str, Any] = {**moves.coordinates, "block": ("block", np.array(names), {"long_name": "block"})}
    if np.ndim(scale_factors):
        factors = np.asarray(scale_factors, dtype=np.float64)
        dims, shape = (*dims, "scale_factor"), (*shape, factors.size)
        coordinates["scale_factor"] = variable("scale_factor", factors, "factor on the accelerations")
    found = {
        name: variable(dims, values.reshape(shape), words, units=units)
        for name, (values, words, units) in variables.items()
    }
    return xr.Dataset(found, coordinates, trace("Response of rigid blocks", function))
