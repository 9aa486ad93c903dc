"""Readers of the formats of strong-motion networks."""
