"""Sections of a report on the scene (structure, scatter, motions), integration errors and provenance."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.foundations.core.description import number_text
from warpdyn.interfaces.reports.markup import Part, heading, paragraph, preformatted, table

MOST_MOTIONS = 60  # largest number of rows in the table of ground motions
MOST_ARCHETYPES = 40  # largest number of rows in the table of archetypes
LONGEST_SCENE = 6000  # largest number of characters of the scene that are printed
# Attributes of a run that the report shows, in the order of the table, with their descriptions.
ATTRIBUTES = {
    "source": "versions",
    "history": "when, and by which call",
    "seed": "seed of every random draw",
    "method": "integration method",
    "method_chosen_because": "why this method",
    "step": "longest integration step [s]",
    "on_unstable": "treatment of samples beyond their stability limit",
    "dtype": "number type",
    "device": "device",
    "kernel": "kernel",
    "fingerprint": "digest of everything that determines the results",
    "seconds_integrating": "time spent integrating [s]",
    "intensity_measure": "intensity measure",
    "fragility_method": "method of the fragility curves",
    "interval_method": "method of their intervals",
    "confidence": "confidence level of the intervals",
}


def scene_parts(scene: Mapping[str, Any]) -> list[Part]:
    """Return the section of a report on the structures, their scatter and their excitation.

    Args:
        scene: The scene of a run, as the mapping that the JSON text in the attribute `scene` of the run contains.
    """
    parts = [heading("Scene")]
    structure, excitation = scene.get("structure", {}), scene.get("excitation", {})
    if "archetypes" in structure:
        archetypes = structure["archetypes"]
        rows = [(str(name), *_of_archetype(each)) for name, each in list(archetypes.items())[:MOST_ARCHETYPES]]
        more = f", the first {MOST_ARCHETYPES}" if len(archetypes) > MOST_ARCHETYPES else ""
        heads = ("archetype", "buildings", "storeys", "storey law", "random parameters")
        parts.append(table(f"Portfolio of archetypes: {len(archetypes):,}{more}", heads, rows))
    else:
        values = [(name.replace("_", " "), _words_of(value)) for name, value in structure.items()]
        parts.append(table("Structure (kg, m, s, N; from the ground up)", ("quantity", "value"), values))
    if scene.get("scatter"):
        rows = [(name.replace("_", " "), _words_of(value)) for name, value in scene["scatter"].items()]
        parts.append(table("Scatter between structures", ("quantity", "distribution"), rows))
    given = [
        (name.replace("_", " "), _words_of(value))
        for name, value in excitation.items()
        if name not in ("motions", "type")
    ]
    if scene.get("record_from"):
        given.append(("peaks recorded from", f"{scene['record_from']:g} s"))
    parts.append(table(f"Excitation: {excitation.get('type', 'unknown')}", ("quantity", "value"), given))
    return parts


def _of_archetype(archetype: Mapping[str, Any]) -> tuple[object, ...]:
    """Return the table row of an archetype: number of buildings, number of storeys, storey law, random parameters."""
    building = archetype.get("structure", {})
    storeys, law = building.get("mass", []), building.get("law", "")
    scattered = ", ".join(name.replace("_", " ") for name in archetype.get("scatter", {}))
    return (
        archetype.get("count", 0),
        len(storeys) if isinstance(storeys, list) else "",
        _words_of(law),
        scattered or "no scatter",
    )


def _motions(run: xr.Dataset) -> list[Part]:
    """Return the table of the ground motions of a run as a list of one part; empty if motions have no names."""
    if "motion_name" not in run or run["motion_name"].ndim != 1:
        return []
    names = run["motion_name"].values
    columns = [name for name in ("motion_step", "motion_peak_acceleration") if name in run]
    heads = ("motion", *(f"{run[name].attrs['long_name']} [{run[name].attrs['units']}]" for name in columns))
    rows = [
        (str(name), *(float(run[column].values[number]) for column in columns))
        for number, name in enumerate(names[:MOST_MOTIONS])
    ]
    more = f", the first {MOST_MOTIONS}" if names.size > MOST_MOTIONS else ""
    return [table(f"Ground motions: {names.size:,}{more}", heads, rows)]


def accuracy(run: xr.Dataset) -> list[Part]:
    """Return the section of a report on the integration error; an empty list if the run has no error estimates.

    Args:
        run: Result of `simulate`, for one event.
    """
    parts = []
    if "estimated_relative_error" in run and run["estimated_relative_error"].dims == ("demand", "error_statistic"):
        found = run["estimated_relative_error"]
        heads = ("demand", *(str(name) for name in found["error_statistic"].values))
        rows = [(str(row["demand"].item()), *map(float, row.values)) for row in found]
        parts.append(
            table("Estimated relative error, from samples run again in float64 with half the step", heads, rows)
        )
    if "energy_balance_error" in run:
        error = np.abs(run["energy_balance_error"].values)
        error = error[np.isfinite(error)]
        if error.size:
            rows = [(float(np.median(error)), float(np.quantile(error, 0.95)), float(error.max()))]
            parts.append(table("Energy residual divided by the energy supplied", ("median", "95 %", "worst"), rows))
    return [heading("Accuracy of the integration"), *parts] if parts else []


def provenance(run: xr.Dataset) -> list[Part]:
    """Return the section of a report that contains everything that is needed to repeat the run.

    Args:
        run: Result of `simulate`.
    """
    rows = [(words, _words_of(run.attrs[name])) for name, words in ATTRIBUTES.items() if name in run.attrs]
    scene = str(run.attrs["scene"])
    cut = f" ... ({len(scene):,} letters in all)" if len(scene) > LONGEST_SCENE else ""
    return [
        heading("Provenance"),
        table("Provenance of the results", ("item", "value"), rows),
        paragraph("The scene as JSON; wd.Scene.from_json makes a Scene from it and the ground motions:"),
        preformatted(scene[:LONGEST_SCENE] + cut),
        *_motions(run),
    ]


def _words_of(value: Any) -> str:
    """Return a value of a scene as text; an object is written as `type(field value, ...)`."""
    if isinstance(value, Mapping):
        fields = ", ".join(f"{name} {_words_of(each)}" for name, each in value.items() if name != "type")
        return f"{value.get('type', '')}({fields})" if "type" in value else fields
    if isinstance(value, list) and value and isinstance(value[0], Mapping | list):
        return json.dumps(value)[:400]
    if isinstance(value, np.generic):
        value = value.item()
    return "none" if value is None else number_text(value)
