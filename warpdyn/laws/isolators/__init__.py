"""Seismic isolators."""
