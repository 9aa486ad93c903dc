"""Linear storeys."""
