"""Intervals of fragility curves by a jackknife over records and structures."""
