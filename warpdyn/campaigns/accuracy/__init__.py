"""Accuracy of runs: error estimates, and the pilot that chooses method and step."""
