"""Rules of a control that has all kinds of actuators, a regulator with an observer, and a controller."""

import warpdyn as wd
from warpdyn.engine.controllers.rules import DAMPER, FORCE, MAGNETORHEOLOGICAL, ActuatorRules, ControlRules

ACTUATORS = (
    ActuatorRules(FORCE, ((0, 1.0),)),
    ActuatorRules(DAMPER, ((1, 1.0), (0, -1.0))),
    ActuatorRules(MAGNETORHEOLOGICAL, ((0, 1.0),)),
)
CONTROLLED = ControlRules(
    ACTUATORS,
    wd.control.ContinuousSkyhook.written,
    states=2,
    has_regulator=True,
    sensors=3,
    is_noisy=True,
    is_rounded=True,
    delay=2,
    senses_ground=True,
    fails_at_limits=True,
    is_limited=True,
)
