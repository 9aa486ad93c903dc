"""Cloud analysis with GEM's vulnerability modellers' toolkit and with warpdyn, for the same records.

    python docs/coming_from/scripts/with_oq_vmtk.py PATH/demos/CloudAnalysis REVISION

It needs warpdyn with the extra ".[test]", the toolkit (`openquake.vmtk`, with PATH on PYTHONPATH if it is not
installed), the folder of the toolkit's public demonstration, which holds 200 records and their intensity measures, and
the toolkit's revision, which is written to the results.
It writes results/oq_vmtk*.csv, results/oq_vmtk.json and figures/oq_vmtk.png. The toolkit's 200 histories are run twice,
at the step of the demonstration and at half of it, in about four minutes of processor time.
"""

from __future__ import annotations

import contextlib
import io
import pickle
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from provenance import FIGURES, provenance, write_csv, write_json

import warpdyn as wd

sys.path.insert(0, str(Path(__file__).parents[3] / "studies"))
from peers.opensees_newmark import load_opensees

load_opensees()  # with its libraries, before the toolkit imports it
from openquake.vmtk.calibration import calibrate_model  # noqa: E402
from openquake.vmtk.modeller import modeller  # noqa: E402
from openquake.vmtk.postprocessor import postprocessor  # noqa: E402

# Input of the demonstration.
STOREYS, HEIGHT, PARTICIPATION, DAMPING_RATIO = 2, 2.8, 1.33, 0.05
CAPACITY = np.array(
    [[0.00060789, 0.00486316, 0.02420000, 0.04353684], [0.10315200, 0.20630401, 0.12378241, 0.12502023]]
).T  # spectral displacements [m] and accelerations [g]
THRESHOLDS = {"slight": 0.00150, "moderate": 0.00545, "extensive": 0.00952, "complete": 0.0135}
LEAST, MOST = 0.1 * THRESHOLDS["slight"], 1.5 * THRESHOLDS["complete"]  # limits of the drift ratios in the regression
MEASURES = ("PGA", "SA(0.3s)", "SA(0.6s)", "SA(1.0s)", "AvgSA")
G = 9.81  # m/s2, in the toolkit
REPEATS = 7  # runs of warpdyn; the shortest time counts


def read_records(folder: Path) -> list[wd.GroundMotion]:
    """Return the demonstration's records, in the order of their numbers."""
    motions = []
    for file in sorted((folder / "acc").glob("acc_*.csv"), key=lambda path: int(path.stem.split("_")[1])):
        times = np.loadtxt(folder / "dts" / file.name.replace("acc", "dts"), max_rows=2)
        step = float(np.round(times[1] - times[0], 9))
        motions.append(wd.records.from_array(np.loadtxt(file), step, "g", file.stem))
    return motions


class Toolkit:
    """Model of the demonstration, made and analysed by functions of the toolkit."""

    def __init__(self, records: Path) -> None:
        self.records = records
        self.mass, self.drift, self.force, self.shape = calibrate_model(
            STOREYS, PARTICIPATION, CAPACITY, isFrame=False, isSOS=False
        )
        self.force = self.force * G  # kN

    def compiled(self) -> tuple[modeller, np.ndarray]:
        """Return a new model after its gravity analysis, and its periods [s]."""
        model = modeller(STOREYS, [HEIGHT] * STOREYS, self.mass, self.drift, self.force, True)
        model.compile_model()
        model.do_gravity_analysis()
        periods, _ = model.do_modal_analysis(num_modes=3)
        return model, np.asarray(periods)

    def pushover(self, roof: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Return roof displacements [m] and base shears [kN] up to a roof displacement."""
        with contextlib.redirect_stdout(io.StringIO()):
            model, _ = self.compiled()
            displacement, shear, *_ = model.do_spo_analysis(roof, 1.0, 1, self.shape, pflag=False, num_steps=steps)
        return displacement[:, -1], shear

    def run(self, motions: list[wd.GroundMotion], part: float) -> tuple[np.ndarray, float]:
        """Return peak drift ratios, shape [record, storey], and processor time [s], with a fraction of the step."""
        peaks, started = np.full((len(motions), STOREYS), np.nan), time.process_time()
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
            for row, motion in enumerate(motions):
                model, _ = self.compiled()
                file = str(self.records / "acc" / f"{motion.name}.csv")
                end = (len(motion.values) - 1) * motion.step
                given = ([file], motion.step, G, end, part * motion.step, folder)
                peaks[row] = model.do_nrha_analysis(*given, pflag=False, xi=DAMPING_RATIO)[2][:, 0]
        return peaks, time.process_time() - started


# [building]
def building_of(mass: np.ndarray, drift: np.ndarray, force: np.ndarray) -> wd.ShearBuilding:
    """Return the building with the toolkit's floor masses [t], drifts [m] and forces [kN]."""
    corners = {f"ductility_{i + 1}": drift[:, i] / drift[:, 0] for i in (1, 2, 3)}
    corners |= {f"force_ratio_{i + 1}": force[:, i] / force[:, 0] for i in (1, 2, 3)}
    return wd.ShearBuilding(
        mass=1000 * np.asarray(mass),  # kg
        stiffness=1000 * force[:, 0] / drift[:, 0],  # N/m
        height=2.8,  # m
        law="pinching4",
        yield_force=1000 * force[:, 0],  # N
        **corners,
        **wd.laws.GEM_DAMAGE,
        drift_capacity=drift[:, 3],  # m; the toolkit's MinMax
        damping="rayleigh",
        damping_ratio=0.05,
    )


# [run]
def cloud(building: wd.ShearBuilding, motions: list[wd.GroundMotion]) -> xr.Dataset:
    """Return the run of the building under all unscaled records."""
    cloud = wd.Cloud(motions, wd.SpectralAcceleration(0.3))
    scene = wd.Scene(building, cloud, recorders=("drift",), tail=0.0)
    return wd.simulate(scene)


# [curves]
def curves_of(run: xr.Dataset, intensity: np.ndarray, of_buildings: float = 0.3) -> xr.Dataset:
    """Return fragility curves by the toolkit's regression, with its dispersion added."""
    run = run.assign_coords(im_level=("sample", intensity, {"units": "g"}))
    seen = run["peak_storey_drift_ratio"].max("storey") >= LEAST
    kept = run.isel(sample=seen.values)
    curves = wd.fragility_of_cloud(kept, THRESHOLDS, intervals_over="records")
    dispersion = np.hypot(curves["fragility_dispersion"], of_buildings)
    return curves.assign(total_dispersion=dispersion)


# [end]


def main(folder: Path, revision: str) -> None:
    """Run both programs, and write the results."""
    warnings.filterwarnings("ignore", message="stiffness_damage_use_exponent")  # the page explains it
    records = next(path for path in (folder / "Records", folder / "records") if path.exists())
    motions = read_records(records)
    measured = pickle.loads((records / "imls_esrm20.pkl").read_bytes())
    toolkit = Toolkit(records)
    building = building_of(toolkit.mass, toolkit.drift, toolkit.force)

    cold = time.perf_counter()
    run = cloud(building, motions)
    cold = time.perf_counter() - cold
    seconds = []
    for _ in range(REPEATS // 2):
        seconds.append(_seconds_of(building, motions))
    peaks, their_seconds = toolkit.run(motions, 1.0)
    while len(seconds) < REPEATS:
        seconds.append(_seconds_of(building, motions))
    peaks_at_half_the_step, _ = toolkit.run(motions, 0.5)

    ends = toolkit.drift[:, 3] / HEIGHT
    ours, theirs = run["peak_storey_drift_ratio"].values, peaks
    collapsed = run["status"].values == 1
    passed, passed_at_half = ((values > ends).any(axis=1) for values in (theirs, peaks_at_half_the_step))
    standing = ~collapsed & ~passed & ~passed_at_half
    apart = _differences(ours, theirs, standing)
    apart_at_half = _differences(peaks_at_half_the_step, theirs, standing)
    _, periods = toolkit.compiled()

    roof, shear = toolkit.pushover(0.9 * toolkit.drift[:, 3].sum(), 400)
    pushed = wd.pushover(building, np.maximum(roof, 0)[1:], pattern="first_mode")["base_shear"].values / 1000
    # Demands of the toolkit with the limits of the demonstration, in the form of a run of warpdyn.
    peak, status = run["peak_storey_drift_ratio"], run["status"]
    reached = (theirs >= MOST).any(axis=1).astype(np.int8)
    as_run = run.assign({peak.name: peak.copy(data=np.minimum(theirs, MOST)), "status": status.copy(data=reached)})
    header = ["intensity measure", "damage state", "median, toolkit [g]", "toolkit's demands, warpdyn's fit [g]"]
    header += ["median, warpdyn [g]", "95 % interval [g]", "dispersion, toolkit", "toolkit's demands, warpdyn's fit"]
    rows, drawn = [], {}
    for measure in MEASURES:
        fitted = postprocessor().do_cloud_analysis(
            measured[measure], theirs.max(axis=1), list(THRESHOLDS.values()), LEAST, MOST
        )["fragility"]
        curves, same_demands = (curves_of(each, np.asarray(measured[measure])) for each in (run, as_run))
        drawn[measure] = fitted, curves
        for i, state in enumerate(THRESHOLDS):
            row, same = curves.isel(damage_state=i), same_demands.isel(damage_state=i)
            low, high = float(row["fragility_median_lower"]), float(row["fragility_median_upper"])
            rows.append(
                [
                    measure.replace("s)", " s)"), state, f"{fitted['medians'][i]:.3f}",
                    f"{float(same['fragility_median']):.3f}", f"{float(row['fragility_median']):.3f}",
                    f"{low:.3f} to {high:.3f}", f"{fitted['betas_total'][i]:.3f}",
                    f"{float(same['total_dispersion']):.3f}", f"{float(row['total_dispersion']):.3f}",
                ]
            )  # fmt: skip
    write_csv("oq_vmtk_curves", [*header, "dispersion, warpdyn"], rows)
    write_csv(
        "oq_vmtk_peaks",
        ["record", "toolkit", "toolkit at half the step", "warpdyn", "toolkit passed MinMax", "warpdyn collapsed"],
        zip(
            [motion.name for motion in motions],
            *([f"{value:.6g}" for value in values.max(axis=1)] for values in (theirs, peaks_at_half_the_step, ours)),
            passed.astype(int),
            collapsed.astype(int),
            strict=True,
        ),
    )
    write_json(
        "oq_vmtk",
        {
            "measured_with": provenance("openseespy", "scipy", toolkit=revision),
            "records": len(motions),
            "record_steps": int(sum(len(motion.values) - 1 for motion in motions)),
            "periods_s": {"toolkit": sorted(set(np.round(periods, 7)), reverse=True),
                          "warpdyn": building.modal()["period"].values.tolist()},
            "collapses": {"toolkit": int(passed.sum()), "toolkit at half the step": int(passed_at_half.sum()),
                          "warpdyn": int(collapsed.sum()), "toolkit and warpdyn": int((passed & collapsed).sum())},
            "standing_in_all": int(standing.sum()),
            "relative_difference_of_peaks": {"warpdyn": apart, "toolkit at half the step": apart_at_half},
            "pushover_largest_difference_over_peak": _pushover_difference(roof, shear, pushed),
            "processor_seconds": {
                "toolkit": their_seconds, "warpdyn": min(seconds), "ratio": their_seconds / min(seconds),
                "warpdyn, of each repeat": seconds, "warpdyn, first run with compiling": cold,
            },
            "method": run.attrs["method"], "dtype": run.attrs["dtype"],
        },
    )  # fmt: skip
    _draw(roof, shear, pushed, ours, theirs, collapsed, np.asarray(measured["AvgSA"]), drawn["AvgSA"])


def _seconds_of(building: wd.ShearBuilding, motions: list[wd.GroundMotion]) -> float:
    """Return the processor time of a run (all threads)."""
    started = time.process_time()
    cloud(building, motions)
    return time.process_time() - started


def _differences(values: np.ndarray, reference: np.ndarray, chosen: np.ndarray) -> dict[str, float]:
    """Return percentiles of the difference of the largest peak drifts, divided by those of the reference."""
    values, reference = values[chosen].max(axis=1), reference[chosen].max(axis=1)
    found = np.percentile(np.abs(values / reference - 1), (50, 90, 95, 100))
    return dict(zip(("median", "90 %", "95 %", "largest"), found.tolist(), strict=True))


def _pushover_difference(roof: np.ndarray, shear: np.ndarray, pushed: np.ndarray) -> dict[str, float]:
    """Return the largest differences up to the peak, and over the whole curve."""
    apart, peak = np.abs(pushed - shear[1:]) / shear.max(), int(shear.argmax())
    return {"up to the peak": float(apart[:peak].max()), "to 90 % of the last point": float(apart.max())}


def _draw(roof, shear, pushed, ours, theirs, collapsed, intensity, curves) -> None:
    """Draw the pushover, the clouds and the curves of average spectral acceleration."""
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    push, dots, lines = figure.subplots(1, 3)
    push.plot(1000 * roof, shear, lw=4, alpha=0.4, label="toolkit")
    push.plot(1000 * roof, np.append(0.0, pushed), "k--", lw=1, label="warpdyn")
    push.set(xlabel="roof displacement [mm]", ylabel="base shear [kN]", ylim=(0, None))
    push.legend()
    for values, marker, name in ((theirs, "o", "toolkit"), (ours, "x", "warpdyn")):
        largest = 100 * values.max(axis=1)
        size = (
            {"s": 22, "facecolors": "none", "edgecolors": "C0"} if marker == "o" else {"s": 12, "color": "k", "lw": 0.8}
        )
        dots.scatter(intensity, np.minimum(largest, 100 * MOST), marker=marker, label=name, **size)
    dots.axhline(100 * MOST, color="0.6", lw=0.8)
    dots.set(
        xscale="log", yscale="log", xlabel="average spectral acceleration [g]", ylabel="peak storey drift ratio [%]"
    )
    dots.legend(title="at most 2.03 %")
    fitted, own = curves
    from scipy.stats import norm

    levels = np.geomspace(0.05, 5, 200)
    for i, state in enumerate(THRESHOLDS):
        their = norm.cdf(np.log(levels / fitted["medians"][i]) / fitted["betas_total"][i])
        row = own.isel(damage_state=i)
        mine = norm.cdf(np.log(levels / float(row["fragility_median"])) / float(row["total_dispersion"]))
        lines.plot(levels, their, f"C{i}", lw=4, alpha=0.4, label=state)
        lines.plot(levels, mine, "k--", lw=1)
    lines.set(xscale="log", xlabel="average spectral acceleration [g]", ylabel="probability of exceedance", ylim=(0, 1))
    lines.legend(fontsize=8, title="thin: warpdyn", title_fontsize=8)
    FIGURES.mkdir(exist_ok=True)
    figure.savefig(FIGURES / "oq_vmtk.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
