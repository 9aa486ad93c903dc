"""Devices that stand beside a storey's law: friction dampers, viscous dampers and stops."""
