"""Damage states of samples, numbers of buildings in the damage states, and losses."""
