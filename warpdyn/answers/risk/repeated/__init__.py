"""Damage that accumulates over repeated events."""
