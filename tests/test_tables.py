"""Long tables of results: what plain pandas reads of them."""

import errno
import re
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.interfaces.exchange import tables, text_files

pytestmark = pytest.mark.fast

STATES = ["slight", "moderate"]
MEDIAN = [0.1 + 0.2, 1.0 / 3.0]  # with digits up to the last
FRACTION = [[0.1, 0.5, 1.0], [0.0, 0.25, 0.75]]
VALID = [10, 20, 40]


def make_curves():
    """Build some of what `fragility` returns."""
    flags = {"flag_values": np.arange(2, dtype=np.int8), "flag_meanings": "fitted no_exceedance", "units": "1"}
    return xr.Dataset(
        {
            "fragility_median": ("damage_state", np.array(MEDIAN), {"units": "g"}),
            "fragility_dispersion": ("damage_state", np.array([0.4, np.nan]), {"units": "1"}),
            "fit_status": ("damage_state", np.array([0, 1], dtype=np.int8), flags),
            "exceedance_fraction": (("damage_state", "stripe"), np.array(FRACTION), {"units": "1"}),
            "valid_samples": ("stripe", np.array(VALID), {"units": "1"}),
            "excluded_samples": ((), 3, {"units": "1"}),
        },
        {"damage_state": STATES, "stripe": ("stripe", np.array([0.1, 0.2, 0.4]), {"units": "g"})},
        {"intensity_measure": "PGA", "confidence": 0.95, "bootstrap_seed": np.int64(3), "codes": np.arange(2)},
    )


def test_one_row_a_damage_state(tmp_path):
    table = pd.read_csv(wd.write_table(make_curves(), tmp_path / "curves.csv"))
    assert list(table.columns) == ["damage_state", "fragility_median_g", "fragility_dispersion", "fit_status"]
    assert table.damage_state.tolist() == STATES
    assert table.fragility_median_g.tolist() == MEDIAN  # to the last bit
    assert table.fragility_dispersion[0] == 0.4
    assert np.isnan(table.fragility_dispersion[1])
    assert table.fit_status.tolist() == ["fitted", "no_exceedance"]


def test_one_row_a_damage_state_and_stripe(tmp_path):
    path = wd.write_table(make_curves(), tmp_path / "stripes.csv", rows=("damage_state", "stripe"))
    table = pd.read_csv(path)
    assert list(table.columns[:2]) == ["damage_state", "stripe_g"]
    assert "excluded_samples" not in table
    wide = table.pivot(index="damage_state", columns="stripe_g", values="exceedance_fraction")
    assert wide.loc[STATES].values.tolist() == FRACTION
    assert wide.columns.tolist() == [0.1, 0.2, 0.4]
    assert table.fragility_median_g.tolist() == np.repeat(MEDIAN, 3).tolist()
    assert table.valid_samples.tolist() == VALID * 2
    other = pd.read_csv(wd.write_table(make_curves(), path, rows=["stripe", "damage_state"]))
    assert other.exceedance_fraction.tolist() == np.transpose(FRACTION).ravel().tolist()


def test_parquet_has_the_attributes(tmp_path):
    pytest.importorskip("pyarrow")
    table = pd.read_parquet(wd.write_table(make_curves(), tmp_path / "curves.parquet"))
    assert table.fragility_median_g.tolist() == MEDIAN
    assert table.damage_state.tolist() == STATES
    assert table.attrs == {"intensity_measure": "PGA", "confidence": 0.95, "bootstrap_seed": 3, "codes": [0, 1]}


def test_excel_has_the_numbers_and_one_sheet(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    path = wd.write_table(make_curves(), tmp_path / "curves.xlsx")
    (sheet,) = openpyxl.load_workbook(path).worksheets
    head, *rows = sheet.iter_rows(values_only=True)
    assert head == ("damage_state", "fragility_median_g", "fragility_dispersion", "fit_status")
    digits = pytest.approx(MEDIAN, rel=1e-15)  # a file of Excel has numbers of 16 digits
    assert [row[1] for row in rows] == digits
    assert [row[::2] + row[3:] for row in rows] == [("slight", 0.4, "fitted"), ("moderate", None, "no_exceedance")]
    infinite = make_curves()
    infinite["fragility_median"][0] = np.inf
    wd.write_table(infinite, path)  # the same columns: its own table is replaced
    assert pd.read_excel(path)["fragility_median_g"].astype(float).tolist() == [np.inf, MEDIAN[1]]


def test_excel_does_not_replace_other_files(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    path = wd.write_table(make_curves(), tmp_path / "curves.xlsx")
    book = openpyxl.load_workbook(path)
    book.create_sheet("notes")
    book.save(path)
    before = path.read_bytes()
    with pytest.raises(FileExistsError, match="is not a table with the same columns"):
        wd.write_table(make_curves(), path)
    assert path.read_bytes() == before
    wd.write_table(make_curves(), path, overwrite=True)
    assert len(openpyxl.load_workbook(path).worksheets) == 1


def test_excel_keeps_all_digits_of_long_whole_numbers(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    long = [5265093289339365046, 5265093289339365047, -3]
    identity = xr.Dataset({"identity": ("sample", np.array(long)), "number": ("sample", np.arange(3))})
    path = wd.write_table(identity, tmp_path / "runs.xlsx")
    (sheet,) = openpyxl.load_workbook(path).worksheets
    rows = list(sheet.iter_rows(min_row=2, values_only=True))
    assert [int(row[1]) for row in rows] == long
    assert [row[2] for row in rows] == [0, 1, 2]


def test_runs_put_together_by_concat_are_refused(tmp_path):
    """Joined by xr.concat, motion 0 of the second run would have the name of motion 0 of the first run."""
    run = xr.Dataset(
        {"peak": ("sample", [1.0, 2.0]), "motion_name": ("motion", ["a"])},
        {"sample": [0, 1], "motion_index": ("sample", [0, 0])},
    )
    assert pd.read_csv(wd.write_table(run, tmp_path / "run.csv", rows="sample"))["motion_name"].tolist() == ["a", "a"]
    with pytest.raises(ValueError, match=r"sample number 0 is in the dataset twice.*wd\.join"):
        wd.write_table(xr.concat([run, run], "sample", data_vars="minimal"), tmp_path / "two.csv", rows="sample")


def test_excel_refuses_tables_that_are_too_large_and_names_openpyxl(tmp_path, monkeypatch):
    pytest.importorskip("openpyxl")
    monkeypatch.setattr(tables, "SHEET", (2, 16))
    with pytest.raises(ValueError, match=r"has 3 rows, but a sheet of Excel has at most 2: write CSV or Parquet"):
        wd.write_table(make_curves(), tmp_path / "curves.xlsx")
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(ImportError, match=r'Excel needs openpyxl.*pip install "openpyxl>=3\.1", or write CSV'):
        wd.write_table(make_curves(), tmp_path / "curves.xlsx")
    assert not list(tmp_path.iterdir())


def test_parquet_without_pyarrow_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r'pip install "pyarrow>=17"'):
        wd.write_table(make_curves(), tmp_path / "curves.parquet")
    assert not list(tmp_path.iterdir())


def test_units_stand_in_the_names(tmp_path):
    units = {
        "acceleration": ("m s-2", "acceleration_m_per_s2"),
        "shear": ("N", "shear_N"),
        "energy": ("kg m2 s-2", "energy_kg_m2_per_s2"),
        "rate": ("year-1", "rate_per_year"),
        "share": ("%", "share_percent"),
        "ratio": ("1", "ratio"),
        "loss": ("", "loss"),
    }
    dataset = xr.Dataset({name: ("return_period", [1.0], {"units": unit}) for name, (unit, _) in units.items()})
    dataset = dataset.assign_coords(return_period=("return_period", [475.0], {"units": "year"}))
    table = pd.read_csv(wd.write_table(dataset, tmp_path / "losses.csv"))
    assert list(table.columns) == ["return_period_year", *(column for _, column in units.values())]


def test_a_dimension_without_labels_is_numbered(tmp_path):
    dataset = xr.Dataset({"drift": (("sample", "storey"), [[1.0, 2.0], [3.0, 4.0]])}, {"storey": [1, 2]})
    table = pd.read_csv(wd.write_table(dataset, tmp_path / "drifts.csv", rows=("sample", "storey")))
    assert table.values.tolist() == [[0, 1, 1], [0, 2, 2], [1, 1, 3], [1, 2, 4]]


def test_what_is_no_table_is_refused(tmp_path):
    curves, path = make_curves(), tmp_path / "curves.csv"
    cases = (
        (
            curves.rename(damage_state="limit"),
            {},
            r"limit, stripe: choose those of the rows, such as rows='limit'",
        ),
        (curves, {"rows": "stripes"}, "did you mean 'stripe'"),
        (curves, {"rows": ()}, "must name one or more"),
        (curves, {"rows": ("stripe", "stripe")}, "different dimensions"),
        (
            curves[["exceedance_fraction"]],
            {"rows": "stripe"},
            r"no variable has only the dimensions stripe.*exceedance_fraction\(",
        ),
        (curves[["excluded_samples"]], {}, "no dimension"),
        (curves.assign(fragility_median_g=curves.fragility_dispersion), {}, "two columns would have the name"),
    )
    for dataset, how, message in cases:
        with pytest.raises(ValueError, match=message):
            wd.write_table(dataset, path, **how)
    with pytest.raises(ValueError, match=r"must end in '\.csv' or '\.parquet' or '\.xlsx'"):
        wd.write_table(curves, tmp_path / "curves.txt")
    with pytest.raises(TypeError, match="Dataset"):
        wd.write_table(curves["fragility_median"], path)
    assert not list(tmp_path.iterdir())


def test_an_older_file_stays_where_the_new_one_fails(tmp_path, monkeypatch):
    path = tmp_path / "curves.csv"
    path.write_text("older")

    def fail(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr(pd.DataFrame, "to_csv", fail)
    with pytest.raises(OSError, match="disk full"):
        wd.write_table(make_curves(), path, overwrite=True)
    assert [each.read_text() for each in tmp_path.iterdir()] == ["older"]


def test_a_link_stays_and_its_target_is_written(tmp_path):
    target, link = tmp_path / "target.csv", tmp_path / "link.csv"
    target.write_text("older")
    link.symlink_to(target)
    assert wd.write_table(make_curves(), link, overwrite=True) == link
    assert link.is_symlink()
    assert target.read_text().startswith("damage_state,")


def test_a_folder_that_cannot_be_written_is_told_with_the_file_that_was_asked_for(tmp_path, monkeypatch) -> None:
    def refuse(*paths: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(paths[0]))

    monkeypatch.setattr(text_files.os, "replace", refuse)
    path = tmp_path / "curves.csv"
    with pytest.raises(PermissionError, match=rf"^cannot write {re.escape(str(path))}: Permission denied$"):
        wd.write_table(make_curves(), path)
    assert not list(tmp_path.iterdir())


def make_run():
    """Build some of what `simulate` returns: 3 samples of a building of 2 storeys under 2 motions."""
    rng = np.random.default_rng(1)
    return xr.Dataset(
        {
            "peak_storey_drift": (("sample", "storey"), rng.random((3, 2)), {"units": "m"}),
            "peak_floor_acceleration": (("floor", "sample"), rng.random((2, 3)), {"units": "m s-2"}),
            "peak_base_shear": ("sample", rng.random(3), {"units": "N"}),
            "yield_force": (("sample", "storey"), rng.random((3, 2)), {"units": "N"}),
            "motion_name": ("motion", ["a", "b"]),
            "displacement": (("history", "time", "dof"), rng.random((1, 4, 2)), {"units": "m"}),
        },
        {
            "sample": [0, 1, 2],
            "storey": ("storey", [1, 2]),
            "floor": ("floor", [1, 2]),
            "motion": ("motion", [0, 1]),
            "motion_index": ("sample", [1, 0, 1]),
        },
        {"title": "run"},
    )


def test_a_run_by_samples_has_a_column_for_each_storey_and_floor(tmp_path, caplog):
    run = make_run()
    table = pd.read_csv(wd.write_table(run, tmp_path / "run.csv", rows="sample"))
    for storey in (1, 2):
        np.testing.assert_array_equal(
            table[f"peak_storey_drift_storey_{storey}_m"], run["peak_storey_drift"].sel(storey=storey)
        )
        np.testing.assert_array_equal(table[f"yield_force_storey_{storey}_N"], run["yield_force"].sel(storey=storey))
        np.testing.assert_array_equal(
            table[f"peak_floor_acceleration_floor_{storey}_m_per_s2"], run["peak_floor_acceleration"].sel(floor=storey)
        )
    assert table["motion_name"].tolist() == ["b", "a", "b"]
    assert table["sample"].tolist() == [0, 1, 2]
    assert "does not contain displacement (rows=('history', 'time', 'dof'))" in caplog.text


def test_a_run_by_samples_and_storeys_is_long(tmp_path, caplog):
    run = make_run()
    table = pd.read_csv(wd.write_table(run, tmp_path / "run.csv", rows=("sample", "storey")))
    assert len(table) == 6
    np.testing.assert_array_equal(table["peak_storey_drift_m"], run["peak_storey_drift"].values.ravel())
    assert table["motion_name"].tolist() == ["b", "b", "a", "a", "b", "b"]
    assert "peak_floor_acceleration (rows=('floor', 'sample'))" in caplog.text


def test_every_variable_is_in_the_table_or_named(tmp_path, caplog):
    curves = make_curves()
    for rows in (None, "stripe", ("damage_state", "stripe")):
        caplog.clear()
        table = pd.read_csv(wd.write_table(curves, tmp_path / "curves.csv", rows=rows, overwrite=True))
        for name in curves.data_vars:
            assert any(str(column).startswith(name) for column in table) != (name in caplog.text), name


def test_an_index_that_is_not_of_a_dimension_takes_nothing(tmp_path, caplog):
    run = make_run().assign_coords(motion_index=("sample", [1, -1, 1]))
    table = pd.read_csv(wd.write_table(run, tmp_path / "run.csv", rows="sample"))
    assert "motion_name" not in table
    assert "motion_name (rows='motion')" in caplog.text


def test_samples_of_joined_buildings_have_the_name_of_their_building(tmp_path):
    """As of `wd.join({"old": run, "new": other})`; the table had only the number of the building."""
    run = xr.Dataset(
        {"peak": ("sample", [1.0, 2.0, 3.0]), "buildings_of_archetype": ("archetype", [1, 2])},
        {"archetype_index": ("sample", [1, 0, 1]), "archetype": ["old", "new"]},
    )
    table = pd.read_csv(wd.write_table(run, tmp_path / "run.csv", rows="sample"))
    assert table["archetype"].tolist() == ["new", "old", "new"]
    assert table["archetype_index"].tolist() == [1, 0, 1]
    assert table["buildings_of_archetype"].tolist() == [2, 1, 2]


@pytest.mark.parametrize("name", ["curves.csv", "curves.parquet", "CURVES.CSV"])
def test_only_a_table_with_the_same_columns_is_replaced(name, tmp_path):
    path = tmp_path / name
    inventory = pd.DataFrame({"id": ["a"], "storeys": [2]})
    write = inventory.to_parquet if path.suffix == ".parquet" else inventory.to_csv
    write(path, index=False)
    before = path.read_bytes()
    with pytest.raises(FileExistsError, match=r"(?i)curves.* is not a table with the same columns.*overwrite=True"):
        wd.write_table(make_curves(), path)
    assert path.read_bytes() == before
    wd.write_table(make_curves(), path, overwrite=True)
    changed = make_curves()
    changed["fragility_median"][:] = 0.7
    read = pd.read_parquet if path.suffix == ".parquet" else pd.read_csv
    assert read(wd.write_table(changed, path))["fragility_median_g"].tolist() == [0.7, 0.7]
    path.write_bytes(b"\xff\x00 no table")
    with pytest.raises(FileExistsError, match="exists and is not a table"):
        wd.write_table(changed, path)
    with pytest.raises(TypeError, match="overwrite must be True or False, got 'yes'"):
        wd.write_table(changed, path, overwrite="yes")
