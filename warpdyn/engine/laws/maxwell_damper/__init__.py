"""Viscous dampers in series with a brace (Maxwell elements)."""
