"""Statistics of demands: fragility curves, damage shares."""
