"""Drifts up to which storeys respond elastically, and drifts at which storeys collapse."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.model.structures.physics import capacities_of, inverse_drift_capacity


def elastic_drifts(run: Ensemble) -> tuple[np.ndarray, np.ndarray]:
    """Return two drifts of each storey [m], [structure, storey]: the elastic limit and the collapse drift.

    Up to the elastic limit the storey is linear. The limit is 0 if the storey law is curved from the start (such as
    Bouc-Wen), or if the structure has another nonlinear element: a stop or friction damper, or a viscous damper whose
    force is a power of the velocity.

    Args:
        run: Ensemble with the structures.
    """
    scene, plan = run.scene, run.plan
    count = len(run.rayleigh)
    if plan.pattern is not None:
        limit = np.inf if scene.collapse_limit is None else scene.collapse_limit * scene.structure.parameters["height"]
        # Springs may yield or collapse without a storey.
        is_known = run.model.dynamics.forces.is_linear and not plan.has_drift_capacity
        shape = count, len(plan.pattern.storeys)
        return np.full(shape, np.inf if is_known else 0.0), np.broadcast_to(limit, shape)
    if plan.family != "chain":
        return np.full((count, plan.dofs), np.inf), np.full((count, plan.dofs), np.inf)
    p = run.model.dynamics.parameters_of(run.drawn)
    shape = count, plan.dofs
    law = scene.structure.storey_law
    elastic = np.zeros(shape)
    if law.is_linear_until_yield and plan.viscous_dampers != "power":
        elastic = np.full(shape, np.inf)
        for name in {"yield_force", "yield_force_negative"} & p.keys():
            elastic = np.minimum(elastic, p[name] / p["stiffness"])
    collapse = np.full(shape, np.inf)
    if capacities_of(p):
        collapse = 1 / inverse_drift_capacity(p)
    if scene.collapse_limit is not None:
        collapse = np.minimum(collapse, scene.collapse_limit * p["height"])
    return np.broadcast_to(elastic, shape), np.broadcast_to(collapse, shape)
