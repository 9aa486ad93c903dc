"""Files of another kind than a reader takes are refused by the reader's name, the file's, and what it is not."""

import gzip
import time

import pytest

import warpdyn as wd
from warpdyn.foundations.files import text

pytestmark = pytest.mark.fast

CSV = {
    "read_pelicun_demands": wd.read_pelicun_demands,
    "read_consequences": wd.read_consequences,
    "read_taxonomy_mapping": wd.read_taxonomy_mapping,
    "HazardCurve.from_openquake_csv": wd.HazardCurve.from_openquake_csv,
    "HazardCurve.from_usgs": wd.HazardCurve.from_usgs,
}
XML = {"read_nrml_fragility": wd.read_nrml_fragility, "read_nrml_vulnerability": wd.read_nrml_vulnerability}
OF_OTHER_KINDS = {
    "own.xml": b"<?xml version='1.0'?>\n<nrml a='1,2,3,4'>\n<b>1,2</b>\n</nrml>\n",
    "own.xlsx": gzip.compress(b"a workbook", mtime=0),  # bytes that are no UTF-8
    "latin.csv": "höhe,1\n".encode("latin-1"),
    "empty.csv": b"",
    "blank.csv": b"\n \n",
    "zeros.csv": b"a,b\n1,\x00\n",
}


@pytest.mark.parametrize("file", OF_OTHER_KINDS)
@pytest.mark.parametrize("name", CSV)
def test_files_that_are_no_csv(name, file, tmp_path):
    path = tmp_path / file
    path.write_bytes(OF_OTHER_KINDS[file])
    with pytest.raises(ValueError, match=rf"^{name}: .*{file} is (empty, )?not .*CSV"):
        CSV[name](path)


@pytest.mark.parametrize("name", ["read_pelicun_demands", "read_consequences", "read_taxonomy_mapping"])
def test_text_that_breaks_a_table(name, tmp_path):
    path = tmp_path / "broken.csv"
    path.write_text('taxonomy,consequence\n"open,1\n')
    with pytest.raises(ValueError, match=rf"^{name}: .*broken.csv is not CSV: "):
        CSV[name](path)


def test_rows_of_unequal_length_are_no_demands(tmp_path):
    path = tmp_path / "rows.csv"
    path.write_text(",1-PID-1-1\nUnits,rad\n0,1,2,3,4\n")
    with pytest.raises(ValueError, match=r"^read_pelicun_demands: .*rows.csv is not CSV: .*line 3"):
        wd.read_pelicun_demands(path)


def test_a_hazard_file_that_ends_after_its_first_line(tmp_path):
    path = tmp_path / "curve.csv"
    path.write_text("#,\"investigation_time=1.0, imt='PGA'\"\n")
    with pytest.raises(ValueError, match="ends after its first line"):
        wd.HazardCurve.from_openquake_csv(path)


@pytest.mark.parametrize("file", ["own.xlsx", "latin.csv", "empty.csv"])
@pytest.mark.parametrize("name", XML)
def test_files_that_are_no_xml(name, file, tmp_path):
    path = tmp_path / file
    path.write_bytes(OF_OTHER_KINDS[file])
    with pytest.raises(ValueError, match=rf"^{name}: .*{file} is not XML: "):
        XML[name](path)


@pytest.mark.parametrize("name", [*CSV, *XML])
def test_files_that_are_not_there(name, tmp_path):
    read = (CSV | XML)[name]
    with pytest.raises(FileNotFoundError, match=rf"^{name}: there is no file .*none.csv: correct the path"):
        read(tmp_path / "none.csv")
    with pytest.raises(IsADirectoryError, match=rf"^{name}: .* is a folder"):
        read(tmp_path)
    with pytest.raises(TypeError, match=rf"^{name}: path must name a file, got None"):
        read(None)


def test_the_time_of_reading_goes_with_the_number_of_columns(tmp_path):
    """8 times the columns take 8 times as long, and took 64 times: 30 is far from both on any processor."""

    def seconds(columns):
        names = [f"c{i}" for i in range(columns)]
        file = tmp_path / f"{columns}.csv"
        file.write_text(f"id,{','.join(names)}\n1,{','.join(['1'] * columns)}\n")
        begun = time.process_time()
        assert text.read_csv(file).shape == (1, columns + 1)
        return time.process_time() - begun

    seconds(10)  # what is imported at the first call
    assert seconds(24_000) < 30 * max(seconds(3_000), 0.02)
