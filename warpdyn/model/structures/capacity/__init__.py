"""Shear buildings from capacity curves: a bilinear fit or the curve's points, distributed over the storeys."""
