"""Modules of the study decision: errors of fragility medians, their computing time, and the figure."""
