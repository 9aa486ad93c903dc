"""Kernels that integrate rigid blocks, which rock or slide on a moving base."""
