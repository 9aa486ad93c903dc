"""Hazard curves: readers of files, names of intensity measures, plausibility."""
