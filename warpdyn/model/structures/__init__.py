"""Structures: shear buildings and linear systems, also from capacity curves, Hazus types and periods."""
