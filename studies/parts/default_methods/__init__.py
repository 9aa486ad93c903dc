"""Parts of the study default_methods."""
