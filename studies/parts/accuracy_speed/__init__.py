"""Modules of the study accuracy_speed: scenes, points, comparison with `plan`, and figures."""
