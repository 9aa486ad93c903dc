"""Device functions of laws and devices by name; combinations are named as in "bilinear|bouc_wen_1+gap"."""

from warpdyn.engine.laws import DEVICES, LAWS
from warpdyn.engine.laws.building_law import BuildingLaw
from warpdyn.engine.laws.springs import OneOrOther, SideBySide, spring_row

ELEMENTS = {**LAWS, **DEVICES}
VARIANTS = {name: variant for element in ELEMENTS.values() for name, variant in element.variants.items()}
SPRINGS = {name: spring_row(variant) for law in LAWS.values() for name, variant in law.variants.items()}


def rules_of(name):
    """Return the device functions of a name, as a plan has them."""
    first, _, device = name.rpartition("+")
    if first:
        return SideBySide(rules_of(first), VARIANTS[device])
    first, _, other = name.partition("|")
    return OneOrOther(VARIANTS[first], rules_of(other)) if other else VARIANTS[name]


def forces_of(law):
    """Return the storey forces of laws and devices, such as "bilinear|bouc_wen+gap"."""
    laws, *devices = law.split("+")
    building = BuildingLaw([LAWS[name] for name in laws.split("|")], [DEVICES[name] for name in devices])
    return building.forces(has_power_dampers="viscous_damper" in devices)
