"""Mistakes in measurements, pulses, spectra, weights and frames: each is refused, or gives a warning that names it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import warpdyn as wd
from warpdyn.answers.fragility.intervals.extrapolation import levels_towards
from warpdyn.campaigns.inference.plausible import warn_of_implausible_measurement
from warpdyn.campaigns.inference.responses import check_response
from warpdyn.model.ground_motions.selection.bounds import check_enough
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = pytest.mark.fast

BUILDING = wd.ShearBuilding(2e5, [1.6e8, 1.3e8, 0.9e8], 3.2, damping="rayleigh", damping_ratio=0.02)
MOTION = wd.GroundMotion(3 * np.sin(0.07 * np.arange(1000)), 0.01, "sine")  # 10 s
SCENE = wd.Scene(BUILDING, MOTION, {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))})
MODEL = {"periods": [0.2, 0.5, 1.0], "dispersion": [0.5, 0.6, 0.6], "conditioning": wd.SpectralAcceleration(1.0)}
MEDIAN = np.array([0.62, 0.26, 0.14])  # g
TABLE = {"duration": 12.0, "middle": 7.0, "frequency": 5.0, "frequency_slope": -0.1, "damping_ratio": 0.3}


def portal(gravity_load=3.4e5, **options):
    nodes = {"A": (0.0, 0.0), "B": {"x": 0.0, "y": 4.0}, "C": {"x": 6.0, "y": 4.0}, "D": (6.0, 0.0)}
    if gravity_load:
        nodes["B"]["gravity_load"] = nodes["C"]["gravity_load"] = gravity_load
    ends = {"section": "one", "spring_start": 6e8, "spring_end": 6e8}
    members = {
        name: {"start": start, "end": end, **ends}
        for name, start, end in (("left", "A", "B"), ("right", "D", "C"), ("beam", "B", "C"))
    }
    sections = {"one": {"elastic_modulus": 2e11, "area": 0.012, "second_moment": 2e-4}}
    held = {"supports": {"A": "fixed", "D": "fixed"}, "diaphragms": {"floor": ["B", "C"]}, "masses": {"floor": 7e4}}
    hinges = {("beam", end): {"law": "bilinear", "yield_force": 6e5, "hardening_ratio": 0.02} for end in ENDS}
    damping = {"damping": "modal", "damping_ratio": 0.03}
    return wd.HingedFrame(wd.Frame(nodes, members, sections, **held), hinges, **damping, **options)


ENDS = ("start", "end")


class Computed:
    """A misfit with a given computed peak."""

    def __init__(self, peak):
        self.peak = peak

    def __call__(self, values):
        return np.zeros(1), np.zeros(1), np.array([self.peak])


def compared(measured, peak=1.0):
    class Median:
        variables = 1

        def values(self, normals):
            return normals

        def allowed(self, values):
            return [True]

    warn_of_implausible_measurement(measured, SCENE, Median(), Computed(peak))


REFUSED = {
    "pulse of 80 Hz": (lambda: wd.VelocityPulse(0.6, 80.0, 1.6, time=3.0).added_to(MOTION), "Nyquist frequency 50 Hz"),
    "pulse of 80 Hz alone": (lambda: wd.VelocityPulse(0.6, 80.0, 1.6, time=3.0).motion(0.01, 9.0), "below 0.00625 s"),
    "one column, three floors": (
        lambda: check_response("calibrate", SCENE, wd.MeasuredResponse(np.zeros(1000), 0.01)),
        r"1 column, but the structure has 3 floors: give floors=, .* such as floors=\[3\]",
    ),
    "negative weight": (
        lambda: wd.control.lqr(BUILDING, [wd.control.Actuator(1)], force_weight=1e-8, state_weight=-np.eye(6)),
        "state_weight must be positive semidefinite",
    ),
    "too few records": (lambda: check_enough(100, 30, 30, {"scale factor 0.2 to 5": 30}, None), "Add records"),
    "no gravity": (lambda: portal(gravity_load=0.0), "or give p_delta=False"),
    "unknown parameter": (
        lambda: wd.Scene(portal(), MOTION, {"yield": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}),
        "damping='modal'\\): mass, yield_force",  # without stiffness, which cannot be random
    ),
}
WARNED = {
    "record in g": (
        lambda: compared(wd.MeasuredResponse(np.ones(9), 0.01, floors=[3]), 9.81),
        "with the measurement given in g",
    ),
    "step in ms": (
        lambda: compared(wd.MeasuredResponse(np.ones(301), 10.0, floors=[3])),
        "measurement lasts 3000 s, the motion 9.99 s.*step given in ms",
    ),
    "pulse in cm/s": (lambda: wd.VelocityPulse(60.0, 0.5, 1.6, time=5.0), "if given in cm/s, it would be 0.6 m/s"),
    "pulse after the motion": (
        lambda: wd.VelocityPulse(0.6, 0.5, 1.6, time=100.0).added_to(MOTION),
        "middle of the velocity pulse over the duration",
    ),
    "medians in m/s2": (
        lambda: wd.conditional_spectrum(median=9.81 * MEDIAN, level=0.3, **MODEL),
        "if given in m/s2, it would be 0.62",
    ),
    "level of 30 g": (lambda: wd.conditional_spectrum(median=MEDIAN, level=30.0, **MODEL), r"\(epsilon\) is 8.9"),
    "epsilon of 10": (lambda: wd.conditional_spectrum(median=MEDIAN, epsilon=10.0, **MODEL), r"\(epsilon\) is 10 "),
    "capacity in percent": (
        lambda: warn_of_implausible(wd.Scene(portal(drift_capacity=10.0), MOTION)),
        r"collapse drift ratio \(drift_capacity\) is 10 .*if given in percent, it would be 0.1",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_it_is_refused_with_advice(case) -> None:
    call, words = REFUSED[case]
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("case", WARNED)
def test_a_warning_names_the_mistake(case) -> None:
    call, words = WARNED[case]
    with pytest.warns(UserWarning, match=f"implausible input: .*{words}"):
        call()


@pytest.mark.filterwarnings("error:implausible input")
def test_synthetic_motions_in_another_unit_are_reported_before_the_kernel() -> None:
    table = pd.DataFrame({"arias_intensity": [1.0, 500.0], **TABLE})
    with pytest.raises(UserWarning, match=r"in row 1 of parameters is 500 m/s.*if given in cm/s, it would be 5 m/s"):
        wd.synthetic_motions(table)


def test_a_cloud_is_advised_to_add_motions() -> None:
    advice = levels_towards(0.05, 0.2, 1.4, "g", "motions")
    assert advice.startswith("add motions with intensities below 0.2 g, such as 0.05")


def test_weights_without_negative_eigenvalues_are_accepted() -> None:
    weight = 1e8 * np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    wd.control.lqr(BUILDING, [wd.control.Actuator(1)], force_weight=1e-8, state_weight=weight)
    wd.control.lqr(BUILDING, [wd.control.Actuator(1)], force_weight=1e-8)
    with pytest.warns(UserWarning, match="eigenvalue of the structure by the regulator.*force_weight may be too large"):
        wd.control.lqr(BUILDING, [wd.control.Actuator(1)], force_weight=1.0)
