"""Shared parts of readers: archives, encodings, values of fixed width, and comparisons with headers."""
