"""Four-point storeys with pinching and damage (OpenSees: Pinching4)."""
