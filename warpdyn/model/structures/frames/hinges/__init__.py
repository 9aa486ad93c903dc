"""Frames with nonlinear hinges."""
