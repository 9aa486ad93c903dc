"""Writers replace a file that they wrote themselves, but other files only by overwrite=True."""

import numpy as np
import pytest
from test_building_files import RESULTS
from test_nrml_fragility import make_curves
from test_nrml_vulnerability import make_function
from test_report import run_with_scene

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("storey_height")]

NRML = '<?xml version="1.0" encoding="utf-8"?>\n<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">\n  <{} id="{}">'
# Writer -> function of a path and further arguments; name of the file; content of files of others.
WRITERS = {
    "write_nrml_fragility": (
        lambda path, **how: wd.write_nrml_fragility({"A": make_curves()}, path, **how),
        "model.xml",
        (NRML.format("fragilityModel", "gem"), NRML.format("vulnerabilityModel", "warpdyn")),
    ),
    "write_nrml_vulnerability": (
        lambda path, **how: wd.write_nrml_vulnerability({"A": make_function()}, path, **how),
        "model.xml",
        (NRML.format("vulnerabilityModel", "gem"), NRML.format("fragilityModel", "warpdyn")),
    ),
    "write_taxonomy_mapping": (
        lambda path, **how: wd.write_taxonomy_mapping({"W": "W1"}, path, **how),
        "mapping.csv",
        ("id,lon,lat,taxonomy\n1,10.0,45.0,W\n",),
    ),
    "write_consequences": (
        lambda path, **how: wd.write_consequences({"W1": {"slight": 0.1, "complete": 1.0}}, path, **how),
        "consequences.csv",
        ("risk_id,consequence,loss_type,slight,moderate,complete\n",),
    ),
    "write_openquake_damages": (
        lambda path, **how: wd.write_openquake_damages(RESULTS, path, **how),
        "avg_damages.csv",
        ("#,,,,,\"generated_by='OpenQuake engine 3.26'\"\nasset_id,taxonomy,lon,lat\n",),
    ),
    "write_r2d_results": (
        lambda path, **how: wd.write_r2d_results(RESULTS, path, **how),
        "R2D_results.geojson",
        ('{"type": "FeatureCollection",\n"features": [\n{"type": "Feature", "properties": {"id": 1}}\n]}\n',),
    ),
    "write_pelicun_demands": (
        lambda path, **how: wd.write_pelicun_demands(run(), path, **how),
        "demands.csv",
        (",1-PID-1-1\nUnits,rad\n0,0.01\n",),
    ),
    "report": (
        lambda path, **how: wd.report(run_with_scene(), path, **how),
        "run.html",
        ("<!DOCTYPE html>\n<html><head><title>warpdyn</title></head></html>\n",),
    ),
}


def run():
    building = wd.ShearBuilding([1e5, 1e5], 8e7, 3.0, damping="rayleigh", damping_ratio=0.05)
    motion = wd.GroundMotion(np.sin(0.2 * np.arange(100)), 0.01)
    return wd.simulate(wd.Scene(building, wd.Cloud([motion]), recorders=("drift", "acceleration")), device="cpu")


@pytest.mark.parametrize("name", WRITERS)
def test_files_of_others_are_kept(name, tmp_path):
    write, file_name, others = WRITERS[name]
    path = tmp_path / file_name
    for other in (*others, "notes", ""):
        path.write_text(other, encoding="utf-8", newline="\n")
        with pytest.raises(
            FileExistsError, match=rf"{name}: .*{path.stem}.* exists and is not .*: choose.*overwrite=True"
        ):
            write(path)
        assert path.read_text(encoding="utf-8") == other
    path.write_bytes(b"\xff\x00 no text")
    with pytest.raises(FileExistsError, match="overwrite=True"):
        write(path)
    write(path, overwrite=True)
    assert path.read_bytes() != b"\xff\x00 no text"
    with pytest.raises(TypeError, match=f"{name}: overwrite must be True or False, got 'yes'"):
        write(path, overwrite="yes")


@pytest.mark.parametrize("name", WRITERS)
def test_a_writer_replaces_its_own_file(name, tmp_path):
    write, file_name, _ = WRITERS[name]
    path = write(tmp_path / file_name)
    first = path.stat().st_ino
    assert write(path) == path
    assert path.stat().st_ino != first  # a new file took its place
