"""Sound record files in the formats of strong-motion networks, made by the formats' descriptions."""

from __future__ import annotations

import numpy as np
from record_files import fortran


def fields(values: np.ndarray, form: str, per_line: int) -> list[str]:
    """Return lines of numbers without their leading zeros, as Fortran prints them."""
    texts = [form % value for value in values]
    width = len(texts[0])
    texts = [text.replace(" 0.", "  .").replace("-0.", " -.")[-width:] for text in texts]
    return ["".join(texts[i : i + per_line]) for i in range(0, len(texts), per_line)]


def knet(values: np.ndarray, **changes: str) -> str:
    """Return a K-NET file of values in gal: 17 lines of names in 18 columns, then counts of 8 digits and a blank."""
    factor = 3920 / 6182761
    counts = np.round(values / factor).astype(int) + 12085
    gal = factor * (counts - counts.mean())
    told = {
        "Origin Time": "2030/01/01 12:00:00", "Lat.": "38.103", "Long.": "142.860", "Depth. (km)": "24", "Mag.": "9.0",
        "Station Code": "MYG001", "Station Lat.": "38.9", "Station Long.": "141.6", "Station Height(m)": "35",
        "Record Time": "2030/01/01 12:01:00", "Sampling Freq(Hz)": "100Hz",
        "Duration Time(s)": f"{values.size / 100:g}",
        "Dir.": "N-S", "Scale Factor": "3920(gal)/6182761", "Max. Acc. (gal)": f"{np.abs(gal).max():.3f}",
        "Last Correction": "2030/01/01 12:01:00", "Memo.": "",
    } | changes  # fmt: skip
    header = [f"{name:18}{value}" for name, value in told.items()]
    body = ["".join(f"{count:8d} " for count in counts[i : i + 8]) for i in range(0, counts.size, 8)]
    return "\n".join([*header, *body]) + "\n"


def _numeric_header(reals: int, width: int = 10) -> list[str]:
    whole = ["".join(f"{1:5d}" for _ in range(min(16, 100 - i))) for i in range(0, 100, 16)]
    return [*whole, *("".join(f"{1.0:{width}.3f}" for _ in range(min(8, reals - i))) for i in range(0, reals, 8))]


def csmip_v1(
    values: np.ndarray, step: float = 0.005, label: str = "90 Deg", channel: int = 1, channels: int = 1
) -> str:
    """Return a channel of a V1 file of CSMIP, of values in g at equal steps."""
    peak = np.argmax(np.abs(values))
    count = values.size
    head = [
        "Uncorrected Accelerogram Data             Processed: 02/13/30, CGS  146be002",
        "Record of Tue Jan  1, 2030 12:00:00.0 PST             (Avol1 v9.2,12/11 CSMIP)",
        "CSMIP Preliminary Processing            (Origin:  To be determined)",
        "89146-L2500-12044.02                 Start time:  1/ 1/30, 21:06:45.0 UTC (GPS)",
        f"Station No. 89146   40.941N, 123.633W      Etna  s/n 2500  ({channels} Chns of  3 at Sta)",
        "Nowhere                                   CGS",
        f"Chan  {channel}: {label}",
        "Record of Tue Jan  1, 2030 12:00:00.0 PST    Tue Jan  1, 2030 12:00:00.0 PST",
        "Hypocenter:  To be determined.               ML:  To be determined.",
        "Instr Period =  .0109 sec,  Damping =  .670,  Sensitivity =  .63  v/g",
        f"No. of Points =  {count}  Record Length = {count * step:.3f} sec   at {1 / step:.0f} Samples/sec",
        f"Units of uncor data are sec and g .        Max  =   {values[peak]:.4f} g , at  {peak * step:.3f} sec.",
        "RMS calc for complete record =        .   Chn. metadata effective date: 08/10/05",
    ]
    points = f" {count} Accelerogram points at {1 / step:.0f} pts/sec in units of g .      Format: (8f9.6)"
    end = f"/&  ----------  End of Data for Channel  {channel}  ----------"
    return "\n".join([*head, *_numeric_header(50), points, *fields(values, "%9.6f", 8), end]) + "\n"


def csmip_pairs(values: np.ndarray, times: np.ndarray) -> str:
    """Return a V1 file of values in g/10 at times that a person has digitised, five pairs per line."""
    head = csmip_v1(values / 10).split("\n")[:13]
    head[10] = f"NO. OF POINTS =  {values.size}  RECORD LENGTH = {times[-1]:.3f} SEC"
    head[11] = f"UNITS OF UNCOR ACCEL ARE SEC AND G/10.     MAX  =  {np.abs(values).max() / 10:.4f} G, AT   0.100 SEC."
    pairs = np.column_stack([times, values]).ravel()
    return "\n".join([*head, *_numeric_header(50), *fields(pairs, "%7.3f", 10), "/&  ----------"]) + "\n"


def bhrc(values: np.ndarray, step: float = 0.005) -> str:
    """Return a file of BHRC of three components with the same values in g/10, whose header is cut at 70 characters."""
    rows = [values[i : i + 10] for i in range(0, values.size, 10)]
    lines = []
    for label in ("L1", "V2", "T3"):
        lines += ["* VOL1DS FILE:  5520/01", "Inst Type = SSA-2", "Origin Time : 2030/08/11   12:23:16", "", "L", ""]
        lines += [
            f"COMP {label}",
            "Nowhere                   Station   38.474 N 47.059 E   Altitude 1360m   Azimuth L 352   T 82",
            "Epicenter 38.520 N 46.860 E   FD 12 Km",
            "INSTR PERIOD =  .019 SEC   DAMPING =  .640",
            f"NO. OF POINTS =  {values.size}      DURATION =  {values.size * step:.3f}",
            "UNITS ARE SECONDS AND G/10",
            "",
            *(line[:70] for line in _numeric_header(50, 13)),
            *("".join(f"{fortran(value, 6):>13}" for value in row) for row in rows),
            "/&",
        ]
    return "\n".join(lines) + "\n"


def csmip_v2(
    values: np.ndarray, step: float = 0.005, label: str = "90 Deg", channel: int = 1, channels: int = 1
) -> str:
    """Return a channel of a V2 file of CSMIP, of values in cm/s2, with velocities and displacements."""
    peak = np.argmax(np.abs(values))
    count = values.size
    of_volume_1 = csmip_v1(values / 980.665, step, label, channel, channels).split("\n")[:10]
    head = [
        f"Corrected accelerogram   89146-L2500-12044.02       Chan  {channel}: {label}     from",
        *of_volume_1,
        f"                        Record length = {count * step:.3f} sec.",
        "                                     Uncor Max  =   .079 g , at  30.590 sec.",
        "RMS accel of (uncor) record  =        .   Chn. metadata effective date: 08/10/05",
        "Accelerogram bandpass filtered with 3 dB pts at   .30 and 40.00 cyc/sec",
        f" {count} points of instrument- and baseline-corrected accel, veloc and displ data",
        f"At equally-spaced intervals of    {step:.3f}  sec.",
        f"Peak acceleration =    {values[peak]:.3f}    cm/sec/sec  at   {peak * step:.3f}   sec.",
        "Peak   velocity   =     3.150      cm/sec    at   30.650   sec.",
        "Peak displacement =      .165        cm      at   30.765   sec.",
        "Initial velocity  =      .000   cm/sec;   Initial displacement =     .000   cm",
        "Record of Tue Jan  1, 2030 12:00:00.0 PST    Tue Jan  1, 2030 12:00:00.0 PST",
        "",
        f"89146-L2500-12044.02      Nowhere    Chan  {channel}: {label}",
        "",
    ]
    lines = [*head, *_numeric_header(100)]
    for quantity, unit, factor in (("accel", "cm/sec2", 1.0), ("veloc", "cm/sec", 0.01), ("displ", "cm", 0.001)):
        lines.append(f" {count} points of {quantity} data equally spaced at  {step:.3f} sec, in {unit}. (8f10.5)")
        lines += fields(factor * values, "%10.5f", 8)
    return "\n".join([*lines, f"/&  ----------  End of data for channel  {channel}  ----------"]) + "\n"


def smc(
    values: np.ndarray, step: float = 0.005, times: np.ndarray | None = None, up: int = 90, azimuth: int = 360
) -> str:
    """Return an SMC file of values in cm/s2 at equal steps, or with their times."""
    whole, reals = [-32768] * 48, [1.7e38] * 50
    pairs = values if times is None else np.column_stack([times, values]).ravel()
    at = step * np.arange(values.size) if times is None else times
    whole[12:17] = [up, azimuth, 101, 2, pairs.size]
    reals[28:32] = [at[values.argmax()], values.max(), at[values.argmin()], values.min()]
    if times is None:
        reals[1] = 1 / step

    def fortran(value: float) -> str:
        mantissa, exponent = f"{value:.4e}".split("e")
        return f"{mantissa}E{int(exponent):+d}".rjust(10)

    def real(value: float) -> str:
        mantissa, exponent = f"{abs(value):.6e}".split("e")
        digits, power = mantissa.replace(".", ""), int(exponent) + (value != 0)
        return f"{'-' if value < 0 else ''}0.{digits}E{power:+03d}".rjust(15)

    header = [
        "2 CORRECTED ACCELEROGRAM" if times is None else "1 UNCORRECTED ACCELEROGRAM", "*", "SAF0A",
        "     2030  01  01    0004 No Earthquake, CA", "Moment Mag=      7.1 Ms=      7.1 Ml=      7.0",
        "station = Nowhere, 1295 Shafter, F       component=    360", 
        "epicentral dist =     89.0       pk     =    104.4",
        "inst type=SMA-1      data source = USGS", "*", "*", "*",
        *("".join(f"{value:10d}" for value in whole[i : i + 8]) for i in range(0, 48, 8)),
        *("".join(map(real, reals[i : i + 5])) for i in range(0, 50, 5)), "|", "|ref - none",
    ]  # fmt: skip
    body = ["".join(map(fortran, pairs[i : i + 8])) for i in range(0, pairs.size, 8)]
    return "\n".join([*header, *body]) + "\n"


def geonet(values: np.ndarray, step: float = 0.005, components: tuple[str, ...] = ("N10E", "N80W", "Up")) -> str:
    """Return a V1A file of GeoNet of values in mm/s2, the same in each component."""
    count, peak = values.size, np.argmax(np.abs(values))
    whole = [1] * 40
    whole[33:36] = [count, 0, 0]
    lines = []
    for component in components:
        lines += [
            "Uncorrected accelerogram 20300101_110256_HSES_20 GNS Science",
            "Site HSES      42 31 24S  172 49 50E     Basalt file:  20300101_110300_HSES",
            "Nowhere Emergency Centre", "Instrument Basalt_2430",
            "Resolution: 24-bit   Instr Period: 0.0050 s   Damping: 0.700",
            "Accelerogram 20300101_110256_HSES_20                 Processed 2030 December 09",
            "5 km south-west of Nowhere", "2030 January 01         11:02:56 UT",
            "Epicentre  42 41 33S 173 01 19E  Bearing S40E  Dist   25km  Depth   15km Mw 7.82",
            f"Number of points  {count}    Duration {count * step:.2f} s",
            f"Raw readings in units of 1.00 mm/s/s  at intervals of {step:.3f} s",
            "Data is unfiltered", f"Component {component}",
            f"Acceleration:  Peak   {values[peak]:.1f} mm/s/s at  {peak * step:.2f} s     RMS   209.89 mm/s/s",
            "Velocity record unevaluated", "Displacement record unevaluated",
            *("".join(f"{value:8d}" for value in whole[i : i + 10]) for i in range(0, 40, 10)),
            *("".join(f"{1.0:8.2f}" for _ in range(10)) for _ in range(6)),
            *("".join(f"{value:8.1f}" for value in values[i : i + 10]) for i in range(0, count, 10)),
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def asa(table: np.ndarray, step: float = 0.005, orientations: str = "/V/N00E/N90E") -> str:
    """Return an ASA 2.0 file of a table of values in gal, shape [time, channel]."""
    count, channels = table.shape
    peaks = table[np.argmax(np.abs(table), axis=0), range(channels)]

    def each(text: str) -> str:
        return f"/{text}" * channels

    told = {
        "VERSION DEL FORMATO": "2.0", "NOMBRE DEL ARCHIVO": "ACAC3001.011", "CLAVE DE LA ESTACION": "ACAC",
        "LOCALIZACION DE LA ESTACION": "NOWHERE", "": "SECOND LINE", "NUMERO DE CANALES": f"{channels}",
        "ORIENTACION C1-C6 (rumbo;orientacion)": orientations, "ORIENTACION C7-C12 (rumbo;orientacion)": "",
        "VEL. DE MUESTREO, C1-C6 (muestras/s)": each(f"{1 / step:.0f}"),
        "INTERVALO DE MUESTREO, C1-C6 (s)": each(f"{step:g}"), "INTERVALO DE MUESTREO, C7-C12 (s)": "",
        "FECHA DEL SISMO [GMT]": "2030/01/01", "HORA DE LA PRIMERA MUESTRA (GMT)": "18:14:18",
        "DURACION DEL REGISTRO (s), C1-C6": each(f"{count * step:.2f}"),
        "NUM. TOTAL DE MUESTRAS, C1-C6": each(f"{count}"),
        "ACEL. MAX.(Gal), C1-C6": "".join(f"/{peak:.4f}" for peak in peaks),
        "UNIDADES DE LOS DATOS": "Gal (cm/s/s)", "FORMATO DATOS (FORTRAN,10 campos/dato)": f"{channels}F10.4",
    }  # fmt: skip
    rule = "---------+" * 8
    return "\n".join(
        [
            "*" * 80, "                       INSTITUTO DE INGENIERIA, UNAM", "*" * 80,
            "ARCHIVO ESTANDAR DE ACELERACION:", *(f"{name:39}: {value}" for name, value in told.items()), "=" * 80,
            "COMENTARIOS:", "", "=" * 80, "DATOS DE ACELERACION:", rule, "   CANAL-1   CANAL-2   CANAL-3",
            "         V      N00E      N90E", rule,
            *("".join(f"{value:10.4f}" for value in row) for row in table),
        ]
    ) + "\n"  # fmt: skip


def afad(table: np.ndarray, step: float = 0.01) -> str:
    """Return an AFAD file of a table of values in gal, shape [time, 3]."""
    peaks = np.abs(table).max(axis=0)
    told = {
        "PLACE": "AYDIN", "EARTHQUAKE DATE": "2030/01/01 22:31:09 (GMT)", "STATION ID": "0921",
        "RECORD TIME": "01/01/2030 22:30:58.000000 (GMT)", "NUMBER OF DATA": f"{len(table)}",
        "SAMPLING INTERVAL (sec)": f"{step:g}",
        "RAW PGA VALUES (gal)": f"(N-S) {peaks[0]:.6f} (E-W) {peaks[1]:.6f} (U-D) {peaks[2]:.6f}",
    }  # fmt: skip
    return "\n".join(
        [
            "STRONG GROUND MOTION RECORDS OF TURKIYE", *(f"{name:24}: {value}" for name, value in told.items()),
            "Copyright EARTHQUAKE DEPARTMENT", "       N-S          E-W          U-D",
            *("".join(f"{value:14.6f}" for value in row) for row in table),
        ]
    ) + "\n"  # fmt: skip


def cwa(table: np.ndarray, step: float = 0.01) -> str:
    """Return a CWA file of a table of values in gal, shape [time, 3], to three decimals: vertical, north, east."""
    table = np.round(table, 3)
    told = {
        "Origin Time(GMT+08)": "2030/01/01-23:50:42", "StationCode": "EAS",
        "StartTime(GMT+08)": "2030/01/01-23:50:29.000",
        "RecordLength(sec)": f"{len(table) * step:g}", "SampleRate(Hz)": f"{1 / step:.0f}",
        "AmplitudeUnit": " gal. DCoffset(corr)",
        **{f"AmplitudeMAX. {c}": f"{x.max():8.3f}~{x.min():9.3f}" for c, x in zip("UNE", table.T, strict=True)},
        "DataSequence": "Time U(+); N(+); E(+)", "Data": "4F10.3",
    }  # fmt: skip
    rows = np.column_stack([step * np.arange(len(table)), table])
    return "\n".join(
        [
            "#Earthquake Information", *(f"#{name}: {value}" for name, value in told.items()),
            *("".join(f"{value:10.3f}" for value in row) for row in rows),
        ]
    ) + "\n"  # fmt: skip


def running(values: np.ndarray, step: float = 0.01) -> str:
    """Return values in gal that run on from line to line, behind a line with their number and the step."""
    header = f"Record of nowhere, component 90\nNPTS= {values.size}, DT= {step:g} s"
    return "\n".join([header, *fields(values, "%10.4f", 8)]) + "\n"
