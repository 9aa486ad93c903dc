"""Storey laws as data: the parameters a scene gives them, their bounds, and the coefficients a kernel reads."""

from warpdyn.laws.bilinear import BILINEAR
from warpdyn.laws.bouc_wen import BOUC_WEN
from warpdyn.laws.devices import DEVICES
from warpdyn.laws.ibarra_medina_krawinkler import (
    IBARRA_MEDINA_KRAWINKLER_BILINEAR,
    IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED,
    IBARRA_MEDINA_KRAWINKLER_PINCHING,
)
from warpdyn.laws.isolators import FRICTION_PENDULUM, LEAD_RUBBER_BEARING
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter

LAWS = {
    "elastic": Law(),
    "bilinear": BILINEAR,
    "bouc_wen": BOUC_WEN,
    "lead_rubber_bearing": LEAD_RUBBER_BEARING,
    "friction_pendulum": FRICTION_PENDULUM,
    "ibarra_medina_krawinkler_bilinear": IBARRA_MEDINA_KRAWINKLER_BILINEAR,
    "ibarra_medina_krawinkler_peak_oriented": IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED,
    "ibarra_medina_krawinkler_pinching": IBARRA_MEDINA_KRAWINKLER_PINCHING,
}

__all__ = ["DEVICES", "HARDENING_RATIO", "LAWS", "YIELD_FORCE", "Law", "Parameter"]
