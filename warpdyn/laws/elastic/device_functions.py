"""The linear storey."""

from typing import Any

import warp as wp

from warpdyn.laws.spring import Spring


@wp.func
def elastic_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift


@wp.func
def elastic_recoverable(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * c[0] * drift * drift


@wp.func
def elastic_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return c[0]


SPRINGS = {
    "elastic": Spring(elastic_force, None, elastic_recoverable, coefficients=1, tangent=elastic_tangent),
}
