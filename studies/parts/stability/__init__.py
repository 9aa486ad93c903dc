"""Modules of the study stability: oscillators, failures, figures and the table of limits."""
