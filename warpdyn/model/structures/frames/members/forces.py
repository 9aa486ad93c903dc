"""Forces at the ends of members: linear combinations of displacements, envelopes and demand-capacity ratios."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from warpdyn.foundations.core.checks import check_dataset

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame
    from warpdyn.model.structures.frames.members.matrices import Bent

ENDS = ("start", "end")
INCLUDES_GRAVITY = "includes_gravity"  # attribute of the result of `Frame.static`: 1 or 0
FORCES_OF_OUTPUTS = {"axial": 3, "shear start": 1, "shear end": 4, "moment start": 2, "moment end": 5}


def force_names(members: Sequence[str]) -> list[str]:
    """Return the names of the outputs of members, such as "beam moment start"; the axial force is a tension."""
    return [f"{member} {force}" for member in members for force in FORCES_OF_OUTPUTS]


def unit_of(output: str) -> str:
    """Return the unit of an output of a reduced frame."""
    if output.startswith("drift ") and output.removeprefix("drift ").isdigit():
        return "1"
    return "N m" if output.endswith(("moment start", "moment end")) else "N"


def force_rows(
    frame: Frame, members: Sequence[str], shapes: np.ndarray, bent: Bent, softening: np.ndarray | None = None
) -> np.ndarray:
    """Return forces per unit displacement of the kept degrees of freedom, in the order of `force_names`.

    Args:
        frame: The frame.
        members: Names of the members.
        shapes: Displacements of the free degrees of freedom per kept one, shape [structure, free, dof].
        bent: Result of `Frame.bent` for the section properties.
        softening: Geometric stiffness in local axes, result of `Frame.local_geometric`; None: without P-Delta.

    Returns:
        Coefficients [N/m] or [N m/m], shape [structure, force, dof].
    """
    number = {name: place for place, name in enumerate(frame.members)}
    places = np.array([number[name] for name in members], dtype=int)
    local, conditions = bent
    ends = local[..., places, :, :] @ conditions.ends[..., places, :, :]
    if softening is not None:
        ends = ends + softening[..., places, :, :]
    of_joints = ends[..., list(FORCES_OF_OUTPUTS.values()), :] @ frame.geometry.to_local[places]
    everywhere = np.zeros((len(shapes), len(frame.numbering.names), shapes.shape[2]))
    everywhere[:, frame.numbering.free] = shapes
    joints = everywhere[:, frame.numbering.of_members[places]]  # [structure, member, 6, dof]
    result: np.ndarray = (of_joints @ joints).reshape(len(shapes), -1, shapes.shape[2])
    return result


def demand_capacity_ratios(frame: Frame, results: xr.Dataset, *, has_gravity: bool) -> xr.Dataset:
    """Return the result of `Frame.demand_capacity`."""
    function = "demand_capacity"
    check_dataset(function, results, advice="give the result of Frame.static or simulate()", argument="results")
    if "end_force" in results:
        has_gravity = has_gravity and not _includes_gravity(results)
        forces = abs(results["end_force"].sel(member=list(frame.members)))
        demands = {
            "axial": forces.sel(action="axial").max("end"),
            "shear": forces.sel(action="shear").max("end"),
            "moment": forces.sel(action="moment").max("end"),
        }
    else:
        demands = _peaks(frame, results)
    if has_gravity:
        still = frame.static(gravity=True)["end_force"]
        demands = {
            action: demand + abs(still.sel(action=action, drop=True)).max("end").sel(member=demand["member"])
            for action, demand in demands.items()
        }
    found = xr.Dataset()
    for action, demand in demands.items():
        name, units = f"{action}_demand", "N m" if action == "moment" else "N"
        words = "bending moment" if action == "moment" else f"{action} force"
        found[name] = demand.drop_vars("action", errors="ignore")
        found[name].attrs = {"long_name": f"largest absolute {words} of the member", "units": units}
        rows = [frame.sections[frame.members[member]["section"]] for member in demand["member"].values]
        capacity = xr.DataArray([row[f"{action}_capacity"] for row in rows], dims="member")
        found[f"{action}_ratio"] = found[name] / capacity
        found[f"{action}_ratio"].attrs = {"long_name": f"{words} over its capacity", "units": "1"}
    found["interaction_ratio"] = found["axial_ratio"] + found["moment_ratio"]
    found["interaction_ratio"].attrs = {
        "long_name": "axial force and bending moment over their capacities, added",
        "units": "1",
    }
    return found


def _includes_gravity(results: xr.Dataset) -> bool:
    """Return whether the forces of a static analysis include those under the gravity loads of the tables."""
    if INCLUDES_GRAVITY not in results.attrs:
        raise ValueError(
            f"demand_capacity: the attribute {INCLUDES_GRAVITY!r} of the results is missing, such as after a sum of "
            "two results, so that it is unknown whether gravity must be added: give gravity=False, or set "
            f"results.attrs[{INCLUDES_GRAVITY!r}] to 1 or 0"
        )
    return bool(results.attrs[INCLUDES_GRAVITY])


def _peaks(frame: Frame, results: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the largest axial forces, shear forces and moments of the members of a run's outputs."""
    advice = "give Frame.lumped(..., outputs=['member_force']) and simulate with recorders=('output',)"
    check_dataset("demand_capacity", results, "peak_output", advice=advice, argument="results")
    recorded = set(results["output"].values.tolist())
    members = [name for name in frame.members if any(f"{name} {force}" in recorded for force in FORCES_OF_OUTPUTS)]
    if not members:
        raise ValueError(f"demand_capacity: the run has no forces of members: {advice}")
    peak = results["peak_output"]
    found = {}
    for action in ("axial", "shear", "moment"):
        columns = []
        for member in members:
            names = [name for name in force_names([member]) if f" {action}" in name.removeprefix(member)]
            taken = [name for name in names if name in recorded]
            zero = xr.zeros_like(peak.isel(output=0, drop=True))
            columns.append(peak.sel(output=taken).max("output") if taken else zero)
        found[action] = xr.concat(columns, xr.DataArray(members, dims="member", name="member")).transpose(..., "member")
    return found
