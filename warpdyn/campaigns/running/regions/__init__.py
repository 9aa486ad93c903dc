"""Regions of a run, each drawn and integrated separately: in this process or on the workers of a cluster."""
