"""Modules of studies/metropolis.py: the buildings of a region, its earthquake, and the figure."""
