"""Probability distributions of random parameters; values are computed from a standard normal variable."""
