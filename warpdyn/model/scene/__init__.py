"""Scenes: a structure, its excitation, the scatter of its parameters, and the recorded demands."""
