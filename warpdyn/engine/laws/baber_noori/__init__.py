"""Bouc-Wen storeys that degrade and pinch (Baber and Noori)."""
