"""Menegotto-Pinto storeys (OpenSees: Steel02)."""
