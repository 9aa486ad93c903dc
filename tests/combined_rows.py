"""Buildings whose storeys have several laws or devices, and their rows of SPRINGS."""

import numpy as np
from combination_cases import VALUES

import warpdyn as wd
from warpdyn.engine.laws import LAWS
from warpdyn.model.structures.shear_building import DAMPING

FRICTION = {"devices": ("friction_damper",), "slip_force": 200.0, "brace_stiffness": 4e5}
STOP = {"clearance": 0.001, "contact_stiffness": 4e5, "restitution": 0.7}
DAMPER = {"damper_coefficient": 500.0, "velocity_exponent": 0.5}
# Rows of SPRINGS made of several, and viscous dampers: laws of the storeys and devices that lead to them.
COMBINED = {
    "bouc_wen_1+friction_damper": {"law": ("bouc_wen",) * 2, **FRICTION},
    "bilinear|bouc_wen_1+gap": {"law": ("lead_rubber_bearing", "bouc_wen"), "devices": ("gap",), **STOP},
    "bouc_wen|takeda|elastic+friction_damper": {"law": ("bouc_wen", "takeda", "elastic"), "exponent": 1.5, **FRICTION},
    "bilinear|menegotto_pinto+friction_damper+gap": {
        "law": ("bilinear", "menegotto_pinto"), **FRICTION, **STOP, "devices": ("friction_damper", "gap")
    },
    "elastic": {"law": ("elastic",) * 2, "devices": ("viscous_damper",), **DAMPER},
    "bilinear+friction_damper": {
        "law": ("bilinear",) * 3, **FRICTION, **DAMPER, "devices": ("viscous_damper", "friction_damper")
    },
}  # fmt: skip
# Four explicit methods, and three implicit ones.
SOME = ("rk4", "nystroem4", "velocity_verlet", "dormand_prince54", "central_difference", "newmark_average", "hht_alpha")


def combined_structure(row, damping):
    """Return a building of a row of COMBINED."""
    given = COMBINED[row]
    taken = {name for law in given["law"] for name in LAWS[law].parameters} | set(DAMPING[damping].parameters)
    values = {name: VALUES[name] for name in taken if name in VALUES}
    return wd.ShearBuilding(np.full(len(given["law"]), 1e3), 4e5, 3.0, damping=damping, **values | given)
