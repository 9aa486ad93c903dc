"""Modules of the study growth."""
