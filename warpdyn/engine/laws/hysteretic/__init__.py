"""Trilinear storeys with pinching, damage and softer unloading (OpenSees: Hysteretic)."""
