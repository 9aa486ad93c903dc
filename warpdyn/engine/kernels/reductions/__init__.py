"""Kernels that count and add up the samples of a run by cell."""
