"""Bayesian inference from measurements: calibration by tempering, and filters of measured floor responses."""
