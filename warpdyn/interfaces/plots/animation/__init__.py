"""Animations of response histories."""
