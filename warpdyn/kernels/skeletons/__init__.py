"""The courses of integration that kernels follow, with slots for the parts that a scene wants."""
