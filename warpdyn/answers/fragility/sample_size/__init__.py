"""Sample size: the number of structures for a given precision, and the levels at which fragility curves rise."""
