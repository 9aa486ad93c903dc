"""Methods that share the source of their kernels, of which the default test run needs only one."""

import functools
from collections.abc import Iterable

import pytest

from warpdyn.engine.kernels.plan import keeps_slopes
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS


@functools.cache
def source_of(method):
    """Return the properties that determine a kernel's source; methods with the same ones differ only in constants."""
    row = METHODS[method]
    if row.kind != "explicit":
        return row.kind, getattr(row, "beta", 0) > 0, getattr(row, "force_lag", 0) > 0
    if isinstance(row, MultistepMethod):
        return row.kind, "multistep"
    return row.kind, keeps_slopes(row), row.is_adaptive, row.is_nystroem, row.starts_halfway


def by_source(methods: Iterable[str]) -> dict[tuple, list[str]]:
    """Return methods by their source, in their order."""
    alike = {}
    for method in methods:
        alike.setdefault(source_of(method), []).append(method)
    return alike


def shown(methods: Iterable[str]) -> list[str]:
    """Return one method of each source: RK4, which is simulate's default, and otherwise the first."""
    return ["rk4" if "rk4" in names else names[0] for names in by_source(methods).values()]


def thorough_unless(kept: bool, *values, **options):
    """Return a case that is run by default if it is to be kept, and by `pytest -m thorough` otherwise."""
    return pytest.param(*values, marks=() if kept else pytest.mark.thorough, **options)


def one_per_source(methods: Iterable[str]) -> list:
    """Return methods as cases: one of each source, and the others as thorough ones."""
    methods = list(methods)
    return [thorough_unless(method in shown(methods), method) for method in methods]
