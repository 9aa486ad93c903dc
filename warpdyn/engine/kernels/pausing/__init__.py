"""Kernels that can pause: the variables that live across the interval loop are loaded at its start and stored after it."""
