"""Time integration methods: kinds, table of methods, default method, amplification and stability limits."""

from warpdyn.engine.methods.table import METHODS, check_fits

__all__ = ["METHODS", "check_fits"]
