"""Joining of runs: identities of their structures and motions, and one dataset of all samples."""
