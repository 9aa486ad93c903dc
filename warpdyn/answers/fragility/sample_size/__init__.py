"""How much is run: structures until intervals are narrow, and levels where curves rise."""
