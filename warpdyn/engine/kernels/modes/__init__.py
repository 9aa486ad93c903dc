"""Kernels for eigenvalues and modes of many structures."""
