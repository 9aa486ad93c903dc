"""Settings of the recorders of a scene."""
