"""Structures that are added to every motion until intervals are narrow: what the first ones tell says how many."""
