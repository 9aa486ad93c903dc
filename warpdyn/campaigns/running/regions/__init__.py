"""Regions of a run (ranges of structures), each integrated separately: in this process or on a cluster."""
