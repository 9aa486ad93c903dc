"""Filters: parameters and states of a structure from measured floor responses (data assimilation)."""
