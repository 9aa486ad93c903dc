"""Storey laws as data: the parameters a scene gives them, their bounds, and the coefficients a kernel reads."""

from warpdyn.laws.baber_noori import BABER_NOORI
from warpdyn.laws.bilinear import BILINEAR
from warpdyn.laws.bouc_wen import BOUC_WEN
from warpdyn.laws.devices import DEVICES
from warpdyn.laws.elastic_perfectly_plastic import ELASTIC_PERFECTLY_PLASTIC
from warpdyn.laws.hysteretic import HYSTERETIC
from warpdyn.laws.ibarra_medina_krawinkler import (
    IBARRA_MEDINA_KRAWINKLER_BILINEAR,
    IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED,
    IBARRA_MEDINA_KRAWINKLER_PINCHING,
)
from warpdyn.laws.isolators import FRICTION_PENDULUM, LEAD_RUBBER_BEARING
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter
from warpdyn.laws.menegotto_pinto import MENEGOTTO_PINTO
from warpdyn.laws.multilinear import QUADRILINEAR, TRILINEAR
from warpdyn.laws.peak_oriented import PEAK_ORIENTED, TAKEDA
from warpdyn.laws.pinching4 import PINCHING4

LAWS = {
    "elastic": Law(),
    "bilinear": BILINEAR,
    "bouc_wen": BOUC_WEN,
    "lead_rubber_bearing": LEAD_RUBBER_BEARING,
    "friction_pendulum": FRICTION_PENDULUM,
    "ibarra_medina_krawinkler_bilinear": IBARRA_MEDINA_KRAWINKLER_BILINEAR,
    "ibarra_medina_krawinkler_peak_oriented": IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED,
    "ibarra_medina_krawinkler_pinching": IBARRA_MEDINA_KRAWINKLER_PINCHING,
    "elastic_perfectly_plastic": ELASTIC_PERFECTLY_PLASTIC,
    "trilinear": TRILINEAR,
    "quadrilinear": QUADRILINEAR,
    "menegotto_pinto": MENEGOTTO_PINTO,
    "peak_oriented": PEAK_ORIENTED,
    "takeda": TAKEDA,
    "baber_noori": BABER_NOORI,
    "hysteretic": HYSTERETIC,
    "pinching4": PINCHING4,
}

__all__ = ["DEVICES", "HARDENING_RATIO", "LAWS", "YIELD_FORCE", "Law", "Parameter"]
