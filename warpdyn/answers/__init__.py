"""What users ask of a run: fragility, hazard, risk and loss."""
