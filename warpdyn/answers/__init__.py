"""Answers from runs: fragility, hazard, risk and losses."""
