"""Portfolios: runs of buildings of different types."""
