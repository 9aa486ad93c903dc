"""The figures of the seed_frame study."""
