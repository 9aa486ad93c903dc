"""Kernels that count samples and add up demands and losses, separately for each cell of a result (such as a level)."""
