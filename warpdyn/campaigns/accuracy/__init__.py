"""Accuracy of runs: error estimates, and the pilot run that chooses method and step."""
