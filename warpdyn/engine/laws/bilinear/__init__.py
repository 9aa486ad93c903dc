"""Bilinear storeys, with or without hardening."""
