"""Foundations of all other layers: checks, messages, progress, and files."""
