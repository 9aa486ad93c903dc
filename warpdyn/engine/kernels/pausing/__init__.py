"""Kernels that can pause: variables that live across the interval loop are loaded before it and stored after it."""
