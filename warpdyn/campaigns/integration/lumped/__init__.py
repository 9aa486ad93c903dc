"""Equations of motion of lumped structures."""
