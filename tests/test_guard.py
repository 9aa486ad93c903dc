"""The guard: what it does where a step is beyond a structure's limit, and what it promises over many buildings."""

import numpy as np
import pytest
from building_sweep import BROKEN, sweep

import warpdyn as wd
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.integration.stability_guard import SAMPLES_OF_A_RANGE, Reruns
from warpdyn.campaigns.integration.time_grid import Schedule
from warpdyn.foundations.core.output_variables import UNSTABLE_STEP

pytestmark = pytest.mark.meant_as_given(
    "damping_ratio",
    "first_period",
    "initial_velocity",
    "no_damping",
    "storey_height",
    "yield_base_shear_coefficient",
    "yield_drift_ratio",
)

LIMIT = 2.82842712474619  # of w h, RK4 without damping


def oscillators(frequencies, duration=40.0, **building):
    """Return a scene of undamped oscillators of 1 kg in free vibration."""
    scatter = {"stiffness": wd.GivenValues(np.square(frequencies))}
    return wd.Scene(
        wd.ShearBuilding([1.0], 1.0, 1.0, **building), wd.FreeVibration(duration, velocity=1.0), scatter=scatter
    )


def test_unstable_samples_alone_take_the_fewest_steps_that_hold():
    frequencies = np.array([1.0, 0.99 * LIMIT, 1.01 * LIMIT, 1.99 * LIMIT, 2.01 * LIMIT, 7.5 * LIMIT])
    with pytest.warns(UserWarning, match="beyond the stability limit of 4 of 6 samples.* up to 8 times"):
        run = wd.simulate(oscillators(frequencies), structures=6, step=1.0, dtype="float64", device="cpu")
    np.testing.assert_allclose(1 / run["integration_step"], [1, 1, 2, 2, 3, 8], rtol=1e-12)
    assert np.all(run["status"] == 0)
    # What none of them may do is grow: the amplitude of free vibration is v / w, and steps only lower it.
    assert np.all(run["peak_storey_drift"].values[:, 0] <= 1.0 / frequencies * 1.001)
    assert run.attrs["on_unstable"] == "substep"


def test_a_sample_without_need_is_the_same_bits_as_ever():
    frequencies = np.array([1.0, 2.0, 5.0])
    with pytest.warns(UserWarning, match="1 of 3 samples"):
        run = wd.simulate(oscillators(frequencies), structures=3, step=1.0, dtype="float64", device="cpu")
    alone = wd.simulate(oscillators(frequencies[:2]), structures=2, step=1.0, dtype="float64", device="cpu")
    for name in ("peak_storey_drift", "residual_drift_ratio", "viscous_energy", "integration_step"):
        assert np.array_equal(run[name].values[:2], alone[name].values), name


def test_raise_names_the_sample_its_period_and_the_step_that_holds():
    frequencies = np.array([1.0, 4.0, 8.0])
    with pytest.raises(ValueError, match=r"2 of 3 samples, the first of them sample 1") as told:
        wd.simulate(oscillators(frequencies), structures=3, step=1.0, on_unstable="raise")
    assert f"first period {2 * np.pi / 4:.4g} s" in str(told.value)
    holds = float(str(told.value).split("Give a step= of at most ")[1].split(" s")[0])
    assert holds == pytest.approx(LIMIT / 8, rel=2.2e-3)  # what the engine's table may lie below the limit
    run = wd.simulate(
        oscillators(frequencies, 39.9), structures=3, step=39.9 / np.ceil(39.9 / holds), on_unstable="raise"
    )
    assert np.all(run["status"] == 0)


def test_flag_runs_them_and_keeps_nothing_of_them():
    with pytest.warns(UserWarning, match="1 of 2 samples; their status is unstable_step"):
        run = wd.simulate(oscillators([1.0, 4.0]), structures=2, step=1.0, on_unstable="flag")
    assert run["status"].values.tolist() == [0, 3]
    assert np.isnan(run["peak_storey_drift"].values[1, 0])


def test_a_method_without_a_stable_step_is_refused():
    for on_unstable in ("substep", "raise"):
        with pytest.raises(ValueError, match=r"'heun' amplifies sample 0 at any step.*'rk4'"):
            wd.simulate(oscillators([1.0]), step=0.01, method="heun", on_unstable=on_unstable)
    with pytest.raises(ValueError, match=r"on_unstable.*'substep', 'raise', 'flag'|on_unstable.*substep.*raise.*flag"):
        wd.simulate(oscillators([1.0]), on_unstable="ignore")


@pytest.mark.parametrize("method", ["newmark_average", "hht_alpha", "generalised_alpha", "wilson_theta", "exact"])
def test_methods_without_a_limit_take_the_step_asked_for(method):
    run = wd.simulate(oscillators([1.0, 400.0]), structures=2, step=1.0, method=method, on_unstable="raise")
    assert np.all(run["integration_step"] == 1.0)
    assert np.all(run["status"] == 0)


def test_a_storey_that_unloads_stiffer_is_held_by_that_stiffness():
    # gamma < beta: unloading from its bound a Bouc-Wen storey is 2 beta / (beta + gamma) times as stiff as at first.
    building = wd.ShearBuilding(
        [1.0], 1.0, 1.0, law="bouc_wen", yield_force=0.1, hardening_ratio=0.0, beta=0.9, gamma=0.1, exponent=1.0
    )
    scene = wd.Scene(building, wd.FreeVibration(40.0, velocity=1e-3))
    assert wd.simulate(scene, step=2.0, on_unstable="raise").status.item() == 0
    with pytest.raises(ValueError, match=r"at most 2\.1"):  # 2.828 / sqrt(1.8) = 2.108
        wd.simulate(scene, step=2.5, on_unstable="raise")


def test_steps_that_do_not_divide_cost_the_order_and_must_be_asked_for():
    # TRUTHS: h = 0.0016 s on a record of 0.02 s errs by 1e-6 where 4e-9 was due. Cutting the corners costs as much.
    wave = 3 * np.random.default_rng(0).normal(size=400)
    scene = wd.Scene(wd.ShearBuilding([1.0], 160.0, 1.0), wd.GroundMotion(wave, 0.02), recorders=("drift",))

    def peak(**settings):
        return wd.simulate(scene, dtype="float64", device="cpu", **settings)["peak_storey_drift"].item()

    with pytest.raises(ValueError, match=r"0.0016 s does not divide .* 0.02 s.*resample=True"):
        peak(step=0.0016)
    with pytest.raises(ValueError, match="resample needs step="):
        peak(resample=True)
    with pytest.raises(ValueError, match="step= and longest_step= cannot be combined"):
        peak(step=0.001, longest_step=0.001)
    assert peak(step=0.002, resample=True) == peak(step=0.002)  # one that divides is not resampled
    assert peak(longest_step=0.0021) == peak(step=0.002)
    truth, divided, cut = peak(step=0.00025), peak(step=0.002), peak(step=0.0016, resample=True)
    assert abs(cut / truth - 1) > 3 * abs(divided / truth - 1)
    assert abs(cut / truth - 1) < 1e-2


def test_bouc_wen_beyond_its_own_limit_is_run_again_at_shorter_steps():
    # It slides at 1 m/s over a yield drift of 10 mm: stable at h < 2.785 uy / (n |v|), 13.9 ms with n = 2.
    building = wd.ShearBuilding(
        1e9, 1e3, 1.0, law="bouc_wen", yield_force=10.0, hardening_ratio=0.0, exponent=2.0, damping="none"
    )
    run = wd.simulate(wd.Scene(building, wd.FreeVibration(4.0, velocity=1.0)), step=0.05, dtype="float64", device="cpu")
    assert run.status.item() == 0
    assert run["integration_step"].item() == pytest.approx(0.05 / 4)
    assert run["hysteretic_energy"].item() == pytest.approx(40, rel=0.02)  # 10 N over 4 m


@pytest.mark.parametrize(("samples", "steps"), [(96, 9000), (1, 9000), (1, 5_000_000), (40_000, 300)])
def test_reruns_are_bounded_by_steps(samples, steps, monkeypatch):
    """If all samples fail for ever, each rerun takes at most twice the steps of each range, or some seconds."""
    rerun = []

    def integrate(self, chosen):
        rerun.append((chosen.size, int(self.schedule.substeps[chosen].max()) * steps))
        return {"status": np.full(chosen.size, UNSTABLE_STEP, dtype=np.int8)}

    monkeypatch.setattr(Ensemble, "integrate", integrate)
    building = wd.ShearBuilding([1.0] * 3, 100.0, 1.0)
    run, _ = prepare(wd.Scene(building, wd.FreeVibration(1.0, velocity=1.0)), structures=samples, device="cpu")
    every = np.ones(samples, dtype=np.int32)
    run.schedule = Schedule(steps * every, every, 1.0 / steps * every, every)
    Reruns().settle(run, np.arange(samples), integrate(run, np.arange(samples)))
    assert 1 < len(rerun) <= 11
    for number, (count, length) in enumerate(rerun[1:], start=1):
        assert length == 2**number * steps
        rows = -(-count // 16)
        ranges = -(-samples // SAMPLES_OF_A_RANGE)
        each = -(-min(samples, SAMPLES_OF_A_RANGE) // 16)  # rows of a range
        assert 3 * 16 * rows * length <= ranges * max(3e7, 3 * 2 * 16 * each * steps), number


@pytest.mark.parametrize("storeys", [(3,), pytest.param((1, 5), marks=pytest.mark.thorough)], ids=str)
def test_what_the_guard_promises_over_random_buildings(storeys):
    counts = sweep(storeys, count=20)
    assert counts["buildings"] == len(storeys) * 3 * 2 * 20
    assert counts["unstable"] == pytest.approx(BROKEN * counts["buildings"], rel=0.02)
    assert counts["diverged_substep"] == counts["not_finite_ok"] == counts["diverged_unflagged"] == 0
    assert counts["garbage_substep"] == 0  # and none of those given more steps stays bounded and wrong
    assert counts["right"] > 0  # the share below is of something
    assert counts["right_flagged"] < 0.05 * counts["right"]
