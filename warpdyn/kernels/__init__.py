"""Kernels that integrate whole histories, and how they are composed, fed and launched."""
