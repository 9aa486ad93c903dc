"""Structures and where they come from: shear buildings, linear systems, capacity curves, Hazus, periods."""
