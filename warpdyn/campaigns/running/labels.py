"""Labels of a run's dataset: names, units, coordinates and attributes."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.campaigns.accuracy.reliability import ATTRIBUTES as RELIABILITY, UNRELIABLE
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble, MapFunction
from warpdyn.campaigns.integration.model import Model, levels_of
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.preparation.inputs import Inputs
from warpdyn.campaigns.running.selections import OF_EVENTS
from warpdyn.engine.kernels.arguments import output_dtype
from warpdyn.engine.kernels.output_table import HISTORY, OF_SPRINGS
from warpdyn.engine.kernels.queues import device_names
from warpdyn.foundations.core.output_variables import (
    DRIFT_RATIO,
    MEASURE,
    OF_SEQUENCE,
    STATUS_MEANINGS,
    STRIPED,
    UNNAMED,
    label_of_levels,
)
from warpdyn.foundations.core.units import unit_attributes
from warpdyn.foundations.files.netcdf import trace
from warpdyn.foundations.files.template import Template
from warpdyn.model.ground_motions.excitation import Assignment
from warpdyn.model.ground_motions.motions import GroundMotion, motion_names, motion_numbers
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions
from warpdyn.model.scene.scene import Scene

SAMPLES_AT_A_TIME = 2**16  # samples that one thread divides by storey heights

BECAUSE = "method_chosen_because"  # attribute of a run: the reason why its method is the default


# Inputs of a sample that do not depend on drawn parameters: the functions that return them, by variable name.
OF_ASSIGNMENT: dict[str, Callable[[Ensemble | Inputs], Any]] = {
    "sample": attrgetter("sample"),
    "structure": attrgetter("assignment.structure"),
    "motion_index": attrgetter("assignment.motion"),
    "scale_factor_of_motion": attrgetter("assignment.scale"),
    "im_level": attrgetter("assignment.im_level"),
}


@dataclass(frozen=True)
class Column:
    """A variable of a run's dataset that has one value (or one row of values) for each sample.

    Args:
        dims: Dimensions of the variable in addition to `sample`: ("storey",), ("floor",), ("dof",) or (); in an
            EventSequence, "event" comes before them.
        dtype: Number type.
        attributes: Attributes of the variable in the dataset.
        is_coordinate: Whether the variable is a coordinate of the dataset.
    """

    dims: tuple[str, ...]
    dtype: np.dtype
    attributes: Mapping[str, object]
    is_coordinate: bool = False


def columns_of(model: Model, keep_inputs: bool) -> dict[str, Column]:
    """Return the variables of a run's dataset that have one value for each sample, by name.

    Args:
        model: The model that is integrated.
        keep_inputs: Whether the drawn parameters of each sample are among the variables.
    """
    scene, plan = model.scene, model.plan
    structure, excitation = scene.structure, scene.excitation
    real, integer, double = np.dtype(plan.dtype), np.dtype("int32"), np.dtype("float64")
    columns: dict[str, Column] = {}
    for name, variable in model.variables.items():
        attributes = {"long_name": variable.long_name, "units": structure.units_along(variable.dims, variable.units)}
        attributes |= _start_time(model.scene, name)
        of_oscillators = _of_oscillators(model.scene, variable.dims)
        columns[name] = Column(variable.dims, output_dtype(name, plan.dtype), attributes | of_oscillators)
    if "peak_storey_drift" in columns:
        attributes = {"long_name": DRIFT_RATIO.long_name, "units": DRIFT_RATIO.units}
        attributes |= _start_time(model.scene, "peak_storey_drift_ratio")
        columns["peak_storey_drift_ratio"] = Column(DRIFT_RATIO.dims, real, attributes)
    attributes = {"long_name": "integration step", "units": "s"}
    columns["integration_step"] = Column((), double, attributes)
    status = {
        "long_name": "outcome of the sample",
        "units": "1",
        "flag_values": np.arange(len(STATUS_MEANINGS), dtype=np.int8),
        "flag_meanings": " ".join(STATUS_MEANINGS),
    }
    columns["status"] = Column((), np.dtype("int8"), status)
    columns[UNRELIABLE] = Column((), np.dtype("int8"), RELIABILITY)
    for name in scene.scatter if keep_inputs else ():
        parameter = structure.parameter_table[name]
        dims = (structure.dim_of(name),) if structure.is_by_storey(name) else ()
        attributes = {"long_name": parameter.long_name, "units": structure.units_along(dims, parameter.units)}
        columns[structure.input_name(name)] = Column(dims, real, attributes)
    sample = {"standard_name": "realization", "long_name": "sample", "units": "1"}
    of_structure = {"long_name": "index of the drawn structure", "units": "1", "sampling": scene.sampling_of_structures}
    coordinates: dict[str, tuple[np.dtype, Mapping[str, object]]] = {
        "sample": (integer, sample),
        "structure": (integer, of_structure),
    }
    if excitation.motions:
        coordinates["motion_index"] = (integer, {"long_name": "index along the dimension motion", "units": "1"})
        scale = {"long_name": "factor on the recorded motion", "units": "1"}
        coordinates["scale_factor_of_motion"] = (double, scale)
    levels = levels_of(scene)
    if len(levels) > 1:
        attributes = {
            "long_name": label_of_levels(UNNAMED[1]),
            "design": OF_SEQUENCE,
        }
        units = {level.units for level in levels}
        # If the units of the events differ, the variable im_level_units contains the unit of each event.
        coordinates["im_level"] = (double, attributes | ({"units": units.pop()} if len(units) == 1 else {}))
    elif levels[0].im_level is not None:
        coordinates["im_level"] = (double, _level_attributes(levels[0]))
    for name, (dtype, said) in coordinates.items():
        columns[name] = Column((), dtype, said, is_coordinate=True)
    return _by_event(scene, columns) if len(levels) > 1 else columns


def attributes_of_run(run: Run) -> dict[str, object]:
    """Return the attributes of a run's dataset that describe the integration, such as seed, method, step and device."""
    integration, steps = run.integration, np.unique(run.model.timeline.steps)
    attributes = {
        "seed": run.model.seed,
        "method": integration.method,
        BECAUSE: integration.reason or None,
        "step": steps if steps.size > 1 else float(steps[0]),
        "on_unstable": integration.on_unstable,
        "dtype": integration.dtype,
        "device": device_names(run.execution.devices),
        "kernel": run.model.kernel_name,
        "longest_step": integration.longest_step,
        "target_error": integration.target_error,
        "resampled": "yes" if integration.resample else None,
        "tolerance": run.model.tolerance if run.model.method.is_adaptive else None,
    }
    return {name: value for name, value in attributes.items() if value is not None}


def _start_time(scene: Scene, name: str) -> dict[str, str]:
    """Return the comment of a peak variable if peaks are recorded only from `record_from` on; otherwise empty."""
    if scene.record_from == 0 or "peak" not in name:
        return {}
    return {"comment": f"of the states from record_from = {scene.record_from:g} s on"}


def _of_oscillators(scene: Scene, dims: tuple[str, ...]) -> dict[str, object]:
    """Return the attributes of a floor spectrum: damping ratio and quantity; otherwise empty."""
    if scene.floor_spectra is None or "period" not in dims:
        return {}
    return {"damping_ratio": scene.floor_spectra.damping_ratio, "quantity": scene.floor_spectra.quantity}


def _level_attributes(level: Assignment) -> dict[str, Any]:
    """Return the attributes of the variable `im_level` (intensity level of a sample) of one event's design."""
    striped = STRIPED if level.is_striped else "of a design in which every motion has its own level"
    name = str(level.measure.get(MEASURE, UNNAMED[1]))
    label = {"long_name": label_of_levels(name), "design": striped} | unit_attributes(level.units)
    return {**label, **level.measure}


def _by_event(scene: Scene, columns: dict[str, Column]) -> dict[str, Column]:
    """Return the columns of an EventSequence with the added dimension `event`.

    The sample and structure numbers and the drawn parameters do not depend on the event and stay without it.
    """
    fixed = {"sample", "structure", *scene.scatter}
    return {
        name: column if name in fixed else replace(column, dims=("event", *column.dims))
        for name, column in columns.items()
    }


def lengths(model: Model, column: Column) -> tuple[int, ...]:
    """Return the lengths of a column's dimensions in addition to `sample`."""
    events = len(model.scene.excitation.event_names)
    of_structure = {"event": events, "member": model.scene.structure.length_along("member")}
    return tuple(of_structure.get(dim) or model.plan.length(dim) for dim in column.dims)


def fill_inputs(known: Ensemble | Inputs, rows: Arrays, map_function: MapFunction = map) -> None:
    """Write the inputs of samples, which are known before the integration, to arrays of the dataset.

    Args:
        known: The samples with their structures, motions and drawn parameters.
        rows: Arrays by variable name, shape [sample, ...]; they are changed in place.
        map_function: A function such as `map` that is called over the variables and may run in parallel.
    """

    def fill(name: str) -> None:
        if name in OF_ASSIGNMENT:
            np.copyto(rows[name], OF_ASSIGNMENT[name](known))
        else:
            _spread(known.drawn[of_structure[name]].astype(rows[name].dtype), rows[name])

    of_structure = scattered_inputs(known.scene)
    list(map_function(fill, rows.keys() & (OF_ASSIGNMENT | of_structure).keys()))


def scattered_inputs(scene: Scene) -> dict[str, str]:
    """Return the names of a scene's scattered parameters, by the names of their variables in the dataset."""
    return {scene.structure.input_name(name): name for name in scene.scatter}


def fill_outcomes(run: Ensemble, rows: Arrays, map_function: MapFunction = map) -> None:
    """Compute the integration steps [s] and drift ratios [1] of a block's samples and write them to rows.

    Args:
        run: Samples of the block.
        rows: Arrays by variable name, shape [sample, ...]; they are changed in place.
        map_function: A function such as `map` that is called over parts of the samples and may run in parallel.
    """
    if "integration_step" in rows:
        rows["integration_step"][...] = run.steps
    if "peak_storey_drift_ratio" not in rows:
        return
    drift, ratio = rows["peak_storey_drift"], rows["peak_storey_drift_ratio"]
    height = run.storey_heights
    # Inner loops over a few storeys are slow, so all samples of a structure form one row of these arrays.
    structures = len(run.structures)
    wide = np.tile(height.astype(ratio.dtype), (1, len(drift) // structures))
    drifts, ratios = drift.reshape(structures, -1), ratio.reshape(structures, -1)

    at_a_time = max(1, SAMPLES_AT_A_TIME * structures // len(drift))

    def divide(first: int) -> None:
        part = slice(first, first + at_a_time)
        np.divide(drifts[part], wide[part] if len(wide) > 1 else wide, out=ratios[part])

    list(map_function(divide, range(0, structures, at_a_time)))


def _spread(values: np.ndarray, rows: np.ndarray) -> None:
    """Repeat each structure's values, shape [structure, ...], in all rows of its samples, which follow one another."""
    samples_per_structure = len(rows) // len(values)
    by_structure = rows.reshape(len(values), samples_per_structure, -1)
    by_structure[:, 0] = values.reshape(len(values), -1)
    done = 1
    while done < samples_per_structure:  # copy twice as much each time: inner loops over a few storeys are slow
        more = min(done, samples_per_structure - done)
        by_structure[:, done : done + more] = by_structure[:, :more]
        done += more


def labelled(model: Model, columns: dict[str, Column], rows: Arrays) -> Template:
    """Return the template of a run's dataset: its variables with attributes, but without samples.

    Args:
        model: The model that is integrated.
        columns: Variables with one value for each sample, by name.
        rows: Empty arrays of these variables, shape [0, ...].
    """
    scene = model.scene
    variables = {
        name: _variable(name, ("sample", *column.dims), rows[name], column.attributes)
        for name, column in columns.items()
    }
    coordinates = {name: variables.pop(name) for name, column in columns.items() if column.is_coordinate}
    of_motions = {name: _variable(name, *of_all) for name, of_all in _motion_table(scene).items()}
    if of_motions:
        coordinates = {"motion": of_motions.pop("motion")} | coordinates
    coordinates |= {name: _variable(name, *numbered) for name, numbered in _numbered(scene).items()}
    levels = levels_of(scene)
    measure = levels[0].measure if len(levels) == 1 else {}
    attributes = {**trace(scene.title, "simulate"), **measure, "scene": scene.to_json()}
    return Template(variables | of_motions | coordinates, tuple(coordinates), attributes)


def filled(template: Template, rows: Mapping[str, Any]) -> xr.Dataset:
    """Return the dataset of a run from its template and the values of its samples.

    Args:
        template: Template of the dataset, from `labelled`.
        rows: Values by variable name, shape [sample, ...], as arrays or variables.
    """
    variables: dict[Any, xr.Variable] = dict(template.variables)
    for name, values in rows.items():
        labels = variables[name]
        is_variable = isinstance(values, xr.Variable)
        variables[name] = values if is_variable else _variable(name, labels.dims, values, labels.attrs)
    coordinates = {name: variables.pop(name) for name in template.coords}
    return xr.Dataset(variables, coordinates, template.attrs)


def _variable(
    name: str, dims: str | tuple[Hashable, ...], values: np.ndarray, attributes: Mapping[str, object]
) -> xr.Variable:
    """Return a variable of a NumPy array of numbers or texts.

    xarray would import Dask, if Dask is installed, to find out whether it made the array, which takes 0.3 s of a new
    process. `fastpath` and, for the numbers along a dimension, an index of pandas avoid it.
    """
    if dims in (name, (name,)) and values.dtype.kind in "iuf":
        return xr.IndexVariable(name, pd.Index(values), attributes, fastpath=True)
    return xr.Variable(dims, values, attributes, fastpath=True)


def _numbered(scene: Scene) -> dict[str, tuple]:
    """Return the coordinates along dimensions other than `sample`, such as storey, floor and event, by name."""
    coordinates, excitation = scene.structure.numbered(scene.recorders), scene.excitation
    if scene.floor_spectra is not None:
        coordinates |= scene.floor_spectra.coordinate
    if len(excitation.event_names) > 1:
        names = np.array(excitation.event_names)
        coordinates["event"] = ("event", names, {"long_name": "event of the sequence"})
        levels = [_level_attributes(level) for level in levels_of(scene)]
        for key, missing in OF_EVENTS.items():
            text = {"long_name": f"{key} of im_level in each event"}
            if any(key in level for level in levels):
                values = np.array([level.get(key, missing) for level in levels])
                coordinates[f"im_level_{key}"] = ("event", values, text)
        copies = excitation.samples_per_structure // np.array(excitation.samples_by_event)
        text = {"long_name": "samples, one after the other, that have a history of the event in common", "units": "1"}
        coordinates["samples_per_history"] = ("event", copies.astype(np.int32), text)
    return coordinates


def _motion_table(scene: Scene) -> dict[str, tuple]:
    """Return the variables along the dimension `motion` (name, step, peak ground acceleration), by variable name."""
    motions = scene.excitation.motions
    if not motions:
        return {}
    steps = np.array([motion.step for motion in motions])
    table: dict[str, tuple] = {
        "motion": motion_numbers(len(motions)),
        "motion_name": motion_names(motions),
        "motion_step": ("motion", steps, {"long_name": "sampling step of the motion", "units": "s"}),
    }
    recorded = [
        motion.peak_ground_acceleration for motion in motions if isinstance(motion, GroundMotion | PairOfMotions)
    ]
    if len(recorded) == len(motions):
        said = {"long_name": "peak ground acceleration of the motion as recorded", "units": "m s-2"}
        table["motion_peak_acceleration"] = "motion", np.array(recorded), said
    return table


def history_variables(
    samples: Sequence[int], time: np.ndarray, values: dict[str, np.ndarray], scene: Scene
) -> xr.Dataset:
    """Return whole histories as a dataset along `history`, `time` and `dof` (or `storey`); NaN after a history's end.

    Args:
        samples: Index of the sample of each history.
        time: Times of the returned states [s].
        values: Histories by name, shape [history, time, dof].
        scene: The scene, whose structure may have names of degrees of freedom and springs.
    """
    variables = {}
    known, numbered = HISTORY | OF_SPRINGS, scene.structure.numbered(scene.recorders)
    numbers = np.arange(1, next(iter(values.values())).shape[2] + 1, dtype=np.int32)
    for name, array in values.items():
        units = scene.structure.units_along(known[name].dims, known[name].units)
        attributes = {"long_name": known[name].long_name, "units": units}
        variables[name] = (("history", "time", *known[name].dims), array, attributes)
    coordinates = {
        "time": ("time", time, {"standard_name": "time", "long_name": "time", "units": "s"}),
        "dof": numbered.get("dof", ("dof", numbers, {"long_name": "degree of freedom", "units": "1"})),
        "history_sample": (
            "history",
            np.array(samples, dtype=np.int32),
            {"long_name": "index along the dimension sample", "units": "1"},
        ),
    }
    return xr.Dataset(variables, coords=coordinates)
