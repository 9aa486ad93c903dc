"""Comparison of intensity measures, fragility surfaces of two measures, and conversion between measures."""
