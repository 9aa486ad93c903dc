"""Searches for equilibrium in pushover analyses: chains of storeys, and lumped structures."""
