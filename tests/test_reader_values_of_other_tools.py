"""Readers of OpenQuake's tables, hazard curves and pelicun's responses: correct results, and what they refuse."""

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY

pytestmark = pytest.mark.fast


def file(folder, text, name="file.csv"):
    path = folder / name
    path.write_text(text)
    return path


# Tables of the engine (cases 24 and 27).


def test_weights_of_repeated_rows_are_added(tmp_path):
    text = "taxonomy,conversion,weight\nCR,C1,0.25\nCR,C2,0.5\nCR,C1,0.25\n"
    assert wd.read_taxonomy_mapping(file(tmp_path, text)) == {"CR": {"C1": 0.5, "C2": 0.5}}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("taxonomy,risk_id,weight\nCR,C1,nan\n", "finite number above 0, got 'nan'"),
        ("taxonomy,risk_id,weight\nCR,C1,-1\nCR,C2,2\n", "finite number above 0, got '-1'"),
        ("taxonomy,risk_id,weight\nCR,C1,0\nCR,C2,1\n", "finite number above 0, got '0'"),
        ("taxonomy,risk_id,weight\nCR,C1,\n", "finite number above 0, got ''"),
        ("taxonomy,risk_id,weight\nCR,C1,0.4\nCR,C1,0.4\n", "'CR' is 0.8; it must be 1"),
        ("taxonomy,risk_id,Risk_ID\nCR,C1,C2\n", "differ only in upper and lower case"),
        ("taxonomy;risk_id\nCR;C1\n", "separated by ';'"),
        ("taxonomy,risk_id,weight\nCR,C1\n", "line 2: fewer values"),
        ("taxonomy,risk_id\n", "has no rows below"),
        ("taxonomy,risk_id\n,C1\n", "taxonomy '' must be ASCII"),
        ("taxonomy,risk_id\nC R,C1\n", "must be ASCII text without spaces"),
    ],
)
def test_mappings_that_cannot_be_are_refused_with_the_file(text, message, tmp_path):
    path = file(tmp_path, text)
    with pytest.raises(ValueError, match=message) as raised:
        wd.read_taxonomy_mapping(path)
    assert str(path) in str(raised.value)


@pytest.mark.parametrize("peril", ["earthquake", "groundshaking", "Earthquake", ""])
def test_consequences_of_earthquakes_are_read(peril, tmp_path):
    text = f"risk_id,consequence,loss_type,peril,slight,complete\nC1,losses,structural,{peril},0.1,1\n"
    text += "C1,losses,structural,liquefaction,0.5,1\n"
    assert wd.read_consequences(file(tmp_path, text)) == {"C1": {"slight": 0.1, "complete": 1.0}}


def test_what_a_file_of_consequences_has_instead_is_named(tmp_path):
    text = "risk_id,consequence,loss_type,peril,slight\nC1,losses,structural,tsunami,0.1\n"
    text += "C1,collapsed,contents,earthquake,0.1\n"
    with pytest.raises(
        ValueError, match=r"by earthquakes; it has losses for structural by tsunami; collapsed for contents"
    ):
        wd.read_consequences(file(tmp_path, text))
    for values, message in (
        ("0.5,0.1", "the share falls from 0.5 for 'slight' to 0.1"),
        ("0.5,1.1", "from 0 to 1 .*got '1.1'"),
        ("nan,1", "got 'nan'"),
        ("-0.1,1", "got '-0.1'"),
        (",1", "got ''"),
    ):
        text = f"risk_id,consequence,slight,complete\nC1,losses,{values}\n"
        with pytest.raises(ValueError, match=message):
            wd.read_consequences(file(tmp_path, text))


# Hazard curves.
HAZARD = """#,,,,,"generated_by='OpenQuake engine 3.16', kind='{kind}', investigation_time=50.0, imt='PGA'"
lon,lat,depth,poe-0.1,poe-0.2,poe-0.4
10.0,45.0,0.0,0.3,0.1,0.02
"""


def test_only_curves_of_probabilities_are_read(tmp_path):
    for kind in ("mean", "rlz-000"):
        curve = wd.HazardCurve.from_openquake_csv(file(tmp_path, HAZARD.format(kind=kind)))
        assert curve.annual_rate == pytest.approx(-np.log1p(-np.array([0.3, 0.1, 0.02])) / 50)
    for kind in ("std", "xyz", ""):
        with pytest.raises(ValueError, match=rf"file.csv contains a curve of kind='{kind}', .*kind='mean'"):
            wd.HazardCurve.from_openquake_csv(file(tmp_path, HAZARD.format(kind=kind)))
    for kind in ("quantile-0.15", "max"):
        with pytest.warns(UserWarning, match=rf"kind='{kind}', so rates and losses computed with it are not means"):
            wd.HazardCurve.from_openquake_csv(file(tmp_path, HAZARD.format(kind=kind)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("poe-0.2", "poe-0.1", "'poe-0.1' twice"),
        ("poe-0.2", "poe-0.5", "intensity must increase"),
        ("poe-0.2", "poe-nan", "'nan' is not a finite number"),
        ("poe-0.1", "poe--0.1", "must be above 0"),
        ("lon,lat", "lon,LON", "differ only in upper and lower case"),
        ("0.3,0.1,", "0.1,0.3,", "never rises"),
        ("0.3,0.1,", "0.3,nan,", "not a finite number"),
        ("0.3,0.1,", "0.3,1.5,", "from 0 to 1"),
        ("lon,lat,depth,", "lon;lat;depth;", "columns must be lon, lat"),
    ],
)
def test_hazard_files_that_cannot_be_are_refused_with_the_file(old, new, message, tmp_path):
    path = file(tmp_path, HAZARD.format(kind="mean").replace(old, new))
    with pytest.raises(ValueError, match=message) as raised:
        wd.HazardCurve.from_openquake_csv(path)
    assert str(path) in str(raised.value)


def test_a_site_that_stands_twice_is_refused(tmp_path):
    text = HAZARD.format(kind="mean") + "10.0,45.0,0.0,0.4,0.2,0.03\n"
    with pytest.raises(ValueError, match=r"several sites at longitude 10, latitude 45: lines 3, 4"):
        wd.HazardCurve.from_openquake_csv(file(tmp_path, text), site=(10.0, 45.0))
    names = "name,lon,lat,0.1,0.2\nA,10,45,0.01,0.001\nA,11,45,0.02,0.002\n"
    with pytest.raises(ValueError, match=r"has the site 'A' in 2 lines"):
        wd.HazardCurve.from_usgs(file(tmp_path, names), site="A", measure="PGA")


# Responses of pelicun.
RESPONSE = ",1-PFA-0-1,1-PID-1-1,1-RID-1-1,1-SA_0.5-0-1\n0,3.0,0.01,-0.001,0.4\n1,2.0,0.02,0.002,0.5\n"
UNITS = {"PFA": "mps2", "PID": "rad", "RID": "rad", "SA": "g"}


def test_responses_without_a_row_of_units_take_units(tmp_path):
    path = file(tmp_path, RESPONSE)
    with pytest.raises(ValueError, match=r"has 0 rows of units, .*units=\{'PFA': 'mps2'"):
        wd.read_pelicun_demands(path)
    found = wd.read_pelicun_demands(path, units=UNITS)
    assert found["peak_ground_acceleration"].values.tolist() == [3.0, 2.0]
    assert found["peak_storey_drift_ratio"].values.tolist() == [[0.01], [0.02]]
    assert found["im_level"].values.tolist() == [0.4, 0.5]
    in_g = wd.read_pelicun_demands(path, units=UNITS | {"PFA": "g"})
    assert in_g["peak_ground_acceleration"].values == pytest.approx(np.array([3.0, 2.0]) * STANDARD_GRAVITY)
    with_row = RESPONSE.replace("\n0,", "\nUnits,mps2,rad,rad,g\n0,", 1)
    again = wd.read_pelicun_demands(file(tmp_path, with_row), units=UNITS)
    assert again.identical(wd.read_pelicun_demands(file(tmp_path, with_row)))
    with pytest.raises(ValueError, match=r"column '1-PFA-0-1' is in 'mps2', but units= has 'g' for PFA"):
        wd.read_pelicun_demands(file(tmp_path, with_row), units=UNITS | {"PFA": "g"})


@pytest.mark.parametrize(
    ("old", "new", "units", "message"),
    [
        ("", "", {"PFA": "mps2"}, "units= has no unit of PID: give units={..., 'PID': 'rad'}"),
        ("", "", UNITS | {"PFA": "m/s2"}, "unknown unit of PFA 'm/s2'"),
        ("", "", UNITS | {"PFX": "g"}, "unknown kind of demand in units 'PFX'"),
        ("0.02", "-0.02", UNITS, "1 impossible value, the first is -0.02 of sample 1"),
        ("0.02", "inf", UNITS, "1 impossible value, the first is inf"),
        ("1-RID-1-1", "1-PID-1-1", UNITS, "'1-PID-1-1' twice"),
        ("1-RID-1-1", "1-pid-1-1", UNITS, "differ only in upper and lower case"),
        ("1-PFA-0-1,1-PID-1-1", "1-PFA-0-1;1-PID-1-1", UNITS, "names must be"),
    ],
)
def test_responses_that_cannot_be_are_refused_with_the_file(old, new, units, message, tmp_path):
    path = file(tmp_path, RESPONSE.replace(old, new, 1))
    with pytest.raises(ValueError, match=message.replace("{", r"\{").replace("...", r"\.\.\.")):
        wd.read_pelicun_demands(path, units=units)


def test_units_of_responses_are_a_mapping(tmp_path):
    with pytest.raises(TypeError, match=r"units must map kinds"):
        wd.read_pelicun_demands(file(tmp_path, RESPONSE), units="rad")


def test_a_measure_that_stands_twice_in_the_service_s_json_is_refused(tmp_path):
    curve = (
        '{"imt": {"value": "PGA"}, "data": [{"component": "Total", "values": {"xs": [0.1, 0.2], "ys": [0.01, 0.001]}}]}'
    )
    path = file(tmp_path, f'{{"response": {{"hazardCurves": [{curve}]}}}}', "curve.json")
    assert wd.HazardCurve.from_usgs(path).measure == "PGA"
    path.write_text(f'{{"response": {{"hazardCurves": [{curve}, {curve}]}}}}')
    with pytest.raises(ValueError, match=r"curve.json has PGA twice"):
        wd.HazardCurve.from_usgs(path)
