"""Sets of fragility curves, their shapes, and warnings about them."""
