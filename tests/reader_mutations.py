"""Damaged files for readers of inventories, sites, hazard and other tools' files: every error must name the file.

    python tests/reader_mutations.py 10000

reads as many damaged copies of a file of each kind, and prints what was raised otherwise: errors of other classes, and
messages without the path. A test reads some of them.
"""

from __future__ import annotations

import random
import re
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import test_nrml_limits as nrml
import test_reader_values_of_inventories as inventories
import test_reader_values_of_other_tools as tools
import test_reader_values_of_sites as sites

import warpdyn as wd

CHARACTERS = '-9x;,\x00é" \n.<>&0eE'
NUMBERS = ("nan", "inf", "-1", "1e400", "", "1e308", "-inf", "x", "0")
LIMITS = (
    '<imls imt="PGA" noDamageLimit="0.05" minIML="0.1" maxIML="5"/><params ls="complete" mean="0.3" stddev="0.15"/>'
)
VULNERABILITY = """<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">
<vulnerabilityModel id="wd" lossCategory="structural">
<description>x</description><vulnerabilityFunction id="C1M_H" dist="BT"><imls imt="SA(0.3)">0.1 0.2 0.5 1.0</imls>
<meanLRs>0.002 0.03 0.30 0.72</meanLRs><covLRs>2.5 1.8 0.9 0.3</covLRs></vulnerabilityFunction>
</vulnerabilityModel></nrml>
"""
GEOJSON = """{"type": "FeatureCollection", "features": [
{"type": "Feature", "properties": {"id": "1", "Longitude": -122.0, "Latitude": 37.8, "YearBuilt": 1990},
 "geometry": {"type": "Point", "coordinates": [-122.0, 37.8]}},
{"type": "Feature", "properties": {"id": "2"}, "geometry": {"type": "Polygon", "coordinates":
 [[[-122, 37.9], [-122.001, 37.9], [-122, 37.901], [-122, 37.9]]]}}]}
"""
PLACES = inventories.PLACES.assign(ID_1=[9, 12, 13])

# Of each reader the file that is damaged, its text, and the call.
Reader = Callable[[Path], object]
SOUND: dict[str, tuple[str, str, Reader]] = {
    "read_r2d": ("r2d.csv", inventories.BUILDINGS, wd.inventories.read_r2d),
    "read_openquake": (
        "exposure.csv",
        "id,lon,lat,taxonomy,number,structural\na,1,2,W1,3,4\nb,1.5,2,W1,3,4\n",
        wd.inventories.read_openquake,
    ),
    "read_openquake of GEM": (
        "gem.csv",
        inventories.GEM,
        lambda path: wd.inventories.read_openquake(path, places=PLACES),
    ),
    "read_geojson": ("buildings.geojson", GEOJSON, wd.inventories.read_geojson),
    "read_shakemap": ("grid.xml", sites.SHAKEMAP, wd.sites.read_shakemap),
    "read_ground_motion_field": (
        "gmf.csv",
        "event_id,gmv_PGA,site_id\n0,0.5,0\n1,0.6,1\n",
        lambda path: wd.sites.read_ground_motion_field(path, path.with_name("mesh.csv")),
    ),
    "read_intensity_grid": (
        "a.csv",
        "PGA,SA_0.3\n0.1,0.2\n0.3,0.4\n",
        lambda path: wd.sites.read_intensity_grid(path.parent, "g"),
    ),
    "read_taxonomy_mapping": (
        "mapping.csv",
        "taxonomy,conversion,weight\nCR,C1,0.25\nCR,C2,0.5\nCR,C1,0.25\n",
        wd.read_taxonomy_mapping,
    ),
    "read_consequences": (
        "consequences.csv",
        "risk_id,consequence,loss_type,slight,complete\nC1,losses,structural,0.1,1\n",
        wd.read_consequences,
    ),
    "from_openquake_csv": ("hazard.csv", tools.HAZARD.format(kind="mean"), wd.HazardCurve.from_openquake_csv),
    "read_pelicun_demands": (
        "demands.csv",
        tools.RESPONSE,
        lambda path: wd.read_pelicun_demands(path, units=tools.UNITS),
    ),
    "read_nrml_fragility": (
        "fragility.xml",
        nrml.MODEL.format(format="continuous", shape=' shape="logncdf"', function=LIMITS),
        wd.read_nrml_fragility,
    ),
    "read_nrml_vulnerability": ("vulnerability.xml", VULNERABILITY, wd.read_nrml_vulnerability),
}


def write_sound(folder: Path) -> None:
    """Write one sound file of each kind, and those that they need."""
    (folder / "mesh.csv").write_text(sites.MESH)
    (folder / "EventGrid.csv").write_text(sites.GRID)
    for name in "bc":
        (folder / f"{name}.csv").write_text(SOUND["read_intensity_grid"][1])
    for name, text, _ in SOUND.values():
        (folder / name).write_text(text)


def damaged(text: str, drawn: random.Random) -> str:
    """Return a text with one fault: a character, a line or a number that is lost, doubled, exchanged or impossible."""
    place, lines = drawn.randrange(len(text)), text.split("\n")
    row = drawn.randrange(len(lines))
    match drawn.randrange(7):
        case 0:
            return text[:place] + text[place + 1 :]
        case 1:
            return text[:place]
        case 2:
            return text[:place] + drawn.choice(CHARACTERS) + text[place + 1 :]
        case 3:
            return "\n".join([*lines[: row + 1], *lines[row:]])
        case 4:
            return "\n".join(lines[:row] + lines[row + 1 :])
        case 5:
            return "\n".join(drawn.sample(lines, len(lines)))
    number = drawn.choice(list(re.finditer(r"-?\d+\.?\d*", text)))
    return text[: number.start()] + drawn.choice(NUMBERS) + text[number.end() :]


def faults(folder: Path, name: str, count: int, seed: int) -> tuple[int, Counter[str]]:
    """Return how many damaged files a reader read, and what it raised that is no error with the file's name."""
    file, text, reader = SOUND[name]
    path, drawn, found, read = folder / file, random.Random(f"{name} {seed}"), Counter[str](), 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader(path)
        for _ in range(count):
            path.write_text(damaged(text, drawn), encoding="utf-8")
            try:
                reader(path)
                read += 1
            except (ValueError, FileNotFoundError) as error:
                if str(folder) not in str(error):
                    found[f"without the file: {error}"] += 1
            except Exception as error:
                found[f"{type(error).__name__}: {error}"] += 1
    path.write_text(text)
    return read, found


if __name__ == "__main__":
    many = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    with tempfile.TemporaryDirectory() as at:
        write_sound(Path(at))
        for reader_name in SOUND:
            accepted, wrong = faults(Path(at), reader_name, many, int(np.random.default_rng().integers(2**31)))
            print(
                f"{reader_name}: {many} damaged files, {accepted} read, {wrong.total()} errors without the file's name"
            )
            for message, times in wrong.most_common(5):
                print(f"    {times} x {message[:150]}")
