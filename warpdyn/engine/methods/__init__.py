"""Integration methods: their tables, kinds, amplification and stability limits."""

from warpdyn.engine.methods.table import METHODS, check_fits

__all__ = ["METHODS", "check_fits"]
