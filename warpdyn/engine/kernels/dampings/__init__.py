"""Kinds of viscous damping: one part of the kernels each."""
