"""Sample size: number of structures for a given precision, and levels at which curves rise."""
