"""Portfolios: a building's results are those of its archetype by itself, whatever stands beside it."""

import io
import os

import numpy as np
import pytest
import xarray as xr
from test_simulate import MOTIONS, make_motion
from tqdm import tqdm

import warpdyn as wd
from warpdyn.campaigns.accuracy import pilot
from warpdyn.campaigns.integration.settings import Integration
from warpdyn.campaigns.integration.time_grid import STEPS_PER_PERIOD
from warpdyn.campaigns.portfolio.groups import ROUND_STEP, checked_archetypes, groups_of, parameters_of
from warpdyn.campaigns.portfolio.labels import common_attributes
from warpdyn.campaigns.running import run as module
from warpdyn.campaigns.running.regions import region as regions, workers

pytestmark = pytest.mark.meant_as_given("first_period", "yield_base_shear_coefficient")

STRIPES = wd.Stripes(MOTIONS, [0.1, 0.4], wd.PeakGroundAcceleration())
DAMPED = {"damping": "rayleigh", "damping_ratio": 0.05}
YIELDING = {"law": "bilinear", "yield_force": 4e3, "hardening_ratio": 0.05}
SCATTER = {
    "mass": wd.RandomFactor(wd.Lognormal(1, 0.1)),
    "stiffness": wd.RandomFactor(wd.Lognormal(1, 0.2), per="storey"),
    "damping_ratio": wd.RandomValue(wd.Uniform(0.02, 0.08)),
}


def chain(storeys, stiffness=6e5, **changes):
    return wd.ShearBuilding(2e3, np.full(storeys, stiffness), 3.0, **(YIELDING | DAMPED | changes))


def smooth(storeys, **changes):
    return chain(storeys, law="bouc_wen", **changes)


TABLE = {
    "stiffness": wd.GivenValues(np.linspace(3e5, 9e5, 12).reshape(4, 3)),
    "mass": wd.GivenValues([1e3, 2e3, 3e3, 4e3]),
}
ARCHETYPES = {
    "low": wd.Archetype(chain(1), 5, SCATTER),
    "house": wd.Archetype(chain(2)),
    "table": wd.Archetype(chain(3), scatter=TABLE),
    "high": wd.Archetype(chain(3, 5e5, hardening_ratio=0.1), 3, SCATTER, {("mass", "stiffness"): 0.5}),
    "smooth": wd.Archetype(smooth(2), 4, {"yield_force": wd.RandomFactor(wd.Lognormal(1, 0.3))}),
    "linear": wd.Archetype(wd.ShearBuilding(2e3, [6e5, 4e5], 3.0, **DAMPED), 2, {"mass": wd.GivenValues([1e3, 2e3])}),
    "again": wd.Archetype(chain(2, 7e5, yield_force=5e3), 6, {"mass": wd.GivenValues(np.linspace(1.5e3, 3e3, 6))}),
}
SETTINGS = {"tail": 1.0, "collapse_drift_ratio": 0.05}
CITY = wd.Portfolio(ARCHETYPES)


def simulate(portfolio, excitation, **settings):
    """Run a portfolio, given what its scene and what its run takes together."""
    names = ("recorders", "tail", "collapse_drift_ratio", "scatter", "correlation", "sampling")
    of_scene = {key: settings.pop(key) for key in names if key in settings}
    if "target_error" not in settings:
        settings.setdefault("method", "rk4")  # which a given step takes, too
    return wd.simulate(wd.Scene(portfolio, excitation, **of_scene), **settings)


@pytest.fixture(scope="module")
def city():
    return simulate(CITY, STRIPES, seed=5, device="cpu", **SETTINGS)


def rows_of(portfolio, name, each):
    place = list(portfolio.archetypes).index(name)
    first = int(portfolio.first[place]) * each
    return slice(first, first + int(portfolio.counts[place]) * each)


def assert_same(part, alone):
    """Check that every result of a part of a portfolio's run has the bits of a run by itself; storeys above are NaN."""
    own = {"motion_name", "motion_step", "motion_peak_acceleration", "estimated_relative_error"}
    for name in set(alone.data_vars) - own:
        one, other = part[name].values, alone[name].values
        inner = one[(slice(None), *(slice(size) for size in other.shape[1:]))]
        assert inner.dtype == other.dtype
        assert inner.tobytes() == np.ascontiguousarray(other).tobytes(), name
        if one.ndim > 1:
            assert np.isnan(one[:, other.shape[1] :]).all(), name


@pytest.mark.parametrize("name", ARCHETYPES)
def test_a_building_is_what_its_archetype_by_itself_makes_of_it(name, city):
    part = city.isel(sample=rows_of(CITY, name, 6))
    archetype = ARCHETYPES[name]
    values = parameters_of(CITY, name, seed=5)
    scatter = {key: wd.GivenValues(value) for key, value in values.items()}
    scene = wd.Scene(archetype.building, STRIPES, scatter, **SETTINGS)
    steps = part["integration_step"].values
    alone = wd.simulate(scene, structures=len(values["mass"]), longest_step=steps.max(), device="cpu", seed=99)
    np.testing.assert_array_equal(alone["integration_step"].values, steps)
    assert_same(part, alone)


def test_the_dataset_says_which_sample_is_of_what(city):
    each = 6
    np.testing.assert_array_equal(city["sample"], np.arange(CITY.buildings * each))
    np.testing.assert_array_equal(city["building"], np.repeat(np.arange(25), each))
    names = city["archetype"].values[city["archetype_index"].values]
    np.testing.assert_array_equal(names, np.repeat(list(ARCHETYPES), np.multiply([5, 1, 4, 3, 4, 2, 6], each)))
    np.testing.assert_array_equal(city["motion_index"], np.tile(np.repeat(np.arange(3), 2), 25))
    np.testing.assert_array_equal(city["im_level"], np.tile([0.1, 0.4], 75))
    np.testing.assert_array_equal(city["storeys_of_archetype"], [1, 2, 3, 3, 2, 2, 2])
    np.testing.assert_array_equal(city["buildings_of_archetype"], [5, 1, 4, 3, 4, 2, 6])
    assert city["peak_storey_drift_ratio"].dims == ("sample", "storey")
    assert city["peak_floor_acceleration"].dims == ("sample", "floor")
    assert city.sizes["storey"] == 3
    storeys = city["storeys_of_archetype"].values[city["archetype_index"].values]
    padded = np.arange(3) >= storeys[:, None]
    np.testing.assert_array_equal(np.isnan(city["peak_storey_drift_ratio"]), padded)
    assert "structure" not in city.variables
    assert (city["status"] <= 1).all()
    # A law's parameters are NaN where the building has none; elastic storeys do not yield.
    linear = rows_of(CITY, "linear", each)
    assert np.isnan(city["yield_force"][linear]).all()
    np.testing.assert_array_equal(city["mass"][linear, 0], np.repeat(np.float32([1e3, 2e3]), each))
    assert f"{25 * each} samples" in wd.summary(city)


def test_buildings_of_one_kernel_share_their_runs(city, monkeypatch):
    # low; house and again; table and high; smooth; linear: seven archetypes, five kernels, one step each.
    assert city.attrs["groups"] == 5
    assert city.attrs["kernel"].count(";") == 4
    runs = []

    def count(host, job, structures, *settings, **options):
        runs.append(len(structures))
        return original(host, job, structures, *settings, **options)

    original = regions.Region
    monkeypatch.setattr(workers, "Region", count)
    kinds = [chain(1), chain(2), chain(3)]
    # 300 archetypes whose strengths differ, and whose periods do within an octave.
    many = {f"{i}": wd.Archetype(replaced(kinds[i % 3], 1 + i / 1000), 2, SCATTER) for i in range(300)}
    short = wd.Cloud([MOTIONS[0]])
    run = simulate(wd.Portfolio(many), short, recorders=("drift",), tail=0.0, device="cpu")
    assert run.sizes["sample"] == 600
    assert len(runs) <= 6
    assert sum(runs) == 600


def test_whatever_a_building_is_beside_its_parameters_decides_on_its_group():
    # All buildings of a group are built like its first one. Whoever gives ShearBuilding one more attribute must have
    # `groups_of` tell buildings apart by it, and add it here.
    derived = {"inherent_damping"}  # from these
    told_apart = {"storeys", "storey_laws", "devices", "damping", "damping_modes", "damped_storeys", "own_storeys"}
    assert set(vars(chain(2))) == told_apart | {"parameters", "parameter_table", "law", "storey_law", *derived}
    kinds = [chain(3), chain(3, damping_modes=(1, 3)), chain(3, damping="modal"), chain(3, law="bouc_wen"), chain(2)]
    kinds.append(chain(3, law="bouc_wen", exponent=2.0))  # which has a kernel of its own
    kinds += [chain(3, damped_storeys=(1, 3)), chain(3, damped_storeys=(2, 3)), chain(3, gravity_load=1e3)]
    damper = {"devices": ("friction_damper",), "slip_force": 1e3, "brace_stiffness": 1e6}
    kinds += [chain(3, **damper), chain(3, law=("elastic", "bilinear", "bilinear"))]
    kinds.append(chain(3, law=("bilinear", "elastic", "bilinear")))
    # Linear dampers are dashpots, those of a power have a kernel of their own.
    viscous = {"devices": ("viscous_damper",), "damper_coefficient": 2e4}
    kinds += [chain(3, **viscous, velocity_exponent=exponent) for exponent in (1.0, 0.4)]
    city = wd.Portfolio({f"{i}": wd.Archetype(kind) for i, kind in enumerate(kinds)})
    archetypes = checked_archetypes(wd.Scene(city, MOTIONS[0]), "rk4")
    assert len(groups_of(city, archetypes, Integration(step=0.001), 0)) == len(kinds)


def replaced(building, factor):
    return chain(building.storeys, 6e5 * factor, yield_force=4e3 * factor)


def test_steps_are_round_and_at_most_an_archetypes_own(city):
    for name in ("low", "house", "high", "smooth"):
        own = ARCHETYPES[name].building.fundamental_period / STEPS_PER_PERIOD
        # The motions' own steps, 20, 5 and 10 ms, divide by 10 ms over a power of 2 from 5 ms on.
        step = city["integration_step"][rows_of(CITY, name, 6)].values.max()
        assert own / 2 < step <= own
        assert step in (ROUND_STEP / 2, ROUND_STEP / 4)
    coarse = simulate(CITY, MOTIONS[1], step=0.005, device="cpu", **SETTINGS)
    assert (coarse["integration_step"] == 0.005).all()
    assert coarse.attrs["groups"] == 5


def test_no_other_building_changes_a_bit(city):
    # Another order, and a part of them: where nothing is drawn, the number of a building does not matter.
    names = ["again", "table", "house", "linear"]
    part = simulate(wd.Portfolio({name: ARCHETYPES[name] for name in names}), STRIPES, device="cpu", seed=1, **SETTINGS)
    for name in names:
        first = part.isel(sample=rows_of(wd.Portfolio({key: ARCHETYPES[key] for key in names}), name, 6))
        second = city.isel(sample=rows_of(CITY, name, 6))
        for key in set(part.data_vars) - {"motion_name", "motion_step", "motion_peak_acceleration"}:
            if part[key].dims[0] == "sample":
                np.testing.assert_array_equal(first[key].values, second[key].values, err_msg=key)


def test_dampers_of_another_kind_beside_it_change_no_bit_of_a_building():
    viscous = {"devices": ("viscous_damper",), "damper_coefficient": 2e4}
    linear, power = (wd.Archetype(chain(2, **viscous, velocity_exponent=exponent)) for exponent in (1.0, 0.4))
    settings = {"recorders": ("drift",), "tail": 0.0, "device": "cpu"}
    both = simulate(wd.Portfolio({"linear": linear, "power": power}), MOTIONS[0], **settings)
    for place, archetype in enumerate((linear, power)):
        alone = simulate(wd.Portfolio({"alone": archetype}), MOTIONS[0], **settings)
        np.testing.assert_array_equal(both["peak_storey_drift"][place], alone["peak_storey_drift"][0])


@pytest.mark.meant_as_given("yield_base_shear_coefficient", "yield_drift_ratio", "no_damping")
def test_damage_of_another_archetype_changes_no_bit_of_a_building():
    # Laws that count reversals run far samples again in float64, and take shorter steps: their neighbours do not.
    def archetype(damage):
        own = {"ductility_2": 3.0, "force_ratio_2": 1.2, "ductility_3": 12.0, "force_ratio_3": 1.3}
        own |= {"pinching_drift": 0.6, "pinching_force": 0.4, "damage_by_ductility": 0.0, "damage_by_energy": damage}
        building = wd.ShearBuilding(1e5, 4e7, 3.0, law="hysteretic", yield_force=2e4, **own)
        return wd.Archetype(building, count=16, scatter={"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.5))})

    time = np.arange(0, 6, 0.01)
    pulse = 6 * np.random.default_rng(1).normal(size=time.size) * np.exp(-(((time - 3) / 1.5) ** 2))
    design = wd.Cloud([wd.GroundMotion(pulse, 0.01)])
    alone, beside = (
        wd.simulate(wd.Scene(wd.Portfolio(kinds), design, recorders=("drift",)), device="cpu")
        for kinds in ({"a": archetype(0.0)}, {"a": archetype(0.0), "b": archetype(0.1)})
    )
    found = wd.select_archetype(beside, "a")
    for name in ("peak_storey_drift", "integration_step", "unreliable"):
        np.testing.assert_array_equal(found[name], alone[name])


def test_draws_go_by_seed_and_number_alone():
    values = parameters_of(CITY, "high", 5)
    assert values["stiffness"].shape == (3, 3)
    assert values["damping_ratio"].shape == (3,)
    # Ten buildings stand before "high"; of one archetype with as many before it they are the same.
    others = wd.Portfolio({"before": wd.Archetype(chain(4), 10, SCATTER), "high": ARCHETYPES["high"]})
    for key, value in values.items():
        np.testing.assert_array_equal(parameters_of(others, "high", 5)[key], value, err_msg=key)
    fewer = wd.Portfolio({"before": wd.Archetype(chain(4), 9, SCATTER), "high": ARCHETYPES["high"]})
    np.testing.assert_array_equal(parameters_of(fewer, "high", 5)["mass"][1:], values["mass"][:2])
    assert not np.array_equal(parameters_of(CITY, "high", 6)["mass"], values["mass"])
    # Buildings of two archetypes of one scatter are drawn apart.
    twins = wd.Portfolio({"a": wd.Archetype(chain(1), 4, SCATTER), "b": wd.Archetype(chain(1), 4, SCATTER)})
    factors = np.concatenate([parameters_of(twins, name, 0)["mass"][:, 0] for name in "ab"])
    assert np.unique(factors).size == 8


def test_each_building_can_have_a_motion_of_its_own():
    motion = np.arange(CITY.buildings) % 3
    scale = np.linspace(0.5, 2, CITY.buildings)
    run = simulate(CITY, wd.OneMotionPerStructure(MOTIONS, motion, scale), device="cpu", seed=5, **SETTINGS)
    np.testing.assert_array_equal(run["motion_index"], motion)
    np.testing.assert_allclose(run["scale_factor_of_motion"], scale)
    name = "high"
    part = run.isel(sample=rows_of(CITY, name, 1))
    own = wd.OneMotionPerStructure(MOTIONS, motion[10:13], scale[10:13])
    scatter = {key: wd.GivenValues(value) for key, value in parameters_of(CITY, name, 5).items()}
    scene = wd.Scene(ARCHETYPES[name].building, own, scatter, **SETTINGS)
    alone = wd.simulate(scene, structures=3, longest_step=part["integration_step"].values.max(), device="cpu")
    assert_same(part, alone)
    # Drawn ones go by the building's number, too.
    drawn = simulate(CITY, wd.OneMotionPerStructure(MOTIONS), device="cpu", seed=5, **SETTINGS)
    expected = wd.OneMotionPerStructure(MOTIONS).assign(np.arange(CITY.buildings), 5)
    np.testing.assert_array_equal(drawn["motion_index"], expected.motion)


@pytest.mark.parametrize("keep_inputs", [True, False])
def test_the_file_is_what_the_run_in_memory_is(keep_inputs, city, tmp_path, monkeypatch):
    monkeypatch.setattr("warpdyn.campaigns.portfolio.labels.SAMPLES_AT_A_TIME", 7 * 6)  # ends within an archetype
    # Three of the five kernels: the estimate of the error has as many again.
    names = ("low", "table", "linear")
    few = wd.Portfolio({name: ARCHETYPES[name] for name in names})
    settings = {"keep_inputs": keep_inputs, "checked_share": 0.1, "memory": 10**9, **SETTINGS}
    held = simulate(few, STRIPES, seed=5, device="cpu", **settings)
    with simulate(few, STRIPES, seed=5, device="cpu", path=tmp_path / "run.nc", **settings) as read:
        assert os.listdir(tmp_path) == ["run.nc"]
        assert set(read.variables) == set(held.variables)
        assert set(read.attrs) == set(held.attrs)
        for name in held.variables:
            xr.testing.assert_identical(read[name].load().drop_attrs(), held[name].drop_attrs())
            # HDF5 keeps the order of attributes only where they are few and short.
            assert str(sorted(read[name].attrs.items())) == str(sorted(held[name].attrs.items())), name
    assert ("mass" in held) == keep_inputs
    with xr.open_dataset(wd.write(held, tmp_path / "again.nc")) as again:
        xr.testing.assert_identical(again.load(), held)
    # The error of a portfolio is no less than that of any of its archetypes.
    errors = held["estimated_relative_error"].sel(demand="peak_storey_drift")
    assert 0 < float(errors.sel(error_statistic="median")) <= float(errors.sel(error_statistic="worst")) < 0.1
    assert "estimated relative error" in wd.summary(held)
    # Neither file nor estimate changes a bit of what is recorded.
    sampled = [name for name in held.data_vars if held[name].dims[0] == "sample"]
    assert {"status", "peak_storey_drift", "integration_step"} <= set(sampled)
    for archetype in names:
        part, whole = held.isel(sample=rows_of(few, archetype, 6)), city.isel(sample=rows_of(CITY, archetype, 6))
        for name in sampled:
            np.testing.assert_array_equal(part[name].values, whole[name].values, err_msg=name)


def test_a_portfolio_that_was_stopped_goes_on_from_its_finished_groups(tmp_path, monkeypatch, caplog):
    def stop(self, sink, part, place, report):
        take(self, sink, part, place, report)
        taken.append(part.number)
        if len(taken) == 2:
            raise KeyboardInterrupt

    taken, take = [], module.Run.take
    monkeypatch.setattr(module.Run, "take", stop)
    path = wd.write(xr.Dataset({"x": 1.0}), tmp_path / "run.nc")
    before = path.read_bytes()
    settings = {"tail": 0.0, "recorders": ("drift",), "device": "cpu"}
    with pytest.raises(FileExistsError, match="contains another run"):
        simulate(CITY, MOTIONS[0], path=path, **settings)
    with pytest.raises(KeyboardInterrupt):
        simulate(CITY, MOTIONS[0], path=path, overwrite=True, **settings)
    assert sorted(os.listdir(tmp_path)) == [".run.nc.unfinished", "run.nc"]
    assert path.read_bytes() == before
    with simulate(CITY, MOTIONS[0], path=path, overwrite=True, **settings) as read:
        assert "resumes after the 12 of 25 structures" in caplog.text  # 5 of one storey, 7 of two
        assert taken == [0, 1, 2, 3, 4]  # each group once
        held = simulate(CITY, MOTIONS[0], **settings)
        for name in held.variables:
            np.testing.assert_array_equal(read[name].values, held[name].values, err_msg=name)
        assert read.attrs["fingerprint"] == held.attrs["fingerprint"]
    assert os.listdir(tmp_path) == ["run.nc"]


def test_attributes_hold_what_there_is_of_all_groups(city):
    # Every group has the round step that its archetypes' lead to: all of them are told, as the steps are.
    assert set(np.atleast_1d(city.attrs["longest_step"])) <= {ROUND_STEP / 2, ROUND_STEP / 4}
    runs = [xr.Dataset(attrs=city.attrs | {"method": name}) for name in ("rk4", "dormand_prince54", "dormand_prince54")]
    runs[1].attrs["tolerance"], runs[2].attrs["tolerance"] = 1e-6, 1e-5
    found = common_attributes(runs, 0.0)
    assert found["method"] == "rk4; dormand_prince54"
    assert found["tolerance"].tolist() == [1e-6, 1e-5]
    assert "target_error" not in found


def test_a_plan_is_made_for_each_group(monkeypatch):
    monkeypatch.setattr(pilot, "CANDIDATES", ("exact", "rk4"))  # of which one suits the linear group alone
    two = wd.Portfolio({name: ARCHETYPES[name] for name in ("house", "linear")})
    run = simulate(two, MOTIONS[0], recorders=("drift",), tail=0.0, device="cpu", target_error=0.05)
    assert run.attrs["target_error"] == 0.05
    assert run.attrs["groups"] == 2
    assert np.isfinite(run["peak_storey_drift"].values).all()


def test_unstable_steps_are_seen_to_and_say_whose_they_are():
    # A stiff building at a step far beyond its limit, beside a soft one that it suits.
    stiff = chain(1, 2e8, yield_force=1e7)
    city = wd.Portfolio({"soft": wd.Archetype(chain(2)), "stiff": wd.Archetype(stiff, 2)})
    settings = {"step": 0.02, "recorders": ("drift",), "device": "cpu", "tail": 1.0}
    with pytest.warns(UserWarning, match=r"2 buildings of 1 storey \(archetype 'stiff'\): the step is beyond"):
        run = simulate(city, MOTIONS[0], **settings)
    np.testing.assert_array_equal(run["status"], [0, 0, 0])
    assert run["integration_step"][0] == 0.02
    assert (run["integration_step"][1:] < 0.01).all()
    with pytest.raises(ValueError, match=r"archetype 'stiff'.*sample 0"):
        simulate(city, MOTIONS[0], on_unstable="raise", **settings)


def test_one_bar_shows_how_far_all_groups_are(monkeypatch):
    bars = []

    def make(**settings):
        bars.append(tqdm(**settings, file=io.StringIO()))
        return bars[-1]

    monkeypatch.setattr("warpdyn.foundations.core.progress.tqdm", make)
    for _ in range(2):
        simulate(CITY, MOTIONS[0], recorders=("drift",), tail=0.0, device="cpu")
    wd.simulate(wd.Scene(chain(1), MOTIONS[0], recorders=("drift",), tail=0.0), device="cpu")
    assert [bar.total for bar in bars] == [25, 25, 1]


def test_a_thousand_archetypes_are_laid_out_in_seconds():
    city = {f"{i}": wd.Archetype(chain(1 + i % 2, 6e5 * (1 + i / 1e4)), 3, SCATTER) for i in range(1000)}
    motion = make_motion(0.02, 30, 4)
    run = simulate(wd.Portfolio(city), motion, recorders=("drift",), tail=0.0, device="cpu")
    assert run.sizes["sample"] == 3000
    assert run.attrs["groups"] <= 4
    assert len(run.attrs["scene"]) > 100_000  # and is written, all the same
