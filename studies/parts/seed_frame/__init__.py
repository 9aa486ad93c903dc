"""Module of the study seed_frame with its figures."""
