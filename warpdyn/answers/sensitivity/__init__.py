"""Sensitivity of demands and fragility medians to the random parameters of a structure."""
