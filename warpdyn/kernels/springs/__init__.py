"""Storey laws as scalar device functions, one row each in SPRINGS.

A law sees the storey drift [m], its own memory and its coefficients, both as short vectors, and returns a force [N].
The coefficients are prepared once per structure (`warpdyn.laws`), so that no division stands in the time loop.
"""

from warpdyn.kernels.springs.baber_noori import BABER_NOORI, BABER_NOORI_PINCHING
from warpdyn.kernels.springs.bilinear import BILINEAR
from warpdyn.kernels.springs.bouc_wen import BOUC_WEN, BOUC_WEN_1, BOUC_WEN_2
from warpdyn.kernels.springs.elastic import ELASTIC
from warpdyn.kernels.springs.hysteretic import HYSTERETIC, HYSTERETIC_SOFTER
from warpdyn.kernels.springs.pinching4 import PINCHING4, PINCHING4_CYCLE, PINCHING4_ENERGY

SPRINGS = {
    "elastic": ELASTIC,
    "bilinear": BILINEAR,
    "bouc_wen_1": BOUC_WEN_1,
    "bouc_wen_2": BOUC_WEN_2,
    "bouc_wen": BOUC_WEN,
    "baber_noori": BABER_NOORI,
    "baber_noori_pinching": BABER_NOORI_PINCHING,
    "hysteretic": HYSTERETIC,
    "hysteretic_softer_unloading": HYSTERETIC_SOFTER,
    "pinching4": PINCHING4,
    "pinching4_energy_damage": PINCHING4_ENERGY,
    "pinching4_cycle_damage": PINCHING4_CYCLE,
}
