"""Skeletons of kernels, with slots for the parts that a scene needs."""
