"""Integrals of fragility curves over hazard curves: closed form for lognormal curves, quadrature for all others."""
