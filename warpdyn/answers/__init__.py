"""Answers from runs: fragility curves, hazard curves, annual rates of damage, and losses."""
