"""Risk: hazard curves, annual rates of damage, losses, and the collapse margins of FEMA P-695."""
