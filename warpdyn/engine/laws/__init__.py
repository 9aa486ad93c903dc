"""Storey laws: one folder each, with the parameters a scene gives them and the device functions a kernel runs.

A law's folder holds `parameters.py`, with a class whose fields are the parameters (`Law`, or `Device` of what stands
beside a storey's law), and `device_functions.py`, with its Warp functions in a table SPRINGS. The tables LAWS and
DEVICES are found: they hold the classes of all folders, under their names in a scene. Nothing here imports warp;
`warpdyn.engine.laws.springs` imports the device functions when the first row is asked for.

    warpdyn.laws.Bilinear(yield_force=1e6, hardening_ratio=0.05)

To add a law, add its folder; `elastic` is the shortest to begin from, `bilinear` the shortest with memory, `bouc_wen`
the one of a rate law. `tests/test_law_contract.py` then takes it through what every law must fulfil. The imports below
under TYPE_CHECKING let editors complete its name.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING, TypeVar

from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Device, Law, StoreyElement
from warpdyn.engine.laws.parameter import Parameter
from warpdyn.engine.laws.pinching4.parameters import GEM_DAMAGE

if TYPE_CHECKING:  # what editors complete; the tables below need no entry
    from warpdyn.engine.laws.baber_noori.parameters import BaberNoori
    from warpdyn.engine.laws.bilinear.parameters import Bilinear, ElasticPerfectlyPlastic
    from warpdyn.engine.laws.bouc_wen.parameters import BoucWen
    from warpdyn.engine.laws.devices.parameters import FrictionDamper, Gap, OneSidedGap, ViscousDamper
    from warpdyn.engine.laws.elastic.parameters import Elastic
    from warpdyn.engine.laws.hysteretic.parameters import Hysteretic
    from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import (
        IbarraMedinaKrawinklerBilinear,
        IbarraMedinaKrawinklerPeakOriented,
        IbarraMedinaKrawinklerPinching,
    )
    from warpdyn.engine.laws.isolators.parameters import FrictionPendulum, LeadRubberBearing
    from warpdyn.engine.laws.maxwell_damper.parameters import MaxwellDamper
    from warpdyn.engine.laws.menegotto_pinto.parameters import MenegottoPinto
    from warpdyn.engine.laws.multilinear.parameters import Quadrilinear, Trilinear
    from warpdyn.engine.laws.peak_oriented.parameters import PeakOriented, Takeda
    from warpdyn.engine.laws.pinching4.parameters import Pinching4
    from warpdyn.engine.laws.saws.parameters import Saws
    from warpdyn.engine.laws.self_centring.parameters import SelfCentring

_Kind = TypeVar("_Kind", bound=StoreyElement)
FIRST = ("elastic", "bilinear", "bouc_wen")  # folders that come first in messages; the others follow by name


def law_folders() -> list[str]:
    """Return the names of the folders of laws, devices and isolators, in the order of the tables."""
    found = sorted(module.name for module in pkgutil.iter_modules(__path__) if module.ispkg)
    return [name for name in FIRST if name in found] + [name for name in found if name not in FIRST]


def find(kind: type[_Kind]) -> dict[str, type[_Kind]]:
    """Return the laws, or the devices, of all folders, by their names in a scene."""
    found: dict[str, type[_Kind]] = {}
    for folder in law_folders():
        module = importlib.import_module(f"{__name__}.{folder}.parameters")
        for value in vars(module).values():
            is_class = isinstance(value, type) and value.__module__ == module.__name__
            if is_class and issubclass(value, kind) and not value.__name__.startswith("_"):
                found[value.name] = value
    return found


#: The class of every storey law by its name in a scene.
LAWS: dict[str, type[Law]] = find(Law)
#: The class of every device that stands beside a storey's law, by its name in a scene.
DEVICES: dict[str, type[Device]] = find(Device)
globals().update({element.__name__: element for element in (LAWS | DEVICES).values()})

__all__ = [
    "DEVICES",
    "GEM_DAMAGE",
    "HARDENING_RATIO",
    "LAWS",
    "YIELD_FORCE",
    "Device",
    "Law",
    "Parameter",
    "StoreyElement",
]
__all__ += [element.__name__ for element in (LAWS | DEVICES).values()]


def __dir__() -> list[str]:
    """Return the public names, which the folders' and the tables' own words would hide."""
    return sorted(__all__)
