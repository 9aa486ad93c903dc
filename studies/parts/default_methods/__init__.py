"""Modules of the study default_methods."""
