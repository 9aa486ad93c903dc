"""Sound record files of every format that has a reader, made by the formats' descriptions."""

from __future__ import annotations

import numpy as np


def fortran(value: float, decimals: int = 7) -> str:
    """Return a number as Fortran's format E prints it, with a mantissa below one."""
    digits, exponent = f"{abs(value):.{decimals - 1}e}".split("e")
    power = 0 if value == 0 else int(exponent) + 1
    return f"{'-' if value < 0 else ''}.{digits.replace('.', '')}E{power:+03d}"


def at2(values: np.ndarray, step: float = 0.01) -> str:
    """Return a PEER .AT2 file of values in g."""
    rows = [values[i : i + 5] for i in range(0, len(values), 5)]
    return (
        "PEER NGA STRONG MOTION DATABASE RECORD\nImperial Valley-02, 5/19/1940, El Centro Array #9, 180\n"
        f"ACCELERATION TIME SERIES IN UNITS OF G\nNPTS=   {len(values)}, DT=   {step:.4f} SEC,\n"
        + "".join("".join(f"{fortran(value):>16}" for value in row) + "\n" for row in rows)
    ).replace("   0.", "   .")


def text(values: np.ndarray, step: float = 0.01) -> str:
    """Return a file of two comma-separated columns, without columns of fixed width."""
    return "time,acceleration\n" + "".join(f"{step * i:.3f},{value:.6f}\n" for i, value in enumerate(values))


def table(values: np.ndarray, step: float = 0.01) -> str:
    """Return a file of two columns of fixed width."""
    return "".join(f"{step * i:9.3f}{value:15.6f}\n" for i, value in enumerate(values))


def esm(values: np.ndarray, step: float = 0.005, **changes: str) -> str:
    """Return an ESM file of values in cm/s2: header format DYNA 1.2."""
    told = {
        "EVENT_NAME": "NONE", "EVENT_ID": "X-1", "EVENT_DATE_YYYYMMDD": "20300101", "EVENT_TIME_HHMMSS": "120000",
        "NETWORK": "XX", "STATION_CODE": "STA1", "SAMPLING_INTERVAL_S": f"{step:.6f}", "NDATA": str(len(values)),
        "DURATION_S": f"{step * len(values):.3f}", "STREAM": "HNN", "UNITS": "cm/s^2",
        "PGA_CM/S^2": f"{values[np.argmax(np.abs(values))]:.6f}", "HEADER_FORMAT": "DYNA 1.2",
        "DATA_TYPE": "ACCELERATION",
    } | changes  # fmt: skip
    lines = [f"{name}: {value}" for name, value in told.items()]
    lines += [f"USER{i}: " for i in range(64 - len(lines))]
    return "\n".join(lines) + "\n" + "".join(f"{value:.6f}\n" for value in values)


def cosmos(values: np.ndarray, step: float = 0.005, azimuth: int = 90, unit: str = "cm/sec2(04)") -> str:
    """Return a channel of a COSMOS file of values in cm/s2."""
    integers, reals = [-999] * 100, [-999.0] * 100
    integers[:3], integers[53] = [2, 1, 4], azimuth
    reals[61], reals[63] = 1000 * step, float(values[np.argmax(np.abs(values))])
    body = [values[i : i + 8] for i in range(0, len(values), 8)]
    header = [
        "Corrected acceleration    (Format v01.20 with 13 text lines)",
        "Record of No Earthquake of Tue Jan 1, 2030 12:00 UTC",
        "Hypocenter: unknown", "Origin: 2030/01/01 12:00:00    UTC", "Statn No: 37-000011 Code:XX-STA1     Nowhere",
        *[f"Line {i} of the text header" for i in range(6, 13)],
        "Values used when parameter or data value is unknown/unspecified:   -999, -999.00",
    ]  # fmt: skip
    return "\n".join(
        [
            *header,
            " 100 Integer-header values follow on  10 lines, Format= (10I8)",
            *("".join(f"{value:8d}" for value in integers[i : i + 10]) for i in range(0, 100, 10)),
            " 100 Real-header values follow on  20 lines, Format= (5F15.6)",
            *("".join(f"{value:15.6f}" for value in reals[i : i + 5]) for i in range(0, 100, 5)),
            "   1 Comment line(s) follow, each starting with a \"|\":",
            "| no comment",
            f"{len(values):8d} acceleration pts, approx {step * len(values):4.0f} secs, units={unit},Format=(8F10.5)",
            *("".join(f"{value:10.5f}" for value in row) for row in body),
            "End-of-data for Chan  1 acceleration",
        ]
    ) + "\n"  # fmt: skip
