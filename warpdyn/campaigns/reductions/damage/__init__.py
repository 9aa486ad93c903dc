"""Damage states of samples, the buildings in them, and losses."""
