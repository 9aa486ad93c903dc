"""Modules of the study simcenter."""
