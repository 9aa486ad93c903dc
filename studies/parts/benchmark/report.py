"""Tables that the study benchmark prints, and the selection of rows for them and for the figure."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr

from parts.benchmark.cases import LABELS, LAW_METHODS

BY_HAND = ("cpp_vectors", "cuda_registers", "cpp_stoermer", "cuda_stoermer")
# Columns that must be equal in a row of warpdyn and the row of the peer with which it is compared.
SAME = ["device", "law", "dtype", "storeys", "substeps", "compared_method"]


def measurements(result: xr.Dataset, part: str) -> pd.DataFrame:
    """Return the rows of one part of the benchmark, such as "kernels", as a table."""
    names = [name for name, variable in result.variables.items() if variable.dims == ("measurement",)]
    table = result[names].to_dataframe()
    return table[table["part"] == part]


def beside_peers(result: xr.Dataset) -> pd.DataFrame:
    """Return the rows of the peers (other programs), with warpdyn's speed in the same case over that of the peer."""
    table = measurements(result, "kernels")
    table = table.assign(compared_method=table["method"].replace("", "rk4"))
    merged = table[table["peer"] != "warpdyn"]
    for recorders, ratio in (("drift", "ratio"), ("all", "ratio_with_all_recorders")):
        own = table[(table["peer"] == "warpdyn") & (table["recorders"] == recorders)]
        own = own[[*SAME, "dof_steps_per_second"]].rename(columns={"dof_steps_per_second": ratio})
        merged = merged.merge(own, on=SAME, how="left")
        merged[ratio] /= merged["dof_steps_per_second"]
    return merged


def print_report(result: xr.Dataset) -> None:
    """Print the results of all parts of the benchmark as tables."""
    print_kernels(result)
    _print_laws(measurements(result, "laws"))
    _print_scaling(result)
    _print_jobs(result)
    print("\nstart of a process of the main job [s]: importing, first run, second run")
    for start in result["start"].values:
        row = result.sel(start=start)
        seconds = "".join(f"{row[f'start_{name}'].item():8.2f}" for name in ("importing", "first_run", "second_run"))
        print(f"  {row['start_device'].item():<8} {row['start_cache'].item():<12}{seconds}")
    _print_duration(result)


def print_kernels(result: xr.Dataset) -> None:
    """Print the speeds of the kernels of warpdyn, and of the other programs (peers) that are compared with them."""
    print(f"\n{result.attrs['processor']}; GPU: {result.attrs['gpu']}\n{result.attrs['source']}")
    _print_kernels(measurements(result, "kernels"))
    beside = beside_peers(result)
    _print_peers(beside)
    _print_shares(beside)


def _print_duration(result: xr.Dataset) -> None:
    parts = {name.removeprefix("seconds_"): value for name, value in result.attrs.items() if name.startswith("seconds")}
    print("\nthe benchmark took " + ", ".join(f"{name} {value:.0f} s" for name, value in parts.items()))


def _print_kernels(table: pd.DataFrame) -> None:
    own = table[(table["peer"] == "warpdyn") & (table["substeps"] == 1)]
    storeys = sorted(own["storeys"].unique())
    print("\nwarpdyn's kernels: DOF-steps/s by storeys; a CPU on one thread")
    print(" " * 48 + "".join(f"{n:>9}" for n in storeys))
    for key, rows in own.groupby(["device", "method", "dtype", "law", "recorders"], sort=False):
        speed = rows.set_index("storeys")["dof_steps_per_second"]
        words = f"  {key[0]:<8} {key[1]:<8} {key[2]:<8} {key[3]:<9} {key[4]:<8}"
        print(words + "".join(f"{speed[n]:9.2e}" for n in storeys))
    for row in own[own["status"] != "measured"].itertuples():
        print(f"  {row.device} {row.dtype} {row.law} {row.storeys}: {row.status}, by {row.peak_drift_difference:.1g}")


def _print_peers(table: pd.DataFrame) -> None:
    print(
        "\npeers: DOF-steps/s; warpdyn's over that, with peak drifts alone and with all recorders; agreement of drifts"
    )
    for row in table[table["seconds"].notna()].itertuples():
        step = "" if row.substeps == 1 else f", steps of 1/{row.substeps}"
        case = f"{row.device} {row.dtype} {row.law} {row.storeys}{step}"
        case += "" if row.recorders == "drift" else f", {row.recorders}"
        ratios = f"{row.ratio:9.3g} {row.ratio_with_all_recorders:9.3g}"
        numbers = f"{row.dof_steps_per_second:9.2e} {ratios} {row.peak_drift_difference:9.1e}"
        print(f"  {LABELS.get(row.peer, row.peer):<27} {case:<40} {numbers}  {row.status}, {row.note}")
    absent = table[table["seconds"].isna()].drop_duplicates(["peer", "device", "status", "note"])
    for row in absent.itertuples():
        print(f"  {LABELS.get(row.peer, row.peer):<27} {row.device:<8} {row.status}: {row.note}")


def _print_shares(table: pd.DataFrame) -> None:
    """Print the speed of warpdyn divided by the speed of hand-written code for the same device."""
    by_hand = table[table["peer"].isin(BY_HAND) & table["ratio"].notna()]
    storeys = sorted(by_hand["storeys"].unique())
    print("\nshare of the speed of code by hand that records the same, by storeys")
    print(" " * 52 + "".join(f"{n:>6}" for n in storeys))
    for (peer, dtype, law, recorders), rows in by_hand.groupby(["peer", "dtype", "law", "recorders"], sort=False):
        ratio = rows.set_index("storeys")["ratio" if recorders == "drift" else "ratio_with_all_recorders"]
        shares = "".join(f"{ratio.get(n, np.nan):6.2f}" for n in storeys)
        print(f"  {LABELS[peer]:<22} {dtype:<9} {law:<10} {recorders:<6}{shares}")


def _print_laws(table: pd.DataFrame) -> None:
    print(
        "\nevery law, 5 storeys, float32, steps of 1/8: DOF-steps/s of OpenSeesPy; on one CPU core by RK4 and by"
        "\nvelocity Verlet, each with its ratio to that; on a GPU by both"
    )
    for law, rows in table.groupby("law", sort=False):
        speeds = {}
        for row in rows.itertuples():
            speeds[bool(row.gpus), row.method] = row.dof_steps_per_second
        theirs = speeds.get((False, "newmark_linear"), np.nan)
        own = [speeds.get((False, method), np.nan) for method in LAW_METHODS]
        ratios = " ".join(f"{speed:9.2e} {speed / theirs:6.0f}" for speed in own)
        on_gpu = " ".join(f"{speeds.get((True, method), np.nan):9.2e}" for method in LAW_METHODS)
        numbers = f"{theirs:9.2e} {ratios} {on_gpu}"
        failed = ", ".join(f"{row.peer} {row.status}" for row in rows.itertuples() if row.status != "measured")
        print(f"  {law:<40} {numbers}  {failed}")


def _print_scaling(result: xr.Dataset) -> None:
    for part, column in (("samples", "run_samples"), ("threads", "threads"), ("gpus", "gpus")):
        table = measurements(result, part)
        if table.empty:
            continue
        storeys = table["storeys"].iloc[0]
        print(f"\nover {part}, {storeys} storeys, Bouc-Wen, float32: kernel [s], simulate [s], DOF-steps/s in kernels")
        for row in table.itertuples():
            numbers = f"{row.seconds:10.4f} {row.seconds_in_simulate:10.4f} {row.dof_steps_per_second:10.2e}"
            where = f"  {row.device:<8} {getattr(row, column):>9,} "
            print(where + (numbers if np.isfinite(row.seconds) else f"{row.status}: {row.note}"))


def _print_jobs(result: xr.Dataset) -> None:
    parts = result["job_part"].values
    print("\nthe main job [s]: " + ", ".join(parts) + "; simulate over kernels; with writing")
    for job in range(result.sizes["job"]):
        row = result.isel(job=job)
        seconds = "".join(f"{value:8.3f}" for value in row["seconds_of_part"].values)
        ratios = f"{row['ratio_to_dataset'].item():8.2f} {row['ratio_to_netcdf'].item():8.2f}"
        print(f"  {row['job_device'].item():<8} {row['job_histories'].item():>9,}{seconds}{ratios}")
