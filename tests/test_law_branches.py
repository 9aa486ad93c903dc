"""Storey laws that go on along a line: where nothing is decided, by that line as by all of their rules."""

import functools
from zlib import crc32

import numpy as np
import pytest
import warp as wp
from combination_cases import ROW_OF_LAW, springs_of_laws
from law_rows import SPRINGS
from method_sources import thorough_unless
from storey_draws import STIFFNESS, YIELD_DRIFT, YIELD_FORCE, drawn_building, random_paths

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.laws import LAWS

STOREYS = 200
ROWS = [name for name, spring in SPRINGS.items() if spring.leaves_line is not None]
# Of the yield force. A step rounds forces on lines that begin up to a hundred yield drifts away; over thousands of
# steps a line adds up what it rounds.
STEP = {"float64": 1e-12, "float32": 1e-4}
PATH = {"float64": 1e-10, "float32": 1e-2}
# Chords, in yield drifts, and of the initial stiffness what rounding and the bend of curves make of their slopes.
CHORD, SLOPE = 1e-5, 1e-4
# Storeys, in single precision or exhausted, whose rounding a jump of the law may show: damage that runs away aims at
# drifts of 1e14 yield drifts and more, and a low power of energy lifts what rounding leaves of it.
MAY_DIFFER = STOREYS // 50


@functools.cache
def walking_kernel(row: str, dtype_name: str) -> wp.Kernel:
    """Return a kernel that takes storeys along drifts by their rules, and by lines where nothing is decided."""
    spring, dtype = SPRINGS[row], DTYPES[dtype_name]
    options = module_options(max_unroll=1)  # products and sums fused, as in whole histories
    mapped, memory_on_line, leaves_line, tangent_on_line, force, held, C = (
        spring.return_mapping,
        spring.memory_on_line,
        spring.leaves_line,
        spring.tangent_on_line,
        spring.force,
        spring.force_at_accepted_state,
        spring.coefficients,
    )
    LENGTH = wp.constant(dtype(CHORD * YIELD_DRIFT))
    CHANGED = spring.values_on_line or spring.memory
    coefficient_vector = wp.types.vector(length=C, dtype=dtype)
    memory_vector = wp.types.vector(length=spring.memory, dtype=dtype)

    @wp.kernel(module="unique", enable_backward=False, module_options=options)
    def walk(coefficients: wp.array2d(dtype=dtype), drift: wp.array2d(dtype=dtype), result: wp.array3d(dtype=dtype)):
        storey = wp.tid()
        c = coefficient_vector()
        for q in range(C):
            c[q] = coefficients[q, storey]
        by_rules = memory_vector()
        by_lines = memory_vector()
        for step in range(drift.shape[0]):
            now = drift[step, storey]
            result[0, step, storey] = wp.where(leaves_line(now, by_rules, c), dtype(1.0), dtype(0.0))
            result[1, step, storey] = held(now, memory_on_line(now, by_rules, c), c)
            result[4, step, storey] = tangent_on_line(now, by_rules, c)
            behind, ahead = now - LENGTH, now + LENGTH
            here = force(now, by_rules, c)
            result[5, step, storey] = (here - force(behind, by_rules, c)) / (now - behind)
            result[6, step, storey] = (force(ahead, by_rules, c) - here) / (ahead - now)
            ends = leaves_line(behind, by_rules, c) or leaves_line(ahead, by_rules, c)
            result[7, step, storey] = wp.where(ends, dtype(1.0), dtype(0.0))
            by_rules = mapped(now, by_rules, c)
            result[2, step, storey] = held(now, by_rules, c)
            if leaves_line(now, by_lines, c):
                by_lines = mapped(now, by_lines, c)
            else:
                on_line = memory_on_line(now, by_lines, c)
                for m in range(CHANGED):
                    by_lines[m] = on_line[m]
            result[3, step, storey] = held(now, by_lines, c)

    return walk


def swinging(rng: np.random.Generator) -> np.ndarray:
    """Return drifts [m] of storeys that swing ever wider in two modes about a drift that they go to, [step, storey]."""
    time = np.linspace(0, 1, 3000)[:, None]
    amplitude = 10 ** rng.uniform(-0.5, 1.1, STOREYS)
    slow, fast, phase = rng.uniform(8, 12, STOREYS), rng.uniform(40, 60, STOREYS), rng.uniform(0, 6, STOREYS)
    share, middle = rng.uniform(0, 0.3, STOREYS), rng.normal(size=STOREYS)
    swings = np.sin(2 * np.pi * slow * time) + share * np.sin(2 * np.pi * fast * time + phase)
    return YIELD_DRIFT * (amplitude * swings * time + middle * time)


PATHS = {
    "random": lambda rng: random_paths(STOREYS, 40, 100, rng)[:-1],  # not to 0, where lines may end
    "random, long steps": lambda rng: random_paths(STOREYS, 200, 7, rng)[:-1],
    "swinging": swinging,
    "standing": lambda rng: np.repeat(random_paths(STOREYS, 40, 50, rng)[:-1], 2, axis=0),
}


@functools.cache
def drawn_coefficients(row: str) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients of a row, [coefficient, storey], and which storeys energy may exhaust: half, if any."""
    rng = np.random.default_rng(crc32(row.encode()))
    law, _values = springs_of_laws()[row]
    names = LAWS[law].parameters
    lasting = {name: 10.0 for name in names if name.endswith("_deterioration_drift")}
    lasting |= {name: 0.01 for name in names if name.startswith("damage_by_")}
    # By a power below 1 damage would make much of what rounding leaves of no energy.
    lasting |= {name: 1.0 for name in names if name.endswith("_use_exponent")}
    lasting |= {"ultimate_drift": 0.0} if "ultimate_drift" in names else {}
    parts = []
    for fixed in ({}, {}, lasting, lasting):
        building = drawn_building(law, STOREYS // 4, rng, is_asymmetric="asymmetric" in row, **fixed)
        parameters = {name: np.atleast_1d(value)[None] for name, value in building.parameters.items()}
        parts.append(np.concatenate(np.broadcast_arrays(*LAWS[law].coefficients(parameters, row))))
    return np.concatenate(parts, axis=1), (np.arange(STOREYS) < STOREYS // 2) & bool(lasting)


def walked(row: str, drift: np.ndarray, dtype: str) -> np.ndarray:
    """Return what the walking kernel finds of drawn storeys along drifts, [result, step, storey]."""
    given = drawn_coefficients(row)[0], drift
    arrays = [wp.array(part.astype(dtype), dtype=DTYPES[dtype], device="cpu") for part in given]
    result = wp.full((8, *drift.shape), np.nan, dtype=DTYPES[dtype], device="cpu")
    wp.launch(loaded(walking_kernel(row, dtype)), dim=STOREYS, inputs=[*arrays, result], device="cpu")
    assert np.isfinite(result.numpy()).all()
    return result.numpy()


@pytest.mark.parametrize("row", [thorough_unless(row in ROW_OF_LAW.values(), row) for row in ROWS])
def test_a_storey_that_has_not_moved_has_its_initial_stiffness(row):
    leaves_line, *_forces, tangent, behind, ahead, _ends = walked(row, np.zeros((1, STOREYS)), "float64")
    np.testing.assert_allclose([behind, ahead], STIFFNESS, rtol=1e-5)
    stays = leaves_line == 0
    np.testing.assert_allclose(tangent[stays], STIFFNESS, rtol=1e-12)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("row", [thorough_unless(row in ROW_OF_LAW.values(), row) for row in ROWS])
def test_lines_are_the_rules_where_nothing_is_decided(row, path, dtype):
    _coefficients, exhausts = drawn_coefficients(row)
    drift = PATHS[path](np.random.default_rng([crc32(row.encode()), len(path)]))
    leaves_line, line, rules, by_lines, tangent, behind, ahead, ends = walked(row, drift, dtype)
    assert set(np.unique(leaves_line)) == {0, 1}
    leaves_line = leaves_line == 1
    # Lines are worth having, bear force, and end somewhere else than rules lead.
    assert leaves_line.mean() < 0.4
    assert (~leaves_line & (np.abs(rules) > 0.01 * YIELD_FORCE)).mean() > 0.1
    missed = np.abs(line - rules) / YIELD_FORCE
    assert (missed[leaves_line] > 0.01).any()
    assert missed[~leaves_line].max() < STEP[dtype]
    if dtype == "float64":  # in single precision, chords round too much off
        # A line may bend where it meets a backbone: a chord to one side or the other is straight then.
        along = ~leaves_line & (ends == 0)
        assert along.sum() > 0.4 * (~leaves_line).sum()  # where a storey stands, one of the two turns
        beside = np.abs(tangent - [behind, ahead, (behind + ahead) / 2]).min(axis=0)
        assert beside[along].max() < SLOPE * STIFFNESS
    # A path by rules where something is decided, and by lines between them, is the path by rules alone.
    astray = np.abs(by_lines - rules).max(axis=0) > PATH[dtype] * YIELD_FORCE
    assert astray.sum() <= MAY_DIFFER
    if dtype == "float64":
        assert not astray[~exhausts].any()
