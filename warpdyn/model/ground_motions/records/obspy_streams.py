"""Ground motions from streams of obspy, which reads K-NET, KiK-net, MiniSEED, SAC and other formats."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.units import checked_step, unit_factor

# Formats for which obspy's `calib` is a factor that converts values to displacements at one period.
_CALIBRATED_TO_DISPLACEMENT = ("GSE1", "GSE2", "CSS", "NNSA_KB_CORE")
# Header variable IDEP of SAC -> quantity of the values, if they are not accelerations.
_SAC_QUANTITIES = {6: "displacements", 7: "velocities", 50: "volts"}
# Second letter of a SEED channel -> instrument, if it is not an accelerometer.
_SEISMOMETERS = {"H": "seismometer", "L": "low-gain seismometer"}
_OUTPUTS = {"VEL": "velocities", "DISP": "displacements"}  # argument `output` of obspy's remove_response -> quantity
_LARGEST_COUNT_LIKE, _FEWEST_VALUES = 100.0, 50  # 50 whole numbers with a peak above 100 are probably counts


def from_obspy(stream: Iterable[Any], unit: str | None = None) -> list[GroundMotion]:
    """Return the motions in an obspy stream, one motion per trace, including vertical components.

    The values are the data times the calibration `stats.calib`. For K-NET and KiK-net, this gives m/s2, although the
    files are in gal. Records are not corrected: records of K-NET have an offset, which `detrend` removes.

    MiniSEED files and most SAC files contain counts of the digitizer. `stream.remove_response(inventory, output="ACC")`
    converts counts to accelerations in m/s2.

    Args:
        stream: The stream, such as `obspy.read("AKT0131103111446.EW")`, with pip install "obspy>=1.4".
        unit: Unit of the values, one of `UNITS`. It is not needed for K-NET and KiK-net, and after
            `remove_response(output="ACC")`, because obspy then gives values in m/s2.

    Returns:
        The motions [m/s2], named by the traces, with the station and start as `record` and the channel as `component`.

    Raises:
        TypeError: If `stream` is not a stream.
        ValueError: If there is no trace, the unit is unknown, missing or contradicts the trace, the values are counts,
            velocities or displacements, a trace has gaps, or a value is not finite.

    Example:
        >>> import obspy
        >>> stream = obspy.Stream([obspy.Trace(100 * noise[0], {"station": "STA1", "channel": "HNN", "delta": 0.02})])
        >>> [motion.component for motion in wd.records.from_obspy(stream, unit="gal")]
        ['HNN']
    """
    return motions_of_stream(stream, unit)


def motions_of_stream(stream: Iterable[Any], unit: str | None, file: str = "") -> list[GroundMotion]:
    """Return the motions in an obspy stream, as `from_obspy` does; messages begin with the name `file`, if given."""
    traces = []
    for trace in stream:
        if not hasattr(trace, "stats") or not hasattr(trace, "data"):
            raise TypeError(
                f"from_obspy() takes an obspy Stream, such as obspy.read(path), got a sequence "
                f"with an object of type {type(trace).__name__}"
            )
        traces.append(trace)
    if not traces:
        raise ValueError("the stream has no traces: give a stream with at least one trace, such as obspy.read(path)")
    places = [f"{f'{file}: ' if file else ''}trace {trace.id}" for trace in traces]
    rows = zip(traces, places, _records_of(traces, places), strict=True)
    return [_motion_of(trace, place, unit, record) for trace, place, record in rows]


def _motion_of(trace: Any, place: str, unit: str | None, record: str) -> GroundMotion:
    stats = trace.stats
    is_in_si = "knet" in stats or "output='ACC'" in _processing(stats).replace('"', "'")
    _refuse_other_quantities(trace, place)
    if unit is None and not is_in_si:
        raise ValueError(
            f"{place}: the unit is unknown, because most traces do not state it: give unit=, such as unit='m/s2'"
        )
    if np.ma.is_masked(trace.data):
        raise ValueError(
            f"{place} has gaps: fill them by stream.merge(fill_value='interpolate'), or split the stream by "
            f"stream.split()"
        )
    factor = unit_factor(unit, place) if unit is not None else 1.0
    if is_in_si and factor != 1.0:
        why = "the K-NET file's scale factor" if "knet" in stats else "remove_response(output='ACC')"
        raise ValueError(
            f"{place}: obspy gives these values in m/s2, by {why}, but unit={unit!r} is given, so all values would be "
            f"wrong by a factor of {factor:.6g}: remove unit="
        )
    calibration = float(stats.calib)
    values = np.asarray(trace.data, dtype=np.float64)
    if calibration == 1.0:
        _refuse_counts(trace, values, place)
    _refuse_second_calibration(stats, values, place)
    step = checked_step(float(stats.delta), f"{place}: step")
    return GroundMotion(factor * calibration * values, step, trace.id, "obspy", record, stats.channel.upper())


def _processing(stats: Any) -> str:
    """Return the processing steps that obspy recorded in the metadata of a trace, joined to one text."""
    return " ".join(map(str, stats.get("processing", ())))


def _refuse_other_quantities(trace: Any, place: str) -> None:
    """Raise a ValueError if a trace is not an acceleration; warn if the instrument is not an accelerometer."""
    stats, done = trace.stats, _processing(trace.stats).replace('"', "'")
    output = re.findall(r"output='(VEL|DISP)'", done)
    is_differentiated = "differentiate(" in done
    found = _OUTPUTS.get(output[-1]) if output and not is_differentiated else None
    if "integrate(" in done and not is_differentiated:
        found = "integrals"
    found = found or _SAC_QUANTITIES.get(int(stats.get("sac", {}).get("idep", 5)))
    if found:
        raise ValueError(
            f"{place}: its values are {found}, not accelerations: convert them by stream.remove_response(inventory, "
            "output='ACC') or stream.differentiate()"
        )
    if stats.get("_format") in _CALIBRATED_TO_DISPLACEMENT and float(stats.calib) != 1.0:
        raise ValueError(
            f"{place}: the calibration of {stats.get('_format')} gives displacements at one period, not accelerations: "
            "use stream.remove_response(inventory, output='ACC') and set trace.stats.calib = 1"
        )
    kind = _SEISMOMETERS.get(stats.channel.upper()[1]) if len(stats.channel) == 3 else None
    if kind and "output='ACC'" not in done and not is_differentiated:
        warn_caller(
            f"{place}: channel {stats.channel} is a {kind}, which measures velocity: unless its values are "
            "accelerations already, use stream.remove_response(inventory, output='ACC')"
        )


def _refuse_counts(trace: Any, values: np.ndarray, place: str) -> None:
    """Raise a ValueError if the values of a trace are counts (whole numbers); warn if they may be counts."""
    remedy = (
        "use stream.remove_response(inventory, output='ACC'), which gives m/s2, or divide by the sensitivity of the "
        "instrument"
    )
    if trace.data.dtype.kind in "iu":
        raise ValueError(
            f"{place}: its values are whole numbers (type {trace.data.dtype}), so they are counts of the digitizer and "
            f"have no unit: {remedy}. If they have a unit, set trace.data = trace.data.astype(float)"
        )
    if "response" in trace.stats and "remove_" not in _processing(trace.stats):
        warn_caller(f"{place}: the response of the instrument was not removed, so the values may be counts: {remedy}")
        return
    is_whole = values.size >= _FEWEST_VALUES and np.abs(values).max() >= _LARGEST_COUNT_LIKE
    if is_whole and np.array_equal(values, np.round(values)):
        warn_caller(f"{place}: all its values are whole numbers, so they may be counts of the digitizer: {remedy}")


def _refuse_second_calibration(stats: Any, values: np.ndarray, place: str) -> None:
    """Raise a ValueError if the peak of the data is already the peak in K-NET's header: calibration was applied."""
    stated = 0.01 * float(stats.get("knet", {}).get("accmax", 0.0))  # m/s2
    peak = float(np.abs(values - values.mean()).max())
    if stated > 0 and float(stats.calib) != 1.0 and abs(peak - stated) <= 0.02 * stated:
        raise ValueError(
            f"{place}: the file states a peak of {stated:g} m/s2, which is that of the data, so the calibration was "
            "applied already: leave out apply_calib=True, or set trace.stats.calib = 1"
        )


def _records_of(traces: Sequence[Any], places: Sequence[str]) -> list[str]:
    """Return the name of the record of each trace, shape [trace].

    Overlapping traces of one sensor belong to one record, named by station and start time. A warning is given if its
    components do not start at the same time, because they are read as if they did.
    """
    records = [""] * len(traces)
    last: dict[tuple[str, str], tuple[Any, Any, str]] = {}
    for i in sorted(range(len(traces)), key=lambda i: traces[i].stats.starttime):
        stats = traces[i].stats
        station = f"{stats.network}.{stats.station}.{stats.location}"
        sensor = station, orientation(stats.channel).sensor
        start, end = stats.starttime, stats.get("endtime", stats.starttime)
        first_start, first_end, record = last.get(sensor, (None, None, ""))
        late = 0.0 if not record or start == first_start else float(start - first_start)  # s
        if not record or (late and late > 0.5 * (first_end - first_start)):
            record = f"{station} {start}"
            last[sensor] = start, end, record
        elif late > 0.5 * float(stats.delta):
            warn_caller(
                f"{places[i]} starts {late:g} s after another component of its record, and both are read as "
                "if they started together: use stream.trim(start, end) first"
            )
        records[i] = record
    return records
