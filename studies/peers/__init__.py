"""What warpdyn is measured against: the same shear chain, written or set up for other tools.

Each peer is a module with one function, `measure(case)`, which integrates every sample of a case and returns the time
of the integration alone and the peak storey drifts. None of them imports warpdyn. Where what it needs is not on the
machine, importing it or `measure` raises ImportError or Missing, and the benchmark names the peer as missing.
"""
