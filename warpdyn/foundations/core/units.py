"""Standard gravity, and attributes of dataset variables: units are SI, except accelerations in g."""

STANDARD_GRAVITY = 9.80665  # m/s2, exact by definition (CGPM 1901)
IN_G = f"g is standard gravity, {STANDARD_GRAVITY} m s-2"  # comment of every variable in g, which UDUNITS reads as gram


def unit_attributes(units: str, comment: str = "") -> dict[str, str]:
    """Return a variable's attributes `units` (a UDUNITS string, or "g") and, if it is not empty, `comment`."""
    words = "; ".join(part for part in (IN_G if units == "g" else "", comment) if part)
    return {"units": units} | ({"comment": words} if words else {})
