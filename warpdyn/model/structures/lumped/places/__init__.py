"""Kinds, units and groups of the degrees of freedom, springs and outputs of lumped structures."""
