"""Soil-structure interaction: springs and dashpots of foundations, cone models, and periods and damping on soil."""
