"""Regions of a run, each drawn and integrated by itself: in this process or on the workers of a cluster."""
