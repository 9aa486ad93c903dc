"""Intervals of fragility curves: the jackknife over records and structures, and what it leaves out of observations."""
