"""Regulators, closed-loop eigenvalues and delay margins against values that were computed without warpdyn."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm
from validation import difference, relative_difference

import warpdyn as wd
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.engine.kernels.control.control_sampling import _sensed_motions
from warpdyn.foundations.core.output_variables import DIVERGED

control = wd.control
# The three-storey model building of Dyke, Spencer, Sain and Carlson (1996); its stiffness matrix is not that of a chain
# exactly: the second diagonal entry is 2 kN/m larger.
DYKE = wd.LumpedStructure(
    {"1": 98.3, "2": 98.3, "3": 98.3},
    [
        wd.Spring("first", {"1": 1.0}, stiffness=5.16e5, damping_coefficient=125.0),
        wd.Spring("second", {"2": 1.0, "1": -1.0}, stiffness=6.84e5, damping_coefficient=50.0),
        wd.Spring("third", {"3": 1.0, "2": -1.0}, stiffness=6.84e5, damping_coefficient=50.0),
    ],
    influence={"1": 1.0, "2": 1.0, "3": 1.0},
    stiffness_matrix=np.diag([0.0, 2e3, 0.0]),
)
BELOW = [control.Actuator({"1": -1.0})]  # a positive force pulls the first floor back, as in the paper
RECOMPUTED = "computed without warpdyn with SciPy, to 9 digits; the margin also from the characteristic roots"
DESIGNS = {  # weights -> gain, closed-loop roots with positive imaginary part, delay margin [s]
    "energy, R = 1e-4": (
        {"force_weight": 1e-4, "state_weight": "energy"},
        [-9290.11407, 9858.03934, -3042.04963, -1365.1125, -233.850988, -404.756868],
        [-1.8830773 + 34.284905j, -3.8433457 + 99.341122j, -2.8702835 + 148.51602j],
        0.0124503155,
    ),
    "energy, R = 1e-5": (
        {"force_weight": 1e-5},
        [-99895.2221, 114903.85, -39212.1342, -4789.27452, -589.958682, -1314.69282],
        [-5.8014865 + 34.297064j, -11.806003 + 99.394203j, -8.4061149 + 148.43813j],
        0.0086506233,
    ),
    "acceleration of the third floor": (
        {"force_weight": 1e-7, "acceleration_weight": [0.0, 0.0, 1.0]},
        [-8975982.48, 3568037.49, 5434190.55, -42032.5947, -167722.71, 150908.008],
        [-8.2354816 + 9.6840044j, -144.41296 + 96.378222j, -62.802195 + 220.41891j],
        0.0023513578,
    ),
}


@pytest.mark.parametrize("design", DESIGNS)
def test_lqr_of_the_three_storey_building(design, measured):
    weights, gain, roots, margin = DESIGNS[design]
    regulator = control.lqr(DYKE, BELOW, **weights)
    value = relative_difference(regulator.gain[0], gain)
    measured("gains of LQR, three-storey building", truth=RECOMPUTED, value=value, bound=1e-6)
    found = control.closed_loop_eigenvalues(DYKE, BELOW, regulator)
    found = found[found.imag > 0]
    value = difference(np.abs(np.sort_complex(found) / np.sort_complex(roots) - 1), np.zeros(3))
    measured("eigenvalues of closed loops, three-storey building", truth=RECOMPUTED, value=value, bound=1e-6)
    value = abs(control.delay_margin(DYKE, BELOW, regulator) / margin - 1)
    measured("delay margins of closed loops, three-storey building", truth=RECOMPUTED, value=value, bound=1e-6)


OSCILLATORS = [  # frequency, damping ratio, gain per mass of displacement or velocity, critical delay
    (6.283185307179586, 0.02, 0.0, 2.0, 0.23075898),
    (10.0, 0.05, 0.0, 8.0, 0.115168364),
    (6.283185307179586, 0.02, 10.0, 0.0, 0.0252651034),
    (6.283185307179586, 0.05, 39.0, 0.0, 0.0161656517),
]


def test_delay_margins_of_oscillators(measured):
    found, due = [], []
    for frequency, ratio, of_displacement, of_velocity, margin in OSCILLATORS:
        oscillator = wd.ShearBuilding(
            1e3, 1e3 * frequency**2, 3.0, damping="storey", damping_coefficient=2e3 * ratio * frequency
        )
        regulator = control.Regulator([[1e3 * of_displacement, 1e3 * of_velocity]])
        found.append(control.delay_margin(oscillator, [control.Actuator(1)], regulator))
        due.append(margin)
        w, z, g, p = frequency, ratio, of_velocity, of_displacement
        if g:
            root = np.sqrt(g**2 - (2 * z * w) ** 2)
            exact = np.arccos(-2 * z * w / g) / ((root + np.sqrt(root**2 + 4 * w**2)) / 2)
        else:
            root = np.sqrt(p**2 - 4 * z**2 * (1 - z**2) * w**4)
            squares = [s for s in (w**2 * (1 - 2 * z**2) + root, w**2 * (1 - 2 * z**2) - root) if s > 0]
            exact = min(np.arctan2(2 * z * w * s**0.5 / p, (s - w**2) / p) / s**0.5 for s in squares)
        assert exact == pytest.approx(margin, rel=1e-7)
    truth = "closed form of oscillators with delayed displacement or velocity feedback"
    measured("delay margins of oscillators", truth=truth, value=relative_difference(found, due), bound=1e-6)


def test_margins_without_crossing_and_of_unstable_loops():
    oscillator = wd.ShearBuilding(1e3, 4e4, 3.0, damping="storey", damping_coefficient=1e3)
    inner = [control.Actuator(1)]
    assert control.delay_margin(oscillator, inner, control.Regulator([[0.0, 500.0]])) == np.inf
    assert control.delay_margin(oscillator, inner, control.Regulator([[0.0, -2e3]])) == 0.0


CHAIN = wd.ShearBuilding([1e5, 8e4], [4e7, 3e7], 3.0, damping="storey", damping_coefficient=2e5)
TENDON = [control.Actuator(1)]


def integrated(function, end):
    return quad_vec(function, 0.0, end, epsrel=1e-12)[0]


def test_sampled_lqr_minimises_the_integral_of_the_sampled_system():
    interval = 0.05
    regulator = control.lqr(CHAIN, TENDON, force_weight=1e-8, sampling_interval=interval)
    system = control.state_space(CHAIN, TENDON)
    weight = np.zeros((5, 5))
    weight[:2, :2], weight[2:4, 2:4], weight[4, 4] = system.stiffness / 2, system.mass / 2, 1e-8
    held = np.zeros((5, 5))
    held[:4, :4], held[:4, 4:] = system.dynamics, system.input
    cost = integrated(lambda t: expm(held.T * t) @ weight @ expm(held * t), interval)
    step = expm(held * interval)[:4]
    value = np.zeros((4, 4))
    for _ in range(4000):  # value iteration: the Riccati recursion
        whole = cost + step.T @ value @ step
        gain = np.linalg.solve(whole[4:, 4:], whole[4:, :4])
        value = whole[:4, :4] - whole[:4, 4:] @ gain
    np.testing.assert_allclose(regulator.gain, gain, rtol=1e-6)


def test_lqg_has_the_gain_of_the_kalman_recursion():
    noise = {"acceleration": 0.02, "displacement": 1e-4}
    design = dict(force_weight=1e-9, sampling_interval=0.02, ground_noise=1e-2, sensor_noise=noise)
    regulator = control.lqg(CHAIN, TENDON, **design, sensor_dofs={"displacement": [1]})
    system = control.state_space(CHAIN, TENDON)
    a, pull = system.dynamics, system.ground
    growth = expm(0.02 * a)
    spread = integrated(lambda t: 1e-2 * np.outer(expm(a * t) @ pull, expm(a * t) @ pull), 0.02)
    rows = np.vstack([system.accelerations[0], np.eye(4)[1:2]])
    of_sensors = np.diag([0.02, 0.02, 1e-4]) ** 2
    covariance = np.eye(4)
    for _ in range(3000):
        kalman = covariance @ rows.T @ np.linalg.inv(rows @ covariance @ rows.T + of_sensors)
        covariance = growth @ (np.eye(4) - kalman @ rows) @ covariance @ growth.T + spread
    states = np.linalg.solve(growth, regulator.correction[:4])[:, [4, 5, 1]]
    np.testing.assert_allclose(states, kalman, rtol=1e-6, atol=1e-9 * np.abs(kalman).max())
    assert np.count_nonzero(regulator.gain) == 3  # the other sensor values are not used


def test_sampled_eigenvalues_tend_to_those_of_the_continuous_loop():
    regulator = control.lqr(CHAIN, TENDON, force_weight=1e-8)
    continuous = control.closed_loop_eigenvalues(CHAIN, TENDON, regulator)
    errors = []
    for interval in (0.002, 0.001):
        loop = control.Control(TENDON, regulator=regulator, sampling_interval=interval)
        found = np.log(control.sampled_eigenvalues(CHAIN, loop)[:4]) / interval
        errors.append(np.abs(found[np.argsort(found.imag)] - continuous[np.argsort(continuous.imag)]).max())
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.05)  # half an interval of delay: of first order


def test_a_sampled_loop_becomes_unstable_at_its_delay_margin():
    regulator = control.lqr(CHAIN, TENDON, force_weight=1e-9)
    margin, interval = control.delay_margin(CHAIN, TENDON, regulator), 0.0005
    stable = []
    for delay in (np.floor(0.98 * margin / interval), np.ceil(1.02 * margin / interval)):
        loop = control.Control(TENDON, regulator=regulator, sampling_interval=interval, delay=delay * interval)
        stable.append(abs(control.sampled_eigenvalues(CHAIN, loop)[0]) < 1)
    assert stable == [True, False]  # half an interval of delay by the hold is 1 % of the margin


def test_parameters_of_a_drawn_building():
    stiffer = wd.ShearBuilding([1e5, 8e4], [8e7, 6e7], 3.0, damping="storey", damping_coefficient=2e5)
    found = control.state_space(CHAIN, TENDON, {"stiffness": [8e7, 6e7]})
    for one, other in zip(found, control.state_space(stiffer, TENDON), strict=True):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(ValueError, match=r"no parameter 'stifness' \(did you mean 'stiffness'\?\)"):
        control.state_space(CHAIN, TENDON, {"stifness": 1.0})


def test_state_space_of_a_chain_is_that_of_its_lumped_structure():
    building = wd.ShearBuilding(
        [1e5, 9e4, 8e4], [4e7, 3e7, 2e7], 3.0, damping="rayleigh", damping_ratio=0.03, gravity_load=1e5
    )
    chain = control.state_space(building, [control.Actuator(2), control.Actuator({3: 1.0})])
    lumped = wd.lumped_chain(building)
    names = lumped.dof_names
    other = control.state_space(
        lumped, [control.Actuator({names[1]: 1.0, names[0]: -1.0}), control.Actuator({names[2]: 1.0})]
    )
    for one, same in zip(chain, other, strict=True):
        np.testing.assert_allclose(one, same, rtol=1e-9, atol=1e-12 * np.abs(one).max())


GOOD = dict(actuators=TENDON, regulator=control.Regulator([[0.0, 0.0, 1e4, 0.0]]), sampling_interval=0.02)
SKYHOOK = control.OnOffSkyhook(low=1e3, high=1e5)
DAMPER = [control.VariableDamper(1, low=1e3, high=1e5)]
BAD = {
    "no sampling": ({"sampling_interval": None}, ValueError, "sampling_interval is missing"),
    "no actuator": ({"actuators": []}, ValueError, "at least one actuator"),
    "no law": ({"regulator": None}, ValueError, "needs a regulator= .* or a controller="),
    "a class": ({"controller": control.ClippedOptimal}, TypeError, r"give ClippedOptimal\(...\)"),
    "delay": ({"delay": 0.03}, ValueError, "delay=0.03 s is not a multiple .* give delay=0.04"),
    "kind of noise": ({"noise": {"speed": 1.0}}, ValueError, "unknown kind of sensor in noise 'speed'"),
    "negative noise": ({"noise": {"velocity": -1.0}}, ValueError, r"noise of velocity \[m/s\]"),
    "two gains": ({"regulator": control.Regulator(np.zeros((2, 4)))}, ValueError, "the regulator has 2 actuators"),
    "coefficient": ({"actuators": DAMPER}, ValueError, "the command of a VariableDamper is a coefficient"),
    "force for a voltage": (
        {"actuators": [control.MRDamper(1)], "controller": control.SkyhookDamper(coefficient=1e3)},
        ValueError,
        r"SkyhookDamper returns a force \[N\], but the command of actuator 1 \(MRDamper\) is a voltage \[V\]",
    ),
    "coefficient for a force": (
        {"actuators": [*DAMPER, *TENDON], "regulator": None, "controller": SKYHOOK},
        ValueError,
        r"OnOffSkyhook returns a coefficient .* actuator 2 \(Actuator\) is a force",
    ),
    "no desired force": (
        {"actuators": [control.MRDamper(1)], "regulator": None, "controller": control.ClippedOptimal(voltage=2.0)},
        ValueError,
        "ClippedOptimal reads measured.desired, which is 0 without a regulator: give regulator=",
    ),
    "on_limit": ({"on_limit": "stop"}, ValueError, "unknown on_limit 'stop'"),
    "design": (
        {"regulator": control.lqr(CHAIN, TENDON, force_weight=1e-8, sampling_interval=0.01)},
        ValueError,
        "designed for sampling_interval=0.01 s, not 0.02 s",
    ),
}
WEIGHTS = {
    "negative": ({"state_weight": -np.eye(4)}, ValueError, "state_weight must be positive semidefinite"),
    "not symmetric": ({"state_weight": np.triu(np.ones((4, 4)))}, ValueError, "state_weight must be symmetric"),
    "two forces": ({"force_weight": [[2.0, 1.0], [0.0, 2.0]]}, ValueError, "force_weight must be symmetric"),
    "no list": ({"actuators": control.Actuator(1)}, TypeError, r"got Actuator: give \[actuator\]"),
    "stiffness": (
        {"parameters": {"stiffness": -1e8}},
        ValueError,
        "stiffness in parameters must be .*above 0, got -1e",
    ),
}


@pytest.mark.parametrize("case", WEIGHTS)
def test_a_wrong_design_of_a_regulator_is_refused(case):
    changed, kind, message = WEIGHTS[case]
    given = {"force_weight": 1e-8, "actuators": TENDON * (2 if case == "two forces" else 1)} | changed
    with pytest.raises(kind, match=message):
        control.lqr(CHAIN, **given)


def test_a_regulator_belongs_to_a_number_of_degrees_of_freedom():
    three = control.lqr(wd.ShearBuilding(np.full(3, 1e5), 1e8, 3.0), TENDON, force_weight=1e-8)
    loop = control.Control(**GOOD | {"regulator": three})  # its 6 columns could be those of 2 floors with accelerations
    with pytest.raises(ValueError, match="designed for 3 degrees of freedom, but the structure has 2"):
        wd.Scene(CHAIN, wd.Cloud([MOTION]), control=loop)
    assert control.delay_margin(CHAIN, TENDON, control.Regulator(np.zeros((1, 4)))) == np.inf
    with pytest.raises(
        TypeError, match=r"Scene\(control=...\) takes a wd.control.Control, got Regulator: give control="
    ):
        wd.Scene(CHAIN, wd.Cloud([MOTION]), control=three)


def test_warnings_of_commands_beyond_the_limits_of_an_actuator():
    beyond = {
        "high": (DAMPER, control.OnOffSkyhook(low=1e3, high=1e9)),
        "value": ([control.MRDamper(1)], control.ConstantCommand(value=240.0)),
    }
    for name, (actuators, controller) in beyond.items():
        loop = control.Control(actuators, controller=controller, sampling_interval=0.02)
        with pytest.warns(UserWarning, match=f"{name}=.* is beyond the limits of actuator 1"):
            wd.Scene(CHAIN, wd.Cloud([MOTION]), control=loop)
    with pytest.raises(ValueError, match="low=10 N s/m is above high=1 N s/m: exchange them"):
        control.OnOffSkyhook(low=10.0, high=1.0)


def test_the_warning_of_diverged_samples_names_the_loop():
    findings = StabilityFindings(3, "rk4")
    findings.is_controlled, findings.failed[DIVERGED] = True, 1
    with pytest.warns(UserWarning, match="loop may be unstable: see wd.control.sampled_eigenvalues and .*delay_margin"):
        findings.warn("substep")


@pytest.mark.parametrize("case", BAD)
def test_a_wrong_control_is_refused(case):
    changed, kind, message = BAD[case]
    with pytest.raises(kind, match=message):
        control.Control(**GOOD | changed)


MOTION = wd.GroundMotion(np.sin(0.1 * np.arange(300)), 0.01, "sine")
PLACES = {
    "storey": (3, "storey 3, but the building has storeys 1 to 2"),
    "spring": ("first", "storeys with numbers, not the spring 'first'"),
    "floor": ({5: 1.0}, "no floor 5; it has 1, 2"),
}


@pytest.mark.parametrize("case", PLACES)
def test_an_actuator_at_no_place_is_refused(case):
    place, message = PLACES[case]
    loop = control.Control(**GOOD | {"actuators": [control.Actuator(place)]})
    with pytest.raises(ValueError, match=message):
        wd.Scene(CHAIN, wd.Cloud([MOTION]), control=loop)
    with pytest.raises(ValueError, match=r"no spring 'frist' .did you mean 'first'"):
        control.state_space(DYKE, [control.Actuator("frist")])


def test_scenes_that_cannot_be_controlled():
    loop = control.Control(**GOOD)
    system = wd.LinearSystem([2.0, 1.0], np.eye(2), np.array([[300.0, -100.0], [-100.0, 100.0]]))
    with pytest.raises(TypeError, match="can be controlled, got LinearSystem"):
        wd.Scene(system, wd.Cloud([MOTION]), control=loop)
    events = wd.EventSequence({"main": wd.Cloud([MOTION]), "after": wd.Cloud([MOTION])})
    with pytest.raises(ValueError, match="an EventSequence cannot have a control"):
        wd.Scene(CHAIN, events, control=loop)
    wide = control.Control(**GOOD | {"regulator": control.Regulator(np.zeros((1, 5)))})
    with pytest.raises(ValueError, match=r"must have 4 .* or 6"):
        wd.Scene(CHAIN, wd.Cloud([MOTION]), control=wide)
    scene = wd.Scene(CHAIN, wd.Cloud([MOTION]), recorders=("drift",), control=loop)
    with pytest.raises(ValueError, match="method 'stoermer' does not support the control"):
        wd.simulate(scene, method="stoermer", device="cpu")
    odd = wd.Scene(CHAIN, wd.Cloud([MOTION]), control=control.Control(**GOOD | {"sampling_interval": 0.015}))
    with pytest.raises(ValueError, match=r"neither a multiple nor a whole fraction .* give sampling_interval=0.02"):
        wd.simulate(odd, device="cpu")
    finer = wd.Scene(CHAIN, wd.Cloud([MOTION]), control=control.Control(**GOOD | {"sampling_interval": 0.0025}))
    with pytest.raises(ValueError, match="does not divide the sampling interval of the control"):
        wd.simulate(finer, step=0.005, device="cpu")


@pytest.mark.parametrize(
    ("interval", "meant"),
    [
        (0.2, "=0.2 s is long for the first period.* give at most 0.0[0-9]+ s, mostly 0.001 to 0.02 s$"),  # not ms
        (10.0, "=10 s is long for the first period.* if 10 is in ms, give 0.01$"),
    ],
)
def test_warnings_of_slow_sampling(interval, meant):
    with pytest.warns(UserWarning, match=meant):
        wd.Scene(CHAIN, wd.Cloud([MOTION]), control=control.Control(**GOOD | {"sampling_interval": interval}))


def test_a_controlled_scene_is_rebuilt_from_its_json():
    loop = control.Control(
        [control.MRDamper(1, first_voltage=1.0), control.MRDamper({2: 1.0})],
        regulator=control.Regulator(np.ones((2, 4))),
        controller=control.ClippedOptimal(voltage=2.0),
        sampling_interval=0.01,
        delay=0.01,
        noise={"velocity": 0.01},
    )
    scene = wd.Scene(CHAIN, wd.Cloud([MOTION]), control=loop)
    again = wd.Scene.from_json(scene.to_json(), [MOTION])
    assert again.to_json() == scene.to_json()
    assert '"control"' not in wd.Scene(CHAIN, wd.Cloud([MOTION])).to_json()


def test_actuators_refuse_wrong_values():
    for arguments, message in (
        ({"force_limit": -1.0}, "force_limit"),
        ({"stroke_limit": 0.0}, "stroke_limit"),
    ):
        with pytest.raises(ValueError, match=message):
            control.Actuator(1, **arguments)
    with pytest.raises(ValueError, match="exchange them"):
        control.VariableDamper(1, low=2.0, high=1.0)
    with pytest.raises(ValueError, match="grows without bound"):
        control.MRDamper(1, beta=-4e6)
    with pytest.raises(ValueError, match="factor of 1 in place must be a finite number, got nan"):
        control.Actuator({1: np.nan})
    with pytest.raises(TypeError, match="place must be the number of a storey"):
        control.Actuator(None)


def test_upper_ends_have_the_velocities_of_all_positive_factors():
    rules = control.Control(
        [control.Actuator({1: 0.5, 2: 0.25}), control.Actuator(2), control.Actuator({1: -1.0})],
        controller=control.SkyhookDamper(coefficient=1.0),
        sampling_interval=0.01,
    ).rules(CHAIN)
    sensed = {"sensed": [0.1, 0.2, 3.0, 4.0], "dtype": float}
    found = {name: np.full(3, np.nan) for name in ("sensed_drift", "sensed_rate", "upper_rate")}
    exec(_sensed_motions(rules, 2), sensed | found)
    np.testing.assert_allclose(found["upper_rate"], [2.5, 4.0, 0.0])
    np.testing.assert_allclose(found["sensed_rate"], [2.5, 1.0, -3.0])
    np.testing.assert_allclose(found["sensed_drift"], [0.1, 0.1, -0.1])


def test_uncontrolled_kernels_contain_nothing_of_control():
    for method, recorders in itertools.product(("rk4", "heun"), (("drift",), None)):
        text = wd.kernels.source(wd.Scene(CHAIN, wd.Cloud([MOTION]), recorders=recorders), method=method, device="cpu")
        assert "control_force" not in text
        assert "steps_of_sampling" not in text


def test_parameters_of_controllers_are_given_by_name():
    with pytest.raises(TypeError, match=r"takes its parameters by name: ConstantCommand\(value=\.\.\.\)"):
        control.ConstantCommand(1e5)
