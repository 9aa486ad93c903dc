"""Kernels that count samples and add up responses and losses for each cell of a result (such as an intensity level)."""
