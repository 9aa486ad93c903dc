"""Device functions of the linear elastic storey."""

from typing import Any

import warp as wp

from warpdyn.engine.laws.elastic.parameters import Coefficient as C
from warpdyn.engine.laws.spring import Spring


@wp.func
def elastic_force(drift: Any, memory: Any, c: Any):
    return c[C.STIFFNESS] * drift


@wp.func
def elastic_elastic_energy(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * c[C.STIFFNESS] * drift * drift


@wp.func
def elastic_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return c[C.STIFFNESS]


SPRINGS = {
    "elastic": Spring(elastic_force, None, elastic_elastic_energy, coefficients=len(C), tangent=elastic_tangent),
}
