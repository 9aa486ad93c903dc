"""Structures with separate degrees of freedom and springs."""
