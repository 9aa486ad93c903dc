"""Peers of warpdyn: the same shear chain in hand-written code and other programs.

Each peer is a module with one function, `measure(case)`, which integrates every sample of a case and returns the time
of the integration and the peak storey drifts. Peers do not import warpdyn. If a requirement is not installed,
importing the peer or `measure` raises ImportError or Missing, and the benchmark lists the peer as missing.
"""
