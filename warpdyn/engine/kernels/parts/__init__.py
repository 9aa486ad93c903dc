"""Pieces of physics and of numerics that a kernel may have: one part of the kernels each."""
