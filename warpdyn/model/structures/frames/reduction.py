"""Static condensation, Guyan and Craig-Bampton reduction of stiffness and mass matrices, and modes of frames.

Sources: Guyan (1965), "Reduction of stiffness and mass matrices"; Craig and Bampton (1968), "Coupling of substructures
for dynamic analyses". All functions accept several structures: matrices of shape [..., dof, dof].
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from warpdyn.engine.methods.undamped_modes import undamped
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.structures.frames import static
from warpdyn.model.structures.frames.members.condensation import BUCKLES, UnstableSections
from warpdyn.model.structures.modal import modal_properties

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame


def condensation(stiffness: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return the displacements of all degrees of freedom per kept one, shape [..., dof, kept]: T = [1; -K_ll^-1 K_lk].

    Args:
        stiffness: Stiffness matrices [N/m], shape [..., dof, dof].
        kept: Numbers of the kept degrees of freedom; no force acts on the others.
    """
    size = stiffness.shape[-1]
    left = np.setdiff1d(np.arange(size), kept)
    found = np.zeros((*stiffness.shape[:-2], size, kept.size))
    found[..., kept, np.arange(kept.size)] = 1.0
    if left.size:
        block = stiffness[..., left, :]
        found[..., left, :] = -np.linalg.solve(block[..., left], block[..., kept])
    return found


def reduced(matrix: np.ndarray, shapes: np.ndarray, right: np.ndarray | None = None) -> np.ndarray:
    """Return T^T A T, or T^T A R with other shapes R, symmetric, shape [..., kept, kept]."""
    found = np.swapaxes(shapes, -1, -2) @ matrix @ (shapes if right is None else right)
    symmetric: np.ndarray = (found + np.swapaxes(found, -1, -2)) / 2
    return symmetric


def condensation_under_gravity(stiffness: np.ndarray, geometric: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return the shapes T of `condensation` of K + K_g; an UnstableSections if eliminated degrees of freedom buckle.

    With the shapes T_0 of K alone, T_0^T K T = T_0^T K T_0, so that T_0^T K_g T is the geometric stiffness that changes
    the condensed K to the condensed K + K_g.

    Args:
        stiffness: Stiffness matrices K [N/m], shape [..., dof, dof].
        geometric: Geometric stiffness matrices K_g, tension positive [N/m], shape [..., dof, dof].
        kept: Numbers of the kept degrees of freedom.
    """
    total = stiffness + geometric
    left = np.setdiff1d(np.arange(total.shape[-1]), kept)
    try:
        np.linalg.cholesky(total[..., left, :][..., left])
    except np.linalg.LinAlgError:
        raise UnstableSections(BUCKLES) from None
    return condensation(total, kept)


def fixed_interface_modes(stiffness: np.ndarray, mass: np.ndarray, kept: np.ndarray, modes: int) -> np.ndarray:
    """Return the first modes with fixed kept degrees of freedom and unit modal mass, shape [..., dof, mode].

    Degrees of freedom without mass follow statically.
    """
    size = stiffness.shape[-1]
    diagonal = np.diagonal(mass, axis1=-2, axis2=-1)
    has_mass = (diagonal > 0).reshape(-1, size).all(axis=0)
    inner = np.setdiff1d(np.flatnonzero(has_mass), kept)
    rest = np.setdiff1d(np.arange(size), kept)
    places = np.searchsorted(rest, inner)
    of_rest = stiffness[..., rest, :][..., rest]
    follows = condensation(of_rest, places)
    mass_of_rest = mass[..., rest, :][..., rest]
    _, shapes = undamped(
        reduced(mass_of_rest, follows).reshape(-1, inner.size, inner.size),
        reduced(of_rest, follows).reshape(-1, inner.size, inner.size),
    )
    chosen = shapes[:, :, :modes].reshape(*stiffness.shape[:-2], inner.size, modes)
    found = np.zeros((*stiffness.shape[:-2], size, modes))
    found[..., rest, :] = follows @ chosen
    return found


def inner_masses(mass: np.ndarray, kept: np.ndarray) -> int:
    """Return the number of degrees of freedom that have mass and are not kept, the largest number of modes."""
    return int(np.setdiff1d(np.flatnonzero(np.diagonal(mass) > 0), kept).size)


def shapes_of(stiffness: np.ndarray, mass: np.ndarray, kept: np.ndarray, modes: int) -> np.ndarray:
    """Return the shapes of a reduced structure: those of condensation, and fixed-interface modes."""
    found = condensation(stiffness, kept)
    if modes:
        found = np.concatenate([found, fixed_interface_modes(stiffness, mass, kept, modes)], axis=-1)
    return found


def gravity_on_supports(frame: Frame) -> list[str]:
    """Return the nodes that can move horizontally and have a gravity load, but also a vertical support."""
    held = [name for name, row in frame.supports.items() if row.get("uy") is True and row.get("ux") is not True]
    return [name for name in held if frame.nodes[name]["gravity_load"] > 0]


def free_matrices(frame: Frame, *, has_p_delta: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return stiffness, geometric stiffness (tension positive) and mass matrix of the free degrees of freedom."""
    free = frame.numbering.free
    geometric = np.zeros((free.size, free.size))
    if has_p_delta:
        held = gravity_on_supports(frame)
        if held:
            others = f" (and of {len(held) - 1} other nodes)" if len(held) > 1 else ""
            warn_caller(
                f"p_delta=True: the gravity_load of node {held[0]!r}{others} has no P-Delta effect, because the node "
                "is supported vertically. Put the load on a leaning column (members with kind='truss')"
            )
        static.refuse_gravity_above_buckling(frame, "p_delta=True", "p_delta=False")
        geometric = frame.geometric(frame.gravity)[free][:, free].toarray()
    stiffness = frame.stiffness(frame.nominal)[free][:, free].toarray()
    return stiffness, geometric, frame.mass()[free][:, free].toarray()


def frame_modes(frame: Frame, modes: int | None, *, has_p_delta: bool) -> xr.Dataset:
    """Return the result of `Frame.modal`."""
    stiffness, geometric, mass = free_matrices(frame, has_p_delta=has_p_delta)
    kept = np.flatnonzero(np.diagonal(mass) > 0)
    if not kept.size:
        raise ValueError(
            "modal(): the frame has no mass: give masses=, the column mass in the table of nodes, or mass_per_length "
            "in the table of sections"
        )
    total = stiffness + geometric
    shapes = condensation(total, kept)
    influence = frame.numbering.is_horizontal[frame.numbering.free[kept]].astype(float)
    found = modal_properties(reduced(mass, shapes), reduced(total, shapes), influence if influence.any() else None)
    names = [frame.numbering.free_names[place] for place in kept]
    found = found.assign_coords(dof=("dof", np.array(names), {"long_name": "degree of freedom"}))
    return found if modes is None else found.isel(mode=slice(modes))
