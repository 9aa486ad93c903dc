"""Matrices of members, degrees of freedom, assembly and member forces of frames."""
