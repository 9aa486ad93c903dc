"""Storey laws, dampers and stops: classes with parameters, bounds and device functions (functions in kernels).

    warpdyn.laws.Bilinear(yield_force=1e6, hardening_ratio=0.05)

Defining a subclass of `Law` or `Device`, also in a user's program, registers it in LAWS or DEVICES. A law of warpdyn
has a folder with two files: `parameters.py` contains its class, and `device_functions.py` its Warp functions in a table
SPRINGS. The second file is imported when a kernel is built, so importing this package does not import Warp.
"""

from __future__ import annotations

import importlib
from typing import Any

from warpdyn.engine.laws.definition import BIAXIAL_LAWS, CONTACTS, DEVICES, LAWS
from warpdyn.engine.laws.law import (
    HARDENING_RATIO,
    YIELD_FORCE,
    Device,
    Law,
    StoreyElement,
    parameter,
    shared,
)
from warpdyn.engine.laws.parameter import Parameter
from warpdyn.foundations.core.near_misses import did_you_mean

# isort: split  (the first three laws come first in messages)
from warpdyn.engine.laws.elastic.parameters import Elastic  # isort: skip
from warpdyn.engine.laws.bilinear.parameters import Bilinear, ElasticPerfectlyPlastic  # isort: skip
from warpdyn.engine.laws.bouc_wen.parameters import BoucWen  # isort: skip
from warpdyn.engine.laws.baber_noori.parameters import BaberNoori
from warpdyn.engine.laws.biaxial.law import BiaxialLaw
from warpdyn.engine.laws.biaxial.parameters import CircularYield, FrictionSlider, IsotropicBoucWen, ParkWenAng
from warpdyn.engine.laws.contacts.contact import Contact
from warpdyn.engine.laws.contacts.parameters import (
    HertzContact,
    JankowskiContact,
    KelvinVoigtContact,
    KelvinVoigtContactWithTension,
    MuthukumarDesRochesContact,
    PreloadedContact,
    YeLiZhuContact,
)
from warpdyn.engine.laws.devices.parameters import FrictionDamper, Gap, OneSidedGap, ViscousDamper
from warpdyn.engine.laws.hysteretic.parameters import Hysteretic
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import (
    IbarraMedinaKrawinklerBilinear,
    IbarraMedinaKrawinklerPeakOriented,
    IbarraMedinaKrawinklerPinching,
)
from warpdyn.engine.laws.isolators.parameters import FrictionPendulum, LeadRubberBearing
from warpdyn.engine.laws.isolators.triple_pendulum import triple_pendulum
from warpdyn.engine.laws.maxwell_damper.parameters import MaxwellDamper
from warpdyn.engine.laws.menegotto_pinto.parameters import MenegottoPinto
from warpdyn.engine.laws.multilinear.parameters import Quadrilinear, Trilinear
from warpdyn.engine.laws.peak_oriented.parameters import PeakOriented, Takeda
from warpdyn.engine.laws.pinching4.parameters import GEM_DAMAGE, Pinching4
from warpdyn.engine.laws.saws.parameters import Saws
from warpdyn.engine.laws.self_centring.parameters import SelfCentring

__all__ = [
    "BIAXIAL_LAWS",
    "CONTACTS",
    "DEVICES",
    "GEM_DAMAGE",
    "HARDENING_RATIO",
    "LAWS",
    "YIELD_FORCE",
    "BaberNoori",
    "BiaxialLaw",
    "Bilinear",
    "BoucWen",
    "CircularYield",
    "Contact",
    "Device",
    "Elastic",
    "ElasticPerfectlyPlastic",
    "FrictionDamper",
    "FrictionPendulum",
    "FrictionSlider",
    "Gap",
    "HertzContact",
    "Hysteretic",
    "IbarraMedinaKrawinklerBilinear",
    "IbarraMedinaKrawinklerPeakOriented",
    "IbarraMedinaKrawinklerPinching",
    "IsotropicBoucWen",
    "JankowskiContact",
    "KelvinVoigtContact",
    "KelvinVoigtContactWithTension",
    "Law",
    "LeadRubberBearing",
    "MaxwellDamper",
    "MenegottoPinto",
    "MuthukumarDesRochesContact",
    "OneSidedGap",
    "Parameter",
    "ParkWenAng",
    "PeakOriented",
    "Pinching4",
    "PreloadedContact",
    "Quadrilinear",
    "Saws",
    "SelfCentring",
    "StoreyElement",
    "Takeda",
    "Trilinear",
    "ViscousDamper",
    "YeLiZhuContact",
    "certify",
    "parameter",
    "shared",
    "triple_pendulum",
]


def __getattr__(name: str) -> Any:
    """Return `certify`, which is imported only when it is used; raise an AttributeError for other names."""
    if name == "certify":
        # `campaigns` is a later package, which may be imported only when this function is called.
        return importlib.import_module("warpdyn.campaigns.running.certification").certify
    raise AttributeError(f"warpdyn.laws has no {name!r}{did_you_mean(name, __all__)}; dir(wd.laws) lists its names")


def __dir__() -> list[str]:
    """Return the public names, without the names of the folders."""
    return sorted(__all__)
