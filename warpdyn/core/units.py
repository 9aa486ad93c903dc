"""Standard gravity, and the comment of dataset variables in g; all other variables are in SI units."""

STANDARD_GRAVITY = 9.80665  # m/s2, exact by definition (CGPM 1901)
IN_G = f"g is standard gravity, {STANDARD_GRAVITY} m s-2"  # comment of every variable in g, which UDUNITS reads as gram
