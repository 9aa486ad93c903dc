"""The parts of studies/metropolis.py: a region's buildings, its earthquake, and the figures."""
