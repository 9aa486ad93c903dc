"""What kernels prepare of the structures of a run, what the host prepares, and their comparison."""

import itertools

import numpy as np
import pytest
import warp as wp

from warpdyn.campaigns.integration import packing
from warpdyn.campaigns.preparation.traced_structures import traced_structures
from warpdyn.engine.kernels.auxiliary.decays import slowest_decays
from warpdyn.engine.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.engine.kernels.plan import structs
from warpdyn.engine.tracing.functions import numpy_function
from warpdyn.engine.tracing.nodes import OPERATIONS
from warpdyn.engine.tracing.requests import FREQUENCIES, PREFIX as RESULT
from warpdyn.engine.tracing.tables import PREFIX, table_of

DIVISIONS = 20
# The same operations in the same order, except that kernels fuse multiplications with additions: 45 units in the last
# place, of which a coefficient loses 1 by each of its operations.
ROUNDING = 1e-14
DEVICES = [
    "cpu",
    pytest.param("cuda:0", marks=pytest.mark.skipif(not wp.get_cuda_device_count(), reason="this computer has no GPU")),
]


def prepared(run, first, end, device="cpu"):
    """Return what the kernels compute of structures `first` to `end`: fields, vibration, refusals and extremes."""
    found, count = traced_structures(run), end - first
    fields = {
        name: wp.full((*rows, count), np.nan, dtype=wp.float64, device=device) for name, rows in found.rows.items()
    }
    vibration = wp.full((3, count), np.nan, dtype=wp.float64, device=device)
    counts = wp.zeros(1, dtype=wp.int32, device=device)
    extremes = wp.array([0.0, np.inf], dtype=wp.float64, device=device)
    struct = structs("float64").Structure()
    for name, array in fields.items():
        setattr(struct, name, array)
    found.prepare(first, count, struct, vibration, counts, extremes)
    own = {name: array.numpy() for name, array in fields.items()}
    return own, vibration.numpy(), counts.numpy()[0], extremes.numpy()


def by_host(run):
    """Return the fields and the vibration of all structures of a run, as the host computes them."""
    drawn, vibration = run.draw(np.arange(run.structures))
    fields = packing.pack_structures(run.model, run.model.dynamics.parameters_of(drawn), None, vibration.rayleigh)
    return fields, np.array([vibration.period, vibration.decay, vibration.stable_step])


def check_rows(found, expected, slack_of=lambda name, count: [0.0] * count, rounding=ROUNDING):
    """Compare fields and vibration with those of the host.

    Args:
        found, expected: Fields and vibration.
        slack_of: Function from a field and its number of rows to the absolute tolerances of the rows.
        rounding: Relative tolerance.
    """
    assert found[0].keys() == expected[0].keys()
    for name, values in expected[0].items():
        values, own = np.atleast_2d(values), np.atleast_2d(found[0][name])
        for each, other, slack in zip(own, values, slack_of(name, len(values)), strict=True):
            np.testing.assert_allclose(each, other, rtol=rounding, atol=slack, err_msg=name)
    (period, decay, stable), (own_period, own_decay, own_stable) = expected[1], found[1]
    np.testing.assert_allclose(own_period, period, rtol=rounding)
    np.testing.assert_allclose(own_stable, stable, rtol=rounding)
    # Eigenvalues of coupled modes have errors of some units in the last place of the largest one, which is below 100 /
    # period here.
    np.testing.assert_allclose(own_decay * period, decay * period, rtol=rounding, atol=100 * 1e-15)


def check_divisions(run, structures, device="cpu"):
    """Prepare the structures of a run in random parts; the results have the bits of the whole."""
    generator = np.random.default_rng(5)

    def rows(first, end):
        fields, vibration, _, _ = prepared(run, first, end, device)
        return np.vstack([*fields.values(), vibration])

    whole = rows(0, structures)
    for _ in range(DIVISIONS):
        edges = [0, *np.flatnonzero(generator.random(structures - 1) < 0.3) + 1, structures]
        np.testing.assert_array_equal(np.hstack([rows(*edge) for edge in itertools.pairwise(edges)]), whole)


def computed(node, inputs, known):
    """Return a value of each structure that NumPy computes from a recorded computation.

    Args:
        node: The value.
        inputs: Values of the names in the texts of inputs.
        known: Values of nodes that were computed before; more are added.
    """
    waiting = [node]
    while waiting:
        each = waiting[-1]
        missing = [other for other in each.arguments if other not in known]
        if missing:
            waiting += missing
            continue
        waiting.pop()
        if each.operation == "input":
            known[each] = eval(each.value, inputs)
        elif each.is_constant:
            known[each] = each.value
        elif each.operation.startswith(PREFIX):
            grid, values, _, _ = table_of(each.operation)
            cell = np.searchsorted(grid, known[each.arguments[0]], side="right") - 1
            known[each] = values[np.clip(cell, 0, values.size - 1)]
        else:
            is_simple = each.operation in OPERATIONS
            function = OPERATIONS[each.operation].function if is_simple else numpy_function(each.operation)
            with np.errstate(all="ignore"):  # in branches that are not taken
                known[each] = function(*(known[other] for other in each.arguments))
    return known[node]


def recorded(run):
    """Return what `prepared` returns, computed by NumPy from the recorded computation."""
    found, structures = traced_structures(run), run.structures
    every = np.arange(structures)
    inputs = {"nominal": found.nominal, "number": every, "s": every}
    inputs["z"] = run.sampler._normals(every)[:, :structures]
    inputs |= {f"given_{place}": values for place, values in enumerate(found.given)}
    known = {}

    def values_of(nodes):
        values = [np.broadcast_to(computed(node, inputs, known), structures) for node in np.ravel(nodes)]
        return np.reshape(values, (*np.shape(nodes), structures))

    for place, request in enumerate(found.values.requests):
        given = [values_of(each).T for each in request.inputs]
        if request.kind == FREQUENCIES:
            inputs[f"{RESULT}{place}"] = circular_frequencies(*given).T
        else:
            mass, stiffness, of_mass, dashpots = given
            inputs[f"{RESULT}{place}"] = slowest_decays(mass, stiffness, of_mass[:, 0], dashpots)[None]
    fields = {name: values_of(nodes) for name, nodes in found.values.fields.items()}
    refused = np.broadcast_to(computed(found.values.refused, inputs, known), structures)
    return fields, values_of(found.values.vibration), np.count_nonzero(refused)
