"""Storey laws as scalar device functions, one row each in SPRINGS.

A law sees the storey drift [m], its own memory and its coefficients, both as short vectors, and returns a force [N].
The coefficients are prepared once per structure (`warpdyn.laws`), so that no division stands in the time loop.

`spring_row` also makes rows of several: "bouc_wen_1+slip" is of storeys that have both, "bilinear|bouc_wen_1+slip" of
storeys that have the first or the second, and the third besides.
"""

import functools

from warpdyn.kernels.springs.baber_noori import (
    BABER_NOORI,
    BABER_NOORI_1,
    BABER_NOORI_PINCHING,
    BABER_NOORI_PINCHING_1,
)
from warpdyn.kernels.springs.bilinear import BILINEAR
from warpdyn.kernels.springs.bouc_wen import BOUC_WEN, BOUC_WEN_1, BOUC_WEN_2
from warpdyn.kernels.springs.combined import one_or_other, side_by_side
from warpdyn.kernels.springs.elastic import ELASTIC
from warpdyn.kernels.springs.gap import GAP
from warpdyn.kernels.springs.hysteretic import HYSTERETIC, HYSTERETIC_SOFTER
from warpdyn.kernels.springs.ibarra_medina_krawinkler_bilinear import (
    IBARRA_MEDINA_KRAWINKLER_BILINEAR,
    IBARRA_MEDINA_KRAWINKLER_BILINEAR_POWER,
)
from warpdyn.kernels.springs.ibarra_medina_krawinkler_peak import (
    IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED,
    IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED_POWER,
    IBARRA_MEDINA_KRAWINKLER_PINCHING,
    IBARRA_MEDINA_KRAWINKLER_PINCHING_POWER,
)
from warpdyn.kernels.springs.menegotto_pinto import MENEGOTTO_PINTO, MENEGOTTO_PINTO_ISOTROPIC
from warpdyn.kernels.springs.multilinear import MULTILINEAR_2, MULTILINEAR_3
from warpdyn.kernels.springs.peak_oriented import PEAK_ORIENTED, TAKEDA
from warpdyn.kernels.springs.pinching4 import PINCHING4, PINCHING4_CYCLE, PINCHING4_ENERGY
from warpdyn.kernels.springs.slip import SLIP
from warpdyn.kernels.springs.spring import Spring

SPRINGS = {
    "elastic": ELASTIC,
    "bilinear": BILINEAR,
    "bouc_wen_1": BOUC_WEN_1,
    "bouc_wen_2": BOUC_WEN_2,
    "bouc_wen": BOUC_WEN,
    "ibarra_medina_krawinkler_bilinear": IBARRA_MEDINA_KRAWINKLER_BILINEAR,
    "ibarra_medina_krawinkler_bilinear_power": IBARRA_MEDINA_KRAWINKLER_BILINEAR_POWER,
    "ibarra_medina_krawinkler_peak_oriented": IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED,
    "ibarra_medina_krawinkler_peak_oriented_power": IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED_POWER,
    "ibarra_medina_krawinkler_pinching": IBARRA_MEDINA_KRAWINKLER_PINCHING,
    "ibarra_medina_krawinkler_pinching_power": IBARRA_MEDINA_KRAWINKLER_PINCHING_POWER,
    "multilinear_2": MULTILINEAR_2,
    "multilinear_3": MULTILINEAR_3,
    "menegotto_pinto": MENEGOTTO_PINTO,
    "menegotto_pinto_isotropic": MENEGOTTO_PINTO_ISOTROPIC,
    "peak_oriented": PEAK_ORIENTED,
    "takeda": TAKEDA,
    "baber_noori": BABER_NOORI,
    "baber_noori_1": BABER_NOORI_1,
    "baber_noori_pinching": BABER_NOORI_PINCHING,
    "baber_noori_pinching_1": BABER_NOORI_PINCHING_1,
    "hysteretic": HYSTERETIC,
    "hysteretic_softer_unloading": HYSTERETIC_SOFTER,
    "pinching4": PINCHING4,
    "pinching4_energy_damage": PINCHING4_ENERGY,
    "pinching4_cycle_damage": PINCHING4_CYCLE,
}
# Of devices, which stand beside a storey's law.
DEVICE_SPRINGS = {"slip": SLIP, "gap": GAP}


@functools.cache
def spring_row(name: str) -> Spring:
    """Return the row of a name, made of several where it names several: the same name gives the same row."""
    one, _, other = name.rpartition("+")
    if one:
        return side_by_side(one, spring_row(one), other, spring_row(other))
    one, _, other = name.partition("|")
    if other:
        return one_or_other(one, spring_row(one), other, spring_row(other))
    return (SPRINGS | DEVICE_SPRINGS)[name]
