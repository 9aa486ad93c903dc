"""From demands to answers: fragility curves, damage shares."""
