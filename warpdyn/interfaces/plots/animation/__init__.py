"""Animations of response histories: moving buildings with roof displacements and a hysteresis loop."""
