"""Storey laws as data: the parameters a scene gives them, their bounds, and the coefficients a kernel reads."""

from warpdyn.laws.bilinear import BILINEAR
from warpdyn.laws.bouc_wen import BOUC_WEN
from warpdyn.laws.devices import DEVICES
from warpdyn.laws.isolators import FRICTION_PENDULUM, LEAD_RUBBER_BEARING
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter

LAWS = {
    "elastic": Law(),
    "bilinear": BILINEAR,
    "bouc_wen": BOUC_WEN,
    "lead_rubber_bearing": LEAD_RUBBER_BEARING,
    "friction_pendulum": FRICTION_PENDULUM,
}

__all__ = ["DEVICES", "HARDENING_RATIO", "LAWS", "YIELD_FORCE", "Law", "Parameter"]
