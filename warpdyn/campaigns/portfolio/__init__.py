"""Portfolios: runs of buildings of different types, whose results are joined in one dataset."""
