"""Self-centring (flag-shaped) storeys."""
