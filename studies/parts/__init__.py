"""Modules of the studies: one folder per study, and the command-line arguments that they share."""
