"""Storeys whose backbone has several corners, with kinematic hardening."""
