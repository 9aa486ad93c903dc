"""Road profiles, and the motions of vehicles on them."""
