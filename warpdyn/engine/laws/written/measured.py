"""Names of the measured values that the device function of a controller may read."""

from __future__ import annotations

#: Names that the device function of a controller may read from its argument `measured`, with their meanings.
MEASURED = {
    "time": "time since the start of the run [s]",
    "desired": "output of the regulator for this actuator; 0 without a regulator",
    "drift": "measured displacement between the ends of the actuator [m]",
    "rate": "measured velocity between the ends of the actuator [m/s]",
    "force": "measured force of the actuator [N]",
    "upper_velocity": "measured velocity of the upper end of the actuator, relative to the base [m/s]",
    "ground_velocity": "velocity of the base, integrated from the motion [m/s]; 0 at the start",
    "displacement": "measured displacement of each degree of freedom [m], index from 0",
    "velocity": "measured velocity of each degree of freedom [m/s], index from 0",
    "acceleration": "measured absolute acceleration of each degree of freedom [m/s2], index from 0",
}
