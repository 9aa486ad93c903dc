"""Parts of the study accuracy_speed: scenes, points, promises and figures."""
