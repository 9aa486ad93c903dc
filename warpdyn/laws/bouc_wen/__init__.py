"""Bouc-Wen storeys."""
