"""Flat files of record databases: periods, spectral accelerations [g] and the table of records."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from numbers import Real

import numpy as np
import pandas as pd

from warpdyn.foundations.core.messages import amount_of, warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.foundations.files.text import existing_file
from warpdyn.model.ground_motions.records.units import unit_factor

Flat = tuple[np.ndarray, np.ndarray, pd.DataFrame]

NGAWEST2_PERIOD = re.compile(r"T(\d+\.\d+)S")
NGAWEST2 = {
    "rsn": "Record Sequence Number",
    "event": "EQID",
    "magnitude": "Earthquake Magnitude",
    "distance": "ClstD (km)",
    "vs30": "Vs30 (m/s) selected for analysis",
    "longest_usable_period": "Lowest Usable Freq - Ave. Component (Hz)",
    "file_1": "File Name (Horizontal 1)",
    "file_2": "File Name (Horizontal 2)",
}
ESM_PERIOD = re.compile(r"rotD50_T(\d+_\d+)")
ESM = {
    "event": "event_id",
    "network": "network_code",
    "station": "station_code",
    "magnitude": "Mw",
    "magnitude_emec": "EMEC_Mw",
    "distance": "rup_dist",
    "distance_jb": "JB_dist",
    "distance_epicentral": "epi_dist",
    "vs30": "vs30_m_sec",
    "high_pass_u": "U_hp",
    "high_pass_v": "V_hp",
}
MISSING = -999.0  # marker of a missing value
GAL = 0.01 / STANDARD_GRAVITY  # 1 cm/s2 in g


def ngawest2_table(path: str | os.PathLike) -> Flat:
    """Return periods [s], RotD50 Sa [g] and the table of records from the flat file of NGA-West2."""
    flat = _read_flat_file(path, "from_ngawest2", ",")
    spectra = {float(found[1]): name for name in flat if (found := NGAWEST2_PERIOD.fullmatch(name))}
    periods, values, table = _parts(flat, spectra, NGAWEST2, path, "NGA-West2", 1.0)
    frequency = table["longest_usable_period"]
    table["longest_usable_period"] = 1 / frequency.where(frequency > 0)
    table.insert(0, "name", "RSN" + table["rsn"].astype(int).astype(str))
    return periods, values, table


def esm_table(path: str | os.PathLike) -> Flat:
    """Return periods [s], RotD50 Sa [g] and the table of records from the flat file of ESM 2018."""
    first = existing_file("from_esm", path).open(encoding="utf-8-sig", errors="replace").readline()
    flat = _read_flat_file(path, "from_esm", ";" if first.count(";") > first.count(",") else ",")
    spectra = {float(found[1].replace("_", ".")): name for name in flat if (found := ESM_PERIOD.fullmatch(name))}
    periods, values, table = _parts(flat, spectra, ESM, path, "ESM", GAL)
    table["magnitude"] = table.pop("magnitude_emec").fillna(table["magnitude"])
    others = table.pop("distance_jb"), table.pop("distance_epicentral")
    table["distance"] = table["distance"].fillna(others[0]).fillna(others[1])
    corner = np.fmax(table.pop("high_pass_u"), table.pop("high_pass_v"))
    table["longest_usable_period"] = 1 / corner.where(corner > 0)
    names = table["event"].astype(str) + " " + table["network"].astype(str) + "." + table["station"].astype(str)
    table.insert(0, "name", names)
    return periods, values, table


def user_table(
    path: str | os.PathLike | pd.DataFrame,
    spectra: Mapping[float, str],
    columns: Mapping[str, str],
    unit: str,
    missing: float,
) -> Flat:
    """Return periods [s], Sa [g] and the table of records from a flat file with given names of columns."""
    flat = path.copy() if isinstance(path, pd.DataFrame) else _read_flat_file(path, "from_table", ",")
    size = unit_factor(unit, "RecordSpectra.from_table: unit=") / STANDARD_GRAVITY
    where = "the table" if isinstance(path, pd.DataFrame) else path
    if not isinstance(spectra, Mapping) or not isinstance(columns, Mapping):
        raise TypeError(
            "from_table: spectra and columns must be mappings, such as spectra={1.0: 'T1'}, columns={'magnitude': 'M'}"
        )
    wrong = [period for period in spectra if isinstance(period, bool) or not isinstance(period, Real)]
    if wrong:
        raise TypeError(f"from_table: the keys of spectra must be periods [s], such as {{1.0: 'T1'}}, got {wrong[0]!r}")
    return _parts(flat, dict(spectra), dict(columns), where, "given", size, missing)


def _read_flat_file(path: str | os.PathLike, function: str, separator: str) -> pd.DataFrame:
    # The C parser reads 21,000 rows of 250 columns in 1 s. Names may contain line breaks, and repeated names occur.
    file = existing_file(f"RecordSpectra.{function}", path)
    try:
        flat = pd.read_csv(file, sep=separator, encoding="utf-8-sig", low_memory=False, encoding_errors="replace")
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeError) as error:
        raise ValueError(f"{path} is not a table in CSV: {error}. Save the flat file as CSV") from None
    flat.columns = pd.Index([" ".join(str(name).split()) for name in flat.columns])
    return flat


def _parts(
    flat: pd.DataFrame,
    spectra: dict[float, str],
    columns: dict[str, str],
    path: object,
    kind: str,
    to_g: float,
    missing: float = MISSING,
) -> Flat:
    """Return periods [s], Sa [g] and the table, without records whose spectrum is not complete."""
    if not spectra:
        raise ValueError(
            f"{path} has no columns of spectral accelerations of the {kind} flat file: give the file with RotD50"
        )
    absent = [name for name in (*columns.values(), *spectra.values()) if name not in flat]
    if absent:
        raise ValueError(
            f"{path} has no column {absent[0]!r}{did_you_mean(absent[0], [str(name) for name in flat])}, which the "
            f"{kind} flat file needs"
        )
    periods = np.array(sorted(spectra))
    rows = flat[[spectra[period] for period in periods]].apply(pd.to_numeric, errors="coerce").to_numpy(float)
    is_complete = np.all(np.isfinite(rows) & (rows > 0), axis=1)
    if not is_complete.any():
        raise ValueError(f"{path}: no record has a complete spectrum with values above 0: correct the file")
    if not is_complete.all():
        left_out = amount_of(int((~is_complete).sum()), "record")
        warn_caller(f"{path}: {left_out} of {len(rows)} without a complete spectrum are omitted")
    table = flat.loc[is_complete, list(columns.values())].reset_index(drop=True)
    table.columns = pd.Index(list(columns))
    for name in table:
        numbers = pd.to_numeric(table[name], errors="coerce")
        is_number = name not in ("name", "event", "station", "network", "file_1", "file_2")
        if is_number and (numbers.notna().any() or name in ("magnitude", "distance", "vs30")):
            table[name] = numbers.where(numbers != missing)
    return periods, to_g * rows[is_complete], table
