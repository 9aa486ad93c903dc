"""Devices that act in parallel with the law of a storey: friction dampers, viscous dampers and stops."""
