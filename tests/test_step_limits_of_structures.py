"""The longest stable step of a structure does not depend on the structures that are prepared with it."""

import numpy as np

import warpdyn as wd
from warpdyn.campaigns.integration.lumped.dynamics import LumpedDynamics
from warpdyn.engine.methods.table import METHODS

FLOORS, STRUCTURES = 5, 40


def test_some_structures_that_stiffen_leave_the_bits_of_the_others():
    law = {"law": "hysteretic", "stiffness": 1e7, "yield_force": 1e5, "ductility_2": 4.0, "force_ratio_2": 1.2}
    law |= {"ductility_3": 10.0, "force_ratio_3": 1.3, "stiffness_ratio_negative": 1.0}
    law |= {f"{name}_negative": law[name] for name in ("yield_force", "ductility_2", "force_ratio_2")}
    law |= {f"{name}_negative": law[name] for name in ("ductility_3", "force_ratio_3")}
    springs = [
        wd.Spring(f"s{floor}", {f"u{floor}": 1.0} | ({f"u{floor - 1}": -1.0} if floor else {}), **law)
        for floor in range(FLOORS)
    ]
    masses = {f"u{floor}": 1e4 * (1 + 0.1 * floor) for floor in range(FLOORS)}
    structure = wd.LumpedStructure(masses, springs, damping="rayleigh", damping_ratio=0.03)
    random = np.random.default_rng(0)
    # Above 1, springs are stiffer than at the start after they have yielded.
    ratio = np.repeat(random.uniform(0.9, 1.1, (STRUCTURES, 1)), FLOORS, axis=1)
    assert 10 < np.count_nonzero(ratio[:, 0] > 1) < 30
    stiffness = 1e7 * random.uniform(0.8, 1.2, (STRUCTURES, FLOORS))
    values = {"stiffness": stiffness, "stiffness_ratio_negative": ratio}
    dynamics = LumpedDynamics(structure, values)

    def vibration(structures):
        return dynamics._vibration(dynamics.parameters_of(values, structures), METHODS["rk4"])[:3]

    together = vibration(slice(None))
    for each in range(STRUCTURES):
        for of_all, of_one in zip(together, vibration(slice(each, each + 1)), strict=True):
            np.testing.assert_array_equal(of_all[each], of_one[0])
