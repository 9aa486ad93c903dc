"""Bad input: each is refused before any kernel runs, by an error that names the field, the place and what is allowed.

Records and their files are in test_records.py, files that cannot be written in test_store.py.
"""

import functools

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn import plots
from warpdyn.engine.kernels import build, queues as devices

pytestmark = [
    pytest.mark.fast,
    pytest.mark.meant_as_given("damping_ratio", "random_factor", "yield_base_shear_coefficient"),
]

WAVE = wd.GroundMotion(np.sin(np.arange(50) * 0.3), 0.02, name="wave")
SILENCE = wd.GroundMotion(np.zeros(50), 0.02, name="silence")
PGA = wd.PeakGroundAcceleration()
MASS, STIFFNESS = np.diag([2.0, 1.0]), np.array([[300.0, -100.0], [-100.0, 100.0]])
NAN, INFINITE = float("nan"), float("inf")


@pytest.fixture(autouse=True)
def no_kernel(monkeypatch):
    def refuse(*arguments, **named):
        pytest.fail("a kernel was reached")

    monkeypatch.setattr(devices.CpuQueue, "launch", refuse)
    monkeypatch.setattr(build, "build_kernel", refuse)


def building(**changes):
    parameters = {"mass": [2e3, 1e3], "stiffness": [6e5, 4e5], "height": [3.5, 3.0], "law": "bilinear"}
    parameters |= {"yield_force": [4e3, 2e3], "hardening_ratio": 0.05, "damping": "rayleigh", "damping_ratio": 0.05}
    return wd.ShearBuilding(**(parameters | changes))


def system(**changes):
    return wd.LinearSystem(**({"mass": MASS, "damping": np.zeros((2, 2)), "stiffness": STIFFNESS} | changes))


def scene(**changes):
    return wd.Scene(**({"structure": building(), "excitation": WAVE} | changes))


def run(scene_changes=None, **arguments):
    return wd.simulate(scene(**(scene_changes or {})), **arguments)


def changed(matrix, at, value):
    matrix = np.array(matrix)
    matrix[at] = value
    return matrix


def with_correlation(pair, value, **more):
    factor = wd.RandomFactor(wd.Lognormal(1, 0.1))
    return scene(scatter={"mass": factor, "stiffness": factor} | more, correlation={pair: value})


# A call, its error, and the text that the message must contain.
STRUCTURES = {
    "negative mass": (lambda: building(mass=[2e3, -1.0]), "mass is -1 at storey 2; it must be finite and above 0"),
    "zero mass": (lambda: building(mass=0.0), "mass is 0 at storey 1; it must be finite and above 0"),
    "mass not finite": (lambda: building(mass=[2e3, NAN]), "mass is nan at storey 2; it must be finite"),
    "zero stiffness": (lambda: building(stiffness=[6e5, 0.0]), "stiffness is 0 at storey 2", "finite and above 0"),
    "infinite stiffness": (lambda: building(stiffness=INFINITE), "stiffness is inf at storey 1; it must be finite"),
    "negative height": (lambda: building(height=[-3.0, 3.0]), "height is -3 at storey 1", "finite and above 0"),
    "zero yield force": (lambda: building(yield_force=[4e3, 0.0]), "yield_force is 0 at storey 2", "above 0"),
    "hardening of one": (lambda: building(hardening_ratio=1.0), "hardening_ratio is 1 at storey 1", "below 1"),
    "critical damping": (
        lambda: building(damping_ratio=1.0),
        "damping_ratio is 1; it must be",
        "at least 0 and below 1",
    ),
    "damping in percent": (lambda: building(damping_ratio=5), "damping_ratio is 5; it must be", "below 1; 5 % is 0.05"),
    "three damping ratios": (
        lambda: building(damping_ratio=[0.05] * 3),
        "damping_ratio must be one value for the building, got 3",
    ),
    "two damping ratios": (lambda: building(damping_ratio=[0.05, 0.04]), "damping_ratio must be one value", "got 2"),
    "unequal lengths": (lambda: building(mass=[1e3] * 3), "stiffness has 2 values and mass has 3: lists with"),
    "unequal laws": (lambda: building(law=["bilinear"] * 3), "mass has 2 values and law has 3: lists with"),
    "too few laws": (
        lambda: building(mass=[1e3] * 3, law=["bilinear", "bouc_wen"]),
        "law has 2 values and mass has 3: lists with",
    ),
    "table for a row": (lambda: building(mass=np.ones((2, 2))), "mass must be one value or one per storey", "(2, 2)"),
    "words for numbers": (lambda: building(mass="heavy"), "mass must be numbers", "heavy"),
    "too many storeys": (
        lambda: building(mass=np.ones(61), stiffness=1.0, height=1.0, yield_force=1.0),
        "1 to 60 storeys",
        "61",
    ),
    "unknown law": (lambda: building(law="plastic"), "storey law 'plastic'", "'elastic', 'bilinear', 'elastic_perf"),
    "unknown damping": (
        lambda: building(damping="viscous"),
        "unknown damping 'viscous'",
        "'rayleigh', 'rayleigh_tangent', 'mass_proportional', 'stiffness_proportional', 'modal'",
    ),
    "unknown parameter": (lambda: building(strength=1.0), "unknown parameter 'strength'", "yield_force"),
    "parameter of another law": (lambda: building(beta=0.5), "unknown parameter 'beta'", "law 'bilinear'"),
    "missing parameter": (
        lambda: wd.ShearBuilding(1, 1, 1, law="bilinear", yield_force=1),
        "hardening_ratio",
        "is missing",
    ),
    "modes of no Rayleigh": (lambda: building(damping="modal", damping_modes=(1, 2)), "damping_modes", "'rayleigh'"),
    "mode out of range": (lambda: building(damping_modes=(1, 3)), "damping_modes must be two", "from 1 to 2"),
    "modes of one storey": (
        lambda: wd.ShearBuilding(1, 1, 1, damping="rayleigh", damping_ratio=0.05, damping_modes=(1, 3)),
        "damping_modes",
    ),
    "matrix not square": (lambda: system(stiffness=np.ones((2, 3))), "stiffness must be a square matrix", "(2, 3)"),
    "matrices of two sizes": (
        lambda: system(damping=np.zeros((3, 3))),
        "damping has shape (3, 3), but mass has (2, 2)",
    ),
    "no degree of freedom": (lambda: system(mass=[], damping=[], stiffness=[]), "mass", "square matrix"),
    "words in a matrix": (lambda: system(damping=[["a", 0], [0, 0]]), "damping"),
    "too many degrees of freedom": (lambda: wd.LinearSystem(*[np.eye(33)] * 3), "1 to 32 degrees of freedom, got 33"),
    "entry not finite": (lambda: system(damping=changed(MASS, (0, 1), NAN)), "damping[0, 1] is nan", "finite"),
    "asymmetric stiffness": (
        lambda: system(stiffness=changed(STIFFNESS, (0, 1), 5.0)),
        "stiffness is not symmetric: [0, 1] is 5 but [1, 0] is -100",
    ),
    "singular mass": (lambda: system(mass=[2.0, 0.0]), "mass is singular", "every degree of freedom needs mass"),
    "negative mass matrix": (lambda: system(mass=[2.0, -1.0]), "mass is singular or not positive definite"),
    "negative stiffness": (
        lambda: system(stiffness=[[-100, 100], [100, -100]]),
        "eigenvalues of the stiffness are negative",
    ),
    "influence of one": (lambda: system(influence=[1.0]), "one value per degree of freedom, shape [2], got shape (1,)"),
}
SCENES = {
    "motion of no step": (lambda: wd.GroundMotion([0.0, 1.0], 0.0, "A"), "motion 'A': step", "above 0, got 0.0"),
    "motion not finite": (
        lambda: wd.GroundMotion([0.0, NAN], 0.1, "A"),
        "motion 'A': acceleration[1] is nan",
        "finite",
    ),
    "force history of no step": (
        lambda: wd.ForceHistory(np.ones((3, 2)), -1),
        "step [s] must be a finite number above 0, got -1",
    ),
    "force history not finite": (lambda: wd.ForceHistory([[0.0], [NAN]], 0.1), "force[1, 0] is nan"),
    "duration": (lambda: wd.FreeVibration(0.0), "duration [s] must be a finite number above 0, got 0.0"),
    "frequency": (
        lambda: wd.HarmonicForce([1.0], INFINITE, 1.0),
        "circular_frequency [rad/s] must be a finite number of at least 0, got inf",
    ),
    "amplitude a dof": (lambda: scene(excitation=wd.HarmonicForce([1], 1, 1)), "amplitude has 1 value, but the str"),
    "columns a dof": (
        lambda: scene(excitation=wd.ForceHistory([[1], [2]], 1)),
        "force has 1 column, but the structure",
    ),
    "state a dof": (lambda: scene(excitation=wd.FreeVibration(1, [1, 2, 3])), "displacement has 3 values, but the str"),
    "no motion": (lambda: wd.Cloud([]), "motions is empty"),
    "no level": (lambda: wd.Stripes([WAVE], [], PGA), "levels must be a row of finite values above 0 g"),
    "negative level": (lambda: wd.Stripes([WAVE], [-0.1, 0.2], PGA), "levels must be", "above 0 g", "-0.1"),
    "levels that fall": (lambda: wd.Stripes([WAVE], [0.2, 0.1], PGA), "levels must increase, got [0.2, 0.1]"),
    "all-zero record": (lambda: wd.Stripes([WAVE, SILENCE], [0.1], PGA), "motion 1 ('silence')", "record of zeros"),
    "all-zero record, Sa": (lambda: wd.Stripes([SILENCE], [0.1], wd.SpectralAcceleration(1.0)), "motion 0 ('silence')"),
    "index of no motion": (
        lambda: wd.OneMotionPerStructure([WAVE], motion=[1]),
        "motion must be from 0 to 0, the indices of the motions, got 1 to 1",
    ),
    "motions and scales": (
        lambda: wd.OneMotionPerStructure([WAVE], motion=[0, 0], scale=[1.0, 2.0, 3.0]),
        "motion has 2 values and scale has 3",
    ),
    "scale": (lambda: wd.OneMotionPerStructure([WAVE], scale=[1.0, 0.0]), "scale must be", "finite and above 0"),
    "unknown recorder": (lambda: scene(recorders=("drifts",)), "recorder of a ShearBuilding 'drifts'", "'base_shear'"),
    "recorder of a chain": (
        lambda: scene(structure=system(), recorders=("drift",)),
        "LinearSystem 'drift'",
        "'displacement'",
    ),
    "collapse of a full system": (
        lambda: wd.Scene(system(), wd.FreeVibration(1.0), collapse_drift_ratio=0.1),
        "needs storeys: use a ShearBuilding",
    ),
    "drift capacity": (
        lambda: building(drift_capacity=0.0),
        "drift_capacity is 0 at storey 1; it must be finite and above 0",
    ),
    "collapse limit": (lambda: scene(collapse_drift_ratio=0.0), "collapse_drift_ratio must be a finite number above 0"),
    "tail": (lambda: scene(tail=-1.0), "tail [s] must be a finite number of at least 0, got -1.0"),
    "nothing is kept": (lambda: wd.simulate(scene(recorders=())), "the scene has no recorders", "or give histories="),
    "negative frequency": (
        lambda: wd.HarmonicForce([1.0, 1.0], -3.0, 1.0),
        "circular_frequency [rad/s] must be a finite number of at least 0, got -3",
    ),
    "unknown sampling": (lambda: scene(sampling="halton"), "unknown sampling 'halton'", "'latin_hypercube', 'sobol'"),
    "scatter of nothing": (
        lambda: scene(scatter={"strength": 1.0}),
        "scatter names unknown parameter 'strength'",
        "yield_force",
    ),
    "storeys of one value": (
        lambda: scene(scatter={"damping_ratio": wd.RandomFactor(wd.Normal(1, 0.1), per="storey")}),
        "scatter['damping_ratio']: damping_ratio has one value for the building; use per='building'",
    ),
    "matrix for a value": (
        lambda: scene(structure=system(), scatter={"stiffness": wd.RandomValue(wd.Normal(1, 0.1))}),
        "scatter['stiffness']: a matrix can only be scaled; give RandomFactor(...)",
    ),
    "median": (lambda: wd.Lognormal(0.0, 0.1), "Lognormal.median must be a finite number above 0, got 0.0"),
    "dispersion": (
        lambda: wd.Lognormal(1.0, -0.1),
        "Lognormal.dispersion must be a finite number of at least 0, got -0.1",
    ),
    "cov": (lambda: wd.Lognormal.from_mean(1.0, NAN), "cov must be a finite number of at least 0, got nan"),
    "deviation": (
        lambda: wd.Normal(1.0, -0.1),
        "Normal.standard_deviation must be a finite number of at least 0, got -0.1",
    ),
    "bounds": (lambda: wd.Uniform(2.0, 1.0), "Uniform.high must be a finite number above Uniform.low=2, got 1"),
    "unknown per": (
        lambda: wd.RandomFactor(wd.Normal(1, 0.1), per="floor"),
        "unknown per 'floor'",
        "'building', 'storey'",
    ),
    "storey correlation": (
        lambda: wd.RandomFactor(wd.Normal(1, 0.1), "storey", 1.5),
        "storey_correlation must be at most 1, got 1.5",
    ),
    "correlated storeys of one draw": (
        lambda: wd.RandomFactor(wd.Normal(1, 0.1), "building", 0.5),
        "needs per='storey'",
    ),
    "correlation": (
        lambda: with_correlation(("mass", "stiffness"), 1.1),
        "('mass', 'stiffness') must be from -1 to 1, got 1.1",
    ),
    "correlation with oneself": (lambda: with_correlation(("mass", "mass"), 0.5), "two different parameters"),
    "correlation with what is not random": (
        lambda: with_correlation(("mass", "height"), 0.5),
        "('mass', 'height')",
        "random scatter",
    ),
    "correlations that contradict": (
        lambda: scene(
            scatter={name: wd.RandomFactor(wd.Normal(1, 0.1)) for name in ("mass", "stiffness", "yield_force")},
            correlation={("mass", "stiffness"): 0.9, ("stiffness", "yield_force"): 0.9, ("mass", "yield_force"): -0.9},
        ),
        "the correlations contradict each other",
    ),
}
RUNS = {
    "no samples": (lambda: run(structures=0), "structures must be a whole number of at least 1, got 0"),
    "more than can be counted": (lambda: run(structures=2**31), "have more than 2147483647 samples"),
    "half a sample": (lambda: run(structures=1.5), "structures must be a whole number", "1.5"),
    "negative seed": (lambda: run(seed=-1), "seed must be a whole number of at least 0, got -1"),
    "no threads": (lambda: run(threads=0), "threads must be a whole number of at least 1, got 0"),
    "no memory": (lambda: run(memory=0), "memory [bytes] must be a whole number of at least 1, got 0"),
    "too little memory": (lambda: run(memory=1000), "memory must be at least", "bytes for this scene, got 1000"),
    "device twice": (lambda: run(device=["cpu", "cpu"]), "device must be one device or several different GPUs"),
    "no device at all": (lambda: run(device=[]), "device must be one device or several different GPUs"),
    "unknown method": (lambda: run(method="euler"), "unknown method 'euler'", "'rk4'"),
    "unknown dtype": (lambda: run(dtype="float16"), "unknown dtype 'float16'", "'float32', 'float64'"),
    "unknown device": (lambda: run(device="tpu"), "no device 'tpu'", "cpu"),
    "zero step": (lambda: run(step=0.0), "step [s] must be a finite number above 0, got 0.0"),
    "step not finite": (lambda: run(step=NAN), "step [s] must be a finite number above 0, got nan"),
    "step that divides nothing": (
        lambda: run(step=0.003),
        "step 0.003 s does not divide",
        "motion 0 ('wave')",
        "step=0.00333",
    ),
    "step above the record's": (lambda: run(step=0.04), "step 0.04 s does not divide", "step=0.02", "step=0.01"),
    "too many steps": (lambda: run(step=1e-10), "1073741824", "longer step"),
    "history of no sample": (
        lambda: run(histories=wd.Histories((0, 3)), structures=3),
        "histories ask for sample 3, but the run has samples 0 to 2",
    ),
    "history of every nothing": (lambda: run(histories=wd.Histories((0,), 0)), "histories.every", "at least 1, got 0"),
    "gamma above beta": (
        lambda: run({"structure": building(law="bouc_wen"), "scatter": {"beta": wd.GivenValues([0.25])}}),
        "gamma is 0.5 and beta is 0.25 (structure 0, storey 1)",
    ),
    "motion without end": (lambda: wd.GroundMotion([1.0, 2.0], 1e308), "step times the number of samples [s]", "inf"),
    "velocity not finite": (lambda: wd.FreeVibration(1.0, velocity=NAN), "velocity is nan"),
    "histories of nothing": (lambda: wd.Histories(()), "histories.samples", "at least one sample"),
    "seed beyond a file": (lambda: run({}, seed=2**63), "seed must be a whole number", "2^63 - 1"),
    "step in words": (lambda: run({}, step="0.01"), "step [s] must be a finite number", "'0.01'"),
    "damping that feeds": (lambda: run({"structure": system(damping=-MASS)}), "damping", "would add energy"),
    "motions for other samples": (
        lambda: run({"excitation": wd.OneMotionPerStructure([WAVE], motion=[0, 0])}, structures=3),
        "OneMotionPerStructure.motion has 2 values, but the run has 3 structures: give one value per",
    ),
    "draw out of bounds": (
        lambda: run({"scatter": {"mass": wd.RandomFactor(wd.Normal(-1, 0.0))}}, structures=3),
        "the drawn mass is -2000 at structure 0, storey 1; it must be finite and above 0; narrow its scatter",
    ),
    "ratio drawn out of bounds": (
        lambda: run({"scatter": {"damping_ratio": wd.RandomValue(wd.Uniform(1.0, 2.0))}}, structures=3),
        "the drawn damping_ratio is 1.",
        "at structure 0",
        "below 1",
    ),
}
WRONG_TYPES = {
    "keep_inputs by name": (lambda: run(keep_inputs="mass"), "keep_inputs must be True or False, got 'mass'"),
    "histories as a list": (lambda: run({}, histories=[0]), "histories must be Histories"),
    "structure for a scene": (lambda: wd.simulate(system()), "takes a Scene", "LinearSystem"),
    "one recorder as text": (lambda: scene(recorders="drift"), "recorders must be a tuple", "'drift'"),
    "measure by name": (
        lambda: wd.Cloud([wd.GroundMotion([0.0, 1.0], 0.1)], measure="PGA"),
        "measure must be",
        "'PGA'",
    ),
    "structure": (lambda: scene(structure=3.0), "must be a ShearBuilding, a LumpedStructure, "),
    "excitation": (lambda: scene(excitation=[WAVE]), "excitation must be", "Stripes", "got list"),
    "motion": (lambda: wd.Cloud([WAVE, 3.0]), "motions[1] is a float", "GroundMotion"),
    "scatter": (
        lambda: scene(scatter={"mass": "much"}),
        "scatter['mass'] must be RandomFactor",
        "one value per structure as GivenValues",
        "much",
    ),
    "distribution": (lambda: wd.RandomFactor(0.1), "distribution must be Normal, Lognormal, Uniform", "got 0.1"),
}
LIMITS = {"slight": 0.01}
NO_BUILDING = {
    "pushover": (lambda given: wd.pushover(given, [0.1]), "pushover() takes a ShearBuilding or a LumpedStructure"),
    "storey_hysteresis": (
        lambda given: wd.storey_hysteresis(given, [0.1]),
        "storey_hysteresis() takes a ShearBuilding",
    ),
    "plots.building": (plots.building, "plots.building() takes a ShearBuilding"),
    "plan": (lambda given: wd.plan(given, 0.01), "plan() takes a Scene"),
}
NO_DATASET = {
    "modal_table": (wd.modal_table, "; give building.modal()"),
    "write": (lambda given: wd.write(given, "run.nc"), ""),
    "summary": (wd.summary, "; pass the result of simulate()"),
    "fragility": (lambda given: wd.fragility(given, LIMITS), "; give the result of simulate()"),
    "damage_shares": (
        lambda given: wd.damage_shares(given, {"A": LIMITS}),
        "; give the result of simulate() for a portfolio",
    ),
    "select_event": (
        lambda given: wd.select_event(given, "mainshock"),
        "; give the result of simulate() for an EventSequence",
    ),
    "select_archetype": (
        lambda given: wd.select_archetype(given, "A"),
        "; give the result of simulate() for a portfolio",
    ),
    "select_storeys": (lambda given: wd.select_storeys(given, 1, 2), "; give the result of simulate()"),
    "plots.fragility_curves": (plots.fragility_curves, "; draw the result of fragility(run, limits)"),
    "plots.drift_over_height": (plots.drift_over_height, "; draw a run"),
    "plots.drift_against_intensity": (plots.drift_against_intensity, "; draw a run"),
    "plots.spectra": (plots.spectra, "; draw the result of response_spectra("),
    "plots.hysteresis": (plots.hysteresis, "; draw a run of simulate("),
    "plots.pushover_curve": (plots.pushover_curve, "; draw the result of pushover("),
}
for name, (call, told) in NO_BUILDING.items():
    for given in (None, system()):
        told_of = f"{told}, got {type(given).__name__}"
        WRONG_TYPES[f"{name} of {type(given).__name__}"] = (functools.partial(call, given), told_of)
for name, (call, told) in NO_DATASET.items():
    for given in (None, building()):
        told_of = f"{name}() takes a Dataset, got {type(given).__name__}"
        WRONG_TYPES[f"{name} of {type(given).__name__}"] = (functools.partial(call, given), told_of, told)
OTHER_DATASETS = {
    "table of a pushover": (
        lambda: wd.modal_table(xr.Dataset({"period": 1.0})),
        "the dataset has no effective_mass_ratio: give building.modal()",
    ),
    "summary of modes": (lambda: wd.summary(building().modal()), "no status, integration_step: pass the result"),
}


def test_the_unchanged_calls_are_accepted():
    # Otherwise the errors of the changed calls might have another cause.
    assert scene().structure.storeys == 2
    assert scene(structure=system()).structure.dofs == 2
    assert with_correlation(("mass", "stiffness"), 0.5)


CASES = [
    pytest.param(kind, *case[:1], case[1:], id=name)
    for kind, table in ((ValueError, STRUCTURES | SCENES | RUNS | OTHER_DATASETS), (TypeError, WRONG_TYPES))
    for name, case in table.items()
]


@pytest.mark.parametrize(("kind", "attempt", "told"), CASES)
def test_refused(kind, attempt, told):
    with pytest.raises(kind) as error:
        attempt()
    for part in told:
        assert part in str(error.value)
