"""Integrals of fragility curves over hazard curves: in closed form of lognormal curves, by quadrature of any other."""
