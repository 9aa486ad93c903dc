"""Stoermer's method: its kernels obey the printed formulas, agree with other programs, and refuse what does not fit."""

from __future__ import annotations

import numpy as np
import pytest
from opensees_ensembles import LAWS, RECORDS, histories

import warpdyn as wd
from warpdyn.engine.methods.table import METHODS

STEP = 0.005
BILINEAR = {"law": wd.laws.Bilinear(yield_force=[3e5, 2e5, 2e5], hardening_ratio=0.05)}
BOUC_WEN = {"law": wd.laws.BoucWen(yield_force=[3e5, 2e5, 2e5], hardening_ratio=0.05)}


def pulse(steps: int = 400, size: float = 3.0) -> wd.GroundMotion:
    time = STEP * np.arange(steps + 1)
    return wd.GroundMotion(size * np.sin(9 * time) * np.sin(np.pi * time / time[-1]) ** 2, STEP, f"pulse {steps}")


def frame(**settings) -> wd.ShearBuilding:
    chosen = settings if "damping" in settings else {"damping": "rayleigh", "damping_ratio": 0.05} | settings
    return wd.ShearBuilding([2e4, 2e4, 1.5e4], [2e7, 1.8e7, 1.2e7], 3.0, **chosen)


def run(scene: wd.Scene, **settings):
    chosen = {"structures": 1, "method": "stoermer", "step": STEP, "dtype": "float64", "device": "cpu"}
    return wd.simulate(scene, **(chosen | settings))


@pytest.mark.parametrize("law", [{}, BILINEAR], ids=["elastic", "bilinear"])
def test_histories_obey_the_printed_formulas(law):
    # Stoermer's formula with k = 3 (Hairer, Norsett and Wanner, III.10) connects displacements and accelerations; with
    # the formula of Adams and Bashforth for the velocity (III.1), and the forces, it is the whole method.
    damping, masses = 3e4, np.array([2e4, 2e4, 1.5e4])
    motion = pulse()
    scene = wd.Scene(frame(damping="storey", damping_coefficient=damping, **law), motion, tail=0.0)
    found = run(scene, histories=wd.Histories(samples=[0])).isel(history=0)
    u, v = found["displacement"].values, found["velocity"].values
    absolute = found["acceleration"].values
    base = np.append(motion.acceleration, 0.0)[: len(u)]
    a = absolute - base[:, np.newaxis]
    second = u[4:] - 2 * u[3:-1] + u[2:-2]
    due = STEP**2 * (13 / 12 * a[3:-1] - 1 / 6 * a[2:-2] + 1 / 12 * a[1:-3])
    # Differences of displacements of 0.05 m lose 12 digits of 16.
    np.testing.assert_allclose(second[3:], due[3:], atol=1e-15)
    due = STEP * (23 / 12 * a[3:-1] - 4 / 3 * a[2:-2] + 5 / 12 * a[1:-3])
    np.testing.assert_allclose((v[4:] - v[3:-1])[3:], due[3:], atol=1e-12)
    forces = found["storey_force"].values + damping * np.diff(v, axis=1, prepend=0.0)
    np.testing.assert_allclose(masses * absolute, np.diff(forces, axis=1, append=0.0), rtol=1e-9, atol=1e-6)


def uniform(sample: int, entry: int) -> float:
    """Return a pseudo-random number from -1 to 1 (the hash of the reference program)."""
    wide = 2**32
    x = sample * 0x9E3779B9 % wide ^ (entry + 1) * 0x85EBCA6B % wide
    x = (x ^ x >> 16) * 0x7FEB352D % wide
    x = (x ^ x >> 15) * 0x846CA68B % wide
    return ((x ^ x >> 16) >> 8) * 2 / 2**24 - 1


# Largest drifts [m] of five storeys by RK4 at 0.0005 s in a program of its own (C++), with which OpenSeesPy (Newmark,
# 0.0005 s) agrees within 0.015 %.
PEAKS = {
    ("bilinear", 0): [0.287821, 0.168167, 0.0260425, 0.0138907, 0.00840102],
    ("bilinear", 1): [0.0245372, 0.0440243, 0.0144744, 0.0109581, 0.00663158],
    ("bouc_wen", 0): [0.290830, 0.172434, 0.0309122, 0.0116367, 0.00786580],
    ("bouc_wen", 1): [0.0204894, 0.0202548, 0.0147598, 0.00910373, 0.00482682],
}


@pytest.mark.parametrize(("law", "sample"), PEAKS)
def test_peaks_agree_with_a_program_that_agrees_with_opensees(law, sample):
    def drawn(first: int, median: float, scatter: float) -> np.ndarray:
        return np.array([median * np.exp(scatter * np.float32(uniform(sample, first + i))) for i in range(5)])

    stiffness, dashpot = drawn(0, 2e7, 0.3), drawn(100, 5e4, 0.3)
    mass, yield_drift, hardening = 1 / drawn(200, 5e-5, 0.15), drawn(300, 0.01, 0.2), drawn(400, 0.05, 0.2)
    scale = np.exp(0.8 * uniform(sample, 500))
    of_mass = 0.1 * np.exp(0.3 * uniform(sample, 501))
    time = STEP * np.arange(2001)
    waves = sum(
        np.sin(2 * np.pi * f * time + (k + 1) ** 2) for k, f in enumerate((0.5, 0.8, 1.2, 1.7, 2.3, 3.1, 4.3, 6.1))
    )
    motion = 1.2 * np.minimum(1, time) * np.exp(-0.15 * np.maximum(0, time - 6)) * waves * scale
    laws = {"bilinear": wd.laws.Bilinear, "bouc_wen": wd.laws.BoucWen}
    settings = {"law": laws[law](yield_force=stiffness * yield_drift, hardening_ratio=hardening)}
    bare = wd.ShearBuilding(mass, stiffness, 3.0)
    building = wd.ShearBuilding(
        mass,
        stiffness,
        3.0,
        damping="mass_proportional",
        damping_ratio=of_mass * bare.fundamental_period / (4 * np.pi),
        devices=[wd.laws.ViscousDamper(damper_coefficient=dashpot)],
        **settings,
    )
    scene = wd.Scene(building, wd.GroundMotion(motion, STEP), recorders=("drift",), tail=0.0)
    found = run(scene, step=STEP / 10, resample=True)["peak_storey_drift"].values.ravel()
    np.testing.assert_allclose(found, PEAKS[law, sample], rtol=5e-4)


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS)
def test_peaks_agree_with_opensees_under_records(law):
    # A few histories of tests/opensees_ensembles.py. In all of its 264 histories, the 95 % quantile of the errors of
    # stoermer is 0.04 %, and that of rk4 0.07 %.
    found = [history for _, _, history in histories([law], [3], RECORDS[::8])]
    assert len(found) == 3
    assert max(each.error("stoermer") for each in found) < 5e-4
    assert max(each.error("rk4") for each in found) < 1e-3


def test_samples_are_the_same_alone_and_beside_others():
    # Motions of different lengths, and collapses: lanes that have finished wait for others.
    motions = [pulse(300), pulse(401, 6.0), pulse(350, 9.0)]
    for law in (BILINEAR, BOUC_WEN):
        scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3))}

        def scene(chosen, law=law, scatter=scatter):
            design = wd.Stripes(chosen, [0.2, 0.8], wd.PeakGroundAcceleration())
            return wd.Scene(frame(**law), design, scatter=scatter, collapse_drift_ratio=0.02)

        together = run(scene(motions), structures=8, dtype="float32", seed=3)
        assert len(np.unique(together["status"])) == 2  # some collapse
        for place, motion in enumerate(motions):
            alone = run(scene([motion]), structures=8, dtype="float32", seed=3)
            same = together["motion_index"] == place
            for name in (
                "peak_storey_drift",
                "peak_floor_acceleration",
                "residual_drift_ratio",
                "status",
                "input_energy",
            ):
                np.testing.assert_array_equal(together[name][same.values], alone[name], name)


def test_an_event_starts_where_the_last_one_ended():
    # The same motion in one event and in two: the second event starts its formulas again, with errors of third order.
    whole = pulse(400)
    half = len(whole.acceleration) // 2
    parts = [
        wd.GroundMotion(each, STEP, name)
        for each, name in ((whole.acceleration[: half + 1], "a"), (whole.acceleration[half:], "b"))
    ]
    peaks = []
    for excitation in (whole, wd.EventSequence({"first": parts[0], "second": parts[1]})):
        found = run(wd.Scene(frame(**BILINEAR), excitation, recorders=("drift",), tail=0.0))
        peak = found["peak_storey_drift"]
        peaks.append(peak.max("event").values.ravel() if "event" in peak.dims else peak.values.ravel())
    np.testing.assert_allclose(*peaks, rtol=1e-3)


def test_what_does_not_fit_is_refused():
    system = wd.LinearSystem(np.eye(2), np.eye(2), 100 * np.eye(2))
    with pytest.raises(ValueError, match="needs a ShearBuilding or a LumpedStructure"):
        run(wd.Scene(system, pulse()))
    relaxing = frame(devices=[wd.laws.MaxwellDamper(brace_stiffness=1e7, damper_coefficient=1e5)])
    with pytest.raises(ValueError, match="cannot integrate a force that relaxes with time"):
        run(wd.Scene(relaxing, pulse()))


def test_a_step_above_the_limit_is_divided_or_refused():
    # With 30 % of damping in the highest mode the limit is 0.76 / omega, and 1.73 / omega without damping.
    building = frame(damping="stiffness_proportional", damping_ratio=0.1)
    scene = wd.Scene(building, pulse(), recorders=("drift",))
    with pytest.raises(ValueError, match="step"):
        run(scene, step=0.04, resample=True, on_unstable="raise")
    divided = run(scene, step=0.04, resample=True, on_unstable="substep")
    assert int(divided["status"].max()) == 0
    assert METHODS["stoermer"].order == 3
