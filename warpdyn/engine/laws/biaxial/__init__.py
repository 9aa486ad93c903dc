"""Biaxial laws: springs with two components that share one state, such as isolators under motion in two directions."""
