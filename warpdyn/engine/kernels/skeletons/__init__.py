"""Skeletons of kernels, with slots for parts."""
