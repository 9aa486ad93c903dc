"""Storeys of several corners with kinematic hardening."""
