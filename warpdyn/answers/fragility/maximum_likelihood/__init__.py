"""Likelihoods of binomial counts, and Newton's method for many small likelihoods at the same time."""
