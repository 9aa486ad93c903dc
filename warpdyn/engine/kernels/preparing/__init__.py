"""Kernels that prepare the structures and samples of a run on a device."""
