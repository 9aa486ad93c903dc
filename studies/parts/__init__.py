"""Modules of the studies: one folder per study, and their common command line."""
