"""Peers of warpdyn in the study benchmark: programs and hand-written code that integrate the same shear chains.

Each peer is a module with a function `measure(case)`. It integrates every sample of a case, and returns the time of the
integration [s] and the peak storey drifts [m]. Peers do not import warpdyn. If a requirement is not installed, the
import of the peer or `measure` raises ImportError or Missing, and the benchmark lists the peer as missing.
"""
