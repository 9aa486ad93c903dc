"""Storey laws as data: the parameters a scene gives them, their bounds, and the coefficients a kernel reads."""

from warpdyn.laws.baber_noori import BABER_NOORI
from warpdyn.laws.bilinear import BILINEAR
from warpdyn.laws.bouc_wen import BOUC_WEN
from warpdyn.laws.hysteretic import HYSTERETIC
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter
from warpdyn.laws.pinching4 import PINCHING4

LAWS = {
    "elastic": Law(),
    "bilinear": BILINEAR,
    "bouc_wen": BOUC_WEN,
    "baber_noori": BABER_NOORI,
    "hysteretic": HYSTERETIC,
    "pinching4": PINCHING4,
}

__all__ = ["HARDENING_RATIO", "LAWS", "YIELD_FORCE", "Law", "Parameter"]
