"""Lumped structures from the properties of buildings, tanks and vehicles."""
