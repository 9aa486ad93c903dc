"""Sample size: number of structures for a given precision, and levels between which curves rise."""
