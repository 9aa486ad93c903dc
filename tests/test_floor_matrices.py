"""Matrices of a frame whose floors are shared among threads: each thread's rows, evaluated in NumPy, are the matrix."""

import numpy as np
import pytest

from warpdyn.engine.kernels.hinges.floor_matrices import floor_matrices
from warpdyn.engine.kernels.lumped.pattern import UNIT, Pattern, table_of, values_in

pytestmark = pytest.mark.fast


def matrices_of(floors, random):
    """Return matrices of a frame: drifts, a geometric stiffness, full damping, and outputs for some threads only."""
    drifts = np.eye(floors) - np.eye(floors, k=-1)
    band = np.abs(np.subtract.outer(range(floors), range(floors))) < 2
    stiffness, damping = random.uniform(1, 2, (2, floors, floors))
    return {
        "deformation": np.vstack([drifts, np.zeros((3, floors))]),  # the last rows are those of hinges
        "inverse_mass": np.diag(random.uniform(1, 2, floors)),
        "stiffness": -(stiffness + stiffness.T) * band,
        "damping": damping + damping.T,
        "drive": np.ones((floors, 1)),
        "mass": np.diag(random.uniform(1, 2, floors)),
        "unmoved": random.uniform(1, 2, (floors, 1)),
        "output": np.vstack([0.3 * drifts, random.uniform(1, 2, (1, floors))]),
    }


@pytest.mark.parametrize("floors", [2, 3, 5])
def test_rows_of_threads_are_the_matrices(floors):
    random = np.random.default_rng(floors)
    matrices = matrices_of(floors, random)
    tables = {name: table_of(matrix[None]) for name, matrix in matrices.items()}
    pattern = Pattern(**tables)
    terms = np.concatenate(
        [values_in(tables[name], matrices[name][None])[:, 0] for name in pattern.tables if name in tables]
    )
    found = floor_matrices(pattern, floors)

    def value(code):
        return float(code) if abs(code) < 2 else np.sign(code) * terms[abs(code) - 2]

    def element(vector, row, entry, thread):
        column = entry.where if row.is_full else thread + entry.where
        return vector[column] if 0 <= column < len(vector) else 0.0

    drifts = matrices["deformation"][:floors]
    assert "mass" not in found.rows  # only energies need it
    del matrices["mass"]
    for name, matrix in (matrices | {"deformation": drifts, "force": drifts.T}).items():
        vector = random.uniform(-1, 1, matrix.shape[1])
        product = np.full((len(found.rows[name]), floors), np.nan)
        for place, row in enumerate(found.rows[name]):
            for thread in range(floors):
                of_thread = [
                    1.0 if each.place == UNIT else value(found.codes[each.place][thread]) for each in row.entries
                ]
                elements = [element(vector, row, each, thread) for each in row.entries]
                signs = [each.sign for each in row.entries]
                product[place, thread] = np.sum(np.multiply(of_thread, elements) * signs)
        rows = len(matrix)
        np.testing.assert_allclose(product.ravel()[:rows], matrix @ vector, rtol=0, atol=1e-13, err_msg=name)
        np.testing.assert_array_equal(product.ravel()[rows:], 0.0)
    assert found.rows["stiffness"][0].is_full is False
    assert found.rows["damping"][0].is_full is (floors > 2)
