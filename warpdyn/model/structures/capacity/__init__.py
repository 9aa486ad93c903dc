"""Shear chains from capacity curves: fitted or followed point by point, then distributed over the storeys."""
