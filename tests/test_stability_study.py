"""The study of stability: limits, growth and errors measured from the kernels, held to tables from elsewhere."""

from __future__ import annotations

import importlib
import io
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT
from matplotlib.image import imread
from scipy.integrate import solve_ivp

# The study charts what test_growth.py, test_stability.py and test_guard.py show of the kernels by default.
pytestmark = pytest.mark.thorough

# Limits of w h by damping ratio: Runge-Kutta of order 2, 3 and 4 in as many stages, and Dormand-Prince 5 at a fixed
# step; roots of |R(z)| = 1 to 40 digits, not from warpdyn.
RUNGE_KUTTA_LIMITS = {
    0: (0.0, 1.7320508075688772, 2.82842712474619, 0.9971890086325469),
    0.005: (0.3485947663352812, 1.765560633189886, 2.838770974762946, 1.6955084660571398),
    0.01: (0.44400333397816505, 1.7964875179955437, 2.8485701134131873, 1.8721300712124531),
    0.02: (0.5688415632504776, 1.8523146154839, 2.8666285482402665, 2.079076763002298),
    0.05: (0.8, 1.9879832044016534, 2.9097996854903947, 2.4025608543983497),
    0.1: (1.0497545964285646, 2.1540485399653275, 2.9508529575261244, 2.6814071086918823),
    0.2: (1.3939075824393259, 2.36958490626632, 2.940087665230473, 3.0007419469176955),
    0.3: (1.647330959889798, 2.4891405090968353, 2.835300102593946, 3.216036064057296),
    0.4: (1.8457894350354667, 2.5362699378891174, 2.700467056027216, 3.351875603667285),
    0.5: (2.0, 2.52165902748985, 2.622542491830483, 3.398991528584633),
    0.6: (2.112339028201798, 2.4592694761692333, 2.6287510076803873, 3.3648666527528075),
    0.7: (2.1801487497895193, 2.37979390048801, 2.697957603401413, 3.3001573252250704),
    0.8: (2.1956720133230303, 2.332847682575104, 2.7914972150806063, 3.284818394637346),
    0.9: (2.1439436436993637, 2.3667967242884016, 2.8523725377901332, 3.3325836653100835),
    0.99: (2.0194023043415883, 2.492740665630788, 2.8023484310608042, 3.3216252590772344),
    1.0: (2.0, 2.5127453266183286, 2.785293563405282, 3.3065678926349453),
    1.1: (1.283484861008832, 1.6125352931426582, 1.787441061048011, 2.1219649160474137),
    1.25: (1.0, 1.2563726633091643, 1.392646781702641, 1.6532839463174727),
    1.5: (0.7639320225002103, 0.9597833096957458, 1.063887472574507, 1.2629965488774357),
    2.0: (0.5358983848622455, 0.6732880810524589, 0.7463171609980491, 0.8859921965502127),
}
RUNGE_KUTTA = {"heun": 0, "midpoint": 0, "kutta3": 1, "ssprk3": 1, "rk4": 2, "three_eighths": 2, "dormand_prince5": 3}
CLOSED_FORM_LIMITS = {
    "central_difference_lagged": lambda z: 2 * (np.sqrt(1 + z**2) - z),
    "central_difference": lambda z: 2 + 0 * z,
    "newmark_linear": lambda z: 2 * np.sqrt(3) + 0 * z,
}
UNDAMPED_LIMITS = {"nystroem4": 2.586518894520, "velocity_verlet": 2.0}
UNLIMITED = ("newmark_average", "hht_alpha", "generalised_alpha", "wilson_theta", "exact")
# Period elongation without damping at h / T = .01, .05, .1 and .2.
CENTRAL = [-1.645394288e-4, -4.141454784e-3, -1.693422976e-2, -7.517243636e-2]
ELONGATION = {
    "newmark_average": [3.289002722e-4, 8.171242600e-3, 3.207491062e-2, 1.200330860e-1],
    "newmark_linear": [1.644474211e-4, 4.083789215e-3, 1.600192184e-2, 5.914510317e-2],
    "central_difference": CENTRAL,
    "central_difference_lagged": CENTRAL,
    "velocity_verlet": CENTRAL,
}
# RK4 by w h: growth a step, relative phase error, amplitude kept a period.
RK4 = {
    0.1: (0.9999999930642, -8.303591e-7, 0.9999995642),
    0.5: (0.9998948783723, -4.751287e-4, 0.9986798055),
    1.0: (0.9939050368230, -5.578894e-3, 0.9623154561),
    2.0: (0.7453559924999, 1.722197e-2, 0.3972088230),
}
CHAIN_STEPS = {"none": 0.0345860585, "modal": 0.0355810836, "rayleigh": 0.0357753037, "stiffness": 0.0159550516}
# Largest error of the seed frame over its peak: float64, float32 with time added up, float32 with steps counted.
CLOCK = {1e-2: (1.6e-5, 5.2e-4, 1.6e-5), 1e-3: (1.6e-9, 1.7e-3, 2.5e-6), 1e-4: (1.5e-13, 2.5e-2, 5.2e-6)}
CLOCK |= {1e-5: (1.7e-14, 2.6e-1, 1.2e-5)}


@pytest.fixture(scope="module", autouse=True)
def studies() -> Iterator[None]:
    """Let the studies be imported as their own scripts import each other."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "studies")
        yield


@pytest.fixture(scope="module")
def oscillator() -> ModuleType:
    return importlib.import_module("parts.stability.oscillator")


@pytest.fixture(scope="module")
def failures() -> ModuleType:
    return importlib.import_module("parts.stability.failures")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Run the study with few oscillators in its maps; all else is as large as ever."""
    out, printed = tmp_path_factory.mktemp("stability") / "made by the study", io.StringIO()
    main = importlib.import_module("stability").main
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
        patch.setattr(sys, "argv", ["stability.py", "--out", str(out), "--device", "cpu", "--samples", "400"])
        main()
    return out, printed.getvalue()


@pytest.fixture(scope="module")
def result(study: tuple[Path, str]) -> xr.Dataset:
    with xr.open_dataset(study[0] / "stability.nc") as dataset:
        return dataset.load()


def test_every_variable_is_labelled_and_finite(result: xr.Dataset) -> None:
    for name, variable in result.variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs["units"], name
        if variable.dtype.kind == "f":
            assert np.isfinite(variable.values).all(), name
    assert 380 <= result.attrs["oscillators_in_each_map"] <= 400
    assert result["frequency_step"].min() > 0
    assert result["frequency_step"].max() == 4
    assert result["damping_ratio"].values[[0, -1]].tolist() == [0, 2]


def test_figures_are_drawn_and_the_report_printed(study: tuple[Path, str]) -> None:
    for name in ("growth", "limits", "accuracy", "rk4", "chain", "bouc_wen", "yielding", "clock"):
        pixels = imread(study[0] / f"stability_{name}.png")
        assert min(pixels.shape[:2]) > 400, name
        assert np.mean(pixels[..., :3].min(axis=2) < 0.9) > 0.02, name  # ink on the paper
    assert "RK4 grows a thousand times in 1747 steps at w h = 2.83, 39 steps" in study[1]


@pytest.mark.parametrize("name", [*RUNGE_KUTTA, *CLOSED_FORM_LIMITS])
def test_limits_of_the_kernels_are_those_of_the_tables(name: str, result: xr.Dataset) -> None:
    ratio = np.array(list(RUNGE_KUTTA_LIMITS))
    if name in RUNGE_KUTTA:
        due = np.array(list(RUNGE_KUTTA_LIMITS.values()))[:, RUNGE_KUTTA[name]]
    else:
        due = CLOSED_FORM_LIMITS[name](ratio)
    row = result.sel(limited_method=name, limit_damping_ratio=ratio)
    for found in (row["measured_limit"].values, row["theoretical_limit"].values):
        # Growth is seen from 1e-8 a step: where every step grows, by x^4 / 8, from x = .017.
        assert np.all(found[due == 0] < 0.02)
        # 0.2 % is asked for (0.5 % where the boundary is flat); the last pass of trial steps is 4 / 64^3 wide.
        np.testing.assert_allclose(found[due > 0], due[due > 0], rtol=1e-4)


def test_the_table_of_the_documentation_is_what_the_study_writes(study: tuple[Path, str]) -> None:
    tables = study[0], ROOT / "docs" / "reference" / "methods"
    ours, kept = ((folder / "stability_limits.csv").read_text().splitlines()[1:] for folder in tables)  # less the date
    assert ours[:3] == kept[:3]
    for row, other in zip(ours[3:], kept[3:], strict=True):
        assert row.split(",")[0] == other.split(",")[0]
        # What the last pass of trial steps leaves on another processor.
        np.testing.assert_allclose([*map(float, row.split(",")[1:])], [*map(float, other.split(",")[1:])], rtol=2e-5)


def test_undamped_limits_and_methods_without_one(oscillator: ModuleType, result: xr.Dataset) -> None:
    for name, due in UNDAMPED_LIMITS.items():
        found = result["measured_limit"].sel(limited_method=name, limit_damping_ratio=0.0)
        assert float(found) == pytest.approx(due, rel=1e-4)
    ratio = np.array([0.0, 0.02, 0.5, 2.0])
    for name in UNLIMITED:
        assert name not in result["limited_method"].values
        assert np.isinf(oscillator.measured_limits(name, ratio, "cpu")).all()
        assert result["growth_per_step"].sel({"method": name}).max() <= 1 + 1e-8


def test_sizes_after_many_steps_agree_with_the_limits(result: xr.Dataset) -> None:
    """Counted, not fitted: half a per cent inside motions decay, half a per cent outside they grow."""
    size = result["size_beside_limit"]
    assert np.all(size.sel(side="inside") < 0.5)
    assert np.all(size.sel(side="outside") > 2)


def test_rk4_beyond_its_limit(result: xr.Dataset, oscillator: ModuleType) -> None:
    np.testing.assert_allclose(result["rk4_steps_to_thousandfold"], [1747, 39, 17], rtol=0.02)
    x = np.array([0.1, 0.5, 1, 2, 2.83, 2.9, 3])
    due = [0.9999999930642, 0.9998948783723, 0.9939050368230, 0.7453559924999, 1.0039609, 1.1930627, 1.5051993]
    # Digits given; one step at a time, rounding is good to some 1e-14.
    np.testing.assert_allclose(oscillator.growth_per_step("rk4", x, 0 * x, "cpu")[:4], due[:4], rtol=1e-12)
    np.testing.assert_allclose(oscillator.growth_per_step("rk4", x, 0 * x, "cpu")[4:], due[4:], rtol=1e-7)


def test_period_and_amplitude_errors(oscillator: ModuleType) -> None:
    x = 2 * np.pi * np.array([0.01, 0.05, 0.1, 0.2])
    for name, due in ELONGATION.items():
        found = oscillator.accuracy(name, x, "cpu")
        np.testing.assert_allclose(found["period_elongation"], due, rtol=1e-9, err_msg=name)  # digits given
        np.testing.assert_allclose(found["factor"], 1, rtol=1e-14, err_msg=name)
    x = np.array(list(RK4))
    found = oscillator.accuracy("rk4", x, "cpu")
    factor, phase, kept = np.array(list(RK4.values())).T
    np.testing.assert_allclose(found["factor"], factor, rtol=0, atol=1e-13)
    np.testing.assert_allclose(1 / (1 + found["period_elongation"]) - 1, phase, rtol=1e-6)
    np.testing.assert_allclose(found["amplitude_kept"], kept, rtol=0, atol=1e-10)
    # The loss itself, in closed form: |R|^2 = 1 - x^6 / 72 + x^8 / 576.
    np.testing.assert_allclose(1 - found["factor"], 1 - np.sqrt(1 - x**6 / 72 + x**8 / 576), rtol=1e-6)


def test_stiffness_proportional_damping_of_a_tall_chain(result: xr.Dataset, failures: ModuleType) -> None:
    rows = result.sel(chain_damping=list(CHAIN_STEPS))
    due = list(CHAIN_STEPS.values())
    np.testing.assert_allclose(rows["theoretical_chain_step"], due, rtol=1e-8)
    np.testing.assert_allclose(rows["measured_chain_step"], due, rtol=2e-3)
    assert np.all(rows["guarded_chain_step"] <= due)
    np.testing.assert_allclose(rows["guarded_chain_step"], due, rtol=2.1e-3)  # what the guard states of its tables
    # The same steps by powers of the step's matrix, in numpy.
    storeys, ratio = 20, 1681.82270854
    stiffness = ratio * (2 * np.eye(storeys) - np.eye(storeys, k=1) - np.eye(storeys, k=-1))
    stiffness[-1, -1] = ratio
    rates = np.block([[np.zeros((storeys, storeys)), np.eye(storeys)], [-stiffness, -0.1 / np.pi * stiffness]])
    step = CHAIN_STEPS["stiffness"] * np.array([0.999, 1.001])
    found = failures.chain_sizes("stiffness", step, 2000, "cpu")[:, 1]
    start = np.concatenate([np.random.default_rng(2).standard_normal(storeys), np.zeros(storeys)])
    for h, size, told in zip(step, found, (4e-3, 4.8e4), strict=True):
        z, one = h * rates, np.eye(2 * storeys)
        power = np.linalg.matrix_power(one + z @ (one + z / 2 @ (one + z / 3 @ (one + z / 4))), 2000)
        # The 12 digits of the ratio above, 2000 times over at the limit's slope of about 4.
        assert size == pytest.approx(np.linalg.norm(power @ start) / np.linalg.norm(start), rel=1e-6)
        assert told / 2 < size < 2 * told  # of another random start


def test_limit_of_bouc_wen(result: xr.Dataset, failures: ModuleType) -> None:
    # z on the way to its bound, in closed form: tanh x at n = 2; a published integral at n = 10.
    due = {2.0: np.tanh(1.0), 10.0: 0.936596963131}
    exponent = np.array(list(due))
    z, _ = failures.pushed_bouc_wen(exponent / 64 / 2.785293563405, exponent, 64, "cpu")
    np.testing.assert_allclose(z[:, -1], list(due.values()), rtol=1e-7)  # RK4 at 1/64 of x = 1: 1e-8
    limit = result["measured_push_limit"].values
    # Sharp where the law is linear. Others fall from z = 0 into the orbit beyond the limit up to 2 % before it.
    assert limit[0] == pytest.approx(2.7852935634, rel=2e-3)
    assert np.all((limit[1:] > 0.975 * 2.7852935634) & (limit[1:] < 1.0004 * 2.7852935634))
    assert limit[3] * 2e-3 / 10 == pytest.approx(5.5706e-4, rel=0.025)  # n = 10, uy = 2 mm, v = 1 m/s
    off, status = result["unsettled"], result["push_status"]
    assert float(off.sel(exponent=2, push_ratio=1.1)) == pytest.approx(0.53, abs=0.005)
    assert np.all(off.sel(push_ratio=slice(None, 0.97)) < 1e-9)
    beyond = off.sel(push_ratio=slice(1.01, None))
    assert np.all(beyond > 0.03)
    assert np.all(status.sel(push_ratio=slice(1.01, None)) == 3)  # unstable_step: finite, wrong, and told
    assert np.all(status.sel(push_ratio=slice(None, 0.85)) == 0)


def test_exact_peaks_of_yielding_storeys(failures: ModuleType) -> None:
    """By scipy: u'' + z uy = 0 and uy z' = u' (1 - z), with w = uy = 1 and a velocity of 3."""

    def turns(t: float, y: np.ndarray) -> float:
        return y[1]

    turns.terminal = True
    path = solve_ivp(lambda t, y: [y[1], -y[2], y[1] * (1 - y[2])], (0, 9), [0, 3, 0], "DOP853", events=turns,
                     rtol=1e-12, atol=1e-12)  # fmt: skip
    assert failures.exact_peak("bouc_wen") == pytest.approx(path.y[0, -1], rel=1e-9)
    assert (
        failures.exact_peak("elastic_perfectly_plastic") == 5
    )  # .05 m of a yield drift of .01 m at .3 m/s and 10 rad/s
    assert failures.exact_peak("elastic") == 3


def test_linear_proofs_do_not_hold_where_storeys_yield(result: xr.Dataset) -> None:
    peak, status = (result[name] for name in ("yielding_peak", "yielding_status"))
    short = peak.sel(yielding_frequency_step=slice(None, 0.11))
    np.testing.assert_allclose(short, 1, atol=0.003)  # second order: some x^2 / 10
    average, linear = (peak.sel(yielding_method=f"newmark_{name}") for name in ("average", "linear"))
    of_average, of_linear = (status.sel(yielding_method=f"newmark_{name}") for name in ("average", "linear"))
    assert np.all(average.sel(yielding_law="elastic") <= 1 + 1e-9)  # the energy of a linear system stays as it is
    for law in ("elastic_perfectly_plastic", "elastic"):
        assert np.all(of_average.sel(yielding_law=law) == 0)
    plastic = average.sel(yielding_law="elastic_perfectly_plastic")
    assert plastic.max() > 1.5
    assert plastic.max() < 100  # wrong but bounded
    softening = {"yielding_law": "bouc_wen", "yielding_frequency_step": slice(1.05, None)}  # limit: 2.785 / 3
    assert np.all(average.sel(softening) > 1e6)
    assert np.all(of_average.sel(softening) > 0)  # and told
    beyond = {"yielding_frequency_step": slice(4.0, None)}
    assert np.all(linear.sel(yielding_law="elastic", **beyond) > 1e6)
    ratchets = linear.sel(yielding_law="elastic_perfectly_plastic", **beyond)
    assert ratchets.max() > 100
    assert ratchets.max() < 1e6  # no blow-up to see
    assert np.all(of_linear.sel(yielding_law="elastic_perfectly_plastic") == 0)


@pytest.mark.parametrize("step", CLOCK)
def test_clocks_in_float32(step: float, result: xr.Dataset) -> None:
    row = result.sel(clock_step=step)
    double, added, counted = CLOCK[step]
    if double > 1e-12:
        assert float(row["float64_error"]) == pytest.approx(double, rel=0.05)
    assert float(row["float64_error"]) < max(1.05 * double, 1e-12)  # rounding, which goes its own way
    assert float(row["float32_accumulated_time_error"]) == pytest.approx(added, rel=0.05)
    # Rounding of a random kind; the kernel adds four increments a step to its state where the table's code adds one.
    assert counted / 3 < float(row["float32_error"]) < 10 * counted
    assert counted / 3 < float(row["float32_in_numpy_error"]) < 3 * counted
    # At the end the clock is off by a whole number of its own last digits.
    end = float(row["clock_error"].sel(clock_time=10.0))
    assert (10 + end) / np.spacing(np.float32(10)) == pytest.approx(round((10 + end) / np.spacing(np.float32(10))))
    assert abs(end) > 1e-4
