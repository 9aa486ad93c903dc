"""Synthetic motions: kernels, and their launches on a CPU or GPU."""
