"""Recorders: each file contains a recorder's part of the kernels and its variables."""
