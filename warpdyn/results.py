"""From a run's arrays to a labelled dataset: names, units, coordinates and the trace of where it came from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from warpdyn.motions import IN_G, Assignment, motion_names
from warpdyn.recorders import ADAPTIVE, HISTORY, RECORDERS, STATUS_MEANINGS, STRIPED
from warpdyn.scene import Scene
from warpdyn.store import trace
from warpdyn.timeline import Schedule, motions_of


def label(
    scene: Scene,
    outputs: dict[str, np.ndarray],
    drawn: dict[str, np.ndarray],
    assignment: Assignment,
    schedule: Schedule,
) -> xr.Dataset:
    """Return the dataset of a run.

    Args:
        scene: The scene.
        outputs: Recorded variables, sample last.
        drawn: Scattered parameters, structure first.
        assignment: Which structure and motion each sample had.
        schedule: How each sample was stepped.
    """
    variables: dict[str, tuple] = {}
    dtype = next((v.dtype for v in outputs.values() if np.issubdtype(v.dtype, np.floating)), np.dtype("float64"))
    for recorder in scene.record:
        for name, variable in RECORDERS[scene.structure.family][recorder].items():
            attributes = {"long_name": variable.long_name, "units": variable.units}
            variables[name] = (("sample", *variable.dims), outputs[name].T, attributes)
    if "peak_storey_drift" in variables:
        values = peak_storey_drift_ratio(scene, outputs, drawn, assignment.structure).T.astype(dtype)
        attributes = {"long_name": "peak absolute storey drift ratio", "units": "1"}
        variables["peak_storey_drift_ratio"] = (("sample", "storey"), values, attributes)
    for name in ADAPTIVE.keys() & outputs.keys():
        attributes = {"long_name": ADAPTIVE[name].long_name, "units": ADAPTIVE[name].units}
        variables[name] = ("sample", outputs[name], attributes)
    variables["integration_step"] = ("sample", schedule.step, {"long_name": "integration step", "units": "s"})
    status = {
        "long_name": "outcome of the sample",
        "units": "1",
        "flag_values": np.arange(len(STATUS_MEANINGS), dtype=np.int8),
        "flag_meanings": " ".join(STATUS_MEANINGS),
    }
    variables["status"] = ("sample", outputs["status"].astype(np.int8), status)
    for name, values in drawn.items():
        parameter = scene.structure.parameter_table[name]
        attributes = {"long_name": parameter.long_name, "units": parameter.units}
        name = name if scene.structure.family == "chain" else f"{name}_factor"
        dims = ("sample", "storey")[: values.ndim]
        variables[name] = (dims, values.astype(dtype)[assignment.structure], attributes)
    dataset = xr.Dataset(variables, coords=_coordinates(scene, assignment))
    dataset = dataset.merge(_motion_table(scene))
    dataset.attrs = trace(scene.title, "simulate") | {"scene": scene.to_json()}
    return dataset


def peak_storey_drift_ratio(
    scene: Scene, outputs: dict[str, np.ndarray], drawn: dict[str, np.ndarray], structure: np.ndarray
) -> np.ndarray:
    """Return the peak drifts over the storey heights, shape [storey, sample], where `structure` is each sample's."""
    height = drawn["height"][structure].T if "height" in drawn else scene.structure.parameters["height"][:, None]
    return outputs["peak_storey_drift"] / height


def _coordinates(scene: Scene, assignment: Assignment) -> dict[str, tuple]:
    count = assignment.structure.size
    coordinates: dict[str, tuple] = {
        "sample": (
            "sample",
            np.arange(count, dtype=np.int32),
            {"standard_name": "realization", "long_name": "sample", "units": "1"},
        ),
        "structure": ("sample", assignment.structure, {"long_name": "index of the drawn structure", "units": "1"}),
    }
    if scene.structure.family == "chain":
        numbers = np.arange(1, scene.structure.storeys + 1, dtype=np.int32)
        coordinates["storey"] = ("storey", numbers, {"long_name": "storey, from the ground up", "units": "1"})
        if "acceleration" in scene.record:
            coordinates["floor"] = ("floor", numbers, {"long_name": "floor above the storey", "units": "1"})
    else:
        numbers = np.arange(1, scene.structure.dofs + 1, dtype=np.int32)
        coordinates["dof"] = ("dof", numbers, {"long_name": "degree of freedom", "units": "1"})
    if motions_of(scene):
        record = {"long_name": "index along the dimension motion", "units": "1"}
        coordinates["record"] = ("sample", assignment.motion, record)
        coordinates["scale_factor_of_motion"] = (
            "sample",
            assignment.scale,
            {"long_name": "factor on the recorded motion", "units": "1"},
        )
    if assignment.im_level is not None:
        name = f"{assignment.measure} of the scaled motion"
        striped = STRIPED if assignment.is_striped else "of a design where every motion has a level of its own"
        attributes = {"long_name": name, "units": assignment.units, "design": striped}
        if assignment.units == "g":
            attributes["comment"] = IN_G
        coordinates["im_level"] = ("sample", assignment.im_level, attributes)
    return coordinates


def _motion_table(scene: Scene) -> xr.Dataset:
    """Return what is known of each motion, along `motion`."""
    motions = motions_of(scene)
    if not motions:
        return xr.Dataset()
    steps = np.array([motion.step for motion in motions])
    return xr.Dataset(
        {
            "motion_name": motion_names(motions),
            "motion_step": ("motion", steps, {"long_name": "sampling step of the motion", "units": "s"}),
        }
    )


def history_variables(samples: Sequence[int], time: np.ndarray, values: dict[str, np.ndarray]) -> xr.Dataset:
    """Return whole histories along `history`, `time` and `dof` (or `storey`); NaN after a history's end.

    Args:
        samples: The sample of each history.
        time: Time of the states kept [s].
        values: Histories by name, shape [history, time, dof].
    """
    variables = {}
    numbers = np.arange(1, next(iter(values.values())).shape[2] + 1, dtype=np.int32)
    for name, array in values.items():
        attributes = {"long_name": HISTORY[name].long_name, "units": HISTORY[name].units}
        variables[name] = (("history", "time", *HISTORY[name].dims), array, attributes)
    coordinates = {
        "time": ("time", time, {"long_name": "time", "units": "s"}),
        "dof": ("dof", numbers, {"long_name": "degree of freedom", "units": "1"}),
        "history_sample": (
            "history",
            np.array(samples, dtype=np.int32),
            {"long_name": "index along the dimension sample", "units": "1"},
        ),
    }
    return xr.Dataset(variables, coords=coordinates)


def summary(run: xr.Dataset) -> str:
    """Return what a run did and how far it can be trusted, in a few lines of text.

    Args:
        run: What `simulate` returned.
    """
    status = np.bincount(run["status"].values, minlength=len(STATUS_MEANINGS))
    told = ", ".join(f"{count:,} {name}" for count, name in zip(status, STATUS_MEANINGS, strict=True) if count)
    steps = run["integration_step"].values
    lines = [
        f"{run.sizes['sample']:,} samples: {told}",
        f"{run.attrs['method']} in {run.attrs['dtype']} on {run.attrs['device']}, "
        f"steps {steps.min():.4g} to {steps.max():.4g} s, {run.attrs['seconds_integrating']:.3g} s integrating",
    ]
    if "estimated_relative_error" in run:
        table = run["estimated_relative_error"]
        heads = "".join(f"{name:>12}" for name in table["error_statistic"].values)
        lines.append(f"{'estimated relative error':<26}{heads}")
        for demand in table["demand"].values:
            row = "".join(f"{value:>12.2e}" for value in table.sel(demand=demand).values)
            lines.append(f"{demand:<26}{row}")
    return "\n".join(lines)
