"""Fragility of structures that earlier events of a sequence have damaged."""
