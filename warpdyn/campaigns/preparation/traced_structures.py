"""Preparation kernels for structures, recorded from the NumPy functions that prepare structures on the host."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from warpdyn.campaigns.integration.run import Run
from warpdyn.engine.kernels.preparing.structures import Draws, StructurePreparation, StructureValues
from warpdyn.engine.tracing.arrays import NotTraceableError, Traced, conditions, nodes_of
from warpdyn.engine.tracing.nodes import Node, apply, constant, given
from warpdyn.engine.tracing.requests import requests
from warpdyn.foundations.core.random_numbers import key_of
from warpdyn.model.scene.scatter import GivenValues, only_at, only_varied, storeys_with
from warpdyn.model.scene.sobol_points import BITS
from warpdyn.model.structures.physics import physics_problem


def traced_structures(run: Run) -> StructurePreparation:
    """Return the kernels that draw the structures of a run and compute their arrays on a device.

    Raises:
        NotTraceableError: If a NumPy function of the preparation cannot be recorded as a kernel.
    """
    model, sampler, structure = run.model, run.sampler, run.model.scene.structure
    dynamics, values_of_nominal = model.dynamics, structure.nominal_values
    if structure.family == "lumped":
        raise NotTraceableError("the host computes the inverse mass matrices of lumped structures")
    if model.needs_step:
        raise NotTraceableError("the host computes the propagators of exact methods")
    nominal, flat = _nominal(values_of_nominal)
    normals: Any = Traced.inputs(lambda variable, row: f"z[{variable}]", len(sampler.variables), 1)
    listed: list[np.ndarray] = []
    drawn: dict[str, Any] = {}
    place = 0
    with conditions() as refused:
        for name, spread in sampler.scatter.items():
            count = spread.variables(structure.length_of(name))
            if isinstance(spread, GivenValues):
                values: Any = spread.placed(_given(len(listed), spread.values), nominal[name])
                listed.append(np.asarray(spread.values, dtype=np.float64))
            else:
                values = spread.draw(nominal[name], normals[place : place + count], np.arange(1))
                values = only_varied(spread.varied(name, structure), values, nominal[name])
            taken = storeys_with(values_of_nominal[name])
            drawn[name] = only_at(taken, values).T
            place += count
            checked = drawn[name] if taken is None else drawn[name][..., taken]
            np.any(structure.parameter_table[name].violations(checked))
        everything: dict[str, Any] = {**{name: nominal[name] for name in structure.parameters}, **drawn}
        problem = structure.storey_law.problem(everything) or physics_problem(everything)
        if problem:
            raise NotTraceableError(problem)
    with requests() as asked:
        parameters = {name: drawn.get(name, values[None]) for name, values in nominal.items()}
        period, decay, stable, rayleigh = dynamics._vibration(parameters, model.method)
        packed = dynamics.pack(parameters, rayleigh)
    fields = {name: nodes_of(values)[..., 0] for name, values in packed.items()}
    vibration = [nodes_of(each).ravel()[0] for each in (period, decay, stable)]
    values_of = StructureValues(fields, vibration, _any(refused), asked)
    draws = Draws(
        model.scene.sampling,
        key_of(model.seed),
        sampler.digits,
        sampler.points,
        sampler.factor,
        BITS,
    )
    return StructurePreparation(draws, flat, listed, values_of, model.plan.dtype)


def _nominal(values: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], np.ndarray]:
    """Return nominal parameter values as traced variables, and the array from which a kernel reads them.

    A storey whose law does not have a parameter gets the constant NaN.
    """
    found, flat = dict[str, Any](), list[float]()
    for name, array in values.items():
        nodes = np.empty(np.shape(array), object)
        for index, value in np.ndenumerate(array):
            nodes[index] = constant(value) if np.isnan(value) else given(f"nominal[{len(flat)}]", varies=False)
            flat.append(float(value))
        found[name] = Traced(nodes)
    return found, np.array(flat)


def _given(number: int, values: np.ndarray) -> Any:
    """Return given values of a parameter as traced variables, shape [1] or [1, storey], which a kernel reads by number.

    Args:
        number: Number of the array of given values.
        values: The given values, shape [structure] or [structure, storey].
    """
    name = f"given_{number}"
    if values.ndim == 1:
        return Traced.inputs(lambda row: f"{name}[number]", 1)
    return Traced.inputs(lambda row, storey: f"{name}[number, {storey}]", 1, values.shape[1])


def _any(nodes: Sequence[Node]) -> Node:
    """Return a condition that is true if any of the given conditions is true for a structure."""
    found = constant(False)
    for node in dict.fromkeys(node for node in nodes if node.varies):  # the host has checked constant conditions
        found = apply("logical_or", found, node)
    return found
