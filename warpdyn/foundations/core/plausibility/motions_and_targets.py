"""Plausibility checks of generated motions, target spectra and measured responses; part of the table of checks."""

from __future__ import annotations

from collections.abc import Mapping

from warpdyn.foundations.core.plausibility.check import (
    ACCELERATION_IN_G,
    TIME,
    VELOCITY,
    Check,
    given_in,
    with_units,
)

CHECKS_OF_MOTIONS: Mapping[str, Check] = {
    # Pulses of recorded near-fault motions have 0.1 to 2 m/s (Mavroeidis and Papageorgiou 2003).
    "pulse_amplitude": Check("amplitude of the velocity pulse", "m/s", 0.0, 5.0, given_in(VELOCITY)),
    # A pulse whose middle is after the end of the motion mostly acts on its free vibration.
    "pulse_time": Check(
        *("middle of the velocity pulse over the duration of the motion", "1", 0.0, 1.0),
        with_units("time", TIME) | {"its time counts from the start of the motion": None},
    ),
    # Recorded motions have up to 30 m/s.
    "synthetic_arias_intensity": Check("Arias intensity of the synthetic motion", "m/s", 0.0, 50.0, given_in(VELOCITY)),
    # Medians of ground-motion models are at most about 2 g, at short periods next to the fault.
    "median_spectral_acceleration": Check(
        "largest median of Sa", "g", 1e-5, 4.0, given_in(ACCELERATION_IN_G), typical=0.3
    ),
    # Disaggregation at return periods of up to 10,000 years leads to values of up to about 3.
    "conditioning_epsilon": Check(
        *("number of standard deviations between the level and the median (epsilon)", "1", 0.0, 4.0),
        {
            "the level or the medians may be given in m/s2: give both in g": None,
            "epsilon may be a level, which level= takes": lambda value: value > 10,
        },
    ),
    # Free vibration after the motion may be measured, too.
    "measured_duration": Check(
        *("duration of the measurement over that of the motion", "1", 0.0, 30.0),
        with_units("step", TIME) | {"the motion may be another one than that of the measurement": None},
    ),
}
