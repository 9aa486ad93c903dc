"""Builders of structures whose parts collide: buildings in a row, and bridges with gaps."""
