"""Pictures of the front page and of the gallery."""
