"""Preparation of structures and samples by kernels of their device."""
