"""The search for each step's end by implicit methods: tangents, yielding, failure, and what it costs in accuracy."""

import warnings

import numpy as np
import pytest
import warp as wp
from law_rows import SPRINGS
from method_sources import thorough_unless
from scipy.integrate import solve_ivp
from three_storeys import (
    AMPLITUDE,
    FREQUENCY,
    HARDENING,
    HEIGHT,
    IMPLICIT,
    INTERVAL,
    MASS,
    STIFFNESS,
    STRENGTH,
    TAIL,
    YIELDING_DAMPING,
    building,
    histories,
)

import warpdyn as wd
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.model.scene.scene import SPECTRA

pytestmark = pytest.mark.meant_as_given(
    "damping_ratio", "first_period", "initial_velocity", "record_step", "storey_height", "yield_base_shear_coefficient"
)

every_method = pytest.mark.parametrize("method", IMPLICIT)

DEMANDS = [
    name
    for recorder, variables in RECORDERS["chain"].items()
    if recorder != SPECTRA  # needs periods
    for name in variables
    if name != "residual_drift"
]


@pytest.mark.parametrize("method", [thorough_unless(name == "newmark_average", name) for name in IMPLICIT])
def test_bouc_wen_against_scipy(method):
    beta, gamma, exponent = 0.6, 0.3, 1.5
    # The storeys push along for half a second and back.
    duration, yield_drift = 1.5, STRENGTH / STIFFNESS

    def slope(time, y):
        drift, rate, z = np.diff(y[:3], prepend=0), np.diff(y[3:6], prepend=0), y[6:]
        force = HARDENING * STIFFNESS * drift + (1 - HARDENING) * STRENGTH * z
        net = AMPLITUDE * np.sin(FREQUENCY * time) - force + np.append(force[1:], 0)
        bend = np.abs(z) ** exponent * (beta * np.abs(rate) * np.sign(z) + gamma * rate)
        return np.concatenate([y[3:6], net / MASS, (rate - bend) / yield_drift])

    time = 0.01 * np.arange(151)
    exact = solve_ivp(slope, (0, duration), np.zeros(9), "DOP853", t_eval=time, rtol=1e-9, atol=1e-12, max_step=1e-3).y
    parameters = {"beta": beta, "gamma": gamma, "exponent": exponent}
    chain = wd.ShearBuilding(
        MASS, STIFFNESS, HEIGHT, law="bouc_wen", yield_force=STRENGTH, hardening_ratio=HARDENING, **parameters
    )
    assert (np.abs(np.diff(exact[:3], axis=0, prepend=0)).max(axis=1) > 1.5 * yield_drift).any()
    errors = []
    for every in (2, 4, 8):
        load = wd.HarmonicForce(AMPLITUDE, FREQUENCY, duration)
        run = histories(chain, load, 0.01 / every, method)
        errors.append(np.abs(run.displacement[::every] - exact[:3].T).max() / np.abs(exact[:3]).max())
    assert errors[-1] < 2e-3
    # Corners of the law where a storey turns within a step leave the order as it is, but not its constant.
    assert np.log2(errors[0] / errors[2]) / 2 == pytest.approx(2, abs=0.2)


# The tests of the other laws look at slopes along paths.
@pytest.mark.parametrize(
    "row", ["elastic", "bilinear", "bouc_wen_1_elastic_unloading", "bouc_wen_1", "bouc_wen_2", "bouc_wen"]
)
def test_tangents_are_the_slopes_of_forces(row):
    spring = SPRINGS[row]
    force, tangent, advance, C = spring.force, spring.tangent, spring.memory_after or spring.force, spring.coefficients
    HAS_MEMORY = spring.memory_after is not None
    coefficient_vector = wp.types.vector(length=C, dtype=wp.float64)
    memory_vector = wp.types.vector(length=1, dtype=wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        drift: wp.array(dtype=wp.float64),
        increment: wp.array(dtype=wp.float64),
        memory: wp.array(dtype=wp.float64),
        coefficients: wp.array(dtype=wp.float64),
        result: wp.array2d(dtype=wp.float64),
    ):
        i = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q]
        before = memory_vector(memory[i])
        after = before
        if HAS_MEMORY:
            after = advance(drift[i], increment[i], before, c)
        result[0, i] = force(drift[i], after, c)
        result[1, i] = tangent(drift[i], increment[i], before, after, c)

    # 100 N/m and a tenth of it after yield at 0.01 m, with a yield force of 1 N.
    coefficients = {"elastic": [100.0], "bilinear": [10.0, 90.0, 0.01]}.get(row, [10.0, 0.9, 100.0, 0.6, 0.3])
    coefficients = coefficients[:C] + ([1.5] if row == "bouc_wen" else [])
    coefficients += [1.0] * (C - len(coefficients))
    random = np.random.default_rng(0)
    increment = random.uniform(-0.001, 0.001, 200)
    memory = random.uniform(-0.02, 0.02, 200) if row == "bilinear" else random.uniform(-1, 1, 200)
    start = random.uniform(-0.02, 0.02, 200)
    change = 1e-7
    forces = []
    for nudge in (-change, 0.0, change):
        values = (start + increment + nudge, increment + nudge, memory, coefficients)
        result = wp.full((2, 200), np.nan, dtype=wp.float64, device="cpu")
        arrays = [wp.array(x, dtype=wp.float64, device="cpu") for x in values]
        wp.launch(loaded(evaluate), dim=200, inputs=[*arrays, result], device="cpu")
        forces.append(result.numpy()[0])
        if nudge == 0:
            found = result.numpy()[1]
    away = (
        np.abs(np.abs(start + increment - memory) - 0.01) > change if row == "bilinear" else np.abs(increment) > change
    )
    assert away.sum() > 190
    # Exact but for rounding; Bouc-Wen's is that of the law itself, of which a Runge-Kutta step past z = 0 is a bit off.
    tolerance = 1e-6 if row in ("elastic", "bilinear") else 0.01
    np.testing.assert_allclose(found[away], (forces[2] - forces[0])[away] / (2 * change), rtol=tolerance)


SCATTER = {
    "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.5)),
    "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.5)),
    "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.5)),
}


def frame(storeys, law="bilinear", damping="rayleigh", ratio=0.03):
    strength = {"yield_force": 1e4, "hardening_ratio": 0.01} if law != "elastic" else {}
    return wd.ShearBuilding(np.full(storeys, 1e3), 4e6, 3.0, law=law, damping=damping, damping_ratio=ratio, **strength)


@pytest.mark.meant_as_given("peak_ground_acceleration")
def test_long_steps_between_yield_and_reversal_converge():
    """Newton's iteration alone would go from one side of a yield point to the other and back for ever."""
    motion = wd.GroundMotion(8 * np.random.default_rng(3).normal(size=100), 0.2)
    scene = wd.Scene(frame(8), motion, scatter=SCATTER, recorders=("drift",), tail=0.0)
    kept = wd.Histories(tuple(range(32)))
    options = {"structures": 32, "step": 0.2, "dtype": "float64", "device": "cpu", "histories": kept}
    run = wd.simulate(scene, method="newmark_average", **options)
    assert (run.status == 0).all()
    assert (run.peak_storey_drift > 3 * 1e4 / 4e6).any("storey").all()
    # The rule's own velocities, v1 = v0 + h (a0 + a1) / 2, with accelerations by the equation of motion.
    relative = run.acceleration.values - motion.acceleration[:, None]
    change = 0.1 * (relative[:, 1:] + relative[:, :-1])
    velocity = run.velocity.values
    np.testing.assert_allclose(np.diff(velocity, axis=1), change, rtol=0, atol=1e-9 * np.abs(velocity).max())


def test_not_converged_is_flagged():
    # Sixty storeys damped critically in every mode: over a long step most of the damping is beyond the three diagonals
    # that the search solves with, and each correction takes off little of the error.
    motion = wd.GroundMotion(np.sin(np.arange(20)), 1.0)
    scene = wd.Scene(frame(60, "elastic", "modal", 0.95), motion, recorders=("drift",), tail=0.0)
    options = {"step": 1.0, "method": "newmark_average", "dtype": "float64", "device": "cpu"}
    with pytest.warns(UserWarning, match="1 of 1 samples is flagged not_converged"):
        run = wd.simulate(scene, on_unstable="flag", **options)
    assert run.status.item() == 4
    assert run.status.attrs["flag_meanings"].split()[4] == "not_converged"
    assert np.isnan(run.peak_storey_drift).all()
    # What is left to the engine is run again at a shorter step.
    run = wd.simulate(scene, **options)
    assert run.status.item() == 0
    assert run.integration_step.item() < 1.0


@pytest.mark.meant_as_given("peak_ground_acceleration", "yield_drift_ratio")
@pytest.mark.parametrize("step", [0.005, 0.001])
def test_a_step_without_a_solution_is_flagged_and_an_explicit_method_recommended(step):
    # When the energy capacity of the storey is exhausted, its force jumps to zero: no acceleration at the end of the
    # step fits the force there, however short the step is.
    drift, lasting = 0.015, 8 * 0.015
    deteriorating = {
        "plastic_drift_to_capping": 4 * drift,
        "post_capping_drift": 15 * drift,
        "capping_force_ratio": 1.15,
        "residual_force_ratio": 0.2,
        **{f"{mode}_deterioration_drift": lasting for mode in ("strength", "post_capping", "unloading")},
    }
    storey = wd.ShearBuilding(
        2e5, 3e7, 3.0, law="ibarra_medina_krawinkler_bilinear", yield_force=3e7 * drift, damping="rayleigh",
        damping_ratio=0.05, **deteriorating,
    )  # fmt: skip
    motions = [*wd.records.far_field()[:12]]
    stripes = wd.Stripes(motions, [0.8, 1.6], wd.SpectralAcceleration(storey.fundamental_period))
    scene = wd.Scene(storey, stripes, recorders=("drift",), tail=0.0)
    options = {"step": step, "dtype": "float64", "device": "cpu", "on_unstable": "flag"}
    with pytest.warns(UserWarning, match="flagged not_converged") as caught:
        run = wd.simulate(scene, method="newmark_average", **options)
    failed = (run.status == 4).values
    assert failed.any()
    [words] = [str(each.message) for each in caught if "not_converged" in str(each.message)]
    for part in ("energy capacity", "no solution", "a shorter step does not help", 'method="rk4"'):
        assert part in words
    assert "hinge" not in words
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Histories near the end of the energy capacity are sensitive to the step, which is another matter.
        warnings.filterwarnings("ignore", ".*samples (is|are) `unreliable`")
        followed = wd.simulate(scene, method="rk4", **options)  # what the message says
    assert (followed.status < 2).all()
    assert np.isfinite(followed.peak_storey_drift.values[failed]).all()


@pytest.mark.parametrize("share", [0.8, 1.02])
@pytest.mark.parametrize("exponent", [1.0, 2.0, 10.0])
def test_increment_too_long_for_bouc_wen_is_flagged(exponent, share):
    """A mass too heavy to be slowed slides at 1 m/s over a yield drift of 10 mm: h < 2.785 uy / (n |v|), as for RK4."""
    step = share * 2.785293563405282 * 0.01 / exponent
    slider = wd.ShearBuilding(1e9, 1e3, 1.0, law="bouc_wen", yield_force=10.0, hardening_ratio=0.0, exponent=exponent)
    scene = wd.Scene(slider, wd.FreeVibration(200 * step, velocity=1.0))
    options = {"step": step, "method": "newmark_average", "dtype": "float64", "device": "cpu", "on_unstable": "flag"}
    if share < 1:
        run = wd.simulate(scene, **options)
        assert run.status.item() == 0
        # The work done against the yield force; z comes to it from below within some yield drifts.
        assert run.hysteretic_energy.item() == pytest.approx(10 * 200 * step, rel=0.05)
    else:
        with pytest.warns(UserWarning, match="1 of 1 samples is flagged unstable_step"):
            assert wd.simulate(scene, **options).status.item() == 3


@pytest.mark.parametrize("method", [thorough_unless(name == "generalised_alpha", name) for name in IMPLICIT])
def test_energy_balance_closes_at_order_2(method):
    # From rest to rest, so that each term is smooth.
    pulse = 3.0 * np.sin(np.linspace(0, 3, 41) ** 2 * 3) * np.hanning(41)
    # The elastic chain, and the yielding ones by turns, are those of test_implicit.py, so that a kernel serves both.
    for law, damping in (("elastic", "rayleigh"), ("bilinear", YIELDING_DAMPING[method])):
        scene = wd.Scene(building(law, damping), wd.GroundMotion(pulse, INTERVAL), tail=TAIL)
        options = {"method": method, "dtype": "float64", "device": "cpu"}
        errors = [
            abs(wd.simulate(scene, step=step, **options).energy_balance_error.item()) for step in (0.005, 0.00125)
        ]
        assert errors[0] < 1e-3
        # A sixteenth is due; those of Wilson's method change sign on the way, and it comes to a ninth.
        assert errors[0] / errors[1] > (8 if method == "wilson_theta" else 14)


@pytest.mark.usefixtures("unoptimised")  # one run is held to another
@pytest.mark.parametrize(
    ("law", "damping"),
    [
        ("bouc_wen", "modal"),
        *(thorough_unless(False, *case) for case in (("elastic", "rayleigh"), ("bilinear", "modal"))),
    ],
)
def test_float32_follows_float64(law, damping):
    motion = wd.GroundMotion(np.sin(np.arange(300) * 0.3) + np.sin(np.arange(300) * 0.05), 0.02)
    scene = wd.Scene(frame(20, law, damping), motion, recorders=("drift", "acceleration"), tail=0.0)
    options = {"step": 0.02, "device": "cpu", "on_unstable": "flag"}
    for method in ("newmark_average", "generalised_alpha"):
        single, double = (wd.simulate(scene, method=method, dtype=dtype, **options) for dtype in ("float32", "float64"))
        assert single.status.item() == double.status.item() == 0
        # 300 steps of a few roundings of displacements, which are up to 20 drifts.
        scale = double.peak_storey_drift.max().item()
        np.testing.assert_allclose(single.peak_storey_drift, double.peak_storey_drift, rtol=0, atol=1e-4 * scale)


@pytest.mark.usefixtures("unoptimised")  # one run is held to another
@pytest.mark.parametrize(("law", "damping"), [("elastic", "storey"), ("bilinear", "rayleigh"), ("bouc_wen", "modal")])
def test_samples_of_a_launch_do_not_see_each_other(law, damping):
    # Runs of different lengths, some over before others yield, some with a load that ends in a jump.
    random = np.random.default_rng(5)
    motions = [wd.GroundMotion(size * random.normal(size=20 * size), 0.02, name=f"{size}") for size in (1, 2, 3, 5)]
    structure = building(law, damping)
    options = {"step": 0.01, "method": "hht_alpha", "device": "cpu"}
    together = wd.simulate(wd.Scene(structure, wd.Cloud(motions), tail=TAIL), structures=5, **options)
    assert (together.status == 0).all()
    for index, motion in enumerate(motions):
        alone = wd.simulate(wd.Scene(structure, motion, tail=TAIL), **options)
        for name in DEMANDS:
            for sample in np.flatnonzero(together.motion_index.values == index):
                np.testing.assert_array_equal(together[name][sample], alone[name][0], err_msg=name)
