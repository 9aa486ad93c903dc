"""Devices that are parallel to a storey's law: friction dampers, viscous dampers and stops."""
