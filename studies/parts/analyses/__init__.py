"""Analyses of the study `analyses.py`, each with its reference results."""
