"""Likelihoods of binomial counts, and Newton's method on many small likelihoods at once."""
